//! The class `Kalman`: a filter that is fed sample by sample.

use std::sync::{Mutex, MutexGuard};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use vpm_core::simulate::{Kalman as Filter, Noise, by_rows};

use crate::arrays::{Numbers, matrix, places};
use crate::errors::CoreError;
use crate::interrupt::unbroken;
use crate::stepping::stepping;
use crate::system::{System, checked};

type Any<'py> = Bound<'py, PyAny>;
type Row<'py> = Bound<'py, PyArray1<f64>>;
type Table<'py> = Bound<'py, PyArray2<f64>>;

/// An extended Kalman filter that is fed sample by sample.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct Kalman {
    filter: Mutex<Filter>,
}

impl Kalman {
    fn filter(&self) -> PyResult<MutexGuard<'_, Filter>> {
        self.filter.try_lock().map_err(|_| {
            CoreError::new_err("this observer is at work in another thread; give each thread its own observer")
        })
    }
}

/// Matrix of the observing filter as an array.
fn matrix_of<'py>(py: Python<'py>, (values, shape): (Vec<f64>, [usize; 2])) -> PyResult<Table<'py>> {
    matrix(py, values, shape)
}

#[pymethods]
impl Kalman {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn new(
        py: Python<'_>,
        system: &System,
        theta: &Any<'_>,
        state: &Any<'_>,
        channels: Vec<i64>,
        noise: (Any<'_>, Any<'_>, Any<'_>, Any<'_>),
        time_step: f64,
        substeps: i64,
        integrator: &str,
    ) -> PyResult<Self> {
        let (theta, state) = (Numbers::vector("theta", theta)?, Numbers::vector("state", state)?);
        let channels = places("channels", &channels)?;
        let of_readings = Numbers::vector("noise of readings", &noise.0)?;
        let of_forces = Numbers::vector("noise of forces", &noise.1)?;
        let of_states = Numbers::vector("noise of states", &noise.2)?;
        let of_first = Numbers::vector("uncertainty of the first state", &noise.3)?;
        let noise = Noise {
            readings: of_readings.values(),
            forces: of_forces.values(),
            states: of_states.values(),
            first: of_first.values(),
        };
        let stepping = system.checked(py, stepping((time_step, substeps, integrator))?)?;
        let description = system.description().clone();
        let filter =
            unbroken(|| Filter::new(description, theta.values(), state.values(), (&channels, noise), stepping))?;
        Ok(Self { filter: Mutex::new(system.checked(py, filter)?) })
    }

    /// Step of the observing filter: corrected state (nx,) and innovations (m,) from readings (m,). The inputs
    /// (n_inputs,) are held to the next sample.
    fn step<'py>(&self, py: Python<'py>, readings: &Any<'py>, inputs: &Any<'py>) -> PyResult<(Row<'py>, Row<'py>)> {
        let (readings, inputs) = (Numbers::vector("readings", readings)?, Numbers::vector("inputs", inputs)?);
        let mut filter = self.filter()?;
        let result = unbroken(|| filter.step(readings.values(), inputs.values()).map(|_| ()))?;
        checked(py, filter.description(), result)?;
        let found = filter.estimate();
        Ok((PyArray1::from_slice(py, found.state.as_slice()), PyArray1::from_slice(py, found.innovation.as_slice())))
    }

    /// Covariance (nx, nx) of the observing filter's last estimate, and (m, m) of the last innovations.
    fn covariances<'py>(&self, py: Python<'py>) -> PyResult<(Table<'py>, Table<'py>)> {
        let filter = self.filter()?;
        Ok((matrix_of(py, by_rows(&filter.estimate().covariance))?, matrix_of(py, by_rows(&filter.estimate().spread))?))
    }

    /// State (nx,) that the observing filter expects at the coming sample.
    fn expected<'py>(&self, py: Python<'py>) -> PyResult<Row<'py>> {
        Ok(PyArray1::from_slice(py, self.filter()?.expected()))
    }

    /// Resets the observing filter to a state (nx,) of this covariance (nx, nx).
    fn reset(&self, py: Python<'_>, state: &Any<'_>, covariance: &Any<'_>) -> PyResult<()> {
        let (state, covariance) = (Numbers::vector("state", state)?, Numbers::table("covariance", covariance)?);
        let mut filter = self.filter()?;
        let result = filter.reset(state.values(), covariance.values());
        checked(py, filter.description(), result)
    }

    /// Holds a gain (nx, m) of the observing filter from now on. The estimate then has this covariance (nx, nx) and the
    /// innovations that one (m, m).
    fn hold_gain(&self, py: Python<'_>, gain: &Any<'_>, covariance: &Any<'_>, spread: &Any<'_>) -> PyResult<()> {
        let (gain, covariance) = (Numbers::table("gain", gain)?, Numbers::table("covariance", covariance)?);
        let spread = Numbers::table("spread", spread)?;
        let mut filter = self.filter()?;
        let result = filter.hold_gain((gain.values(), covariance.values(), spread.values()));
        checked(py, filter.description(), result)
    }

    /// Linearised machine of the observing filter at the expected state. Transition (nx, nx) over a sample, measured
    /// outputs by the state (m, nx), covariance of what moves it (nx, nx).
    fn linearised<'py>(&self, py: Python<'py>, inputs: &Any<'py>) -> PyResult<(Table<'py>, Table<'py>, Table<'py>)> {
        let inputs = Numbers::vector("inputs", inputs)?;
        let mut filter = self.filter()?;
        let result = unbroken(|| filter.linearised(inputs.values()).cloned())?;
        let linear = checked(py, filter.description(), result)?;
        Ok((
            matrix_of(py, by_rows(&linear.transition))?,
            matrix_of(py, by_rows(&linear.output))?,
            matrix_of(py, by_rows(&linear.process))?,
        ))
    }
}
