//! The class `Simulation`, and how time advances.

use std::sync::{Mutex, MutexGuard};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use vpm_core::Error;
use vpm_core::integrator::Method;
use vpm_core::live::{self, Live};
use vpm_core::simulate::Stepping;

use crate::arrays::{Numbers, Vector, matrix};
use crate::errors::CoreError;
use crate::interrupt::{interruptible, unbroken};
use crate::system::{System, checked};

type Row<'py> = Bound<'py, PyArray1<f64>>;
type Any<'py> = Bound<'py, PyAny>;
type Stepped<'py> = (Bound<'py, PyArray2<f64>>, Vec<Option<String>>);

/// Samples between two questions whether to stop.
const PATIENCE: usize = 256;

/// Checked settings for stepping from what Python gave.
pub(crate) fn stepping((time_step, substeps, integrator): (f64, i64, &str)) -> PyResult<Result<Stepping, Error>> {
    let substeps = usize::try_from(substeps)
        .map_err(|_| CoreError::new_err(format!("substeps must be at least 1, got {substeps}; use 1 to begin with")))?;
    Ok(Method::from_name(integrator).and_then(|method| Stepping::new(time_step, substeps, method)))
}

/// Refuses with `CoreError` a name of no integrator for stepping, or a meaningless tolerance in it.
#[pyfunction]
pub(crate) fn check_integrator(name: &str) -> PyResult<()> {
    Method::from_name(name).map(|_| ()).map_err(|error| CoreError::new_err(error.to_string()))
}

/// A simulation as it was at one time.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct Snapshot {
    live: Live,
}

#[pymethods]
impl Snapshot {
    /// Time of a stepping simulation when its snapshot was taken, s.
    #[getter]
    fn time(&self) -> f64 {
        self.live.time()
    }

    fn __repr__(&self) -> String {
        format!("Snapshot(time={} s)", self.live.time())
    }
}

/// A simulation that goes on one sample at a time.
///
/// Parameters
/// ----------
/// system : System
/// theta : array_like, shape (P,)
/// state : array_like, shape (n_states,)
/// time_step : float
///     Time between samples, s.
/// substeps : int
/// integrator : str
///     Its name, for example ``rosenbrock``, ``adaptive`` or ``adaptive(1e-8)``.
///
/// Raises
/// ------
/// CoreError
///     A setting, a size or a value is wrong; one sentence with the repair.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct Simulation {
    live: Mutex<Live>,
}

impl Simulation {
    /// Stepping simulation, if no other thread is at work with it. To wait for that thread here could block the
    /// interpreter.
    fn live(&self) -> PyResult<MutexGuard<'_, Live>> {
        self.live.try_lock().map_err(|_| {
            CoreError::new_err("this simulation is at work in another thread; give each thread its own simulation")
        })
    }
}

#[pymethods]
impl Simulation {
    #[new]
    fn new(
        py: Python<'_>,
        system: &System,
        theta: &Any<'_>,
        state: &Any<'_>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
    ) -> PyResult<Self> {
        let (theta, state) = (Numbers::vector("theta", theta)?, Numbers::vector("state", state)?);
        let stepping = system.checked(py, stepping((time_step, substeps, integrator))?)?;
        let live = unbroken(|| Live::new(system.description().clone(), theta.values(), state.values(), stepping))?;
        Ok(Self { live: Mutex::new(system.checked(py, live)?) })
    }

    /// Compiles the stepping simulation to machine code from now on.
    ///
    /// Returns
    /// -------
    /// str or None
    ///     Why there is no machine code; then the simulation goes on by direct evaluation.
    fn compile(&self) -> PyResult<Option<String>> {
        let mut live = self.live()?;
        unbroken(|| live.compile().err())
    }

