//! Dry friction of constant size.

use serde::Deserialize;

use super::{Domain, tanh_ratio};
use crate::scalar::Scalar;

/// Coulomb friction of a joint: a constant resistance against the direction of motion, rounded off around rest.
///
/// Law: `tau = -coulomb tanh(v / transition_velocity)`, with tau and `coulomb` in N or N m, velocities in m/s or rad/s.
/// The rounding keeps the law differentiable; below the transition velocity the joint creeps instead of sticking. An explicit step h
/// follows it where `coulomb h / inertia` stays below about twice the transition velocity, else the joint chatters.
/// Source: Andersson, Söderberg & Björklund 2007, "Friction models for sliding dry, boundary and mixed lubricated contacts",
/// Tribology International 40(4), smoothed Coulomb law. Checked: the transition velocity must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoulombFriction<P> {
    /// Resistance well above the transition velocity, N or N m.
    pub coulomb: P,
    /// Velocity at which tanh(1) = 76 % of the resistance is reached, m/s or rad/s.
    pub transition_velocity: P,
}

impl<P> CoulombFriction<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> CoulombFriction<T> {
        CoulombFriction { coulomb: f(&self.coulomb), transition_velocity: f(&self.transition_velocity) }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![(&self.coulomb, Domain::Any), (&self.transition_velocity, Domain::Positive)]
    }
}

impl<S: Scalar> CoulombFriction<S> {
    /// Effort on the joint at velocity `v`.
    #[inline]
    pub fn effort(&self, v: S) -> S {
        -(self.coulomb * (v / self.transition_velocity).tanh())
    }

    /// Resistance r at velocity `v`, with `effort = -r v`; finite at rest.
    #[inline]
    pub fn resistance(&self, v: S) -> S {
        self.coulomb * tanh_ratio(v / self.transition_velocity) / self.transition_velocity
    }
}
