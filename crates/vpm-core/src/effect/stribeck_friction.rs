//! The extra friction at low speed, before a lubricant film carries.

use serde::Deserialize;

use super::{Domain, tanh_ratio};
use crate::scalar::Scalar;

/// Stribeck friction of a joint: what static friction adds to Coulomb friction, fading as the speed grows.
///
/// Law: `tau = -stribeck tanh(v / transition_velocity) exp(-(v / stribeck_velocity)^2)`, tau and `stribeck` (static minus Coulomb
/// friction) in N or N m, velocities in m/s or rad/s.
/// Source: the exponential Stribeck curve, Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, Automatica 30(7), section 2.1, with
/// exponent 2. Checked: both velocities must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StribeckFriction<P> {
    /// Static minus Coulomb friction, N or N m.
    pub stribeck: P,
    /// Speed at which the extra friction has fallen to 1/e, m/s or rad/s.
    pub stribeck_velocity: P,
    /// Velocity over which the direction changes, m/s or rad/s.
    pub transition_velocity: P,
}

impl<P> StribeckFriction<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> StribeckFriction<T> {
        StribeckFriction {
            stribeck: f(&self.stribeck),
            stribeck_velocity: f(&self.stribeck_velocity),
            transition_velocity: f(&self.transition_velocity),
        }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![
            (&self.stribeck, Domain::Any),
            (&self.stribeck_velocity, Domain::Positive),
            (&self.transition_velocity, Domain::Positive),
        ]
    }
}

impl<S: Scalar> StribeckFriction<S> {
    /// Effort on the joint at velocity `v`.
    #[inline]
    pub fn effort(&self, v: S) -> S {
        let ratio = v / self.stribeck_velocity;
        -(self.stribeck * (v / self.transition_velocity).tanh() * (-(ratio * ratio)).exp())
    }

    /// Resistance r at velocity `v`, with `effort = -r v`; finite at rest.
    #[inline]
    pub fn resistance(&self, v: S) -> S {
        let ratio = v / self.stribeck_velocity;
        let peak = self.stribeck * (-(ratio * ratio)).exp();
        peak * tanh_ratio(v / self.transition_velocity) / self.transition_velocity
    }
}
