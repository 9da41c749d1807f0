//! Functions of a machine along a measured motion, many samples at a time, with derivatives by parameters.

use rayon::prelude::*;

use super::course::{Behind, Course, Memory};
use super::sample_by_sample::SampleBySample;
use crate::description::{Description, EffectEntry};
use crate::error::{Error, Result};
use crate::motion::{JointMotion, position_sensors};
use crate::scalar::Scalar;
use crate::sensitivity::{Interrupt, differentiate};
use crate::sensor::Sensor;
use crate::system::{Engine, Kind, Places};

/// Samples between two questions whether to stop, and samples that a thread takes at once.
pub(super) const PATIENCE: usize = 256;

/// A measured motion of a machine.
#[derive(Clone, Copy)]
pub(super) struct Record<'a> {
    pub(super) description: &'a Description,
    pub(super) motion: JointMotion<'a>,
    /// Time between samples, s.
    pub(super) time_step: f64,
    pub(super) interrupt: Interrupt<'a>,
}

impl Record<'_> {
    /// Numbers of a record's samples.
    pub(super) fn samples(&self) -> std::ops::Range<usize> {
        0..self.motion.position.rows()
    }

    /// Position, velocity and acceleration of a joint at sample `k` of a record, behind its sensor.
    #[inline]
    pub(super) fn behind<S: Scalar>(&self, k: usize, joint: usize, sensors: &[Option<Sensor<S>>]) -> [S; 3] {
        self.motion.behind(self.time_step, k, joint, sensors[joint].as_ref())
    }

    /// Asks whether to stop on the way through a record.
    pub(super) fn ask(&self) -> Result<()> {
        if (self.interrupt)() { Err(Error::Interrupted) } else { Ok(()) }
    }
}

/// Numbers of a machine along a record, and their derivatives by the parameters asked for, number by number.
pub(super) struct Numbers {
    pub(super) values: Vec<f64>,
    pub(super) jacobian: Vec<f64>,
}

/// A record as the inputs of a machine's functions, with derivatives of these inputs by parameters.
pub(super) struct Along<'a> {
    record: Record<'a>,
    theta: &'a [f64],
    sensitivities: &'a [usize],
    /// Motions of joints whose sensors have a parameter that is asked for.
    joints: Vec<(usize, Course)>,
    /// All memories.
    memories: Vec<Course>,
}

/// What an input of a function, by which it is differentiated, hands on to the parameters asked for.
enum Column<'a> {
    /// A parameter itself, at these places among them.
    Parameter(Vec<usize>),
    /// Number `place` of each sample of a course, which has so many for each.
    Number { course: &'a Course, place: usize, width: usize },
}

impl Column<'_> {
    /// Adds the derivative by the input at sample `k` of a record to those by the parameters.
    #[inline]
    fn add(&self, k: usize, entry: f64, slopes: &mut [f64]) {
        match self {
            Self::Parameter(places) => places.iter().for_each(|&place| slopes[place] += entry),
            Self::Number { course, place, width } => course.add_slopes(k * width + place, entry, slopes),
        }
    }
}

impl<'a> Along<'a> {
    /// Functions along a record for the checked parameters `theta`.
    pub(super) fn new(record: Record<'a>, theta: &'a [f64], sensitivities: &'a [usize]) -> Result<Self> {
        let (mut joints, mut memories) = (Vec::new(), Vec::new());
        for joint in 0..record.description.n_joints() {
            let behind = Behind { record, joint };
            let own = behind.parameters();
            if own.iter().any(|index| sensitivities.contains(index)) {
                joints.push((joint, Course::new(&behind, theta, sensitivities, &own)?));
            }
        }
        let remembers = |entry: &&EffectEntry| matches!(entry, EffectEntry::Memory { .. });
        for entry in record.description.effects.iter().filter(remembers) {
            let memory = Memory { record, entry };
            memories.push(Course::new(&memory, theta, sensitivities, &memory.parameters())?);
        }
        Ok(Self { record, theta, sensitivities, joints, memories })
    }

    /// Evaluates the function `kind`, of `width` numbers, along a record, with derivatives by parameters.
    pub(super) fn follow(&self, kind: Kind, width: usize) -> Result<Numbers> {
        let (description, theta) = (self.record.description, self.theta);
        let (places, functions) = (description.places(), description.functions());
        if self.sensitivities.is_empty() {
            let engine = description.engine(theta, &kind, self.record.samples().len())?;
            return self.run(&Function { engine, places, width, entries: &[], columns: Vec::new() });
        }
        let (by, columns) = self.columns(places);
        let function = functions.function(&Kind::Derived(Box::new(kind.clone()), by), theta)?;
        if function.directions.is_some() {
            let job = SampleBySample { record: self.record, kind, width };
            let (pair, jacobian) = differentiate(&job, theta, self.sensitivities)?;
            return Ok(Numbers { values: pair.first, jacobian });
        }
        let engine = Engine::of_derivatives(&function, theta, self.record.samples().len());
        self.run(&Function { engine, places, width, entries: &function.entries, columns })
    }

