//! Names of inputs, outputs, states and parameters, as C reads them.

use std::ffi::{CString, c_char};
use std::ptr;

use vpm_core::compiled::Compiled;

use crate::simulation::VpmSimulation;
use crate::text::terminated;

/// All names of a simulation, which live as long as it does.
pub(crate) struct Names {
    pub(crate) inputs: Vec<CString>,
    pub(crate) outputs: Vec<CString>,
    pub(crate) states: Vec<CString>,
    pub(crate) parameters: Vec<CString>,
}

impl Names {
    pub(crate) fn new(compiled: &Compiled) -> Self {
        let [inputs, outputs, states, parameters] =
            [&compiled.inputs, &compiled.outputs, &compiled.states, &compiled.description().parameter_names]
                .map(|names| names.iter().map(|name| terminated(name)).collect());
        Self { inputs, outputs, states, parameters }
    }
}

/// Name of an input, as `shoulder.command`; null beyond the last one. Valid until `vpm_close`.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_input_name(simulation: *const VpmSimulation, number: usize) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { name(simulation, number, |names| &names.inputs) }
}

/// Name of an output, as `shoulder.position`; null beyond the last one. Valid until `vpm_close`.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_output_name(simulation: *const VpmSimulation, number: usize) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { name(simulation, number, |names| &names.outputs) }
}

/// Name of a state, as `shoulder.velocity`; null beyond the last one. Valid until `vpm_close`.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_state_name(simulation: *const VpmSimulation, number: usize) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { name(simulation, number, |names| &names.states) }
}

/// Name of a parameter, as `shoulder.friction.coulomb`; null beyond the last one. Valid until `vpm_close`.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_parameter_name(simulation: *const VpmSimulation, number: usize) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { name(simulation, number, |names| &names.parameters) }
}

/// # Safety
/// `simulation` is null or comes from `vpm_open`.
unsafe fn name(
    simulation: *const VpmSimulation,
    number: usize,
    of: impl FnOnce(&Names) -> &[CString],
) -> *const c_char {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    let names = unsafe { simulation.as_ref() }.map(|simulation| of(&simulation.names));
    names.and_then(|names| names.get(number)).map_or(ptr::null(), |name| name.as_ptr())
}
