//! Simulations of whole records.

use numpy::{PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use vpm_core::description::Description;
use vpm_core::integrator::resolution::Damped;
use vpm_core::motion::{JointMotion, StrainRates};
use vpm_core::sensitivity::Interrupt;
use vpm_core::simulate::{
    Hold, Inputs, Run, Setting, Stepping, closed_loop, drives_along, free_run, observed, resolution, restarts, unstuck,
};

use super::System;
use crate::arrays::{self, Numbers, cube, matrix, places};
use crate::stepping::stepping;

type Table<'py> = Bound<'py, PyArray2<f64>>;
type Cube<'py> = Bound<'py, PyArray3<f64>>;
type Any<'py> = Bound<'py, PyAny>;

/// Arguments that every simulation shares, out of Python's hands.
pub(super) struct Request {
    theta: Numbers,
    stepping: Stepping,
    sensitivities: Vec<usize>,
}

impl Request {
    pub(super) fn new(
        system: &System,
        theta: &Any<'_>,
        timing: (f64, i64, &str),
        sensitivities: &[i64],
    ) -> PyResult<Self> {
        Ok(Self {
            theta: Numbers::vector("theta", theta)?,
            stepping: system.checked(theta.py(), stepping(timing)?)?,
            sensitivities: places("sensitivities", sensitivities)?,
        })
    }

    pub(super) fn setting<'a>(&'a self, description: &'a Description, interrupt: Interrupt<'a>) -> Setting<'a> {
        let (theta, sensitivities) = (self.theta.values(), &self.sensitivities);
        Setting { description, theta, stepping: self.stepping, sensitivities, interrupt }
    }
}

impl System {
    pub(super) fn run<'py>(
        &self,
        py: Python<'py>,
        run: Run,
        [differentiated, variables]: [usize; 2],
    ) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let states = self.description.n_states();
        let rows = run.states.len().checked_div(states).unwrap_or(0);
        let outputs = run.outputs.len().checked_div(rows).unwrap_or(0);
        Ok((
            matrix(py, run.outputs, [rows, outputs])?,
            matrix(py, run.states, [rows, states])?,
            cube(py, run.jacobian, [rows, differentiated, variables])?,
        ))
    }
}

