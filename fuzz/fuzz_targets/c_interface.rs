//! The functions for C, with a text and numbers that somebody has damaged.
#![no_main]

mod json;

use std::ffi::{CStr, CString, c_char};

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use vpm::{
    VpmStatus, vpm_close, vpm_input_count, vpm_message, vpm_open_text, vpm_output_count, vpm_parameter_count,
    vpm_parameters, vpm_reset, vpm_set_parameters, vpm_state, vpm_state_count, vpm_step,
};
use vpm_core::compiled::Compiled;

/// More are no mistake, but take their time.
const SUBSTEPS: usize = 100;
/// Of these is a number in the place of each of the caller's.
const NUMBERS: [f64; 8] = [0.0, 1.0, -1.0, 1e-300, 1e155, f64::MAX, f64::INFINITY, f64::NAN];

fuzz_mutator!(|data: &mut [u8], size: usize, most: usize, seed: u32| { json::mutate(data, size, most, seed) });

fuzz_target!(|text: &str| {
    if Compiled::parse(text).is_ok_and(|compiled| compiled.stepping.substeps > SUBSTEPS) {
        return;
    }
    json::limited(|| called(text));
});

fn called(content: &str) {
    let Ok(text) = CString::new(content) else { return };
    let mut message = [1 as c_char; 64];
    // SAFETY: a text, and room for the message.
    let opened = unsafe { vpm_open_text(text.as_ptr(), message.as_mut_ptr(), message.len()) };
    if opened.is_null() {
        assert!(message.contains(&0), "a message without an end");
        return;
    }
    // What the caller gives follows from the text, so that a case can be repeated.
    let mut place = content.len();
    let mut given = |count: usize| -> Vec<f64> {
        (0..count)
            .map(|_| {
                NUMBERS[{
                    place = place.wrapping_mul(31).wrapping_add(7);
                    place
                } % NUMBERS.len()]
            })
            .collect()
    };
    // SAFETY: an open simulation, closed once; as many places as its counts say.
    unsafe {
        let mut outputs = vec![0.0; vpm_output_count(opened)];
        let (states, parameters) = (vpm_state_count(opened), vpm_parameter_count(opened));
        let mut kept = vec![0.0; parameters];
        assert_eq!(vpm_parameters(opened, kept.as_mut_ptr()), VpmStatus::VpmOk);
        for round in 0..3 {
            let inputs = if round == 0 { vec![1e-3; vpm_input_count(opened)] } else { given(vpm_input_count(opened)) };
            let ended = vpm_step(opened, inputs.as_ptr(), outputs.as_mut_ptr());
            assert_ne!(ended, VpmStatus::VpmFault, "{:?}", CStr::from_ptr(vpm_message(opened)));
            if ended == VpmStatus::VpmOk {
                assert!(outputs.iter().all(|value| value.is_finite()), "{outputs:?}");
            }
            assert_ne!(vpm_reset(opened, given(states).as_ptr()), VpmStatus::VpmFault);
        }
        assert_ne!(vpm_set_parameters(opened, given(parameters).as_ptr()), VpmStatus::VpmFault);
        let mut state = vec![0.0; states];
        assert_eq!(vpm_state(opened, state.as_mut_ptr()), VpmStatus::VpmOk);
        vpm_close(opened);
    }
}
