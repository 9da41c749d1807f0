//! Inverse dynamics of a whole record: the effort that the motion needs against the effort that the actuators deliver.

use crate::actuator::Target;
use crate::description::Description;
use crate::dynamics::rnea;
use crate::error::{Error, Result};
use crate::scalar::Scalar;
use crate::sensitivity::{Interrupt, Job, Pair, differentiate};
use crate::sensor::{Channel, Sensor};
use crate::simulate::check_time_step;
use crate::system::{Build, Dynamics, add_effects};
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
    /// Commands, N x actuators, held from each sample to the next.
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
/// Source: inverse dynamic identification model, Khalil & Dombre 2002, "Modeling, Identification and Control of Robots", section 12.4.
/// Checked: recovers the efforts of a simulated run.
pub fn inverse_dynamics(
    description: &Description,
    theta: &[f64],
    motion: Motion<'_>,
    sensitivities: &[usize],
    interrupt: Interrupt<'_>,
) -> Result<Efforts> {
    let (rows, joints) = (motion.position.rows(), description.n_joints());
    motion.position.expect("position", rows, joints)?;
    motion.velocity.expect("velocity", rows, joints)?;
    motion.acceleration.expect("acceleration", rows, joints)?;
    motion.inputs.expect("inputs", rows, description.n_actuators())?;
    check_time_step(motion.time_step)?;
    let job = Inverse { description, motion, interrupt };
    let residual = |pass: &Pair<_>, place: usize| pass.first[place] - pass.second[place];
    let (pair, jacobian) = differentiate(&job, theta, sensitivities, residual)?;
    Ok(Efforts { required: pair.first, applied: pair.second, jacobian })
}

struct Inverse<'a> {
    description: &'a Description,
    motion: Motion<'a>,
    interrupt: Interrupt<'a>,
}

impl Job for Inverse<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::re).collect();
        self.description.check_values(&values)?;
        let mut dynamics = Build::dynamics(&self.description, theta)?;
        let sensors = self.position_sensors(theta);
        Ok(Pair { first: self.required(&mut dynamics, &sensors)?, second: self.applied(&dynamics) })
    }
}

impl Inverse<'_> {
    /// The sensor on the position of each joint, if there is one.
    fn position_sensors<S: Scalar>(&self, theta: &[S]) -> Vec<Option<Sensor<S>>> {
        let sensors = self.description.sensors(theta);
        let on = |joint| sensors.iter().find(|sensor| sensor.channel == Channel::Position { joint }).cloned();
        (0..self.description.n_joints()).map(on).collect()
    }

    fn required<S: Scalar>(&self, dynamics: &mut Dynamics<S>, sensors: &[Option<Sensor<S>>]) -> Result<Vec<S>> {
        let joints = sensors.len();
        let zero = vec![S::zero(); joints];
        let (mut q, mut v, mut a, mut effects) = (zero.clone(), zero.clone(), zero.clone(), zero);
        let mut required = vec![S::zero(); self.motion.position.numbers().len()];
        for (k, row) in required.chunks_exact_mut(joints).enumerate() {
            if k.is_multiple_of(PATIENCE) && (self.interrupt)() {
                return Err(Error::Interrupted);
            }
            for (joint, sensor) in sensors.iter().enumerate() {
                (q[joint], v[joint], a[joint]) = self.true_motion(k, joint, sensor.as_ref());
            }
            row.copy_from_slice(rnea(&dynamics.model, &mut dynamics.data, &q, &v, &a));
            effects.fill(S::zero());
            add_effects(&dynamics.effects, &q, &v, &mut effects);
            for (effort, &effect) in row.iter_mut().zip(&effects) {
                *effort -= effect;
            }
        }
        Ok(required)
    }

    /// Position, velocity and acceleration of a joint behind what was measured.
    #[inline]
    fn true_motion<S: Scalar>(&self, k: usize, joint: usize, sensor: Option<&Sensor<S>>) -> (S, S, S) {
        let Motion { position, velocity, acceleration, time_step, .. } = self.motion;
        let last = position.rows() - 1;
        let at = |table: Table<'_>, sample| S::from_f64(table.at(sample, joint));
        match sensor {
            Some(sensor) => (
                sensor.undo(k, last, time_step, |sample| at(position, sample)),
                sensor.undo_rate(k, last, time_step, |sample| at(velocity, sample)),
                sensor.undo_rate(k, last, time_step, |sample| at(acceleration, sample)),
            ),
            None => (at(position, k), at(velocity, k), at(acceleration, k)),
        }
    }

    fn applied<S: Scalar>(&self, dynamics: &Dynamics<S>) -> Vec<S> {
        let Motion { inputs, time_step, .. } = self.motion;
        let joints = dynamics.joints();
        let mut applied = vec![S::zero(); inputs.rows() * joints];
        for (number, actuator) in dynamics.actuators.iter().enumerate() {
            let Target::Joint(joint) = actuator.on else { continue };
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
                let effort = actuator.motor.effort(mean);
                row[joint] += (before.unwrap_or(effort) + effort) * 0.5;
                before = Some(effort);
            }
        }
        applied
    }
}
