//! The class `PlanarArm`.

use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use vpm_core::beam::Basis;
use vpm_core::beam::linear::TipBody;
use vpm_core::beam::planar::{Arm, Hub, LinkParameters, Order, PlanarChain, Servo, State};
use vpm_core::error::Error;
use vpm_core::sensitivity::Interrupt;

use crate::arrays::{Numbers, cube, matrix};
use crate::errors::exception;
use crate::interrupt::interruptible;

mod course;
use course::Course;

type Any<'py> = Bound<'py, PyAny>;
type Table<'py> = Bound<'py, PyArray2<f64>>;
/// Tips (N, links, 3), joint angles (N, links), joint rates (N, links), strains (N, gauges), states (N, 2 all).
type Motion<'py> = (Bound<'py, PyArray3<f64>>, Table<'py>, Table<'py>, Table<'py>, Table<'py>);

/// Steps between two looks at the signals: some milliseconds.
const BLOCK: usize = 20_000;

/// A chain of one or two flexible links in a plane, with servos on its joints.
///
/// Parameters
/// ----------
/// links : array_like, shape (n, 10)
///     Length, bending stiffness, line density, rotary inertia per length, damping time, hub radius, hub mass, hub inertia, tip
///     mass, tip inertia.
/// servos : array_like, shape (n, 2)
/// gravity : sequence of two float
/// coefficients : int
/// points : int
/// order : {2, 4}
///
/// Raises
/// ------
/// ValueError
///     No arm has these parameters, or the core has no arm of this size.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct PlanarArm {
    links: Vec<[f64; 10]>,
    servos: Vec<[f64; 2]>,
    gravity: [f64; 2],
    size: Size,
    points: usize,
    order: Order,
}

/// The sizes that are compiled: links, then curvature coefficients of each.
#[derive(Clone, Copy)]
enum Size {
    One2,
    One3,
    One4,
    Two2,
    Two3,
    Two4,
}

/// What to record.
struct Request {
    start: Option<Vec<f64>>,
    course: Course,
    gauges: Vec<[f64; 3]>,
    samples: usize,
    steps: usize,
    step: f64,
}

/// What was recorded, row by row.
#[derive(Default)]
struct Record {
    tips: Vec<f64>,
    angles: Vec<f64>,
    rates: Vec<f64>,
    strains: Vec<f64>,
    states: Vec<f64>,
}

impl Size {
    fn of(links: usize, coefficients: i64) -> PyResult<Self> {
        match (links, coefficients) {
            (1, 2) => Ok(Self::One2),
            (1, 3) => Ok(Self::One3),
            (1, 4) => Ok(Self::One4),
            (2, 2) => Ok(Self::Two2),
            (2, 3) => Ok(Self::Two3),
            (2, 4) => Ok(Self::Two4),
            _ => Err(PyValueError::new_err(format!(
                "a planar arm has 1 or 2 links with 2, 3 or 4 curvature coefficients each, not {links} with \
                 {coefficients}; describe other machines as a model with beams"
            ))),
        }
    }

    /// Coordinates of all links together.
    fn coordinates(self) -> usize {
        match self {
            Self::One2 => 3,
            Self::One3 => 4,
            Self::One4 => 5,
            Self::Two2 => 6,
            Self::Two3 => 8,
            Self::Two4 => 10,
        }
    }
}

