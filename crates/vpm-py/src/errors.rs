//! Errors of the core as Python exceptions.

use numpy::PyArray1;
use numpy::prelude::*;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::{create_exception, import_exception};
use vpm_core::error::{Diverged as Partial, Error};

// An error of what was asked, as all of vpm's are: `vpm.errors` imports nothing, so that the core may import it.
import_exception!(vpm.errors, CoreError);

create_exception!(
    vpm._core,
    Diverged,
    CoreError,
    "A simulation left the finite numbers; `sample_index`, `outputs` and `states` hold how far it came."
);

/// The exception for an error of the core; a diverged run carries its samples, `outputs` and `states` per sample.
pub(crate) fn exception(py: Python<'_>, error: Error, outputs: usize, states: usize) -> PyErr {
    match error {
        Error::Diverged(partial) => diverged(py, *partial, outputs, states).unwrap_or_else(|error| error),
        Error::Interrupted => PyKeyboardInterrupt::new_err(error.to_string()),
        error => CoreError::new_err(error.to_string()),
    }
}

fn diverged(py: Python<'_>, partial: Partial, outputs: usize, states: usize) -> PyResult<PyErr> {
    let exception = Diverged::new_err(partial.to_string());
    let value = exception.value(py);
    let rows = partial.states.len() / states.max(1);
    value.setattr("sample_index", partial.sample_index)?;
    value.setattr("outputs", PyArray1::from_vec(py, partial.outputs).reshape([rows, outputs])?)?;
    value.setattr("states", PyArray1::from_vec(py, partial.states).reshape([rows, states])?)?;
    Ok(exception)
}
