//! What resists a piston besides oil: the ends of its stroke and its seals.

use serde::Deserialize;

use super::{Chambers, NamedDomain};
use crate::effect::CoulombFriction;
use crate::effect::Domain;
use crate::effect::Law;
use crate::effect::StribeckFriction;
use crate::effect::ViscousFriction;
use crate::scalar::Scalar;

/// A stop at both ends of a stroke: a spring and a damper that push and never pull.
///
/// Law: beyond an end by e > 0, moving out with v: `-max(stiffness e + damping v, 0)`, N, m, m/s; nothing inside.
/// Source: Kelvin-Voigt contact, cut where it would stick, as in Gilardi & Sharf 2002, "Literature survey of contact dynamics
/// modelling", Mechanism and Machine Theory 37(10), section 4.1. Checked: the stiffness is positive, the damping not negative.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndStop<P> {
    /// Force per distance beyond the end, N/m.
    pub stiffness: P,
    /// Force per velocity beyond the end, N s/m.
    pub damping: P,
}

impl<S: Scalar> EndStop<S> {
    /// Force of a piston's end stop at `x` from mid-stroke, moving with `v`. Half of the stroke is `reach`.
    #[inline]
    pub fn force(&self, x: S, v: S, reach: S) -> S {
        let below = || x.if_less(-reach, || self.push(-x - reach, -v), S::zero);
        reach.if_less(x, || -self.push(x - reach, v), below)
    }

    #[inline]
    fn push(&self, beyond: S, outward: S) -> S {
        (self.stiffness * beyond + self.damping * outward).max(S::zero())
    }
}

/// Dry friction of a piston's seals that the pressures of both chambers press on.
///
/// Law: `-share A (pa + pb) tanh(v / transition_velocity)`, N, with the area `A` of the piston (m^2), pressures in Pa, v in m/s.
/// Source: Bonchis, Corke & Rye 1999, "A pressure-based, velocity independent, friction model for asymmetric hydraulic cylinders",
/// IEEE International Conference on Robotics and Automation. Checked: the transition velocity is positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressedSeals<P> {
    /// Friction as a share of the piston's area times the sum of the pressures.
    pub share: P,
    /// Velocity at which tanh(1) = 76 % of the friction is reached, m/s.
    pub transition_velocity: P,
}

impl<S: Scalar> PressedSeals<S> {
    /// Law of a piston whose seals are pressed by `pressures` (Pa) on an `area` (m^2).
    #[inline]
    fn under(&self, area: S, pressures: Chambers<S>) -> CoulombFriction<S> {
        let coulomb = self.share * area * (pressures.a + pressures.b);
        CoulombFriction { coulomb, transition_velocity: self.transition_velocity }
    }
}

/// Friction of a piston's seals: any of the laws of joints, and friction that the pressures make, added up.
///
/// Checked: see each law.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealFriction<P> {
    /// Resistance proportional to speed.
    #[serde(default = "crate::actuator::none")]
    pub viscous: Option<ViscousFriction<P>>,
    /// Constant resistance.
    #[serde(default = "crate::actuator::none")]
    pub coulomb: Option<CoulombFriction<P>>,
    /// Extra friction at low speed.
    #[serde(default = "crate::actuator::none")]
    pub stribeck: Option<StribeckFriction<P>>,
    /// Dry friction that grows with the pressures.
    #[serde(default = "crate::actuator::none")]
    pub pressed: Option<PressedSeals<P>>,
}

impl<P> SealFriction<P> {
    /// Seal friction of a piston over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> SealFriction<T> {
        SealFriction {
            viscous: self.viscous.as_ref().map(|law| law.map(f)),
            coulomb: self.coulomb.as_ref().map(|law| law.map(f)),
            stribeck: self.stribeck.as_ref().map(|law| law.map(f)),
            pressed: self
                .pressed
                .as_ref()
                .map(|law| PressedSeals { share: f(&law.share), transition_velocity: f(&law.transition_velocity) }),
        }
    }

    /// Parameters of a piston's seal friction and where each is defined.
    pub fn domains(&self) -> Vec<NamedDomain<'_, P>> {
        let viscous = self.viscous.iter().flat_map(ViscousFriction::domains);
        let coulomb = self.coulomb.iter().flat_map(CoulombFriction::domains);
        let stribeck = self.stribeck.iter().flat_map(StribeckFriction::domains);
        let pressed = self.pressed.iter().flat_map(|law| {
            [
                ("cylinder.seal.pressed", &law.share, Domain::Any),
                ("cylinder.seal.pressed", &law.transition_velocity, Domain::Positive),
            ]
        });
        let named = |name: &'static str| move |(parameter, domain)| (name, parameter, domain);
        viscous
            .map(named("cylinder.seal.viscous"))
            .chain(coulomb.map(named("cylinder.seal.coulomb")))
            .chain(stribeck.map(named("cylinder.seal.stribeck")))
            .chain(pressed)
            .collect()
    }
}

impl<S: Scalar> SealFriction<S> {
    /// Force in N on a piston of this `area` (m^2) that moves with `v` (m/s) between `pressures` (Pa).
    #[inline]
    pub fn force(&self, v: S, area: S, pressures: Chambers<S>) -> S {
        let zero = S::zero();
        let pressed = self.pressed.map_or(zero, |law| law.under(area, pressures).effort(zero, v));
        let viscous = self.viscous.map_or(zero, |law| law.effort(zero, v));
        let coulomb = self.coulomb.map_or(zero, |law| law.effort(zero, v));
        viscous + coulomb + self.stribeck.map_or(zero, |law| law.effort(zero, v)) + pressed
    }

    /// Resistance of a piston's seals in N s/m at velocity `v` (m/s) between `pressures` (Pa): the chord from rest.
    #[inline]
    pub fn resistance(&self, v: S, area: S, pressures: Chambers<S>) -> S {
        let zero = S::zero();
        let pressed = self.pressed.map_or(zero, |law| law.under(area, pressures).resistance(zero, v));
        let viscous = self.viscous.map_or(zero, |law| law.resistance(zero, v));
        let coulomb = self.coulomb.map_or(zero, |law| law.resistance(zero, v));
        viscous + coulomb + self.stribeck.map_or(zero, |law| law.resistance(zero, v)) + pressed
    }

    /// Whether a piston has any seal friction.
    #[inline]
    pub fn is_there(&self) -> bool {
        self.viscous.is_some() || self.coulomb.is_some() || self.stribeck.is_some() || self.pressed.is_some()
    }
}
