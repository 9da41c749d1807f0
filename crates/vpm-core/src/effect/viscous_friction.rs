//! Friction proportional to speed.

use serde::Deserialize;

use super::Domain;
use crate::scalar::Scalar;

/// Viscous friction of a joint: a lubricant's resistance, proportional to the velocity.
///
/// Law: `tau = -viscous v`, with tau in N or N m, v in m/s or rad/s and `viscous` in N s/m or N m s/rad.
/// Source: Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, "A survey of models, analysis tools and compensation methods for the
/// control of machines with friction", Automatica 30(7), section 2. Checked: any finite value is accepted.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViscousFriction<P> {
    /// Resistance per velocity, N s/m or N m s/rad.
    pub viscous: P,
}

impl<P> ViscousFriction<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> ViscousFriction<T> {
        ViscousFriction { viscous: f(&self.viscous) }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![(&self.viscous, Domain::Any)]
    }
}

impl<S: Scalar> ViscousFriction<S> {
    /// Effort on the joint at velocity `v`.
    #[inline]
    pub fn effort(&self, v: S) -> S {
        -(self.viscous * v)
    }

    /// Resistance r with `effort = -r v`.
    #[inline]
    pub fn resistance(&self) -> S {
        self.viscous
    }
}
