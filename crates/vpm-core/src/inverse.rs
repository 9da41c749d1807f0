//! Inverse dynamics of a whole record: the effort that the motion needs against the effort that the actuators deliver.

use crate::actuator::{Drive, Target};
use crate::description::{Description, EffectEntry};
use crate::error::{DriveError, Error, Result};
use crate::motion::{JointMotion, position_sensors};
use crate::scalar::Scalar;
use crate::sensitivity::{Interrupt, Job, Pair, differentiate};
use crate::sensor::Sensor;
use crate::simulate::check_time_step;
use crate::system::{Build, Dynamics};
use crate::table::Table;

/// Samples between two questions whether to stop.
const PATIENCE: usize = 256;

/// A measured motion with its commands.
#[derive(Clone, Copy)]
pub struct Motion<'a> {
    /// Coordinates, N x joints, m or rad.
    pub position: Table<'a>,
    /// Velocities, N x joints.
    pub velocity: Table<'a>,
    /// Accelerations, N x joints.
    pub acceleration: Table<'a>,
    /// Inputs, N x inputs, held from each sample to the next.
    pub inputs: Table<'a>,
    /// Time between samples, s.
    pub time_step: f64,
}

/// What the inverse dynamics give, each table row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Efforts {
    /// Effort that the motion needs at each joint: that of the rigid tree minus those of the effects.
    pub required: Vec<f64>,
    /// Effort that the actuators deliver on each joint, mean over the two intervals that meet at the sample.
    pub applied: Vec<f64>,
    /// Derivative of required - applied with respect to each requested parameter.
    pub jacobian: Vec<f64>,
}

/// Required and applied efforts of `motion`.
///
/// Law: `required = M(q) a + h(q, v) - effects(q, v)`, where offset, gain and delay of position sensors have been undone first:
/// `q(t) = (y(t + delay) - offset) / gain`, velocities and accelerations likewise without the offset.
/// `applied[k] = (m[k-1] + m[k]) / 2` with m the mean effort over a sample interval, which is what a central difference of the motion
/// sees; the lag is solved exactly in each interval, from rest at its first input.
/// Hystereses begin relaxed and move on exactly along the way from sample to sample.
/// Source: inverse dynamic identification model, Khalil & Dombre 2002, "Modeling, Identification and Control of Robots", section 12.4.
/// Checked: recovers the efforts of a simulated run.
pub fn inverse_dynamics(
    description: &Description,
    theta: &[f64],
    motion: Motion<'_>,
    sensitivities: &[usize],
    interrupt: Interrupt<'_>,
) -> Result<Efforts> {
    if let Some((beam, _)) = description.beams.iter().zip(description.elastic()).find(|(_, len)| **len > 0) {
        return Err(Error::Flexible { beam: beam.name.clone() });
    }
    if let Some(own) = description.actuators.iter().find(|actuator| !matches!(actuator.drive, Drive::Ideal(_))) {
        let (actuator, drive) = (own.name.clone(), own.drive.name());
        return Err(DriveError::Effort { actuator, drive }.into());
    }
    let (rows, joints) = (motion.position.rows(), description.n_joints());
    motion.position.expect("position", rows, joints)?;
    motion.velocity.expect("velocity", rows, joints)?;
    motion.acceleration.expect("acceleration", rows, joints)?;
    motion.inputs.expect("inputs", rows, description.n_inputs())?;
    check_time_step(motion.time_step)?;
    let job = Inverse { description, motion, interrupt };
    let residual = |pass: &Pair<_>, place: usize| pass.first[place] - pass.second[place];
    let (pair, jacobian) = differentiate(&job, theta, sensitivities, residual)?;
    Ok(Efforts { required: pair.first, applied: pair.second, jacobian })
}

