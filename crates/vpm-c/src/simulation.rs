//! The simulation that C holds a pointer to.

use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::ptr;

use vpm_core::compiled::Compiled;
use vpm_core::live::Live;
use vpm_core::{Error, Result};

use crate::names::Names;
use crate::text;

/// How a call ended.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VpmStatus {
    /// It did what it says.
    VpmOk = 0,
    /// An argument is wrong, for example null, infinite or not a number; the simulation is as it was.
    VpmInvalid = 1,
    /// A state has left its bounds; all stays at the sample before, until `vpm_reset`.
    VpmDiverged = 2,
    /// A fault of the library itself; close the simulation and report the message.
    VpmFault = 3,
}

/// A machine in simulated time. Made by `vpm_open`, released by `vpm_close`.
pub struct VpmSimulation {
    compiled: Compiled,
    live: Live,
    pub(crate) names: Names,
    message: CString,
}

impl VpmSimulation {
    fn new(compiled: Compiled) -> Result<Self> {
        let live = quick(compiled.live()?);
        Ok(Self { live, names: Names::new(&compiled), message: CString::default(), compiled })
    }

    /// Does some work on the simulation, tells how it ended and keeps the sentence of an error.
    fn attempt(&mut self, work: impl FnOnce(&mut Self) -> Result<()>) -> VpmStatus {
        // Whatever a panic left half done is not used again: the status says so.
        match catch_unwind(AssertUnwindSafe(|| work(self))) {
            Ok(Ok(())) => VpmStatus::VpmOk,
            Ok(Err(error)) => {
                self.message = text::terminated(&error.to_string());
                if matches!(error, Error::Diverged(_)) { VpmStatus::VpmDiverged } else { VpmStatus::VpmInvalid }
            }
            Err(_) => {
                self.message =
                    c"the library failed inside; close this simulation and report what it was given".to_owned();
                VpmStatus::VpmFault
            }
        }
    }
}

/// The same by machine code, where the machine has any: made once for all parameters.
fn quick(mut live: Live) -> Live {
    // What has no code steps as exactly without.
    let _ = live.compile();
    live
}

/// Opens a compiled model file.
///
/// Returns a simulation at its start, to be released by `vpm_close`; null where the file cannot be used, with one sentence in `message`
/// (`size` bytes; may be null).
///
/// # Safety
/// `path` is a zero-terminated text; `message` is null or has `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_open(path: *const c_char, message: *mut c_char, size: usize) -> *mut VpmSimulation {
    // SAFETY: as the caller promises.
    let path = unsafe { text::read(path, "the path") };
    let opened = guarded(|| path.and_then(|path| Compiled::read(Path::new(path)).map_err(|error| error.to_string())));
    // SAFETY: as the caller promises.
    unsafe { handed_over(opened, message, size) }
}

/// The same for the text of a compiled model that is in memory already.
///
/// # Safety
/// `model` is a zero-terminated text; `message` is null or has `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_open_text(model: *const c_char, message: *mut c_char, size: usize) -> *mut VpmSimulation {
    // SAFETY: as the caller promises.
    let model = unsafe { text::read(model, "the compiled model") };
    let opened = guarded(|| model.and_then(|model| Compiled::parse(model).map_err(|error| error.to_string())));
    // SAFETY: as the caller promises.
    unsafe { handed_over(opened, message, size) }
}

/// A panic on the way becomes a sentence.
fn guarded<T>(work: impl FnOnce() -> std::result::Result<T, String>) -> std::result::Result<T, String> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err("the library failed inside; report the model file".to_owned()))
}

/// # Safety
/// `message` is null or has `size` bytes.
unsafe fn handed_over(
    opened: std::result::Result<Compiled, String>,
    message: *mut c_char,
    size: usize,
) -> *mut VpmSimulation {
    let made = guarded(|| opened.and_then(|compiled| VpmSimulation::new(compiled).map_err(|error| error.to_string())));
    match made {
        Ok(simulation) => Box::into_raw(Box::new(simulation)),
        Err(sentence) => {
            // SAFETY: as the caller promises.
            unsafe { text::write(&sentence, message, size) };
            ptr::null_mut()
        }
    }
}

