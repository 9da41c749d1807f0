//! Friction that differs between the two directions of motion.

use serde::Deserialize;

use super::{Domain, tanh_ratio};
use crate::scalar::Scalar;

/// Asymmetric friction of a joint: the part of the friction that does not change sign with the direction of motion.
///
/// Law: with `s = tanh(v / transition_velocity)`,
/// `tau = -1/2 coulomb_difference s^2 - 1/2 viscous_difference v s`, tau in N or N m, v in m/s or rad/s.
/// A difference is the value for positive minus the value for negative motion, so that beside a symmetric law with the mean values
/// the two directions get mean ± difference/2.
/// Source: direction-dependent coefficients as in Swevers, Verdonck & De Schutter 2007, "Dynamic model identification for industrial
/// robots", IEEE Control Systems 27(5), written here as mean and difference. Checked: the transition velocity must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AsymmetricFriction<P> {
    /// Coulomb friction of positive minus that of negative motion, N or N m.
    pub coulomb_difference: P,
    /// Viscous friction of positive minus that of negative motion, N s/m or N m s/rad.
    pub viscous_difference: P,
    /// Velocity over which the direction changes, m/s or rad/s.
    pub transition_velocity: P,
}

impl<P> AsymmetricFriction<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> AsymmetricFriction<T> {
        AsymmetricFriction {
            coulomb_difference: f(&self.coulomb_difference),
            viscous_difference: f(&self.viscous_difference),
            transition_velocity: f(&self.transition_velocity),
        }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![
            (&self.coulomb_difference, Domain::Any),
            (&self.viscous_difference, Domain::Any),
            (&self.transition_velocity, Domain::Positive),
        ]
    }
}

impl<S: Scalar> AsymmetricFriction<S> {
    /// Effort on the joint at velocity `v`.
    #[inline]
    pub fn effort(&self, v: S) -> S {
        let direction = (v / self.transition_velocity).tanh();
        (self.coulomb_difference * direction + self.viscous_difference * v) * direction * -0.5
    }

    /// Resistance r at velocity `v`, with `effort = -r v`; finite at rest.
    #[inline]
    pub fn resistance(&self, v: S) -> S {
        let ratio = v / self.transition_velocity;
        let size = (self.coulomb_difference * ratio.tanh() + self.viscous_difference * v) * 0.5;
        size * tanh_ratio(ratio) / self.transition_velocity
    }
}
