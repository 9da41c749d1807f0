//! Friction that differs between the two directions of motion.

use super::{Law, law, tanh_ratio};
use crate::scalar::Scalar;

law! {
    /// Asymmetric friction of a joint: the part of the friction that does not change sign with the direction of motion.
    ///
    /// Law: with `s = tanh(v / transition_velocity)`,
    /// `tau = -1/2 coulomb_difference s^2 - 1/2 viscous_difference v s`, tau in N or N m, v in m/s or rad/s.
    /// A difference is the value for positive minus the value for negative motion, so that beside a symmetric law with the mean values
    /// the two directions get mean ± difference/2.
    /// Source: direction-dependent coefficients as in Swevers, Verdonck & De Schutter 2007, "Dynamic model identification for industrial
    /// robots", IEEE Control Systems 27(5), written here as mean and difference. Checked: the transition velocity must be positive.
    AsymmetricFriction {
        /// Coulomb friction of positive minus that of negative motion, N or N m.
        coulomb_difference: Any,
        /// Viscous friction of positive minus that of negative motion, N s/m or N m s/rad.
        viscous_difference: Any,
        /// Velocity over which the direction changes, m/s or rad/s.
        transition_velocity: Positive,
    }
}

impl<S: Scalar> Law<S> for AsymmetricFriction<S> {
    #[inline]
    fn effort(&self, _: S, v: S) -> S {
        let direction = (v / self.transition_velocity).tanh();
        (self.coulomb_difference * direction + self.viscous_difference * v) * direction * -0.5
    }

    #[inline]
    fn resistance(&self, _: S, v: S) -> S {
        let ratio = v / self.transition_velocity;
        let size = (self.coulomb_difference * ratio.tanh() + self.viscous_difference * v) * 0.5;
        size * tanh_ratio(ratio) / self.transition_velocity
    }
}
