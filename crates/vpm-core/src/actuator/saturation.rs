//! The largest command that has an effect.

use serde::Deserialize;

use crate::scalar::Scalar;

/// Saturation of an actuator or of a controller's output: a symmetric limit.
///
/// Law: `min(max(u, -limit), limit)`, all in the command's unit.
/// Source: Åström & Hägglund 2006, "Advanced PID Control", section 3.5. Checked: the limit must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct Saturation<P> {
    /// Largest magnitude that passes.
    pub limit: P,
}

impl<P> Saturation<P> {
    /// Saturation over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Saturation<T> {
        Saturation { limit: f(&self.limit) }
    }
}

impl<S: Scalar> Saturation<S> {
    /// Command after saturation, within its limits.
    #[inline]
    pub fn apply(&self, command: S) -> S {
        let below = || command.if_less(-self.limit, || -self.limit, || command);
        self.limit.if_less(command, || self.limit, below)
    }
}
