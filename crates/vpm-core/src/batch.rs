//! Functions of the motion of a machine at many motions at once, with derivatives by the motion and by parameters.
//!
//! Law: each row stands for itself; hystereses are relaxed. Derivatives are those of the recorded function (Griewank & Walther 2008,
//! chapter 3), at a kink those of the branch that holds.

use rayon::prelude::*;

use crate::ball::check_angles;
use crate::description::Description;
use crate::error::{Error, Result};
use crate::scalar::{Dual, Scalar};
use crate::sensitivity::{Interrupt, LANES, check_variables};
use crate::system::{Engine, Kind, Places, Routine};
use crate::table::Table;

/// Rows that a thread takes at once; it asks whether to stop in between.
const PIECE: usize = 256;

/// What is asked of a machine at each motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Efforts that accelerations need, those of the effects taken off.
    InverseDynamics,
    /// Accelerations that efforts give, with all effects.
    ForwardDynamics,
    /// Mass matrix with payloads, row by row.
    MassMatrix,
    /// Pose of this marker in the world, a homogeneous matrix row by row.
    MarkerPose(usize),
    /// Angular velocity and velocity of this marker in world axes per unit rate of each coordinate, row by row.
    MarkerJacobian(usize),
    /// Kinetic and potential energy, J.
    Energy,
}

/// Motions of all coordinates; what a function does not depend on may be left out.
#[derive(Clone, Copy, Debug)]
pub struct Motions<'a> {
    /// Coordinates, N x n.
    pub position: Table<'a>,
    /// Their rates, N x n.
    pub velocity: Option<Table<'a>>,
    /// Accelerations, or the efforts of [`Question::ForwardDynamics`], N x n.
    pub third: Option<Table<'a>>,
}

/// The variables by which a function of a machine is differentiated.
#[derive(Clone, Copy, Debug, Default)]
pub struct By<'a> {
    /// By coordinates, rates and accelerations (or efforts), n columns each.
    pub motion: bool,
    /// By these parameters.
    pub parameters: &'a [usize],
}

/// Numbers of a function for all motions of a batch, with the derivatives that were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Answers {
    /// The numbers, `width` for each motion.
    pub values: Vec<f64>,
    /// Derivatives of each number, number by number.
    pub derivatives: Vec<f64>,
    /// How many numbers a motion gives.
    pub width: usize,
}

impl Question {
    /// Kind of function in a batch, and what it is called.
    fn kind(self, description: &Description) -> Result<(Kind, &'static str)> {
        let marker = |number: usize| {
            let count = description.layout().markers;
            if number < count {
                return Ok(number as u32);
            }
            Err(Error::Reference {
                what: "the request for a marker".to_owned(),
                target: "marker",
                index: number,
                count,
            })
        };
        Ok(match self {
            Self::InverseDynamics => (Kind::Required, "effort"),
            Self::ForwardDynamics => (Kind::Accelerations, "acceleration"),
            Self::MassMatrix => (Kind::MassMatrix, "mass_matrix"),
            Self::MarkerPose(number) => (Kind::MarkerPose(marker(number)?), "pose"),
            Self::MarkerJacobian(number) => (Kind::MarkerJacobian(marker(number)?), "jacobian"),
            Self::Energy => (Kind::Energy, "energy"),
        })
    }

    fn width(self, n: usize) -> usize {
        match self {
            Self::InverseDynamics | Self::ForwardDynamics => n,
            Self::MassMatrix => n * n,
            Self::MarkerPose(_) => 16,
            Self::MarkerJacobian(_) => 6 * n,
            Self::Energy => 2,
        }
    }
}

impl Motions<'_> {
    fn check(&self, description: &Description, question: Question) -> Result<()> {
        let (rows, n) = (self.position.rows(), description.n_coordinates());
        self.position.expect("position", rows, n)?;
        for (name, table) in [("velocity", self.velocity), ("acceleration or effort", self.third)] {
            table.map_or(Ok(()), |table| table.expect(name, rows, n))?;
        }
        if question == Question::ForwardDynamics {
            return (0..rows).try_for_each(|row| check_angles(&description.balls, self.position.row(row)));
        }
        Ok(())
    }

    /// Puts motion `row` of a batch among the inputs of a function.
    fn put(&self, places: Places, row: usize, inputs: &mut [f64]) {
        let parts =
            [(0, Some(self.position)), (places.coordinates, self.velocity), (places.accelerations(), self.third)];
        for (first, table) in parts {
            if let Some(table) = table {
                inputs[first..first + places.coordinates].copy_from_slice(table.row(row));
            }
        }
    }
}

/// Batch of answers to `question` at all `motions`, with derivatives.
///
/// Checked: against single evaluations, other programs, difference quotients and dual numbers.
///
/// # Errors
/// [`Error::Dimension`] or [`Error::Reference`] for what does not fit, [`Error::NonFinite`] where an answer is no finite number.
pub fn answer(
    description: &Description,
    theta: &[f64],
    question: Question,
    motions: Motions<'_>,
    by: By<'_>,
    interrupt: Interrupt<'_>,
) -> Result<Answers> {
    description.check_values(theta)?;
    check_variables(theta, by.parameters)?;
    motions.check(description, question)?;
    let (kind, name) = question.kind(description)?;
    let (places, width) = (description.places(), question.width(description.n_coordinates()));
    let inputs = variables(places, by);
    let rows = motions.position.rows();
    let mut job = Job { places, motions, width, columns: inputs.len(), entries: Vec::new(), interrupt, name };
    if inputs.is_empty() {
        return job.run(&description.engine(theta, &kind, rows)?);
    }
    let derived = Kind::Derived(Box::new(kind.clone()), inputs.clone());
    let function = description.functions().function(&derived, theta)?;
    if function.directions.is_some() {
        let directions = Directions { description, theta, kind, inputs };
        return directions.run(&job);
    }
    job.entries.clone_from(&function.entries);
    job.run(&Engine::of_derivatives(&function, theta, rows))
}

