//! Flights of a link through a play.

use numpy::PyArray2;
use pyo3::prelude::*;

use crate::arrays::{Numbers, matrix};
use crate::interrupt::unbroken;

/// Acceleration (N, k) of a link against the motor for each of k widths of its play, impacts included, where nothing but ``pull`` (N,)
/// moves it; every impact is plastic.
#[pyfunction]
pub(crate) fn plastic_flights<'py>(
    py: Python<'py>,
    pull: &Bound<'py, PyAny>,
    gaps: &Bound<'py, PyAny>,
    interval: f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (pull, gaps) = (Numbers::vector("pull", pull)?, Numbers::vector("gaps", gaps)?);
    let shape = [pull.values().len(), gaps.values().len()];
    let fly = || vpm_core::flight::plastic_flights(pull.values(), gaps.values(), interval);
    matrix(py, py.detach(|| unbroken(fly))?, shape)
}
