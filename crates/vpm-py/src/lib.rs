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
}
