//! The time between a command and its effect.

use serde::Deserialize;

use crate::delay::SampleDelay;
use crate::scalar::Scalar;

/// Input delay of an actuator: communication and computation between a command and the amplifier.
///
/// Law: `u(t - time)`, time in s, on a command held between samples; what acts over a sample interval is the mean of the delayed
/// command over it, see [`SampleDelay`]. Checked: the time must not be negative.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct InputDelay<P> {
    /// Delay in s.
    pub time: P,
}

impl<P> InputDelay<P> {
    /// The same delay over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> InputDelay<T> {
        InputDelay { time: f(&self.time) }
    }
}

impl<S: Scalar> InputDelay<S> {
    /// Mean of the delayed command over the interval that begins at sample `k`, in the command's unit.
    #[inline]
    pub fn held(&self, k: usize, time_step: f64, command: impl Fn(usize) -> S) -> S {
        SampleDelay::new(self.time, time_step).delayed(k, command)
    }
}