/// Efforts of ideal drives on the joints as in [`inverse_dynamics`], N x joints, and their derivatives; of a machine of which not every
/// coordinate was measured, as long as all drives act on joints.
pub fn delivered(
    description: &Description,
    theta: &[f64],
    (inputs, time_step): (Table<'_>, f64),
    sensitivities: &[usize],
) -> Result<(Vec<f64>, Vec<f64>)> {
    for actuator in &description.actuators {
        let (name, drive) = (actuator.name.clone(), actuator.drive.name());
        if !matches!(actuator.drive, Drive::Ideal(_)) {
            return Err(DriveError::Effort { actuator: name, drive }.into());
        }
        if let Target::Line(line) = actuator.on {
            let found = format!("the line `{}`", description.lines[line].name);
            return Err(DriveError::Target { actuator: name, drive, found, needed: "a joint" }.into());
        }
    }
    inputs.expect("inputs", inputs.rows(), description.n_inputs())?;
    check_time_step(time_step)?;
    let job = Delivered { description, inputs, time_step };
    let (pair, jacobian) = differentiate(&job, theta, sensitivities, |pass: &Pair<_>, place| pass.first[place])?;
    Ok((pair.first, jacobian))
}

/// Efforts that a measured motion needs as in [`inverse_dynamics`], N x joints, and their derivatives; of a machine with any drives, for
/// what these deliver does not enter.
pub fn required(
    description: &Description,
    theta: &[f64],
    (motion, time_step): (JointMotion<'_>, f64),
    part: Part,
    sensitivities: &[usize],
    interrupt: Interrupt<'_>,
) -> Result<(Vec<f64>, Vec<f64>)> {
    if let Some((beam, _)) = description.beams.iter().zip(description.elastic()).find(|(_, len)| **len > 0) {
        return Err(Error::Flexible { beam: beam.name.clone() });
    }
    check_motion(description, motion)?;
    check_time_step(time_step)?;
    let job = Required { description, motion, time_step, part, interrupt };
    let (pair, jacobian) = differentiate(&job, theta, sensitivities, |pass: &Pair<_>, place| pass.first[place])?;
    Ok((pair.first, jacobian))
}

/// Efforts that the effect with the given number puts on its joint along a measured motion, one per sample, and their derivatives: what
/// it takes off the efforts of [`required`]. A number beyond the effects, and one of an effect that belongs to the tree, is an error.
///
/// An effect that follows the load of its joint counts without that: its share depends on all others.
pub fn effort_of_effect(
    description: &Description,
    theta: &[f64],
    (motion, time_step): (JointMotion<'_>, f64),
    effect: usize,
    sensitivities: &[usize],
) -> Result<(Vec<f64>, Vec<f64>)> {
    check_motion(description, motion)?;
    check_time_step(time_step)?;
    description.check_numbers(theta)?;
    let law = || {
        let what = "the request for an effort".to_owned();
        Error::Reference { what, target: "effect on a joint", index: effect, count: description.effects.len() }
    };
    let entry = description.effects.get(effect).filter(|entry| entry.joint().is_some()).ok_or_else(law)?;
    let job = OfEffect { description, motion, time_step, entry };
    let (pair, jacobian) = differentiate(&job, theta, sensitivities, |pass: &Pair<_>, place| pass.first[place])?;
    Ok((pair.first, jacobian))
}

fn check_motion(description: &Description, motion: JointMotion<'_>) -> Result<()> {
    let (rows, joints) = (motion.position.rows(), description.n_joints());
    motion.position.expect("position", rows, joints)?;
    motion.velocity.expect("velocity", rows, joints)?;
    motion.acceleration.expect("acceleration", rows, joints)
}

struct OfEffect<'a> {
    description: &'a Description,
    motion: JointMotion<'a>,
    time_step: f64,
    entry: &'a EffectEntry,
}

impl Job for OfEffect<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let Some(joint) = self.entry.joint() else { return Ok(Pair { first: Vec::new(), second: Vec::new() }) };
        let sensors = position_sensors(self.description, theta);
        let behind = |k| self.motion.behind(self.time_step, k, joint, sensors[joint].as_ref());
        let rows = 0..self.motion.position.rows();
        let first = match (self.entry.on_joint(theta), self.entry.with_memory(theta)) {
            (Some((_, law)), _) => rows.map(&behind).map(|[q, v, _]| law.effort(q, v)).collect(),
            (None, Some((_, law))) => {
                let (mut memory, mut before) = (S::zero(), None);
                let next = |[q, _, _]: [S; 3]| {
                    memory = before.map_or(memory, |before| law.advance(memory, q - before));
                    before = Some(q);
                    law.effort(memory)
                };
                rows.map(behind).map(next).collect()
            }
            (None, None) => Vec::new(),
        };
        Ok(Pair { first, second: Vec::new() })
    }
}

/// Which part of what a motion needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Whole,
    /// Without the effects on joints, see [`effort_of_effect`].
    WithoutEffects,
}

struct Required<'a> {
    description: &'a Description,
    motion: JointMotion<'a>,
    time_step: f64,
    part: Part,
    interrupt: Interrupt<'a>,
}

