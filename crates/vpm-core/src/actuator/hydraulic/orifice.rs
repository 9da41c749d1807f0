//! Flow through a sharp edge.

use serde::Deserialize;

use super::NamedDomain;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Orifice of variable opening: turbulent flow with the root of the pressure drop, laminar around no drop, in both directions.
///
/// Law: `q = gain u root(dp)` with `root = sign(dp) sqrt(|dp|)` where `|dp|` is at least the transition pressure pt, and
/// `root = sqrt(pt) s (3 - |s|) / 2`, `s = dp / pt`, below it; q in m^3/s, dp in Pa, u in the unit of the opening, `gain` in
/// m^3/(s sqrt(Pa)) per unit of opening. Value and slope are continuous, the slope at no drop is `3 / (2 sqrt(pt))`.
/// Source: `q = C_d W u sqrt(2 dp / rho)`, D'Imperio 2016, section 4.1; the two regimes: Ellman & Piché 1999, "A two regime orifice
/// flow formula for numerical simulation", J. Dynamic Systems, Measurement, and Control 121(4). Checked: the gain is not negative,
/// the transition pressure is positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orifice<P> {
    /// Flow per opening and root of pressure, m^3/(s sqrt(Pa)) per unit of opening.
    pub gain: P,
    /// Pressure drop at which the flow becomes turbulent, Pa; 1e4 Pa is usual.
    pub transition_pressure: P,
}

impl<P> Orifice<P> {
    /// The same orifice over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Orifice<T> {
        Orifice { gain: f(&self.gain), transition_pressure: f(&self.transition_pressure) }
    }

    /// Parameters of the orifice and where each is defined.
    pub fn domains(&self) -> Vec<NamedDomain<'_, P>> {
        vec![
            ("valve.orifice.gain", &self.gain, Domain::NonNegative),
            ("valve.orifice.transition_pressure", &self.transition_pressure, Domain::Positive),
        ]
    }
}

impl<S: Scalar> Orifice<S> {
    /// Orifice gain by a data sheet's rated `flow` (m^3/s) at a pressure `drop` (Pa) and an `opening`. The drop is that
    /// over one edge.
    pub fn rated_gain(flow: S, drop: S, opening: S) -> S {
        flow / (opening * drop.sqrt())
    }

    /// Flow in m^3/s through the `opening` of an orifice under a pressure `drop` (Pa), positive along the drop.
    #[inline]
    pub fn flow(&self, opening: S, drop: S) -> S {
        self.gain * opening * self.root(drop)
    }

    /// How the flow of [`Orifice::flow`] changes with the drop, m^3/(s Pa): never zero where it is open.
    #[inline]
    pub fn conductance(&self, opening: S, drop: S) -> S {
        let size = drop.abs();
        let laminar = || {
            let share = size / self.transition_pressure;
            (-share * 2.0 + 3.0) * 0.5 / self.transition_pressure.sqrt()
        };
        self.gain * opening * size.if_less(self.transition_pressure, laminar, || (size.sqrt() * 2.0).recip())
    }

    /// Signed root of a pressure drop over an orifice, in sqrt(Pa).
    #[inline]
    fn root(&self, drop: S) -> S {
        let size = drop.abs();
        let laminar = || {
            let share = drop / self.transition_pressure;
            self.transition_pressure.sqrt() * share * (-share.abs() + 3.0) * 0.5
        };
        let turbulent = || {
            let root = size.sqrt();
            drop.if_negative(|| -root, || root)
        };
        size.if_less(self.transition_pressure, laminar, turbulent)
    }
}
