//! The class `System`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use vpm_core::Error;
use vpm_core::description::Description;
use vpm_core::evaluate;
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::sensitivity::Interrupt;
use vpm_core::simulate::{Run, Setting, Stepping, closed_loop, free_run, restarts};
use vpm_core::timing::time_steps;

use crate::arrays::{Numbers, cube, matrix, places};
use crate::errors::exception;
use crate::interrupt::interruptible;

type Table<'py> = Bound<'py, PyArray2<f64>>;
type Cube<'py> = Bound<'py, PyArray3<f64>>;
type Any<'py> = Bound<'py, PyAny>;

/// A machine: rigid tree, effects, actuators, sensors and controllers, as one object over a flat parameter vector theta.
///
/// Parameters
/// ----------
/// description : str
///     JSON; see the class `vpm.Model`, which writes it.
///
/// Raises
/// ------
/// ValueError
///     The description cannot be right; one sentence with the place and the repair.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct System {
    description: Description,
}

/// Arguments that every simulation shares, out of Python's hands.
struct Request {
    theta: Numbers,
    stepping: Stepping,
    sensitivities: Vec<usize>,
}

impl Request {
    fn new(
        system: &System,
        theta: &Any<'_>,
        (time_step, substeps, integrator): (f64, i64, &str),
        sensitivities: &[i64],
    ) -> PyResult<Self> {
        let substeps = usize::try_from(substeps).map_err(|_| {
            PyValueError::new_err(format!("substeps must be at least 1, got {substeps}; use 1 to begin with"))
        })?;
        let stepping = Method::from_name(integrator).and_then(|method| Stepping::new(time_step, substeps, method));
        Ok(Self {
            theta: Numbers::vector("theta", theta)?,
            stepping: system.checked(theta.py(), stepping)?,
            sensitivities: places("sensitivities", sensitivities)?,
        })
    }

    fn setting<'a>(&'a self, description: &'a Description, interrupt: Interrupt<'a>) -> Setting<'a> {
        let (theta, sensitivities) = (self.theta.values(), &self.sensitivities);
        Setting { description, theta, stepping: self.stepping, sensitivities, interrupt }
    }
}

impl System {
    fn checked<T>(&self, py: Python<'_>, result: Result<T, Error>) -> PyResult<T> {
        result.map_err(|error| exception(py, error, self.description.n_outputs(), self.description.n_states()))
    }

    /// Runs `job` without the interpreter lock.
    fn compute<T: Send>(
        &self,
        py: Python<'_>,
        job: impl FnOnce(Interrupt<'_>) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let result = interruptible(py, job)?;
        self.checked(py, result)
    }

    fn run<'py>(&self, py: Python<'py>, run: Run, variables: usize) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let (outputs, states) = (self.description.n_outputs(), self.description.n_states());
        let rows = run.states.len().checked_div(states).unwrap_or(0);
        Ok((
            matrix(py, run.outputs, [rows, outputs])?,
            matrix(py, run.states, [rows, states])?,
            cube(py, run.jacobian, [rows, outputs, variables])?,
        ))
    }
}

#[pymethods]
impl System {
    #[new]
    fn new(py: Python<'_>, description: &str) -> PyResult<Self> {
        let description = Description::from_json(description).map_err(|error| exception(py, error, 0, 0))?;
        Ok(Self { description })
    }

    /// Number of joints.
    #[getter]
    fn n_joints(&self) -> usize {
        self.description.n_joints()
    }

    /// Length of the state: positions, velocities, one state per actuator with lag.
    #[getter]
    fn n_states(&self) -> usize {
        self.description.n_states()
    }

    /// Number of actuators.
    #[getter]
    fn n_actuators(&self) -> usize {
        self.description.n_actuators()
    }

    /// Number of inputs: one command per actuator.
    #[getter]
    fn n_inputs(&self) -> usize {
        self.description.n_actuators()
    }

    /// Number of output channels: four per joint, two per actuator.
    #[getter]
    fn n_outputs(&self) -> usize {
        self.description.n_outputs()
    }

    /// Length of theta.
    #[getter]
    fn n_parameters(&self) -> usize {
        self.description.n_parameters()
    }

    fn __repr__(&self) -> String {
        let d = &self.description;
        let (joints, actuators, parameters) = (d.n_joints(), d.n_actuators(), d.n_parameters());
        format!("System(joints={joints}, actuators={actuators}, parameters={parameters})")
    }

