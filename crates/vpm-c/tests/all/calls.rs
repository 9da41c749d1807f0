//! The functions as C calls them: the same numbers as the core, wrong arguments refused, no allocation in a step.

use std::ffi::{CString, c_char};
use std::ptr;

use allocation_counter::measure;
use vpm::{
    VpmStatus, vpm_close, vpm_input_count, vpm_input_name, vpm_message, vpm_open, vpm_open_text, vpm_output_count,
    vpm_output_name, vpm_outputs, vpm_parameter_count, vpm_parameter_name, vpm_parameters, vpm_reset,
    vpm_set_parameters, vpm_state, vpm_state_count, vpm_state_name, vpm_step, vpm_time, vpm_time_step, vpm_version,
};
use vpm_core::compiled::Compiled;

use crate::support::{AXIS, Axis, text};

#[test]
fn steps_are_those_of_the_core() {
    let (axis, mut core) = (Axis::open(), Compiled::parse(AXIS).unwrap().live().unwrap());
    core.compile().unwrap();
    let mut outputs = [0.0; 6];
    for k in 0..500 {
        let input = (0.01 * f64::from(k)).sin();
        assert_eq!(axis.step(input, &mut outputs), VpmStatus::VpmOk);
        assert_eq!(outputs, core.step(&[input]).unwrap());
    }
    let (mut state, mut seen) = ([0.0; 2], [0.0; 6]);
    // SAFETY: as many places as there are states and outputs.
    unsafe {
        assert_eq!(vpm_state(axis.0, state.as_mut_ptr()), VpmStatus::VpmOk);
        assert_eq!(vpm_outputs(axis.0, seen.as_mut_ptr()), VpmStatus::VpmOk);
        assert!((vpm_time(axis.0) - 0.5).abs() < 1e-12);
        assert_eq!(vpm_time_step(axis.0), 1e-3);
    }
    assert_eq!((state.as_slice(), seen), (core.state(), outputs));
    assert!(state[0].abs() > 1e-4, "the axis has not moved");
}

#[test]
fn counts_and_names_are_told() {
    let axis = Axis::open();
    // SAFETY: an open simulation; numbers beyond the last name give null.
    unsafe {
        assert_eq!((vpm_input_count(axis.0), vpm_output_count(axis.0), vpm_state_count(axis.0)), (1, 6, 2));
        assert_eq!(text(vpm_input_name(axis.0, 0)), "drive");
        assert_eq!(text(vpm_output_name(axis.0, 0)), "axis.position");
        assert_eq!(text(vpm_state_name(axis.0, 1)), "axis.velocity");
        assert!(vpm_input_name(axis.0, 1).is_null() && vpm_output_name(axis.0, 6).is_null());
        let names: Vec<_> = (0..vpm_parameter_count(axis.0)).map(|k| text(vpm_parameter_name(axis.0, k))).collect();
        assert!(names.iter().any(|name| name.ends_with(".mass")), "{names:?}");
        assert!(vpm_parameter_name(axis.0, names.len()).is_null());
        assert_eq!(text(vpm_version()), env!("CARGO_PKG_VERSION"));
    }
}

#[test]
fn a_step_allocates_nothing() {
    let axis = Axis::open();
    let mut outputs = [0.0; 6];
    let info = measure(|| {
        for _ in 0..100 {
            axis.step(0.3, &mut outputs);
        }
    });
    assert_eq!(info.count_total, 0);
}

#[test]
fn reset_begins_again() {
    let axis = Axis::open();
    let (mut first, mut again, mut elsewhere) = ([0.0; 6], [0.0; 6], [0.0; 6]);
    axis.step(1.0, &mut first);
    axis.step(1.0, &mut again);
    assert_ne!(first, again);
    // SAFETY: null, then two states.
    unsafe { assert_eq!(vpm_reset(axis.0, ptr::null()), VpmStatus::VpmOk) };
    axis.step(1.0, &mut again);
    assert_eq!(first, again);
    // SAFETY: an open simulation, and arrays of its sizes.
    unsafe { assert_eq!(vpm_reset(axis.0, [0.1, 0.0].as_ptr()), VpmStatus::VpmOk) };
    axis.step(1.0, &mut elsewhere);
    assert!((elsewhere[0] - first[0] - 0.1).abs() < 1e-9);
    // SAFETY: an open simulation, and arrays of its sizes.
    assert!(unsafe { vpm_time(axis.0) } == 1e-3);
}

