//! The class `System`.

mod batch;
mod evaluation;
mod observer;
mod simulation;
mod source;
mod timing;

use std::sync::Arc;

use pyo3::prelude::*;
use vpm_core::Error;
use vpm_core::description::Description;
use vpm_core::sensitivity::Interrupt;

use crate::errors::exception;
use crate::interrupt::interruptible;

/// A machine: rigid tree, effects, actuators, sensors and controllers, as one object over a flat parameter vector theta.
///
/// Parameters
/// ----------
/// description : str
///     JSON; see the class `vpm.Model`, which writes it.
///
/// Raises
/// ------
/// CoreError
///     The description cannot be right; one sentence with the place and the repair.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct System {
    description: Arc<Description>,
}

impl System {
    /// Description of the system, to be shared.
    pub(crate) fn description(&self) -> &Arc<Description> {
        &self.description
    }

    /// Checked result for the system, or its error as an exception.
    pub(crate) fn checked<T>(&self, py: Python<'_>, result: Result<T, Error>) -> PyResult<T> {
        checked(py, &self.description, result)
    }

    /// Runs `job` of the system without the interpreter lock.
    fn compute<T: Send>(
        &self,
        py: Python<'_>,
        job: impl FnOnce(Interrupt<'_>) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let result = interruptible(py, job)?;
        self.checked(py, result)
    }
}

/// Checked result on the machine of a system's `description`, or its error as an exception.
pub(crate) fn checked<T>(py: Python<'_>, description: &Description, result: Result<T, Error>) -> PyResult<T> {
    result.map_err(|error| exception(py, error, description.n_outputs(), description.n_states()))
}

#[pymethods]
impl System {
    #[new]
    fn new(py: Python<'_>, description: &str) -> PyResult<Self> {
        let description = Description::from_json(description).map_err(|error| exception(py, error, 0, 0))?;
        Ok(Self { description: Arc::new(description) })
    }

    /// Number of joints of the system.
    #[getter]
    fn n_joints(&self) -> usize {
        self.description.n_joints()
    }

    /// Number of coordinates of the system: joints, then the elastic coordinates of the beams.
    #[getter]
    fn n_coordinates(&self) -> usize {
        self.description.n_coordinates()
    }

    /// Number of elastic coordinates of the system.
    #[getter]
    fn n_elastic(&self) -> usize {
        self.description.n_elastic()
    }

    /// Number of beams of the system.
    #[getter]
    fn n_beams(&self) -> usize {
        self.description.n_beams()
    }

    /// Length of the system's state: positions, velocities, states of drives, pressures of sagging supplies.
    #[getter]
    fn n_states(&self) -> usize {
        self.description.n_states()
    }

    /// Number of actuators of the system.
    #[getter]
    fn n_actuators(&self) -> usize {
        self.description.n_actuators()
    }

    /// Number of inputs of the system: one command per actuator, one pressure per logged supply.
    #[getter]
    fn n_inputs(&self) -> usize {
        self.description.n_inputs()
    }

    /// Number of output channels of the system.
    #[getter]
    fn n_outputs(&self) -> usize {
        self.description.n_outputs()
    }

    /// Length of the system's theta.
    #[getter]
    fn n_parameters(&self) -> usize {
        self.description.n_parameters()
    }

    fn __repr__(&self) -> String {
        let d = &self.description;
        let (joints, actuators, parameters) = (d.n_joints(), d.n_actuators(), d.n_parameters());
        format!("System(joints={joints}, actuators={actuators}, parameters={parameters})")
    }
}