    /// Inputs of a record by which functions are differentiated, and what they hand on.
    fn columns(&self, places: Places) -> (Vec<u32>, Vec<Column<'_>>) {
        let (mut inputs, mut columns) = (Vec::new(), Vec::new());
        for &parameter in self.sensitivities {
            let input = (places.first_parameter() + parameter) as u32;
            if !inputs.contains(&input) {
                let same = |&place: &usize| self.sensitivities[place] == parameter;
                inputs.push(input);
                columns.push(Column::Parameter((0..self.sensitivities.len()).filter(same).collect()));
            }
        }
        for (joint, course) in &self.joints {
            let motion = [0, places.coordinates, places.accelerations()].map(|first| (first + joint) as u32);
            inputs.extend(motion);
            columns.extend((0..3).map(|place| Column::Number { course, place, width: 3 }));
        }
        let first = places.states - self.memories.len();
        for (number, course) in self.memories.iter().enumerate().filter(|(_, course)| course.is_moved()) {
            inputs.push((first + number) as u32);
            columns.push(Column::Number { course, place: 0, width: 1 });
        }
        (inputs, columns)
    }

    /// Works a function out along the record, on several threads if it is long: what a sample gives does not depend on the others.
    fn run(&self, function: &Function<'_>) -> Result<Numbers> {
        let (numbers, slopes) = (PATIENCE * function.width, PATIENCE * function.width * self.sensitivities.len());
        let count = self.record.samples().len() * function.width;
        let (mut values, mut jacobian) = (vec![0.0; count], vec![0.0; count * self.sensitivities.len()]);
        let mut rest = jacobian.chunks_mut(slopes.max(1));
        let piece = |(k, values)| Piece { first: k * PATIENCE, values, slopes: rest.next().unwrap_or_default() };
        let pieces: Vec<_> = values.chunks_mut(numbers.max(1)).enumerate().map(piece).collect();
        let sensors = position_sensors(self.record.description, self.theta);
        let work = || Work { engine: function.engine.clone(), inputs: Vec::new(), outputs: Vec::new() };
        if pieces.len() > 1 {
            pieces.into_par_iter().try_for_each_init(work, |work, piece| self.fill(function, &sensors, work, piece))?;
        } else {
            pieces.into_iter().try_for_each(|piece| self.fill(function, &sensors, &mut work(), piece))?;
        }
        Ok(Numbers { values, jacobian })
    }

    /// Works out a piece of the record.
    fn fill(
        &self,
        function: &Function<'_>,
        sensors: &[Option<Sensor<f64>>],
        work: &mut Work,
        piece: Piece<'_>,
    ) -> Result<()> {
        self.record.ask()?;
        let Piece { first, values, slopes } = piece;
        let (given, made) = (function.places.first_parameter(), function.width + function.entries.len());
        let rows = values.len() / function.width.max(1);
        work.inputs.resize(rows * given, 0.0);
        work.outputs.resize(rows * made, 0.0);
        for (k, row) in (first..).zip(work.inputs.chunks_exact_mut(given)) {
            self.put(function.places, sensors, k, row);
        }
        work.engine.run(function.places, &work.inputs, &mut work.outputs, made);
        let rows = work.outputs.chunks_exact(made.max(1)).zip(values.chunks_exact_mut(function.width.max(1)));
        let count = self.sensitivities.len();
        for (k, (outputs, values)) in rows.enumerate() {
            let (numbers, entries) = outputs.split_at(function.width);
            values.copy_from_slice(numbers);
            for (&(row, column), &entry) in function.entries.iter().zip(entries) {
                let place = (k * function.width + row) * count;
                function.columns[column].add(first + k, entry, &mut slopes[place..place + count]);
            }
        }
        Ok(())
    }

    /// Puts the motion and the memories at sample `k` of a record among the inputs of a function.
    fn put(&self, places: Places, sensors: &[Option<Sensor<f64>>], k: usize, inputs: &mut [f64]) {
        for joint in 0..sensors.len() {
            let [q, v, a] = self.record.behind(k, joint, sensors);
            inputs[joint] = q;
            inputs[places.coordinates + joint] = v;
            inputs[places.accelerations() + joint] = a;
        }
        for (memory, course) in inputs[places.states - self.memories.len()..].iter_mut().zip(&self.memories) {
            *memory = course.values[k];
        }
    }
}

/// A function of a machine, ready to be worked out.
struct Function<'a> {
    engine: Engine,
    places: Places,
    /// How many values it gives.
    width: usize,
    /// Row and column of each of the derivatives that it gives after them.
    entries: &'a [(usize, usize)],
    columns: Vec<Column<'a>>,
}

/// Some samples of a record.
struct Piece<'a> {
    /// Number of the first.
    first: usize,
    values: &'a mut [f64],
    slopes: &'a mut [f64],
}

/// The memory with which a thread works.
struct Work {
    engine: Engine,
    inputs: Vec<f64>,
    outputs: Vec<f64>,
}