#[pymethods]
impl System {
    /// Simulates a free run on given commands. Outputs (N, ny), states (N, nx), derivatives of the outputs (N, ny, k).
    #[pyo3(signature = (theta, initial_state, inputs, time_step, substeps, integrator, sensitivities=vec![], hold="zero_order"))]
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
        hold: &str,
    ) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let hold = self.checked(py, Hold::from_name(hold))?;
        let initial = Numbers::vector("initial_state", initial_state)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let run = self.compute(py, |interrupt| {
            let inputs = Inputs { table: inputs.as_table()?, hold };
            free_run(request.setting(&self.description, interrupt), initial.values(), inputs)
        })?;
        self.run(py, run, [self.description.n_outputs(), sensitivities.len()])
    }

    /// Compiles the steps of a simulation, as long runs do, or says why not.
    fn compile<'py>(&self, py: Python<'py>, theta: &Any<'py>, integrator: &str) -> PyResult<Option<String>> {
        let request = Request::new(self, theta, (1.0, 1, integrator), &[])?;
        self.compute(py, |interrupt| {
            let Setting { description, theta, stepping, .. } = request.setting(&self.description, interrupt);
            Ok(description.system::<f64>(theta)?.compile(stepping.method).err())
        })
    }

    /// Resolution of a simulation's steps in a run of `duration` (s) about `state`. First the frequency above which
    /// vibrations are off by more than a tenth (Hz). Then for each mode that is or that grows (m, 5): frequency,
    /// damping ratio, time, share that is left, shift of its frequency.
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn resolution<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        state: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        duration: f64,
    ) -> PyResult<(f64, Table<'py>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &[])?;
        let state = Numbers::vector("state", state)?;
        let found = self.compute(py, |interrupt| {
            let Setting { description, theta, stepping, .. } = request.setting(&self.description, interrupt);
            resolution(description, theta, state.values(), stepping, duration)
        })?;
        let row = |mode: &Damped| [mode.frequency, mode.ratio, mode.time, mode.left, mode.shift];
        let rows = found.damped.iter().flat_map(row).collect();
        Ok((found.limit, matrix(py, rows, [found.damped.len(), 5])?))
    }

    /// Dry friction that a simulation's steps do not bring to rest, about `state` under `commands`. The place in words,
    /// and the slope of friction at rest times the step over the inertia that it moves.
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn unstuck(
        &self,
        py: Python<'_>,
        theta: &Any<'_>,
        state: &Any<'_>,
        commands: &Any<'_>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
    ) -> PyResult<Vec<(String, f64)>> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &[])?;
        let state = Numbers::vector("state", state)?;
        let commands = Numbers::vector("commands", commands)?;
        let found = self.compute(py, |interrupt| {
            let Setting { description, theta, stepping, .. } = request.setting(&self.description, interrupt);
            unstuck(description, theta, state.values(), commands.values(), stepping)
        })?;
        Ok(found.into_iter().map(|friction| (friction.site, friction.turn)).collect())
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
        self.run(py, run, [self.description.n_outputs(), sensitivities.len()])
    }

    /// Simulates free runs of `horizon` samples from many samples. Outputs (S, horizon, ny), derivatives (S, horizon,
    /// ny, k).
    #[pyo3(signature = (theta, initial_states, starts, horizon, inputs, time_step, substeps, integrator, sensitivities=vec![], hold="zero_order"))]
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
        hold: &str,
    ) -> PyResult<(Cube<'py>, Bound<'py, PyArray4<f64>>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let hold = self.checked(py, Hold::from_name(hold))?;
        let initial = Numbers::table("initial_states", initial_states)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let starts = places("starts", &starts)?;
        let horizon = usize::try_from(horizon).unwrap_or(0);
        let run = self.compute(py, |interrupt| {
            let setting = request.setting(&self.description, interrupt);
            restarts(setting, initial.as_table()?, &starts, horizon, Inputs { table: inputs.as_table()?, hold })
        })?;
        let outputs = self.description.n_outputs();
        let jacobian = PyArray1::from_vec(py, run.jacobian);
        Ok((
            cube(py, run.outputs, [starts.len(), horizon, outputs])?,
            jacobian.reshape([starts.len(), horizon, outputs, sensitivities.len()])?,
        ))
    }

    /// Simulates joints that follow a motion (N, n_joints); `passive` ones and beams respond. Outputs, states and
    /// derivatives as in `simulate`. Beams are held to the rates of strain (N, gauges) that gauges of some gain showed.
    /// What is free begins at rest, or away from it by `departure` (2 n_coordinates,), coordinates then rates.
    #[pyo3(signature = (theta, position, velocity, acceleration, time_step, substeps, integrator, sensitivities=vec![], passive=vec![], strain_rate=None, strain_gain=None, first=0, departure=None))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn simulate_prescribed<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        acceleration: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        sensitivities: Vec<i64>,
        passive: Vec<i64>,
        strain_rate: Option<&Any<'py>>,
        strain_gain: Option<&Any<'py>>,
        first: i64,
        departure: Option<&Any<'py>>,
    ) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let position = Numbers::table("position", position)?;
        let velocity = Numbers::table("velocity", velocity)?;
        let acceleration = Numbers::table("acceleration", acceleration)?;
        let passive = places("passive", &passive)?;
        let first = arrays::place("first", first)?;
        let rate = strain_rate.map(|array| Numbers::table("strain_rate", array)).transpose()?;
        let gain = strain_gain.map(|array| Numbers::vector("strain_gain", array)).transpose()?;
        let departure = departure.map(|array| Numbers::vector("departure", array)).transpose()?;
        let run = self.compute(py, |interrupt| {
            let motion = JointMotion {
                position: position.as_table()?,
                velocity: velocity.as_table()?,
                acceleration: acceleration.as_table()?,
            };
            let strains = match (&rate, &gain) {
                (Some(rate), Some(gain)) => Some(StrainRates { rate: rate.as_table()?, gain: gain.values() }),
                _ => None,
            };
            let away = departure.as_ref().map_or(&[][..], Numbers::values);
            observed(request.setting(&self.description, interrupt), (motion, first), &passive, strains, away)
        })?;
        self.run(py, run, [self.description.n_outputs(), sensitivities.len()])
    }

    /// Simulates drives and supplies while joints follow a motion (N, n_joints). They answer to it and to `inputs`,
    /// from the states `internal`. Outputs with the effort of the drives on each joint behind them (N, ny + n_joints),
    /// states, derivatives of all these. The efforts are those in the states of drives that were `seen` (N,
    /// len(places)).
    #[pyo3(signature = (theta, position, velocity, acceleration, inputs, internal, places, seen, time_step, substeps, integrator, sensitivities=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn simulate_drives<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        acceleration: &Any<'py>,
        inputs: &Any<'py>,
        internal: &Any<'py>,
        places: Vec<i64>,
        seen: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        sensitivities: Vec<i64>,
    ) -> PyResult<(Table<'py>, Table<'py>, Cube<'py>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let position = Numbers::table("position", position)?;
        let velocity = Numbers::table("velocity", velocity)?;
        let acceleration = Numbers::table("acceleration", acceleration)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let internal = Numbers::vector("internal", internal)?;
        let (places, seen) = (arrays::places("places", &places)?, Numbers::table("seen", seen)?);
        let run = self.compute(py, |interrupt| {
            let motion = JointMotion {
                position: position.as_table()?,
                velocity: velocity.as_table()?,
                acceleration: acceleration.as_table()?,
            };
            let setting = request.setting(&self.description, interrupt);
            drives_along(setting, motion, inputs.as_table()?, internal.values(), (&places, seen.as_table()?))
        })?;
        let (width, states) = (self.description.n_outputs() + self.description.n_joints(), self.description.n_states());
        let rows = run.states.len().checked_div(states).unwrap_or(0);
        Ok((
            matrix(py, run.outputs, [rows, width])?,
            matrix(py, run.states, [rows, states])?,
            cube(py, run.jacobian, [rows, width, sensitivities.len()])?,
        ))
    }
}
