//! The first bending mode of a link that is described as rigid, lumped at its root.

use serde::Deserialize;

use super::Domain;
use crate::scalar::Scalar;

/// Hinge at the root of a link, as a joint of its own whose coordinate is the angle that the link lags behind.
///
/// Law: `tau = -stiffness (q + time v)`, tau in N m, q in rad, v in rad/s: a pseudo-rigid link with damping in proportion to stiffness.
/// It has the potential `1/2 stiffness q^2` but for the damping.
/// Source: Howell 2001, "Compliant Mechanisms", chapter 5 (a bent beam as a rigid one on a torsion spring); Kelvin-Voigt damping.
/// Checked: the frequency of a rigid link on its spring.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkFlexibility<P> {
    /// Moment at the root per angle, N m/rad.
    pub stiffness: P,
    /// Damping per stiffness, s.
    pub time: P,
}

impl<P> LinkFlexibility<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> LinkFlexibility<T> {
        LinkFlexibility { stiffness: f(&self.stiffness), time: f(&self.time) }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![(&self.stiffness, Domain::Any), (&self.time, Domain::Any)]
    }
}

impl<S: Scalar> LinkFlexibility<S> {
    /// Effort at angle `q` and rate `v`.
    #[inline]
    pub fn effort(&self, q: S, v: S) -> S {
        -(self.stiffness * (q + self.time * v))
    }

    /// Effort of the spring.
    #[inline]
    pub fn effort_at_rest(&self, q: S) -> S {
        -(self.stiffness * q)
    }

    /// Resistance to the rate.
    #[inline]
    pub fn resistance(&self) -> S {
        self.stiffness * self.time
    }

    /// Potential energy in J.
    #[inline]
    pub fn potential(&self, q: S) -> S {
        self.stiffness * q * q * 0.5
    }
}
