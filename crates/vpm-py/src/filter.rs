//! Zero-phase filters of records.

use std::num::NonZeroUsize;

use numpy::PyArray2;
use pyo3::prelude::*;
use vpm_core::filter::ZeroPhase;

use crate::arrays::{Numbers, matrix};
use crate::errors::{CoreError, exception};
use crate::interrupt::unbroken;

/// Columns of ``values`` (N, k) filtered forward and backward by ``sections`` (s, 6), each ``b0 b1 b2 a0 a1 a2``, both ends continued by
/// ``padding`` samples; every ``every``-th sample (ceil(N / every), k).
#[pyfunction]
pub(crate) fn zero_phase<'py>(
    py: Python<'py>,
    sections: &Bound<'py, PyAny>,
    values: &Bound<'py, PyAny>,
    padding: usize,
    every: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (sections, values) = (Numbers::table("sections", sections)?, Numbers::table("values", values)?);
    let filter = ZeroPhase::new(&sections.rows_of()?, padding).map_err(|error| exception(py, error, 0, 0))?;
    let Some(every) = NonZeroUsize::new(every) else {
        return Err(CoreError::new_err("`every` must be at least 1, got 0; 1 keeps every sample"));
    };
    let shape = [values.rows().div_ceil(every.get()), values.columns()];
    let apply = || filter.apply(values.values(), values.columns(), every);
    matrix(py, py.detach(|| unbroken(apply))?, shape)
}
