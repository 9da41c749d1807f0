//! Flights of a link through a play.

use numpy::PyArray2;
use pyo3::prelude::*;
use vpm_core::flight::SoftPlay;

use crate::arrays::{Numbers, matrix};
use crate::errors::CoreError;
use crate::interrupt::unbroken;

/// Acceleration (N, k) of a link against the motor for each of k plays, where nothing but ``pull`` (N,) moves it within them; ``gaps``,
/// ``rates`` (rad/s) and ``dampings`` (k,) are those of their soft contacts.
#[pyfunction]
pub(crate) fn soft_flights<'py>(
    py: Python<'py>,
    pull: &Bound<'py, PyAny>,
    gaps: &Bound<'py, PyAny>,
    rates: &Bound<'py, PyAny>,
    dampings: &Bound<'py, PyAny>,
    interval: f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (pull, gaps) = (Numbers::vector("pull", pull)?, Numbers::vector("gaps", gaps)?);
    let (rates, dampings) = (Numbers::vector("rates", rates)?, Numbers::vector("dampings", dampings)?);
    let plays = gaps.values().len();
    if rates.values().len() != plays || dampings.values().len() != plays {
        return Err(CoreError::new_err(format!(
            "gaps has {plays} values, rates {} and dampings {}; give one of each for every play",
            rates.values().len(),
            dampings.values().len()
        )));
    }
    let each = gaps.values().iter().zip(rates.values()).zip(dampings.values());
    let contacts: Vec<SoftPlay> = each.map(|((&gap, &rate), &damping)| SoftPlay { gap, rate, damping }).collect();
    let shape = [pull.values().len(), plays];
    let fly = || vpm_core::flight::soft_flights(pull.values(), &contacts, interval);
    matrix(py, py.detach(|| unbroken(fly))?, shape)
}
