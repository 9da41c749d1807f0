//! A position loop around a velocity loop.

use serde::Deserialize;

use super::{ControlMemory, domains, limit, none};
use crate::actuator::Saturation;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Position controller with an inner velocity loop, as in servo drives.
///
/// Law: `u = velocity_gain (position_gain (r - y) - dy)`, limited to ±limit, with `dy` the backward difference of the mean of the
/// last two samples of y: `dy = (y[k] - y[k-2]) / (2 time_step)`. Units: position_gain in 1/s, velocity_gain in command s/m (s/rad).
/// Source: cascade of P loops, Khalil & Dombre 2002, "Modeling, Identification and Control of Robots", section 14.2; the filtered
/// difference as in Janot, Gautier & Brunot 2019, "Data set and reference models of EMPS". Checked: the limit must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cascade<P> {
    /// Velocity asked for per position error, 1/s.
    pub position_gain: P,
    /// Command per velocity error.
    pub velocity_gain: P,
    /// Largest command.
    #[serde(default = "none")]
    pub limit: Option<Saturation<P>>,
}

impl<P> Cascade<P> {
    /// Cascade law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Cascade<T> {
        Cascade {
            position_gain: f(&self.position_gain),
            velocity_gain: f(&self.velocity_gain),
            limit: limit(self.limit.as_ref(), f),
        }
    }

    /// Parameters of the cascade and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        domains(vec![&self.position_gain, &self.velocity_gain], self.limit.as_ref())
    }
}

impl<S: Scalar> Cascade<S> {
    /// Command of the cascade for `reference` and the measured position `y` (m or rad). It is `time_step` (s) after the
    /// last call.
    #[inline]
    pub fn command(&self, memory: &mut ControlMemory<S>, reference: S, y: S, time_step: f64) -> S {
        memory.begin(reference, y);
        let velocity = (y - memory.measured[1]) / (2.0 * time_step);
        let command = self.velocity_gain * (self.position_gain * (reference - y) - velocity);
        memory.keep(reference, y);
        self.limit.map_or(command, |limit| limit.apply(command))
    }
}
