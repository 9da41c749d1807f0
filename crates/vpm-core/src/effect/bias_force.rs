//! A constant load.

use serde::Deserialize;

use super::Domain;
use crate::scalar::Scalar;

/// Bias force of a joint: a constant load that the drive must overcome (a cable's pull, an unbalanced spring, an amplifier's offset).
///
/// Law: `tau = -force`, both in N or N m. It has the potential `force q`.
/// Source: the offset term of inverse dynamic identification, Khalil & Dombre 2002, "Modeling, Identification and Control of Robots",
/// section 12.2. Checked: any finite value is accepted.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BiasForce<P> {
    /// Load against positive motion, N or N m.
    pub force: P,
}

impl<P> BiasForce<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> BiasForce<T> {
        BiasForce { force: f(&self.force) }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![(&self.force, Domain::Any)]
    }
}

impl<S: Scalar> BiasForce<S> {
    /// Effort on the joint.
    #[inline]
    pub fn effort(&self) -> S {
        -self.force
    }

    /// Potential energy at coordinate `q`, in J, zero at q = 0.
    #[inline]
    pub fn potential(&self, q: S) -> S {
        self.force * q
    }
}