/// Releases a simulation; null is no harm.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`, and nobody uses it afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_close(simulation: *mut VpmSimulation) {
    if !simulation.is_null() {
        // SAFETY: it was boxed by `handed_over` and is given back once.
        drop(unsafe { Box::from_raw(simulation) });
    }
}

/// Holds the inputs (`vpm_input_count` numbers) for the time of one sample and writes what the sensors show at its end into `outputs`
/// (`vpm_output_count` numbers; may be null). Allocates nothing. Where it fails, `outputs` is left alone and `vpm_message` says why.
///
/// # Safety
/// `simulation` comes from `vpm_open`; the arrays have these lengths and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_step(simulation: *mut VpmSimulation, inputs: *const f64, outputs: *mut f64) -> VpmStatus {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    let Some(simulation) = (unsafe { simulation.as_mut() }) else { return VpmStatus::VpmInvalid };
    simulation.attempt(|simulation| {
        let count = simulation.names.inputs.len();
        // SAFETY: as many numbers as the caller promises.
        let inputs = unsafe { numbers("inputs", inputs, count) }?;
        if let Some((place, &value)) = inputs.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(Error::NonFinite { path: simulation.compiled.inputs[place].clone(), value });
        }
        let seen = simulation.live.step(inputs)?;
        // SAFETY: null, or as many numbers as the caller promises.
        unsafe { copy(seen, outputs) };
        Ok(())
    })
}

/// Begins again at time zero in `state` (`vpm_state_count` numbers), or at the start of the file where it is null.
///
/// # Safety
/// `simulation` comes from `vpm_open`; `state` is null or has that length.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_reset(simulation: *mut VpmSimulation, state: *const f64) -> VpmStatus {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    let Some(simulation) = (unsafe { simulation.as_mut() }) else { return VpmStatus::VpmInvalid };
    simulation.attempt(|simulation| {
        let VpmSimulation { compiled, live, .. } = simulation;
        if state.is_null() {
            return live.reset(&compiled.start);
        }
        // SAFETY: as many numbers as the caller promises.
        live.reset(unsafe { numbers("state", state, compiled.states.len()) }?)
    })
}

/// Gives the model other parameters (`vpm_parameter_count` numbers, in the order of `vpm_parameter_name`) and begins again at its start.
/// Allocates; not for the loop.
///
/// # Safety
/// `simulation` comes from `vpm_open`; `parameters` has that length.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_set_parameters(simulation: *mut VpmSimulation, parameters: *const f64) -> VpmStatus {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    let Some(simulation) = (unsafe { simulation.as_mut() }) else { return VpmStatus::VpmInvalid };
    simulation.attempt(|simulation| {
        let compiled = &simulation.compiled;
        // SAFETY: as many numbers as the caller promises.
        let theta = unsafe { numbers("parameters", parameters, simulation.names.parameters.len()) }?;
        simulation.live = quick(Live::new(compiled.description().clone(), theta, &compiled.start, compiled.stepping)?);
        Ok(())
    })
}

/// Writes the parameters of the model now (`vpm_parameter_count` numbers).
///
/// # Safety
/// `simulation` comes from `vpm_open`; `parameters` has that length.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_parameters(simulation: *const VpmSimulation, parameters: *mut f64) -> VpmStatus {
    // SAFETY: the caller's pointers.
    unsafe { told(simulation, parameters, |simulation| simulation.live.parameters()) }
}

/// Writes the state now (`vpm_state_count` numbers).
///
/// # Safety
/// `simulation` comes from `vpm_open`; `state` has that length.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_state(simulation: *const VpmSimulation, state: *mut f64) -> VpmStatus {
    // SAFETY: the caller's pointers.
    unsafe { told(simulation, state, |simulation| simulation.live.state()) }
}