    /// Time of the stepping simulation since the beginning, s.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.live()?.time())
    }

    /// State of the stepping simulation now (n_states,); a copy.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Row<'py>> {
        Ok(PyArray1::from_slice(py, self.live()?.state()))
    }

    /// Outputs of the stepping simulation now, as sensors show them (n_outputs,); a copy.
    #[getter]
    fn outputs<'py>(&self, py: Python<'py>) -> PyResult<Row<'py>> {
        Ok(PyArray1::from_slice(py, self.live()?.outputs()))
    }

    /// Steps the simulation: holds the commands (n_inputs,) for one sample; outputs (n_outputs,) at its end.
    fn step<'py>(&self, py: Python<'py>, inputs: &Any<'py>) -> PyResult<Row<'py>> {
        let inputs = Vector::new("inputs", inputs)?;
        let mut live = self.live()?;
        let values = inputs.values()?;
        let result = unbroken(|| live.step(values).map(|outputs| PyArray1::from_slice(py, outputs)))?;
        checked(py, live.description(), result)
    }

    /// Steps the simulation for each row of the commands (N, n_inputs). Outputs (N, n_outputs), each at the end of its
    /// step.
    fn run<'py>(&self, py: Python<'py>, inputs: &Any<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inputs = Numbers::table("inputs", inputs)?;
        let mut live = self.live()?;
        let width = live.description().n_outputs();
        let guard = &mut *live;
        let result = interruptible(py, |interrupt| {
            let table = inputs.as_table()?;
            let mut rows = Vec::with_capacity(table.rows() * width);
            for row in 0..table.rows() {
                if row % PATIENCE == PATIENCE - 1 && interrupt() {
                    return Err(Error::Interrupted);
                }
                rows.extend_from_slice(guard.step(table.row(row))?);
            }
            Ok(rows)
        })?;
        let outputs = checked(py, live.description(), result)?;
        matrix(py, outputs, [inputs.rows(), width])
    }

    /// Resets the stepping simulation to time zero in a state (n_states,), with nothing remembered.
    fn reset(&self, py: Python<'_>, state: &Any<'_>) -> PyResult<()> {
        let state = Numbers::vector("state", state)?;
        let mut live = self.live()?;
        let result = unbroken(|| live.reset(state.values()))?;
        checked(py, live.description(), result)
    }

    /// Snapshot of the stepping simulation, with what delays and sampled drives remember.
    fn snapshot(&self) -> PyResult<Snapshot> {
        Ok(Snapshot { live: self.live()?.clone() })
    }

    /// Restores the stepping simulation from a snapshot; refuses that of another simulation.
    fn restore(&self, snapshot: &Snapshot) -> PyResult<()> {
        let mut live = self.live()?;
        if !live.is_alike(&snapshot.live) {
            return Err(CoreError::new_err(
                "the snapshot is of another model, other parameters or other steps; restore one that this simulation or its like has taken",
            ));
        }
        live.clone_from(&snapshot.live);
        Ok(())
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("Simulation(time={} s)", self.live()?.time()))
    }
}

/// Steps E simulations of the same machine with inputs (E, n_inputs) over so many samples. Gives outputs (E, n_outputs)
/// at their end, and of each simulation that could not go on why, or None.
#[pyfunction]
pub(crate) fn step_all<'py>(
    py: Python<'py>,
    simulations: Vec<Bound<'py, Simulation>>,
    inputs: &Any<'py>,
    samples: usize,
) -> PyResult<Stepped<'py>> {
    let inputs = Numbers::table("inputs", inputs)?;
    let mut guards: Vec<_> = simulations.iter().map(|one| one.get().live()).collect::<PyResult<_>>()?;
    let mut lives: Vec<&mut Live> = guards.iter_mut().map(|guard| &mut **guard).collect();
    let result = py.detach(|| unbroken(|| live::step_all(&mut lives, inputs.as_table()?, samples)))?;
    let failed = result.map_err(|error| CoreError::new_err(error.to_string()))?;
    let mut outputs = Vec::new();
    guards.iter().for_each(|live| outputs.extend_from_slice(live.outputs()));
    let shape = [guards.len(), outputs.len() / guards.len().max(1)];
    Ok((matrix(py, outputs, shape)?, failed.into_iter().map(|one| one.err().map(|error| error.to_string())).collect()))
}
