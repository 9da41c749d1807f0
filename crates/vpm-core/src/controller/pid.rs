//! Proportional, integral and derivative control.

use serde::Deserialize;

use super::{ControlMemory, domains, limit, none};
use crate::actuator::Saturation;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Proportional, integral and derivative controller of a position.
///
/// Law: `u = proportional e + integral ∫e dt + derivative de/dt`, limited to ±limit, with `e = r - y`, the integral by the
/// rectangle rule and the derivative by the backward difference. While the limit holds, an error that drives further into it is not
/// integrated. Units: command per m (rad), per m s, per m/s.
/// Source: Åström & Hägglund 2006, "Advanced PID Control", sections 3.5 (clamping, conditional integration) and 13.2.
/// Checked: the limit must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pid<P> {
    /// Command per error.
    pub proportional: P,
    /// Command per integrated error.
    pub integral: P,
    /// Command per rate of the error.
    pub derivative: P,
    /// Largest command.
    #[serde(default = "none")]
    pub limit: Option<Saturation<P>>,
}

impl<P> Pid<P> {
    /// PID law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Pid<T> {
        Pid {
            proportional: f(&self.proportional),
            integral: f(&self.integral),
            derivative: f(&self.derivative),
            limit: limit(self.limit.as_ref(), f),
        }
    }

    /// Parameters of PID control and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        domains(vec![&self.proportional, &self.integral, &self.derivative], self.limit.as_ref())
    }
}

impl<S: Scalar> Pid<S> {
    /// PID command for `reference` and the measured position `y` (m or rad), `time_step` (s) after the last call.
    #[inline]
    pub fn command(&self, memory: &mut ControlMemory<S>, reference: S, y: S, time_step: f64) -> S {
        memory.begin(reference, y);
        let command = self.limited(memory, reference - y, time_step);
        memory.keep(reference, y);
        command
    }

    #[inline]
    fn limited(&self, memory: &mut ControlMemory<S>, error: S, time_step: f64) -> S {
        let fast = self.proportional * error + self.derivative * ((error - memory.error) / time_step);
        let integral = memory.integral + error * time_step;
        let command = fast + self.integral * integral;
        let Some(limit) = self.limit else {
            memory.integral = integral;
            return command;
        };
        let free = || (limit.apply(command), integral);
        let held = || (limit.apply(fast + self.integral * memory.integral), memory.integral);
        let at_limit = || (command * self.integral * error).if_positive(held, free);
        let (limited, integral) = limit.limit.if_less(command.abs(), at_limit, free);
        memory.integral = integral;
        limited
    }
}