#[pymethods]
impl PlanarArm {
    #[new]
    fn new(
        py: Python<'_>,
        links: &Any<'_>,
        servos: &Any<'_>,
        gravity: [f64; 2],
        coefficients: i64,
        points: i64,
        order: i64,
    ) -> PyResult<Self> {
        let links = Numbers::table("links", links)?.rows_of::<10>()?;
        let servos = Numbers::table("servos", servos)?.rows_of::<2>()?;
        if servos.len() != links.len() {
            let (servos, links) = (servos.len(), links.len());
            let text = format!("there are {servos} servos for {links} links; give one for each joint");
            return Err(PyValueError::new_err(text));
        }
        let (size, points) = (Size::of(links.len(), coefficients)?, usize::try_from(points).unwrap_or(0));
        let order = match order {
            2 => Order::Second,
            4 => Order::Fourth,
            _ => {
                let text = format!("the steps of a planar arm have order 2 or 4, not {order}; choose one of them");
                return Err(PyValueError::new_err(text));
            }
        };
        let arm = Self { links, servos, gravity, size, points, order };
        let checked = match size {
            Size::One2 => arm.build::<1, 3, 3>(1.0).map(|_| ()),
            Size::One3 => arm.build::<1, 4, 4>(1.0).map(|_| ()),
            Size::One4 => arm.build::<1, 5, 5>(1.0).map(|_| ()),
            Size::Two2 => arm.build::<2, 3, 6>(1.0).map(|_| ()),
            Size::Two3 => arm.build::<2, 4, 8>(1.0).map(|_| ()),
            Size::Two4 => arm.build::<2, 5, 10>(1.0).map(|_| ()),
        };
        checked.map_err(|error| exception(py, error, 0, 0))?;
        Ok(arm)
    }

    /// Number of coordinates of all links.
    #[getter]
    fn n_coordinates(&self) -> usize {
        self.size.coordinates()
    }

    /// Runs `samples` rows over `duration` in `steps` integration steps from row to row.
    ///
    /// Exactly one of `swing` (n, 2) and `reference` (N, 2 n) says where the joints should be.
    #[pyo3(signature = (duration, samples, steps, gauges, swing=None, reference=None, reference_step=0.0, start=None))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn run<'py>(
        &self,
        py: Python<'py>,
        duration: f64,
        samples: i64,
        steps: i64,
        gauges: &Any<'py>,
        swing: Option<&Any<'py>>,
        reference: Option<&Any<'py>>,
        reference_step: f64,
        start: Option<&Any<'py>>,
    ) -> PyResult<Motion<'py>> {
        let (samples, steps) = (usize::try_from(samples).unwrap_or(0), usize::try_from(steps).unwrap_or(0));
        if samples < 2 || steps < 1 || !(duration.is_finite() && duration > 0.0) {
            return Err(PyValueError::new_err(format!(
                "a run needs a positive duration, 2 samples and 1 step between them at least, got {duration} s, {samples} and \
                 {steps}; raise what is too small"
            )));
        }
        let request = Request {
            start: self.start(start)?,
            course: Course::new(self.links.len(), swing, reference, reference_step, duration)?,
            gauges: self.gauges(gauges)?,
            samples,
            steps,
            step: duration / ((samples - 1) * steps) as f64,
        };
        let record = interruptible(py, |interrupt| match self.size {
            Size::One2 => self.record::<1, 3, 3>(&request, interrupt),
            Size::One3 => self.record::<1, 4, 4>(&request, interrupt),
            Size::One4 => self.record::<1, 5, 5>(&request, interrupt),
            Size::Two2 => self.record::<2, 3, 6>(&request, interrupt),
            Size::Two3 => self.record::<2, 4, 8>(&request, interrupt),
            Size::Two4 => self.record::<2, 5, 10>(&request, interrupt),
        })?;
        let record = record.map_err(|error| exception(py, error, 0, 2 * self.size.coordinates()))?;
        let joints = self.links.len();
        Ok((
            cube(py, record.tips, [samples, joints, 3])?,
            matrix(py, record.angles, [samples, joints])?,
            matrix(py, record.rates, [samples, joints])?,
            matrix(py, record.strains, [samples, request.gauges.len()])?,
            matrix(py, record.states, [samples, 2 * self.size.coordinates()])?,
        ))
    }
}

impl PlanarArm {
    fn build<const LINKS: usize, const EACH: usize, const ALL: usize>(
        &self,
        step: f64,
    ) -> Result<Arm<LINKS, EACH, ALL>, Error> {
        let bases: Vec<Basis> =
            self.links.iter().map(|link| Basis::legendre(link[0], EACH - 1)).collect::<Result<_, _>>()?;
        let links = std::array::from_fn(|i| {
            let [_, bending, line, rotary, damping, radius, mass, inertia, tip_mass, tip_inertia] = self.links[i];
            let hub = Hub { radius, mass, inertia };
            let tip = TipBody { mass: tip_mass, inertia: tip_inertia };
            (LinkParameters { bending, line, rotary, damping, hub, tip }, bases[i].clone())
        });
        let servos = std::array::from_fn(|i| Servo { stiffness: self.servos[i][0], damping: self.servos[i][1] });
        Arm::of_order(self.order, PlanarChain::new(links, self.gravity, self.points)?, servos, step)
    }

