//! The machine as C99.

use pyo3::prelude::*;
use vpm_core::c_source::{Names, files};

use super::System;
use crate::arrays::{Numbers, places};

#[pymethods]
impl System {
    /// C source of the system: texts of `NAME.h` and `NAME.c`. The parameters numbered `free` are arguments, all others
    /// constants.
    #[pyo3(signature = (theta, name, states, inputs, outputs, free=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn c_source(
        &self,
        py: Python<'_>,
        theta: &Bound<'_, PyAny>,
        name: String,
        states: Vec<String>,
        inputs: Vec<String>,
        outputs: Vec<String>,
        free: Vec<i64>,
    ) -> PyResult<(String, String)> {
        let theta = Numbers::vector("theta", theta)?;
        let free = places("free", &free)?;
        let names = Names { machine: name, states, inputs, outputs };
        let files = py.detach(|| files(&self.description, theta.values(), &free, &names));
        let files = self.checked(py, files)?;
        Ok((files.header, files.source))
    }
}
