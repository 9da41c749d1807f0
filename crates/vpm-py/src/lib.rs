//! Python bindings of [`vpm_core`]: the module `vpm._core`.
//!
//! Thin on purpose: arrays in and out, errors mapped to exceptions, the interpreter lock released while the core computes.

use pyo3::prelude::*;

mod arrays;
mod dynamics;
mod errors;
mod filter;
mod interrupt;
mod linkage;
mod narx;
mod observing;
mod realtime;
mod stepping;
mod system;

/// The compiled core of vpm: a machine as one object, arrays in and out.
#[pymodule]
mod _core {
    use numpy::PyArray1;
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::dynamics::Dynamics;
    #[pymodule_export]
    use crate::errors::Diverged;
    #[pymodule_export]
    use crate::filter::zero_phase;
    #[pymodule_export]
    use crate::interrupt::stop_when;
    #[pymodule_export]
    use crate::linkage::{Karl, Leg, hyq_parameters};
    #[pymodule_export]
    use crate::narx::{MaxwellNarx, Narx, NarxStepper, narx_candidates, narx_fit, narx_select};
    #[pymodule_export]
    use crate::observing::Kalman;
    #[pymodule_export]
    use crate::realtime::Loop;
    #[pymodule_export]
    use crate::stepping::{Simulation, Snapshot, check_integrator, step_all};
    #[pymodule_export]
    use crate::system::System;

    /// Look up what arrays need of NumPy at once: the look-up panics where Ctrl-C comes in the midst of it.
    #[pymodule_init]
    fn ready(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.py().import("numpy")?;
        PyArray1::<f64>::zeros(module.py(), 0, false);
        Ok(())
    }
}