/// Inputs by which the function of a batch is differentiated.
fn variables(places: Places, by: By<'_>) -> Vec<u32> {
    let n = places.coordinates;
    let motion = [0, n, places.accelerations()].into_iter().flat_map(|first| first..first + n);
    let parameters = by.parameters.iter().map(|parameter| places.first_parameter() + parameter);
    motion.filter(|_| by.motion).chain(parameters).map(|place| place as u32).collect()
}

/// Work on all motions.
struct Job<'a> {
    places: Places,
    motions: Motions<'a>,
    width: usize,
    /// How many derivatives a number has.
    columns: usize,
    /// Row and column of each derivative that a function gives.
    entries: Vec<(usize, usize)>,
    interrupt: Interrupt<'a>,
    name: &'static str,
}

impl Job<'_> {
    fn run(&self, engine: &Engine) -> Result<Answers> {
        let work = || (engine.clone(), Vec::new(), Vec::new());
        let made = self.width + self.entries.len();
        self.fill(work, |(engine, inputs, outputs), rows, values, slopes| {
            let given = self.places.first_parameter();
            inputs.resize(rows.len() * given, 0.0);
            outputs.resize(rows.len() * made, 0.0);
            for (row, inputs) in rows.zip(inputs.chunks_exact_mut(given)) {
                self.motions.put(self.places, row, inputs);
            }
            engine.run(self.places, inputs, outputs, made);
            for (k, outputs) in outputs.chunks_exact(made.max(1)).enumerate() {
                let (numbers, derivatives) = outputs.split_at(self.width);
                values[k * self.width..(k + 1) * self.width].copy_from_slice(numbers);
                for (&(row, column), &derivative) in self.entries.iter().zip(derivatives) {
                    slopes[(k * self.width + row) * self.columns + column] = derivative;
                }
            }
        })
    }

    /// Fills pieces of a batch by threads with memory of their own.
    fn fill<W>(
        &self,
        work: impl Fn() -> W + Sync + Send,
        piece: impl Fn(&mut W, std::ops::Range<usize>, &mut [f64], &mut [f64]) + Sync + Send,
    ) -> Result<Answers> {
        let rows = self.motions.position.rows();
        let mut values = vec![0.0; rows * self.width];
        let mut derivatives = vec![0.0; values.len() * self.columns];
        let mut slopes = derivatives.chunks_mut((PIECE * self.width * self.columns).max(1));
        let pieces: Vec<_> = values
            .chunks_mut((PIECE * self.width).max(1))
            .enumerate()
            .map(|(k, values)| (k * PIECE, values, slopes.next().unwrap_or_default()))
            .collect();
        let one = |own: &mut W, (first, values, slopes): (usize, &mut [f64], &mut [f64])| {
            if (self.interrupt)() {
                return Err(Error::Interrupted);
            }
            piece(own, first..rows.min(first + PIECE), values, slopes);
            Ok(())
        };
        if pieces.len() > 1 {
            pieces.into_par_iter().try_for_each_init(&work, one)?;
        } else {
            pieces.into_iter().try_for_each(|piece| one(&mut work(), piece))?;
        }
        self.sound(&values, self.width, "")?;
        self.sound(&derivatives, self.width * self.columns, "derivative of ")?;
        Ok(Answers { values, derivatives, width: self.width })
    }

    /// Refuses a batch in which a number is not finite.
    fn sound(&self, numbers: &[f64], width: usize, what: &str) -> Result<()> {
        let Some(place) = numbers.iter().position(|number| !number.is_finite()) else { return Ok(()) };
        let path = format!("{what}{}[{}, {}] at this state", self.name, place / width, place % width);
        Err(Error::NonFinite { path, value: numbers[place] })
    }
}

/// A function whose derivatives are too many operations to be recorded, in numbers that carry some of them.
struct Directions<'a> {
    description: &'a Description,
    theta: &'a [f64],
    kind: Kind,
    inputs: Vec<u32>,
}

/// A number with its derivatives along some of the inputs.
type Number = Dual<f64, LANES>;

impl Directions<'_> {
    fn run(&self, job: &Job<'_>) -> Result<Answers> {
        let function = self.description.functions().function(&self.kind, self.theta)?;
        let given = job.places.first_parameter();
        let lane = |part: &[u32], place: usize| part.iter().position(|&input| input as usize == place);
        let lift = |part: &[u32], place: usize, value: f64| match lane(part, place) {
            Some(lane) => Number::variable(value, lane),
            None => Number::constant(value),
        };
        let routines = || {
            let parts = self.inputs.chunks(LANES).map(|part| {
                let theta: Vec<_> = (given..).zip(self.theta).map(|(place, &value)| lift(part, place, value)).collect();
                (part, Routine::new(function.clone(), &theta))
            });
            (parts.collect::<Vec<_>>(), vec![0.0; given], vec![Number::zero(); given])
        };
        job.fill(routines, |(parts, inputs, lifted), rows, values, slopes| {
            for (k, row) in rows.enumerate() {
                job.motions.put(job.places, row, inputs);
                for (number, (part, routine)) in parts.iter_mut().enumerate() {
                    for (place, (lifted, &value)) in lifted.iter_mut().zip(&*inputs).enumerate() {
                        *lifted = lift(part, place, value);
                    }
                    for (place, output) in (k * job.width..).zip(routine.at(lifted)) {
                        values[place] = output.value;
                        let first = place * job.columns + number * LANES;
                        slopes[first..first + part.len()].copy_from_slice(&output.gradient[..part.len()]);
                    }
                }
            }
        })
    }
}
