//! How stiff oil is.

use serde::Deserialize;

use super::NamedDomain;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Air that is carried along as bubbles.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EntrainedAir<P> {
    /// Volume of air per volume of oil at the reference pressure.
    pub fraction: P,
    /// Polytropic exponent of the air: 1 where it keeps its temperature, 1.4 where it keeps its heat.
    pub exponent: P,
    /// Pressure at which the fraction is given, Pa.
    pub reference_pressure: P,
}

impl<P> EntrainedAir<P> {
    /// Air in the fluid over another number type.
    fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> EntrainedAir<T> {
        EntrainedAir {
            fraction: f(&self.fraction),
            exponent: f(&self.exponent),
            reference_pressure: f(&self.reference_pressure),
        }
    }
}

impl<S: Scalar> EntrainedAir<S> {
    /// Volume of air per volume of fluid at a `pressure` (Pa).
    #[inline]
    fn share(&self, pressure: S) -> S {
        self.fraction * ((self.reference_pressure / pressure).ln() / self.exponent).exp()
    }
}

/// Oil of a chamber, with air bubbles if it has any, and more of them than described.
///
/// Law: `beta_e = beta (1 + a) / (1 + a beta / (kappa p))` with `a = fraction (p0 / p)^(1 / kappa)`, all in Pa, p absolute (4.15
/// corrected); without air `beta_e = beta`. More air adds to both sums: `(1 + a + b) / (1 + beta (a / kappa_a + b / kappa_b) / p)`.
/// A chamber's state is what its pressure would be if oil could be pulled: below the vapour pressure the pressure stays there and the
/// state counts the void with the stiffness of the oil alone, `rate of ln(density) = state rate / beta_e`. So no oil is lost while
/// a chamber cavitates, and the void has to be filled before pressure builds up.
/// Source: D'Imperio 2016, section 4.1; Merritt 1967, "Hydraulic Control Systems", section 2-4 (gas in oil). The void as an
/// unfilled volume at constant pressure is an assumption. Checked: all are positive, the fraction is not negative.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fluid<P> {
    /// Bulk modulus of the oil alone, Pa.
    pub bulk_modulus: P,
    /// Pressure below which oil does not go, Pa.
    pub vapour_pressure: P,
    /// Air in the oil.
    #[serde(default = "crate::actuator::none")]
    pub air: Option<EntrainedAir<P>>,
    /// Air beyond that.
    #[serde(default = "crate::actuator::none")]
    pub more_air: Option<EntrainedAir<P>>,
}

impl<P> Fluid<P> {
    /// Fluid over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Fluid<T> {
        Fluid {
            bulk_modulus: f(&self.bulk_modulus),
            vapour_pressure: f(&self.vapour_pressure),
            air: self.air.as_ref().map(|air| air.map(f)),
            more_air: self.more_air.as_ref().map(|air| air.map(f)),
        }
    }

    /// Parameters of the fluid and where each is defined.
    pub fn domains(&self) -> Vec<NamedDomain<'_, P>> {
        let mut domains = vec![
            ("fluid.bulk_modulus", &self.bulk_modulus, Domain::Positive),
            ("fluid.vapour_pressure", &self.vapour_pressure, Domain::Positive),
        ];
        for air in self.air.iter().chain(&self.more_air) {
            domains.push(("fluid.air.fraction", &air.fraction, Domain::NonNegative));
            domains.push(("fluid.air.exponent", &air.exponent, Domain::Positive));
            domains.push(("fluid.air.reference_pressure", &air.reference_pressure, Domain::Positive));
        }
        domains
    }
}

impl<S: Scalar> Fluid<S> {
    /// Pressure in Pa of the fluid in a chamber in a `state` (Pa): never below that of vapour.
    #[inline]
    pub fn pressure(&self, state: S) -> S {
        state.max(self.vapour_pressure)
    }

    /// Effective bulk modulus in Pa of the fluid in a chamber in a `state` (Pa).
    #[inline]
    pub fn effective_bulk_modulus(&self, state: S) -> S {
        if self.air.is_none() && self.more_air.is_none() {
            return self.bulk_modulus;
        }
        let with_air = || {
            let (mut share, mut softness) = (S::zero(), S::zero());
            for air in self.air.iter().chain(&self.more_air) {
                let own = air.share(state);
                share += own;
                softness += own / (air.exponent * state);
            }
            self.bulk_modulus * (share + 1.0) / (softness * self.bulk_modulus + 1.0)
        };
        state.if_less(self.vapour_pressure, || self.bulk_modulus, with_air)
    }
}
