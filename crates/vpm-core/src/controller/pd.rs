//! Proportional control with damping by the measured rate.

use serde::Deserialize;

use super::{domains, limit, none};
use crate::actuator::Saturation;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Proportional controller of a joint's position or of a line's length, damped by its measured rate: a spring and a damper to the
/// reference, without memory.
///
/// Law: `u = proportional (r - y) - derivative dy`, limited to ±limit. Units: command per m (rad), command per m/s (rad/s).
/// Source: PD control in joint space, Siciliano, Sciavicco, Villani & Oriolo 2009, "Robotics", section 8.5.1, without its gravity term.
/// Checked: the limit must be positive; an axis under it against the matrix exponential.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pd<P> {
    /// Command per error.
    pub proportional: P,
    /// Command per measured rate.
    pub derivative: P,
    /// Largest command.
    #[serde(default = "none")]
    pub limit: Option<Saturation<P>>,
}

impl<P> Pd<P> {
    /// PD law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Pd<T> {
        Pd {
            proportional: f(&self.proportional),
            derivative: f(&self.derivative),
            limit: limit(self.limit.as_ref(), f),
        }
    }

    /// Parameters of PD control and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        domains(vec![&self.proportional, &self.derivative], self.limit.as_ref())
    }
}

impl<S: Scalar> Pd<S> {
    /// PD command for `reference` at the measured `y` (m or rad) and its measured `rate`.
    #[inline]
    pub fn command(&self, reference: S, y: S, rate: S) -> S {
        let command = self.proportional * (reference - y) - self.derivative * rate;
        self.limit.map_or(command, |limit| limit.apply(command))
    }
}