    fn record<const LINKS: usize, const EACH: usize, const ALL: usize>(
        &self,
        request: &Request,
        interrupt: Interrupt<'_>,
    ) -> Result<Record, Error> {
        let mut arm = self.build::<LINKS, EACH, ALL>(request.step)?;
        let gauges: Vec<[f64; ALL]> = request.gauges.iter().map(|gauge| strain_row(&arm, gauge)).collect();
        let joints: [[f64; ALL]; LINKS] = std::array::from_fn(|i| arm.chain().joint_row(i));
        let mut state = State::<ALL>::default();
        if let Some(start) = &request.start {
            state.motion.position.copy_from_slice(&start[..ALL]);
            state.motion.velocity.copy_from_slice(&start[ALL..]);
        }
        let (mut record, mut done) = (Record::default(), 0);
        while done < request.samples {
            if interrupt() {
                return Err(Error::Interrupted);
            }
            let rows = (request.samples - done).min((BLOCK / request.steps).max(1));
            // Except at the end, one row more than is kept: the start of the next block.
            let next = usize::from(done + rows < request.samples);
            let block = arm.record(state, |t| request.course.at(t), rows + next, request.steps);
            let block = block.map_err(|error| after(error, done, &record))?;
            for row in &block[..rows] {
                let (x, v) = (&row.motion.position, &row.motion.velocity);
                record.tips.extend(arm.chain().tips(x).as_flattened());
                record.angles.extend(joints.iter().map(|joint| dot(joint, x)));
                record.rates.extend(joints.iter().map(|joint| dot(joint, v)));
                record.strains.extend(gauges.iter().map(|gauge| dot(gauge, x)));
                record.states.extend(x.iter().chain(v));
            }
            (state, done) = (block[rows + next - 1], done + rows);
        }
        Ok(record)
    }

    fn start(&self, start: Option<&Any<'_>>) -> PyResult<Option<Vec<f64>>> {
        let Some(start) = start else { return Ok(None) };
        let (numbers, wanted) = (Numbers::vector("start", start)?, 2 * self.size.coordinates());
        if numbers.values().len() != wanted {
            let found = numbers.values().len();
            let text = format!("`start` has {found} numbers, but the state has {wanted}; give a row of `states`");
            return Err(PyValueError::new_err(text));
        }
        Ok(Some(numbers.values().to_vec()))
    }

    fn gauges(&self, gauges: &Any<'_>) -> PyResult<Vec<[f64; 3]>> {
        let gauges = Numbers::table("gauges", gauges)?.rows_of::<3>()?;
        for (k, &[link, at, _]) in gauges.iter().enumerate() {
            let length = self.links.get(link as usize).map(|link| link[0]);
            if link < 0.0 || link.fract() != 0.0 || length.is_none_or(|length| !(0.0..=length).contains(&at)) {
                return Err(PyValueError::new_err(format!(
                    "gauge {k} sits {at} m along link {link}, which the arm does not have; count links from 0 and lengths from the \
                     clamp"
                )));
            }
        }
        Ok(gauges)
    }
}

/// The row of the strain of a surface over all coordinates.
fn strain_row<const LINKS: usize, const EACH: usize, const ALL: usize>(
    arm: &Arm<LINKS, EACH, ALL>,
    &[link, at, distance]: &[f64; 3],
) -> [f64; ALL] {
    arm.chain().curvature_row(link as usize, at).map(|entry| entry * distance)
}

/// An error of a later block with the rows before it.
fn after(error: Error, done: usize, record: &Record) -> Error {
    match error {
        Error::Diverged(mut partial) => {
            partial.sample_index += done;
            partial.states.splice(..0, record.states.iter().copied());
            Error::Diverged(partial)
        }
        error => error,
    }
}

fn dot<const ALL: usize>(row: &[f64; ALL], x: &[f64; ALL]) -> f64 {
    row.iter().zip(x).map(|(row, x)| row * x).sum()
}
