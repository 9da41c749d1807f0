//! From command to effort.

use serde::Deserialize;

use crate::scalar::Scalar;

/// Motor of an actuator: an effort proportional to what reaches it (a current- or voltage-driven motor with its transmission).
///
/// Law: `tau = gain x`, tau in N or N m, x in the command's unit.
/// Source: Khalil & Dombre 2002, "Modeling, Identification and Control of Robots", section 12.1 (drive gain). Checked: any finite
/// value is accepted.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct Motor<P> {
    /// Effort per command.
    pub gain: P,
}

impl<P> Motor<P> {
    /// The same motor over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Motor<T> {
        Motor { gain: f(&self.gain) }
    }
}

impl<S: Scalar> Motor<S> {
    /// Effort delivered on the joint.
    #[inline]
    pub fn effort(&self, x: S) -> S {
        self.gain * x
    }
}
