//! The class `MaxwellNarx`.

use numpy::PyArray1;
use pyo3::prelude::*;
use vpm_core::narx::{self, MaxwellScheme, Surface};

use super::{Any, Row, raised};
use crate::arrays::Numbers;
use crate::errors::CoreError;

/// A Maxwell element beside a spring as a difference equation.
///
/// Parameters
/// ----------
/// k0, s0 : array_like, shape (10,)
///     Coefficients over `1, u, s, u^2, u s, s^2, u^3, u^2 s, u s^2, s^3`; N/m and m.
/// k1, c1, step : float
///     N/m, N s/m, s.
/// scheme : {"trapezoidal", "printed", "central_mean"}
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct MaxwellNarx {
    element: narx::MaxwellNarx,
}

fn surface(name: &'static str, values: &Any<'_>) -> PyResult<Surface> {
    match Numbers::vector(name, values)?.rows_of::<10>()?[..] {
        [coefficients] => Ok(Surface(coefficients)),
        _ => Err(CoreError::new_err(format!("`{name}` must have ten coefficients; fill up with zeros"))),
    }
}

#[pymethods]
impl MaxwellNarx {
    #[new]
    #[pyo3(signature = (k0, s0, k1, c1, step, scheme))]
    fn new(py: Python<'_>, k0: &Any<'_>, s0: &Any<'_>, k1: f64, c1: f64, step: f64, scheme: &str) -> PyResult<Self> {
        let scheme = match scheme {
            "trapezoidal" => MaxwellScheme::Trapezoidal,
            "printed" => MaxwellScheme::Printed,
            "central_mean" => MaxwellScheme::CentralMean,
            other => {
                let text = format!("`scheme` is {other}; the choices are trapezoidal, printed and central_mean");
                return Err(CoreError::new_err(text));
            }
        };
        let element = narx::MaxwellNarx::new(surface("k0", k0)?, surface("s0", s0)?, k1, c1, step, scheme);
        Ok(Self { element: element.map_err(|error| raised(py, error))? })
    }

    /// Forces (N,) in N; the first two are `start`.
    #[pyo3(signature = (start, drive, length, limit))]
    fn simulate_free_run<'py>(
        &self,
        py: Python<'py>,
        start: [f64; 2],
        drive: &Any<'py>,
        length: &Any<'py>,
        limit: f64,
    ) -> PyResult<Row<'py>> {
        let (u, s) = (Numbers::vector("drive", drive)?, Numbers::vector("length", length)?);
        let run = py.detach(|| self.element.simulate_free_run(start, u.values(), s.values(), limit));
        run.map(|forces| PyArray1::from_vec(py, forces)).map_err(|error| raised(py, error))
    }
}
