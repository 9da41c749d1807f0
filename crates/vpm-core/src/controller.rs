//! Sampled controllers: a reference and a measured position in, a command out, once per sample of the log.

use serde::Deserialize;

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

fn none<T>() -> Option<T> {
    None
}

/// Any control law.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ControlLaw<P> {
    /// Position loop around a velocity loop.
    Cascade(Cascade<P>),
    /// Proportional, integral, derivative.
    Pid(Pid<P>),
}

/// What a controller remembers between samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ControlMemory<S> {
    started: bool,
    /// y[k-1] and y[k-2].
    measured: [S; 2],
    /// e[k-1].
    error: S,
    /// ∫e dt.
    integral: S,
}

impl<P> ControlLaw<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> ControlLaw<T> {
        match self {
            Self::Cascade(law) => ControlLaw::Cascade(Cascade {
                position_gain: f(&law.position_gain),
                velocity_gain: f(&law.velocity_gain),
                limit: law.limit.as_ref().map(|limit| limit.map(f)),
            }),
            Self::Pid(law) => ControlLaw::Pid(Pid {
                proportional: f(&law.proportional),
                integral: f(&law.integral),
                derivative: f(&law.derivative),
                limit: law.limit.as_ref().map(|limit| limit.map(f)),
            }),
        }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let (mut domains, limit) = match self {
            Self::Cascade(law) => {
                (vec![(&law.position_gain, Domain::Any), (&law.velocity_gain, Domain::Any)], &law.limit)
            }
            Self::Pid(law) => (
                vec![(&law.proportional, Domain::Any), (&law.integral, Domain::Any), (&law.derivative, Domain::Any)],
                &law.limit,
            ),
        };
        domains.extend(limit.as_ref().map(|limit| (&limit.limit, Domain::Positive)));
        domains
    }
}

impl<S: Scalar> ControlLaw<S> {
    /// The command for `reference` and the measured position `y` (m or rad), `time_step` (s) after the last call.
    #[inline]
    pub fn command(&self, memory: &mut ControlMemory<S>, reference: S, y: S, time_step: f64) -> S {
        if !memory.started {
            // Before the first sample everything stood as it stands now.
            *memory = ControlMemory { started: true, measured: [y; 2], error: reference - y, integral: S::zero() };
        }
        let command = match self {
            Self::Cascade(law) => law.command(memory, reference, y, time_step),
            Self::Pid(law) => law.command(memory, reference - y, time_step),
        };
        memory.measured = [y, memory.measured[0]];
        memory.error = reference - y;
        command
    }
}

impl<S: Scalar> Cascade<S> {
    #[inline]
    fn command(&self, memory: &ControlMemory<S>, reference: S, y: S, time_step: f64) -> S {
        let velocity = (y - memory.measured[1]) / (2.0 * time_step);
        let command = self.velocity_gain * (self.position_gain * (reference - y) - velocity);
        self.limit.map_or(command, |limit| limit.apply(command))
    }
}

impl<S: Scalar> Pid<S> {
    #[inline]
    fn command(&self, memory: &mut ControlMemory<S>, error: S, time_step: f64) -> S {
        let fast = self.proportional * error + self.derivative * ((error - memory.error) / time_step);
        let integral = memory.integral + error * time_step;
        let command = fast + self.integral * integral;
        let Some(limit) = self.limit else {
            memory.integral = integral;
            return command;
        };
        let limited = limit.apply(command);
        let winds_up = limited.re() != command.re() && (command * self.integral * error).re() > 0.0;
        if winds_up {
            return limit.apply(fast + self.integral * memory.integral);
        }
        memory.integral = integral;
        limited
    }
}
