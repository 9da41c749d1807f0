//! The extra friction at low speed, before a lubricant film carries.

use super::{Law, law, tanh_ratio};
use crate::scalar::Scalar;

law! {
    /// Stribeck friction of a joint: what static friction adds to Coulomb friction, fading as the speed grows.
    ///
    /// Law: `tau = -stribeck tanh(v / transition_velocity) exp(-(v / stribeck_velocity)^2)`, tau and `stribeck` (static minus Coulomb
    /// friction) in N or N m, velocities in m/s or rad/s.
    /// Source: the exponential Stribeck curve, Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, Automatica 30(7), section 2.1, with
    /// exponent 2. Checked: both velocities must be positive.
    StribeckFriction {
        /// Static minus Coulomb friction, N or N m.
        stribeck: Any,
        /// Speed at which the extra friction has fallen to 1/e, m/s or rad/s.
        stribeck_velocity: Positive,
        /// Velocity over which the direction changes, m/s or rad/s.
        transition_velocity: Positive,
    }
}

impl<S: Scalar> Law<S> for StribeckFriction<S> {
    #[inline]
    fn effort(&self, _: S, v: S) -> S {
        let ratio = v / self.stribeck_velocity;
        -(self.stribeck * (v / self.transition_velocity).tanh() * (-(ratio * ratio)).exp())
    }

    #[inline]
    fn resistance(&self, _: S, v: S) -> S {
        let ratio = v / self.stribeck_velocity;
        let peak = self.stribeck * (-(ratio * ratio)).exp();
        peak * tanh_ratio(v / self.transition_velocity) / self.transition_velocity
    }
}
