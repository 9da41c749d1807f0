//! A simulation driven from outside is the free run on the same commands, remembers its delays, and allocates nothing.

use std::sync::Arc;

use allocation_counter::measure;
use serde_json::json;
use vpm_core::error::Error;
use vpm_core::integrator::Method;
use vpm_core::live::Live;
use vpm_core::samples::{double_pendulum, pendulum};
use vpm_core::simulate::Stepping;

use crate::common::{Bench, Machine};

fn machine() -> Machine {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .actuator(0, &[("gain", 1.5), ("delay", 0.0237), ("dead_zone", 0.1), ("saturation", 1.9), ("lag", 0.06)])
        .actuator(1, &[("gain", 1.5)])
        .sensor(json!({"kind": "position", "joint": 0}), &[("gain", 1.1), ("delay", 0.0172)]);
    machine
}

const START: [f64; 5] = [0.4, -0.3, 0.5, 0.2, 0.7];

fn live(machine: &Machine, method: Method) -> Live {
    let description = machine.build();
    let theta = description.parameters.clone();
    Live::new(Arc::new(description), &theta, &START, Stepping::new(0.01, 2, method).unwrap()).unwrap()
}

#[test]
fn steps_are_those_of_a_free_run() {
    let inputs: Vec<f64> = (0..2 * 300).map(|k| (0.37 * f64::from(k)).sin()).collect();
    for method in Method::ALL {
        let bench = Bench::new(&machine(), 0.01, 2, method);
        let run = bench.free(&START, &inputs);
        let mut live = live(&machine(), method);
        // A second pass after a reset begins from nothing again.
        for _ in 0..2 {
            for (k, row) in inputs.chunks_exact(2).enumerate().take(299) {
                assert_eq!(live.state(), &run.states[5 * k..5 * (k + 1)], "{} at {k}", method.name());
                let outputs = &run.outputs[12 * k..12 * (k + 1)];
                // Positions and velocities; accelerations and efforts belong to the command before the sample.
                for column in [0, 1, 4, 5] {
                    assert_eq!(live.outputs()[column].to_bits(), outputs[column].to_bits(), "{} at {k}", method.name());
                }
                live.step(row).unwrap();
            }
            assert!((live.time() - 2.99).abs() < 1e-12);
            live.reset(&START).unwrap();
        }
    }
}

#[test]
fn steps_allocate_nothing() {
    let mut live = live(&machine(), Method::LinearlyImplicit);
    let counted = measure(|| {
        for _ in 0..100 {
            live.step(&[0.3, -0.2]).unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn what_cannot_be_is_refused_and_leaves_the_simulation_as_it_was() {
    let mut live = live(&machine(), Method::Rk4);
    let before = live.state().to_vec();
    assert!(live.step(&[0.0]).unwrap_err().to_string().contains("inputs must have 2 entries, got 1"));
    assert!(live.step(&[0.0, f64::INFINITY]).unwrap_err().to_string().contains("inputs[1]"));
    assert!(live.reset(&[0.0; 3]).unwrap_err().to_string().contains("state must have 5 entries, got 3"));
    assert_eq!(live.state(), before);
}

#[test]
fn a_diverged_simulation_says_so_and_starts_again_after_a_reset() {
    let mut machine = Machine::new(&pendulum(1.0, 1.0));
    machine.effect("viscous_friction", 0, &[("viscous", 1e6)]).actuator(0, &[("gain", 1.0)]);
    let description = machine.build();
    let theta = description.parameters.clone();
    let stepping = Stepping::new(0.01, 1, Method::Rk4).unwrap();
    let mut live = Live::new(Arc::new(description), &theta, &[0.1, 0.0], stepping).unwrap();
    // Every sample before is one that the machine could be at: its rate below c / r, r = 1 m.
    let (mut before, mut error) = (live.state().to_vec(), None);
    for _ in 0..1000 {
        error = live.step(&[0.0]).err();
        if error.is_some() {
            break;
        }
        before = live.state().to_vec();
        assert!(before[1].abs() < 3e8, "{before:?}");
    }
    let Some(Error::Diverged(lost)) = error else { panic!("{error:?}") };
    let sentence = lost.to_string();
    for words in
        ["the velocity of joint", "beyond 2.9979e8, at which its body is as fast as light", "more substeps", "units"]
    {
        assert!(sentence.contains(words), "{sentence}");
    }
    // What went astray is not shown, and it does not come back by itself.
    let time = live.time();
    assert_eq!(lost.time, time + 0.01);
    assert_eq!(live.step(&[0.0]).unwrap_err(), Error::Diverged(lost));
    assert_eq!((live.state(), live.time()), (&*before, time));
    assert!(live.outputs().iter().all(|output| output.is_finite()));
    assert!(live.reset(&[1e300, 0.0]).unwrap_err().to_string().contains("beyond 4.5036e13, where rounding hides"));
    live.reset(&[0.0, 0.0]).unwrap();
    assert!(live.step(&[0.0]).is_ok());
}
