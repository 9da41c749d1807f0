//! What joints, memories and drives do along a record, with derivatives by the parameters that each depends on.

use super::record::Record;
use crate::actuator::{Actuator, Drive, Target};
use crate::description::EffectEntry;
use crate::effect::Seat;
use crate::error::Result;
use crate::motion::position_sensors;
use crate::scalar::Scalar;
use crate::sensitivity::{Job, Pair, differentiate};
use crate::sensor::Channel;
use crate::table::Table;

/// Numbers along a record, with their derivatives by those of the parameters asked for that move them.
pub(super) struct Course {
    /// The numbers.
    pub(super) values: Vec<f64>,
    /// Places of these parameters among all that are asked for.
    by: Vec<usize>,
    /// Derivatives by them, number by number.
    slopes: Vec<f64>,
}

impl Course {
    /// Course of `job` with derivatives by the parameters asked for among `own`. It keeps the first array, and depends
    /// on no other parameters.
    pub(super) fn new(job: &impl Job, theta: &[f64], sensitivities: &[usize], own: &[usize]) -> Result<Self> {
        let by: Vec<usize> = (0..sensitivities.len()).filter(|&place| own.contains(&sensitivities[place])).collect();
        let chosen: Vec<usize> = by.iter().map(|&place| sensitivities[place]).collect();
        let (pair, slopes) = differentiate(job, theta, &chosen)?;
        Ok(Self { values: pair.first, by, slopes })
    }

    /// Whether any of the parameters asked for moves a course.
    pub(super) fn is_moved(&self) -> bool {
        !self.by.is_empty()
    }

    /// Adds `factor` times the derivatives of a course's number `place` to those by all parameters asked for.
    #[inline]
    pub(super) fn add_slopes(&self, place: usize, factor: f64, slopes: &mut [f64]) {
        for (&column, &slope) in self.by.iter().zip(&self.slopes[place * self.by.len()..]) {
            slopes[column] += factor * slope;
        }
    }
}

/// Position, velocity and acceleration of a joint behind its sensor.
pub(super) struct Behind<'a> {
    pub(super) record: Record<'a>,
    pub(super) joint: usize,
}

impl Behind<'_> {
    /// Parameters of the sensor of a course.
    pub(super) fn parameters(&self) -> Vec<usize> {
        let channel = Channel::Position { joint: self.joint };
        let sensor = self.record.description.sensors.iter().find(|sensor| sensor.channel == channel);
        sensor.map_or_else(Vec::new, |sensor| sensor.domains().into_iter().map(|(&index, _)| index).collect())
    }
}

impl Job for Behind<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let sensors = position_sensors(self.record.description, theta);
        let states = self.record.samples().flat_map(|k| self.record.behind(k, self.joint, &sensors));
        Ok(Pair { first: states.collect(), second: Vec::new() })
    }
}

/// Memory of an effect.
pub(super) struct Memory<'a> {
    pub(super) record: Record<'a>,
    pub(super) entry: &'a EffectEntry,
}

impl Memory<'_> {
    /// Parameters of the effect of a course and of the sensors of its joints.
    pub(super) fn parameters(&self) -> Vec<usize> {
        let mut own: Vec<usize> = self.entry.domains().into_iter().map(|(&index, _)| index).collect();
        let joints = self.entry.seat().into_iter().flat_map(Seat::joints);
        own.extend(joints.flat_map(|joint| Behind { record: self.record, joint }.parameters()));
        own
    }
}

impl Job for Memory<'_> {
    /// Course of a memory sample by sample, relaxed at first; nothing of an effect that does not remember.
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let sensors = position_sensors(self.record.description, theta);
        let (mut first, mut memory, mut before) = (Vec::new(), S::zero(), None);
        if let Some((seat, effect)) = self.entry.with_memory(theta) {
            let (law, time) = (effect.law(), S::from_f64(self.record.time_step));
            first.extend(self.record.samples().map(|k| {
                let q = seat.sum(|joint| self.record.behind(k, joint, &sensors)[0]);
                memory = before.map_or(memory, |before| law.advance(memory, q - before, time));
                before = Some(q);
                memory
            }));
        }
        Ok(Pair { first, second: Vec::new() })
    }
}

/// Effort of an ideal drive on a joint or a line, mean over the two intervals that meet at each sample.
pub(super) struct Delivered<'a> {
    pub(super) actuator: &'a Actuator<usize>,
    /// The joint or line on which it acts.
    pub(super) on: Target,
    /// Place of the ratio by which it acts there through a shaft.
    pub(super) ratio: Option<usize>,
    /// Number of the actuator.
    pub(super) number: usize,
    pub(super) inputs: Table<'a>,
    pub(super) time_step: f64,
}

impl Delivered<'_> {
    /// Parameters of the actuator of a course.
    pub(super) fn parameters(&self) -> Vec<usize> {
        self.actuator.domains().into_iter().map(|(&index, _)| index).chain(self.ratio).collect()
    }
}

impl Job for Delivered<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let actuator = self.actuator.map(&mut |&index| theta[index]);
        let mut first = Vec::new();
        if let Drive::Ideal(drive) = &actuator.drive {
            let command = |sample: usize| S::from_f64(self.inputs.at(sample, self.number));
            let (mut state, mut before) = (None, None);
            first.extend((0..self.inputs.rows()).map(|k| {
                let input = actuator.input(k, self.time_step, command);
                let mean = actuator.lag.as_ref().map_or(input, |lag| {
                    let (next, mean) = lag.interval(state.unwrap_or(input), input, self.time_step);
                    state = Some(next);
                    mean
                });
                let shaft = drive.effort(mean);
                let effort = self.ratio.map_or(shaft, |ratio| shaft * theta[ratio]);
                (before.replace(effort).unwrap_or(effort) + effort) * 0.5
            }));
        }
        Ok(Pair { first, second: Vec::new() })
    }
}