#[test]
fn parameters_are_read_and_set() {
    let axis = Axis::open();
    // SAFETY: as many places as there are parameters.
    let count = unsafe { vpm_parameter_count(axis.0) };
    // SAFETY: an open simulation, and arrays of its sizes.
    let mass = (0..count).find(|&k| text(unsafe { vpm_parameter_name(axis.0, k) }).ends_with(".mass")).unwrap();
    let mut parameters = vec![0.0; count];
    // SAFETY: an open simulation, and arrays of its sizes.
    unsafe { assert_eq!(vpm_parameters(axis.0, parameters.as_mut_ptr()), VpmStatus::VpmOk) };
    let (mut light, mut heavy) = ([0.0; 6], [0.0; 6]);
    axis.step(1.0, &mut light);
    parameters[mass] *= 2.0;
    // SAFETY: an open simulation, and arrays of its sizes.
    unsafe { assert_eq!(vpm_set_parameters(axis.0, parameters.as_ptr()), VpmStatus::VpmOk) };
    axis.step(1.0, &mut heavy);
    assert!(heavy[1].abs() < light[1].abs());
    parameters[mass] = -1.0;
    // SAFETY: an open simulation, and arrays of its sizes.
    unsafe { assert_eq!(vpm_set_parameters(axis.0, parameters.as_ptr()), VpmStatus::VpmInvalid) };
    assert!(axis.message().contains("mass"), "{}", axis.message());
    // The machine is as it was.
    let mut after = [0.0; 6];
    assert_eq!(axis.step(1.0, &mut after), VpmStatus::VpmOk);
}

#[test]
fn wrong_arguments_are_refused_and_change_nothing() {
    let axis = Axis::open();
    let mut outputs = [7.0; 6];
    assert_eq!(axis.step(f64::NAN, &mut outputs), VpmStatus::VpmInvalid);
    assert_eq!(
        (axis.message().as_str(), outputs),
        ("`drive` must be a finite number, got NaN; check the value and its unit", [7.0; 6])
    );
    // SAFETY: null is what the functions have to stand.
    unsafe {
        assert_eq!(vpm_step(axis.0, ptr::null(), outputs.as_mut_ptr()), VpmStatus::VpmInvalid);
        assert_eq!(vpm_step(ptr::null_mut(), ptr::null(), ptr::null_mut()), VpmStatus::VpmInvalid);
        assert_eq!(vpm_state(axis.0, ptr::null_mut()), VpmStatus::VpmInvalid);
        assert_eq!(vpm_reset(axis.0, [f64::NAN, 0.0].as_ptr()), VpmStatus::VpmInvalid);
        assert!(vpm_time(ptr::null()).is_nan() && !vpm_message(ptr::null()).is_null());
        assert_eq!(vpm_time(axis.0), 0.0);
        vpm_close(ptr::null_mut());
    }
}

#[test]
fn a_motion_that_diverges_is_told_and_can_begin_again() {
    let axis = Axis::open();
    let mut outputs = [0.0; 6];
    let end = (0..100).map(|_| axis.step(1e13, &mut outputs)).find(|&status| status != VpmStatus::VpmOk);
    assert_eq!(end, Some(VpmStatus::VpmDiverged), "{}", axis.message());
    assert!(axis.message().contains("at which its body is as fast as light"), "{}", axis.message());
    // What is shown is the sample before, and stays so.
    assert_eq!(axis.step(0.0, &mut outputs), VpmStatus::VpmDiverged);
    let (mut state, mut seen) = ([f64::NAN; 2], [f64::NAN; 6]);
    // SAFETY: an open simulation, and arrays of its sizes.
    unsafe {
        assert_eq!(vpm_state(axis.0, state.as_mut_ptr()), VpmStatus::VpmOk);
        assert_eq!(vpm_outputs(axis.0, seen.as_mut_ptr()), VpmStatus::VpmOk);
    }
    assert!(state.iter().all(|number| number.abs() < 3e8), "{state:?}");
    assert!(seen.iter().all(|number| number.is_finite()), "{seen:?}");
    // SAFETY: as before.
    unsafe { assert_eq!(vpm_reset(axis.0, ptr::null()), VpmStatus::VpmOk) };
    assert_eq!(axis.step(0.1, &mut outputs), VpmStatus::VpmOk);
}

#[test]
fn files_that_cannot_be_used_are_refused_with_a_sentence() {
    let cases = [
        ("{", "the compiled model cannot be read"),
        (r#"{"format": 99}"#, "it has format 99, and this library reads format 1"),
        (&AXIS.replace("\"axis.velocity\"\n", "\"axis.velocity\", \"x\"\n"), "its list `states` has 3 entries"),
        (&AXIS.replace("linearly_implicit", "magic"), "magic"),
    ];
    for (content, expected) in cases {
        let content = CString::new(content).unwrap();
        let mut message = [1 as c_char; 300];
        // SAFETY: a text, and room for the message.
        let opened = unsafe { vpm_open_text(content.as_ptr(), message.as_mut_ptr(), message.len()) };
        assert!(opened.is_null());
        let message = text(message.as_ptr());
        assert!(message.contains(expected), "{message}");
    }
    // SAFETY: null, and room that is too short for the sentence.
    let mut short = [1 as c_char; 10];
    // SAFETY: a text or null, and room as long as it is told.
    assert!(unsafe { vpm_open(ptr::null(), short.as_mut_ptr(), short.len()) }.is_null());
    assert_eq!(text(short.as_ptr()), "the path ");
    // SAFETY: a text or null, and room as long as it is told.
    assert!(unsafe { vpm_open(c"nowhere.json".as_ptr(), ptr::null_mut(), 0) }.is_null());
}
