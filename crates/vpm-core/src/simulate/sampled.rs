//! Sampled drives at work: what they read at a sample of theirs, and the effort that they hold until the next.

use crate::actuator::{Drive, MaxwellNarxDrive, NarxDrive, Reading, Target};
use crate::controller::samples_between;
use crate::description::{Description, maxwell_of, narx_of};
use crate::error::{Diverged, Error, Result};
use crate::narx::{MaxwellNarx, MaxwellState, Stepper};
use crate::scalar::Scalar;
use crate::sensor::{Channel, Layout};

/// The drives of a machine that act at samples of their own, with all that they remember. None of it is a state of the integrator.
///
/// Law: at each of its samples a drive takes its inputs as they are then, true and without sensors, makes one step, and holds the effort
/// until its next sample, whatever steps the integrator takes in between. Before its first sample everything stood as it stands there.
#[derive(Clone, Debug)]
pub(crate) struct SampledDrives<S = f64> {
    /// One place for each actuator.
    drives: Vec<Option<SampledDrive<S>>>,
}

/// An effort that a drive cannot have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Astray {
    pub(crate) actuator: usize,
    value: f64,
    limit: f64,
}

#[derive(Clone, Debug)]
struct SampledDrive<S> {
    law: Law<S>,
    /// Samples of the record from one of the drive to its next.
    every: usize,
    limit: f64,
    started: bool,
    effort: S,
}

#[derive(Clone, Debug)]
enum Law<S> {
    Narx(Narx<S>),
    Maxwell(Maxwell<S>),
}

#[derive(Clone, Debug)]
struct Narx<S> {
    stepper: Stepper<S>,
    /// Column among the outputs that each input reads; none for the command.
    reads: Vec<Option<usize>>,
    row: Vec<S>,
    initial: S,
}

#[derive(Clone, Debug)]
struct Maxwell<S> {
    law: MaxwellNarx,
    state: MaxwellState<S>,
    length: usize,
}

impl<S: Scalar> SampledDrives<S> {
    /// The sampled drives of a machine whose record has steps of `time_step` (s).
    pub(crate) fn new(description: &Description, time_step: f64) -> Result<Self> {
        let layout = description.layout();
        let drives = description.actuators.iter().map(|actuator| {
            let (law, sample_time, limit) = match &actuator.drive {
                Drive::Narx(drive) => (Law::Narx(Narx::new(drive, layout)?), drive.sample_time, drive.limit),
                Drive::MaxwellNarx(drive) => {
                    let length = match actuator.on {
                        Target::Joint(joint) => Channel::Position { joint },
                        Target::Line(line) => Channel::Length { line },
                    };
                    let length = length.column(layout);
                    (Law::Maxwell(Maxwell::new(drive, length)?), drive.sample_time, drive.limit)
                }
                _ => return Ok(None),
            };
            let every = samples_between("actuator", &actuator.name, Some(sample_time), time_step)?;
            let limit = limit.unwrap_or(f64::INFINITY);
            Ok(Some(SampledDrive { law, every, limit, started: false, effort: S::zero() }))
        });
        Ok(Self { drives: drives.collect::<Result<_>>()? })
    }

    /// Whether there is no sampled drive.
    pub(crate) fn is_empty(&self) -> bool {
        self.drives.iter().all(Option::is_none)
    }

    /// Forgets the past of all sampled drives.
    pub(crate) fn restart(&mut self) {
        for drive in self.drives.iter_mut().flatten() {
            (drive.started, drive.effort) = (false, S::zero());
        }
    }

    /// What input `number` of the machine holds from sample `row` on, where the actuator receives `command` and the outputs are those that
    /// `see` shows: an effort for a sampled drive, none for everything else.
    #[inline]
    pub(crate) fn sample(
        &mut self,
        number: usize,
        row: usize,
        command: S,
        see: impl Fn(usize) -> S,
    ) -> std::result::Result<Option<S>, Astray> {
        let Some(Some(drive)) = self.drives.get_mut(number) else { return Ok(None) };
        if row.is_multiple_of(drive.every) {
            let (effort, limit) = (drive.step(command, see), drive.limit);
            let value = effort.re();
            // Written so that a value that is no number is beyond any limit.
            if !(value.is_finite() && value.abs() <= limit) {
                return Err(Astray { actuator: number, value, limit });
            }
            drive.effort = effort;
        }
        Ok(Some(drive.effort))
    }

    /// As [`SampledDrives::sample`] of a machine that stands and has not begun yet: no drive makes a step.
    pub(crate) fn rest(&self, number: usize, command: S, see: impl Fn(usize) -> S) -> Option<S> {
        match &self.drives.get(number)?.as_ref()?.law {
            Law::Narx(narx) => Some(narx.initial),
            Law::Maxwell(maxwell) => Some(-maxwell.law.settled(command, see(maxwell.length))),
        }
    }
}

impl Astray {
    /// The error that names the actuator; `at` is the time (s) and the sample where it happened.
    #[cold]
    pub(crate) fn error(self, description: &Description, at: (f64, usize), method: String, step: f64) -> Error {
        let Self { actuator, value, limit } = self;
        let event = match value.is_finite() {
            true => format!("is {value:.4e}, beyond its limit of {limit:.4e},"),
            false => Diverged::NOT_FINITE.to_owned(),
        };
        Error::Diverged(Box::new(Diverged {
            what: format!("the effort of actuator `{}`", description.actuators[actuator].name),
            event,
            time: at.0,
            sample_index: at.1,
            method,
            step,
            repair: "keep commands and motion where its model was identified, or take a model with fewer terms",
            outputs: Vec::new(),
            states: Vec::new(),
        }))
    }
}

impl<S: Scalar> SampledDrive<S> {
    #[inline]
    fn step(&mut self, command: S, see: impl Fn(usize) -> S) -> S {
        let first = !std::mem::replace(&mut self.started, true);
        match &mut self.law {
            Law::Narx(Narx { stepper, reads, row, initial }) => {
                for (place, column) in row.iter_mut().zip(&*reads) {
                    *place = column.map_or(command, &see);
                }
                if first {
                    stepper.stand(*initial, row);
                }
                stepper.step(row)
            }
            Law::Maxwell(Maxwell { law, state, length }) => {
                let length = see(*length);
                if first {
                    *state = law.start([law.settled(command, length); 2], command, [length; 2]);
                }
                // The element pulls, and the effort of an actuator pushes.
                -law.step(state, command, length)
            }
        }
    }
}

impl<S: Scalar> Narx<S> {
    fn new(drive: &NarxDrive, layout: Layout) -> Result<Self> {
        let column = |reading: Reading| match reading {
            Reading::Command => None,
            Reading::Position(joint) => Some(Channel::Position { joint }.column(layout)),
            Reading::Velocity(joint) => Some(Channel::Velocity { joint }.column(layout)),
            Reading::Length(line) => Some(Channel::Length { line }.column(layout)),
            Reading::Rate(line) => Some(Channel::Rate { line }.column(layout)),
        };
        Ok(Self {
            stepper: narx_of(drive)?.stepper_in(),
            reads: drive.inputs.iter().map(|&(_, reading)| column(reading)).collect(),
            row: vec![S::zero(); drive.inputs.len()],
            initial: S::from_f64(drive.initial),
        })
    }
}

impl<S: Scalar> Maxwell<S> {
    fn new(drive: &MaxwellNarxDrive, length: usize) -> Result<Self> {
        Ok(Self { law: maxwell_of(drive)?, state: MaxwellState::default(), length })
    }
}