impl Job for Required<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.description.check_values(&values)?;
        let mut dynamics = Build::dynamics(&self.description, theta)?;
        if self.part == Part::WithoutEffects {
            dynamics.leave_effects();
        }
        let sensors = position_sensors(self.description, theta);
        let Self { motion, time_step, interrupt, .. } = *self;
        let (first, _) = efforts_of_motion(&mut dynamics, &sensors, motion, time_step, interrupt)?;
        Ok(Pair { first, second: Vec::new() })
    }
}

struct Delivered<'a> {
    description: &'a Description,
    inputs: Table<'a>,
    time_step: f64,
}

impl Job for Delivered<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.description.check_values(&values)?;
        let dynamics = Build::dynamics(&self.description, theta)?;
        Ok(Pair { first: applied(&dynamics, self.inputs, self.time_step, &[]), second: Vec::new() })
    }
}

struct Inverse<'a> {
    description: &'a Description,
    motion: Motion<'a>,
    interrupt: Interrupt<'a>,
}

impl Job for Inverse<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.description.check_values(&values)?;
        let mut dynamics = Build::dynamics(&self.description, theta)?;
        let sensors = position_sensors(self.description, theta);
        let Motion { position, velocity, acceleration, time_step, .. } = self.motion;
        let motion = JointMotion { position, velocity, acceleration };
        let (required, levers) = efforts_of_motion(&mut dynamics, &sensors, motion, time_step, self.interrupt)?;
        let applied = applied(&dynamics, self.motion.inputs, time_step, &levers);
        Ok(Pair { first: required, second: applied })
    }
}

/// Efforts that a motion needs, and the lever arms of the lines if actuators act on any: by sample, line and joint.
fn efforts_of_motion<S: Scalar>(
    dynamics: &mut Dynamics<S>,
    sensors: &[Option<Sensor<S>>],
    motion: JointMotion<'_>,
    time_step: f64,
    interrupt: Interrupt<'_>,
) -> Result<(Vec<S>, Vec<S>)> {
    let joints = sensors.len();
    let mut moving = [0; 3].map(|_| vec![S::zero(); joints]);
    let (mut required, mut before) = (vec![S::zero(); motion.position.numbers().len()], vec![S::zero(); joints]);
    let (mut levers, mut row_levers) = (Vec::new(), vec![S::zero(); dynamics.layout().lines * joints]);
    for (k, row) in required.chunks_exact_mut(joints).enumerate() {
        if k.is_multiple_of(PATIENCE) && interrupt() {
            return Err(Error::Interrupted);
        }
        for (joint, sensor) in sensors.iter().enumerate() {
            let state = motion.behind(time_step, k, joint, sensor.as_ref());
            for (numbers, number) in moving.iter_mut().zip(state) {
                numbers[joint] = number;
            }
        }
        let [q, v, a] = &moving;
        if k > 0 {
            dynamics.memories.travel(|joint| q[joint] - before[joint]);
        }
        before.copy_from_slice(q);
        dynamics.inverse_dynamics(q, v, a, row);
        if dynamics.pulls() {
            dynamics.levers(q, &mut row_levers);
            levers.extend_from_slice(&row_levers);
        }
    }
    Ok((required, levers))
}

/// Efforts of ideal drives on the joints, sample by sample, with the `levers` of lines where any acts on one.
fn applied<S: Scalar>(dynamics: &Dynamics<S>, inputs: Table<'_>, time_step: f64, levers: &[S]) -> Vec<S> {
    let (joints, lines) = (dynamics.joints(), dynamics.layout().lines);
    let mut applied = vec![S::zero(); inputs.rows() * joints];
    for (number, actuator) in dynamics.actuators.iter().enumerate() {
        let Drive::Ideal(drive) = &actuator.drive else { continue };
        let command = |sample: usize| S::from_f64(inputs.at(sample, number));
        let (mut state, mut before) = (None, None);
        for (k, row) in applied.chunks_exact_mut(joints).enumerate() {
            let input = actuator.input(k, time_step, command);
            let mean = match &actuator.lag {
                Some(lag) => {
                    let (next, mean) = lag.interval(state.unwrap_or(input), input, time_step);
                    state = Some(next);
                    mean
                }
                None => input,
            };
            let effort = drive.effort(mean);
            let delivered = (before.unwrap_or(effort) + effort) * 0.5;
            match actuator.on {
                Target::Joint(joint) => row[joint] += delivered,
                Target::Line(line) => {
                    let arms = &levers[(k * lines + line) * joints..];
                    for (entry, &arm) in row.iter_mut().zip(arms) {
                        *entry += arm * delivered;
                    }
                }
            }
            before = Some(effort);
        }
    }
    applied
}