    /// Free run on given commands: outputs (N, ny), states (N, nx), derivatives of the outputs (N, ny, k).
    #[pyo3(signature = (theta, initial_state, inputs, time_step, substeps, integrator, sensitivities=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        initial_state: &Any<'py>,
        inputs: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        sensitivities: Vec<i64>,
    ) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let initial = Numbers::vector("initial_state", initial_state)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let run = self.compute(py, |interrupt| {
            free_run(request.setting(&self.description, interrupt), initial.values(), inputs.as_table()?)
        })?;
        self.run(py, run, sensitivities.len())
    }

    /// Closed loop on references, with disturbances added to the commands: as `simulate`.
    #[pyo3(signature = (theta, initial_state, references, disturbances, time_step, substeps, integrator, sensitivities=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn simulate_closed_loop<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        initial_state: &Any<'py>,
        references: &Any<'py>,
        disturbances: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        sensitivities: Vec<i64>,
    ) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let initial = Numbers::vector("initial_state", initial_state)?;
        let references = Numbers::table("references", references)?;
        let disturbances = Numbers::table("disturbances", disturbances)?;
        let run = self.compute(py, |interrupt| {
            let setting = request.setting(&self.description, interrupt);
            closed_loop(setting, initial.values(), references.as_table()?, disturbances.as_table()?)
        })?;
        self.run(py, run, sensitivities.len())
    }

    /// Free runs of `horizon` samples from many samples: outputs (S, horizon, ny), derivatives (S, horizon, ny, k).
    #[pyo3(signature = (theta, initial_states, starts, horizon, inputs, time_step, substeps, integrator, sensitivities=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn restart<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        initial_states: &Any<'py>,
        starts: Vec<i64>,
        horizon: i64,
        inputs: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        sensitivities: Vec<i64>,
    ) -> PyResult<(Cube<'py>, Bound<'py, PyArray4<f64>>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let initial = Numbers::table("initial_states", initial_states)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let starts = places("starts", &starts)?;
        let horizon = usize::try_from(horizon).unwrap_or(0);
        let run = self.compute(py, |interrupt| {
            let setting = request.setting(&self.description, interrupt);
            restarts(setting, initial.as_table()?, &starts, horizon, inputs.as_table()?)
        })?;
        let outputs = self.description.n_outputs();
        let jacobian = PyArray1::from_vec(py, run.jacobian);
        Ok((
            cube(py, run.outputs, [starts.len(), horizon, outputs])?,
            jacobian.reshape([starts.len(), horizon, outputs, sensitivities.len()])?,
        ))
    }

    /// Effort that a motion needs and effort that the actuators deliver, each (N, n), and the derivative of their difference (N, n, k).
    #[pyo3(signature = (theta, position, velocity, acceleration, inputs, time_step, sensitivities=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        acceleration: &Any<'py>,
        inputs: &Any<'py>,
        time_step: f64,
        sensitivities: Vec<i64>,
    ) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let theta = Numbers::vector("theta", theta)?;
        let position = Numbers::table("position", position)?;
        let velocity = Numbers::table("velocity", velocity)?;
        let acceleration = Numbers::table("acceleration", acceleration)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let variables = places("sensitivities", &sensitivities)?;
        let efforts = self.compute(py, |interrupt| {
            let motion = Motion {
                position: position.as_table()?,
                velocity: velocity.as_table()?,
                acceleration: acceleration.as_table()?,
                inputs: inputs.as_table()?,
                time_step,
            };
            inverse_dynamics(&self.description, theta.values(), motion, &variables, interrupt)
        })?;
        let (rows, joints) = (position.rows(), self.description.n_joints());
        Ok((
            matrix(py, efforts.required, [rows, joints])?,
            matrix(py, efforts.applied, [rows, joints])?,
            cube(py, efforts.jacobian, [rows, joints, variables.len()])?,
        ))
    }

    /// Accelerations (n,) of the rigid tree with its effects under efforts on the joints.
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        effort: &Any<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let theta = Numbers::vector("theta", theta)?;
        let (q, v) = (Numbers::vector("position", position)?, Numbers::vector("velocity", velocity)?);
        let effort = Numbers::vector("effort", effort)?;
        let result =
            evaluate::accelerations(&self.description, theta.values(), q.values(), v.values(), effort.values());
        Ok(PyArray1::from_vec(py, self.checked(py, result)?))
    }

    /// Mass matrix (n, n), payloads included.
    fn mass_matrix<'py>(&self, py: Python<'py>, theta: &Any<'py>, position: &Any<'py>) -> PyResult<Table<'py>> {
        let (theta, q) = (Numbers::vector("theta", theta)?, Numbers::vector("position", position)?);
        let result = evaluate::mass_matrix(&self.description, theta.values(), q.values());
        let n = self.description.n_joints();
        matrix(py, self.checked(py, result)?, [n, n])
    }

    /// Kinetic and potential energy in J: of bodies in gravity, and of effects that have a potential.
    fn energy(&self, py: Python<'_>, theta: &Any<'_>, position: &Any<'_>, velocity: &Any<'_>) -> PyResult<(f64, f64)> {
        let theta = Numbers::vector("theta", theta)?;
        let (q, v) = (Numbers::vector("position", position)?, Numbers::vector("velocity", velocity)?);
        self.checked(py, evaluate::energy(&self.description, theta.values(), q.values(), v.values()))
    }

    /// Duration in s of each of `count` steps, on the way through the inputs again and again.
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn time_steps<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        initial_state: &Any<'py>,
        inputs: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        count: i64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &[])?;
        let initial = Numbers::vector("initial_state", initial_state)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let count = usize::try_from(count).map_err(|_| {
            PyValueError::new_err(format!("count must not be negative, got {count}; ask for some steps"))
        })?;
        let durations = self.compute(py, |interrupt| {
            time_steps(request.setting(&self.description, interrupt), initial.values(), inputs.as_table()?, count)
        })?;
        Ok(PyArray1::from_vec(py, durations))
    }
}
