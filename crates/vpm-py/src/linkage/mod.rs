//! Closed linkages: the classes `Karl` and `Leg`.

mod karl;
mod leg;

pub(crate) use karl::Karl;
pub(crate) use leg::{Leg, hyq_parameters};

use pyo3::prelude::*;
use vpm_studies::Error;

use crate::errors::{CoreError, exception};

/// The exception for an error of a linkage.
fn raised(py: Python<'_>, error: Error) -> PyErr {
    match error {
        Error::Core(error) => exception(py, error, 0, 0),
        error => CoreError::new_err(error.to_string()),
    }
}
