//! A gear, shaft or belt that winds up.

use serde::Deserialize;

use super::Domain;
use crate::scalar::Scalar;

/// Compliance between the drive and the link, as a joint of its own whose coordinate is the wind-up, link side minus motor side.
///
/// Law: `tau = -stiffness q - damping v`, tau in N or N m, q in m or rad, v in m/s or rad/s.
/// It has the potential `1/2 stiffness q^2` but for the damping.
/// Source: Spong 1987, "Modeling and Control of Elastic Joint Robots", J. Dyn. Sys. Meas. Control 109, equation (2), with a damper beside
/// the spring. Checked: the frequency of two masses with a spring between them.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointCompliance<P> {
    /// Effort per wind-up, N/m or N m/rad.
    pub stiffness: P,
    /// Effort per rate of it, N s/m or N m s/rad.
    pub damping: P,
}

impl<P> JointCompliance<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> JointCompliance<T> {
        JointCompliance { stiffness: f(&self.stiffness), damping: f(&self.damping) }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![(&self.stiffness, Domain::Any), (&self.damping, Domain::Any)]
    }
}

impl<S: Scalar> JointCompliance<S> {
    /// Effort at wind-up `q` and its rate `v`.
    #[inline]
    pub fn effort(&self, q: S, v: S) -> S {
        self.effort_at_rest(q) - self.damping * v
    }

    /// Effort of the spring.
    #[inline]
    pub fn effort_at_rest(&self, q: S) -> S {
        -(self.stiffness * q)
    }

    /// Resistance to the rate.
    #[inline]
    pub fn resistance(&self) -> S {
        self.damping
    }

    /// Potential energy in J.
    #[inline]
    pub fn potential(&self, q: S) -> S {
        self.stiffness * q * q * 0.5
    }
}
