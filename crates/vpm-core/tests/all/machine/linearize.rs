//! Exact linear models against closed forms and against difference quotients of the machine itself.

use serde_json::json;
use vpm_core::description::Description;
use vpm_core::linearize::{Linearization, linearize};
use vpm_core::ode::Ode;
use vpm_core::samples::{arm7, double_pendulum, pendulum};

use crate::common::{Machine, close};

fn at(description: &Description, state: &[f64], inputs: &[f64]) -> Linearization {
    linearize(description, &description.parameters, state, inputs).unwrap()
}

#[test]
fn a_pendulum_with_lag_is_the_textbooks() {
    // I dw/dt = -m g l sin(q) - c w + k s, T ds/dt = u - s, with m = 1.5, l = 0.8, hanging at q = 0.
    let mut machine = Machine::new(&pendulum(1.5, 0.8));
    machine
        .effect("viscous_friction", 0, &[("viscous", 0.3)])
        .actuator(0, &[("gain", 2.0), ("lag", 0.05), ("delay", 0.02)])
        .sensor(json!({"kind": "position", "joint": 0}), &[("gain", 1.1), ("offset", 0.4), ("delay", 0.013)]);
    let (inertia, gravity, q) = (1.5 * 0.8 * 0.8, 9.806_65, 0.3_f64);
    let linear = at(&machine.build(), &[q, 0.0, 0.5], &[0.5]);
    let stiffness = 1.5 * gravity * 0.8 * q.cos();
    let state = [0.0, 1.0, 0.0, -stiffness / inertia, -0.3 / inertia, 2.0 / inertia, 0.0, 0.0, -20.0];
    linear.state.iter().zip(state).for_each(|(&found, expected)| close(found, expected, 1e-9));
    linear.input.iter().zip([0.0, 0.0, 20.0]).for_each(|(&found, expected)| close(found, expected, 1e-12));
    // Rows: position with the sensor's gain, velocity, acceleration, effort, command, force.
    let output =
        [1.1, 0.0, 0.0, 0.0, 1.0, 0.0, state[3], state[4], state[5], 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0];
    linear.output.iter().zip(output).for_each(|(&found, expected)| close(found, expected, 1e-9));
    assert_eq!(linear.feedthrough, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    close(linear.reading[0], 1.1 * q + 0.4, 1e-12);
    close(linear.rate[1], (1.0 - 1.5 * gravity * 0.8 * q.sin()) / inertia, 1e-9);
}

#[test]
fn dead_zones_and_saturations_have_their_slope_at_the_command() {
    let mut machine = Machine::new(&pendulum(1.0, 1.0));
    machine.actuator(0, &[("gain", 3.0), ("dead_zone", 0.1), ("saturation", 1.0)]);
    let description = machine.build();
    for (command, slope) in [(0.05, 0.0), (0.5, 3.0), (5.0, 0.0), (-0.5, 3.0)] {
        let linear = at(&description, &[0.0, 0.0], &[command]);
        close(linear.input[1], slope, 1e-12);
        close(linear.feedthrough[5], slope, 1e-12);
    }
}

#[test]
fn arms_agree_with_difference_quotients() {
    for sample in [double_pendulum([1.0, 0.7], [0.5, 0.4]), arm7()] {
        let mut machine = Machine::new(&sample);
        machine
            .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
            .effect("spring", 1, &[("stiffness", 2.0), ("rest", 0.3)])
            .actuator(0, &[("gain", 1.5), ("lag", 0.06)])
            .actuator(1, &[("gain", 0.7)]);
        let description = machine.build();
        let n = description.n_states();
        let state: Vec<f64> = (0..n).map(|k| 0.4 * (1.3 * k as f64 + 0.2).sin()).collect();
        let inputs = [0.3, -0.2];
        let linear = at(&description, &state, &inputs);
        let mut system = machine.system();
        let mut rates = |state: &[f64], inputs: &[f64]| {
            inputs.iter().enumerate().for_each(|(actuator, &input)| system.hold(actuator, input));
            let mut rate = vec![0.0; n];
            system.rhs(state, &mut rate);
            rate
        };
        let step = 1e-6;
        for column in 0..n + 2 {
            let mut moved = |sign: f64| {
                let (mut state, mut inputs) = (state.clone(), inputs);
                *state.iter_mut().chain(&mut inputs).nth(column).unwrap() += sign * step;
                rates(&state, &inputs)
            };
            let (plus, minus) = (moved(1.0), moved(-1.0));
            for row in 0..n {
                let quotient = (plus[row] - minus[row]) / (2.0 * step);
                let exact =
                    if column < n { linear.state[row * n + column] } else { linear.input[row * 2 + column - n] };
                close(exact, quotient, 1e-6 * (1.0 + exact.abs()));
            }
        }
    }
}

#[test]
fn nonsense_is_refused_in_one_sentence() {
    let mut machine = Machine::new(&pendulum(1.0, 1.0));
    machine.actuator(0, &[("gain", 1.0)]);
    let description = machine.build();
    let refused = |state: &[f64], inputs: &[f64]| {
        linearize(&description, &description.parameters, state, inputs).unwrap_err().to_string()
    };
    assert!(refused(&[0.0], &[0.0]).contains("state must have 2 entries, got 1"));
    assert!(refused(&[0.0, f64::NAN], &[0.0]).contains("state[1]"));
    assert!(refused(&[0.0, 0.0], &[]).contains("inputs must have 1 entries, got 0"));
}
