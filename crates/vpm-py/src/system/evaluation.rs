//! The machine in a single state, and along a measured motion.

use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use vpm_core::beam::Beam;
use vpm_core::evaluate;
use vpm_core::inverse::{Motion, delivered, inverse_dynamics, required};
use vpm_core::linearize::linearize;
use vpm_core::motion::JointMotion;

use super::System;
use crate::arrays::{Numbers, cube, matrix, place, places};
use crate::interrupt::unbroken;

type Row<'py> = Bound<'py, PyArray1<f64>>;
type Table<'py> = Bound<'py, PyArray2<f64>>;
type Cube<'py> = Bound<'py, PyArray3<f64>>;
type Any<'py> = Bound<'py, PyAny>;

#[pymethods]
impl System {
    /// Evaluates inverse dynamics along a motion: efforts needed and delivered, each (N, n). Also the derivative of
    /// their difference (N, n, k).
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

    /// Checks before an evaluation whether the machine exists with these parameters.
    fn check(&self, py: Python<'_>, theta: &Any<'_>) -> PyResult<()> {
        let theta = Numbers::vector("theta", theta)?;
        self.checked(py, self.description.check_values(theta.values()))
    }

    /// Evaluates the effort that a motion needs (N, n) whatever the drives are, and derivatives (N, n, k).
    #[pyo3(signature = (theta, position, velocity, acceleration, time_step, sensitivities=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn required<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        acceleration: &Any<'py>,
        time_step: f64,
        sensitivities: Vec<i64>,
    ) -> PyResult<(Table<'py>, Cube<'py>)> {
        let theta = Numbers::vector("theta", theta)?;
        let position = Numbers::table("position", position)?;
        let velocity = Numbers::table("velocity", velocity)?;
        let acceleration = Numbers::table("acceleration", acceleration)?;
        let variables = places("sensitivities", &sensitivities)?;
        let (efforts, jacobian) = self.compute(py, |interrupt| {
            let motion = JointMotion {
                position: position.as_table()?,
                velocity: velocity.as_table()?,
                acceleration: acceleration.as_table()?,
            };
            required(&self.description, theta.values(), (motion, time_step), &variables, interrupt)
        })?;
        let (rows, joints) = (position.rows(), self.description.n_joints());
        Ok((matrix(py, efforts, [rows, joints])?, cube(py, jacobian, [rows, joints, variables.len()])?))
    }

    /// Evaluates the effort of ideal drives on the joints (N, n_joints) under `inputs`. Also its derivatives (N,
    /// n_joints, k).
    #[pyo3(signature = (theta, inputs, time_step, sensitivities=vec![]))]
    fn delivered<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        inputs: &Any<'py>,
        time_step: f64,
        sensitivities: Vec<i64>,
    ) -> PyResult<(Table<'py>, Cube<'py>)> {
        let theta = Numbers::vector("theta", theta)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let variables = places("sensitivities", &sensitivities)?;
        let (efforts, jacobian) = self.compute(py, |_| {
            delivered(&self.description, theta.values(), (inputs.as_table()?, time_step), &variables)
        })?;
        let (rows, joints) = (inputs.rows(), self.description.n_joints());
        Ok((matrix(py, efforts, [rows, joints])?, cube(py, jacobian, [rows, joints, variables.len()])?))
    }

    /// Evaluates accelerations (n,) of the rigid tree with its effects under efforts on the joints.
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        effort: &Any<'py>,
    ) -> PyResult<Row<'py>> {
        let theta = Numbers::vector("theta", theta)?;
        let (q, v) = (Numbers::vector("position", position)?, Numbers::vector("velocity", velocity)?);
        let effort = Numbers::vector("effort", effort)?;
        let result = unbroken(|| {
            evaluate::accelerations(&self.description, theta.values(), q.values(), v.values(), effort.values())
        })?;
        Ok(PyArray1::from_vec(py, self.checked(py, result)?))
    }

    /// Evaluates the mass matrix (n, n), payloads included.
    fn mass_matrix<'py>(&self, py: Python<'py>, theta: &Any<'py>, position: &Any<'py>) -> PyResult<Table<'py>> {
        let (theta, q) = (Numbers::vector("theta", theta)?, Numbers::vector("position", position)?);
        let result = unbroken(|| evaluate::mass_matrix(&self.description, theta.values(), q.values()))?;
        let n = self.description().n_coordinates();
        matrix(py, self.checked(py, result)?, [n, n])
    }

    /// Evaluates kinetic and potential energy in J: of bodies in gravity, and of effects with a potential.
    fn energy(&self, py: Python<'_>, theta: &Any<'_>, position: &Any<'_>, velocity: &Any<'_>) -> PyResult<(f64, f64)> {
        let theta = Numbers::vector("theta", theta)?;
        let (q, v) = (Numbers::vector("position", position)?, Numbers::vector("velocity", velocity)?);
        let result = unbroken(|| evaluate::energy(&self.description, theta.values(), q.values(), v.values()))?;
        self.checked(py, result)
    }

    /// Evaluates exact A (nx, nx), B (nx, nu), C (ny, nx), D (ny, nu) at a state under held commands.
    fn linearize<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        state: &Any<'py>,
        inputs: &Any<'py>,
    ) -> PyResult<(Table<'py>, Table<'py>, Table<'py>, Table<'py>)> {
        let (theta, state) = (Numbers::vector("theta", theta)?, Numbers::vector("state", state)?);
        let inputs = Numbers::vector("inputs", inputs)?;
        let linear =
            self.compute(py, |_| linearize(self.description(), theta.values(), state.values(), inputs.values()))?;
        let (nx, nu, ny) = (state.values().len(), inputs.values().len(), self.description().n_outputs());
        Ok((
            matrix(py, linear.state, [nx, nx])?,
            matrix(py, linear.input, [nx, nu])?,
            matrix(py, linear.output, [ny, nx])?,
            matrix(py, linear.feedthrough, [ny, nu])?,
        ))
    }

    /// Evaluates states of drives and supplies (n_states - 2 n,) after standing at a position (n,). There are no
    /// commands.
    fn internal_state<'py>(&self, py: Python<'py>, theta: &Any<'py>, position: &Any<'py>) -> PyResult<Row<'py>> {
        let (theta, q) = (Numbers::vector("theta", theta)?, Numbers::vector("position", position)?);
        let result = unbroken(|| evaluate::internal_state(self.description(), theta.values(), q.values()))?;
        Ok(PyArray1::from_vec(py, self.checked(py, result)?))
    }

    /// Evaluates memories (N, effects that remember) along a path of the joints (N, n), relaxed at first.
    fn memories<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        time_step: f64,
    ) -> PyResult<Table<'py>> {
        let (theta, position) = (Numbers::vector("theta", theta)?, Numbers::table("position", position)?);
        let values = self
            .compute(py, |_| evaluate::memories(self.description(), theta.values(), position.as_table()?, time_step))?;
        let (rows, count) = (position.rows(), values.len() / position.rows().max(1));
        matrix(py, values, [rows, count])
    }

    /// Evaluates equilibrium under gravity with joints held: coordinates (n,), holding efforts (n_joints,).
    fn equilibrium<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
    ) -> PyResult<(Row<'py>, Row<'py>)> {
        let (theta, q) = (Numbers::vector("theta", theta)?, Numbers::vector("position", position)?);
        let result = self.compute(py, |_| evaluate::equilibrium(self.description(), theta.values(), q.values()))?;
        let (coordinates, efforts) = result;
        Ok((PyArray1::from_vec(py, coordinates), PyArray1::from_vec(py, efforts)))
    }

    /// Evaluates efforts (n,) that hold all coordinates at rest at a position, and their derivative (n, n) by these.
    fn load_at_rest<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
    ) -> PyResult<(Row<'py>, Table<'py>)> {
        let (theta, q) = (Numbers::vector("theta", theta)?, Numbers::vector("position", position)?);
        let result = self.compute(py, |_| evaluate::load_at_rest(self.description(), theta.values(), q.values()))?;
        let (load, slope) = result;
        let n = load.len();
        Ok((PyArray1::from_vec(py, load), matrix(py, slope, [n, n])?))
    }

    /// Evaluates natural frequencies (k,) in Hz about rest with the joints locked, slowest first. Negative for growth
    /// instead of vibration.
    fn natural_frequencies<'py>(&self, py: Python<'py>, theta: &Any<'py>, position: &Any<'py>) -> PyResult<Row<'py>> {
        let (theta, q) = (Numbers::vector("theta", theta)?, Numbers::vector("position", position)?);
        let result =
            self.compute(py, |_| evaluate::natural_frequencies(self.description(), theta.values(), q.values()))?;
        Ok(PyArray1::from_vec(py, result))
    }

    /// Evaluates closed loops at a position and a velocity: gap (m,), derivative J (m, n) and `J' v` (m,).
    ///
    /// The last array has 1.0 for each equation that is independent of the others (m,).
    fn loops<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
    ) -> PyResult<(Row<'py>, Table<'py>, Row<'py>, Row<'py>)> {
        let theta = Numbers::vector("theta", theta)?;
        let (q, v) = (Numbers::vector("position", position)?, Numbers::vector("velocity", velocity)?);
        let found = unbroken(|| evaluate::loops(self.description(), theta.values(), q.values(), v.values()))?;
        let found = self.checked(py, found)?;
        let jacobian = matrix(py, found.jacobian, [found.gap.len(), self.description().n_coordinates()])?;
        let [gap, drift, chosen] = [found.gap, found.drift, found.chosen].map(|row| PyArray1::from_vec(py, row));
        Ok((gap, jacobian, drift, chosen))
    }

    /// Evaluates the largest slope in rad of each beam in many states (N, n_beams). It is not a number where the
    /// kinematics are exact.
    fn slopes<'py>(&self, py: Python<'py>, theta: &Any<'py>, states: &Any<'py>) -> PyResult<Table<'py>> {
        let (theta, states) = (Numbers::vector("theta", theta)?, Numbers::table("states", states)?);
        let slopes = self.compute(py, |_| evaluate::slopes(self.description(), theta.values(), states.as_table()?))?;
        matrix(py, slopes, [states.rows(), self.description().n_beams()])
    }

    /// Evaluates the slope in rad up to which the kinematics of small slopes are right within 1 %.
    #[getter]
    fn slope_limit(&self) -> f64 {
        Beam::<f64>::slope_limit()
    }

    /// Evaluates the Jacobian (6, n) of a marker by number. Angular velocity, then velocity of its origin, in world
    /// axes.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        marker: i64,
    ) -> PyResult<Table<'py>> {
        let (theta, q) = (Numbers::vector("theta", theta)?, Numbers::vector("position", position)?);
        let number = place("marker", marker)?;
        let result = unbroken(|| evaluate::marker_jacobian(self.description(), theta.values(), q.values(), number))?;
        matrix(py, self.checked(py, result)?, [6, self.description().n_coordinates()])
    }

    /// Evaluates poses (N, markers, 12) along a motion of all coordinates. Origin in the world, then the axes there,
    /// row by row.
    fn marker_poses<'py>(&self, py: Python<'py>, theta: &Any<'py>, positions: &Any<'py>) -> PyResult<Cube<'py>> {
        let (theta, positions) = (Numbers::vector("theta", theta)?, Numbers::table("positions", positions)?);
        let poses =
            self.compute(py, |_| evaluate::marker_poses(self.description(), theta.values(), positions.as_table()?))?;
        cube(py, poses, [positions.rows(), self.description().markers.len(), 12])
    }
}
