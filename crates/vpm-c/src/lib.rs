//! Compiled models for controllers in C and C++.
//!
//! A model file becomes a compiled model by `vpm compile`; `vpm_open` makes a simulation of it, `vpm_step` advances it by one sample and
//! allocates nothing. A simulation belongs to one thread at a time. All numbers are SI; no function lets a panic pass into C.

mod names;
mod simulation;
mod text;

pub use names::{vpm_input_name, vpm_output_name, vpm_parameter_name, vpm_state_name};
pub use simulation::{
    VpmSimulation, VpmStatus, vpm_close, vpm_input_count, vpm_message, vpm_open, vpm_open_text, vpm_output_count,
    vpm_outputs, vpm_parameter_count, vpm_parameters, vpm_reset, vpm_set_parameters, vpm_state, vpm_state_count,
    vpm_step, vpm_time, vpm_time_step, vpm_version,
};