/// Writes what the sensors show now (`vpm_output_count` numbers).
///
/// # Safety
/// `simulation` comes from `vpm_open`; `outputs` has that length.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_outputs(simulation: *const VpmSimulation, outputs: *mut f64) -> VpmStatus {
    // SAFETY: the caller's pointers.
    unsafe { told(simulation, outputs, |simulation| simulation.live.outputs()) }
}

/// Time since the start, s; not a number where `simulation` is null.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_time(simulation: *const VpmSimulation) -> f64 {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    unsafe { simulation.as_ref() }.map_or(f64::NAN, |simulation| simulation.live.time())
}

/// Time between samples, s; not a number where `simulation` is null.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_time_step(simulation: *const VpmSimulation) -> f64 {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    unsafe { simulation.as_ref() }.map_or(f64::NAN, |simulation| simulation.compiled.stepping.time_step)
}

/// Numbers that a step takes; 0 where `simulation` is null.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_input_count(simulation: *const VpmSimulation) -> usize {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    unsafe { simulation.as_ref() }.map_or(0, |simulation| simulation.names.inputs.len())
}

/// Numbers that a step shows; 0 where `simulation` is null.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_output_count(simulation: *const VpmSimulation) -> usize {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    unsafe { simulation.as_ref() }.map_or(0, |simulation| simulation.names.outputs.len())
}

/// Numbers of the state; 0 where `simulation` is null.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_state_count(simulation: *const VpmSimulation) -> usize {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    unsafe { simulation.as_ref() }.map_or(0, |simulation| simulation.names.states.len())
}

/// Number of parameters; 0 where `simulation` is null.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_parameter_count(simulation: *const VpmSimulation) -> usize {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    unsafe { simulation.as_ref() }.map_or(0, |simulation| simulation.names.parameters.len())
}

/// One sentence about the last call that failed; valid until the next call that fails or `vpm_close`.
///
/// # Safety
/// `simulation` is null or comes from `vpm_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vpm_message(simulation: *const VpmSimulation) -> *const c_char {
    const NULL: &CStr = c"the simulation is a null pointer; open it with vpm_open";
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    unsafe { simulation.as_ref() }.map_or(NULL.as_ptr(), |simulation| simulation.message.as_ptr())
}

/// Version of the library, as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn vpm_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// # Safety
/// `data` is null or points at `count` numbers that nobody changes meanwhile.
unsafe fn numbers<'a>(what: &'static str, data: *const f64, count: usize) -> Result<&'a [f64]> {
    if count == 0 {
        return Ok(&[]);
    }
    if data.is_null() {
        return Err(Error::Dimension {
            what: what.to_owned(),
            expected: count,
            found: 0,
            each: "entry of the array".to_owned(),
        });
    }
    // SAFETY: not null, and of this length as the caller promises.
    Ok(unsafe { std::slice::from_raw_parts(data, count) })
}

/// # Safety
/// `room` is null or has room for all numbers, and is not part of them.
unsafe fn copy(numbers: &[f64], room: *mut f64) {
    if !room.is_null() {
        // SAFETY: as the caller promises.
        unsafe { ptr::copy_nonoverlapping(numbers.as_ptr(), room, numbers.len()) };
    }
}

/// # Safety
/// `simulation` is null or comes from `vpm_open`; `room` is null or has room for all numbers.
unsafe fn told(
    simulation: *const VpmSimulation,
    room: *mut f64,
    of: impl FnOnce(&VpmSimulation) -> &[f64],
) -> VpmStatus {
    // SAFETY: the caller's pointer from `vpm_open`, or null.
    let Some(simulation) = (unsafe { simulation.as_ref() }) else { return VpmStatus::VpmInvalid };
    if room.is_null() {
        return VpmStatus::VpmInvalid;
    }
    // SAFETY: as the caller promises.
    unsafe { copy(of(simulation), room) };
    VpmStatus::VpmOk
}
