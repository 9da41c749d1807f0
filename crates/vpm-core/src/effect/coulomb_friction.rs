//! Dry friction of constant size.

use super::{Law, law, tanh_ratio};
use crate::scalar::Scalar;

law! {
    /// Coulomb friction of a joint: a constant resistance against the direction of motion, rounded off around rest.
    ///
    /// Law: `tau = -coulomb tanh(v / transition_velocity)`, with tau and `coulomb` in N or N m, velocities in m/s or rad/s.
    /// The rounding keeps the law differentiable; below the transition velocity the joint creeps instead of sticking. An explicit step h
    /// follows it where `coulomb h / inertia` stays below about twice the transition velocity, else the joint chatters.
    /// Source: Andersson, Söderberg & Björklund 2007, "Friction models for sliding dry, boundary and mixed lubricated contacts",
    /// Tribology International 40(4), smoothed Coulomb law. Checked: the transition velocity must be positive.
    CoulombFriction {
        /// Resistance well above the transition velocity, N or N m.
        coulomb: Any,
        /// Velocity at which tanh(1) = 76 % of the resistance is reached, m/s or rad/s.
        transition_velocity: Positive,
    }
}

impl<S: Scalar> Law<S> for CoulombFriction<S> {
    #[inline]
    fn effort(&self, _: S, v: S) -> S {
        -(self.coulomb * (v / self.transition_velocity).tanh())
    }

    #[inline]
    fn resistance(&self, _: S, v: S) -> S {
        self.coulomb * tanh_ratio(v / self.transition_velocity) / self.transition_velocity
    }
}
