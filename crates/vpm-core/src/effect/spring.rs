//! A linear spring in parallel with a joint.

use serde::Deserialize;

use super::Domain;
use crate::scalar::Scalar;

/// Spring of a joint: an effort that pulls the coordinate back to its rest.
///
/// Law: `tau = -stiffness (q - rest)`, tau in N or N m, q and `rest` in m or rad, `stiffness` in N/m or N m/rad.
/// It has the potential `1/2 stiffness (q - rest)^2`.
/// Source: Hooke's law. Checked: any finite value is accepted (a negative stiffness is an unstable equilibrium, as of a magnet).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring<P> {
    /// Effort per deflection, N/m or N m/rad.
    pub stiffness: P,
    /// Coordinate without effort, m or rad.
    pub rest: P,
}

impl<P> Spring<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Spring<T> {
        Spring { stiffness: f(&self.stiffness), rest: f(&self.rest) }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![(&self.stiffness, Domain::Any), (&self.rest, Domain::Any)]
    }
}

impl<S: Scalar> Spring<S> {
    /// Effort on the joint at coordinate `q`.
    #[inline]
    pub fn effort(&self, q: S) -> S {
        -(self.stiffness * (q - self.rest))
    }

    /// Potential energy at coordinate `q`, in J.
    #[inline]
    pub fn potential(&self, q: S) -> S {
        let deflection = q - self.rest;
        self.stiffness * deflection * deflection * 0.5
    }
}
