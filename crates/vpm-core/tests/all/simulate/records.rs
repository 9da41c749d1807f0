//! Whole-record simulation: restarts are pieces of a free run, loops close, energy balances, nonsense is refused in one sentence.

use serde_json::json;
use vpm_core::description::Description;
use vpm_core::error::Error;
use vpm_core::evaluate;
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::samples::{Random, arm7, double_pendulum, pendulum, slider};
use vpm_core::simulate::{Setting, Stepping, free_run};
use vpm_core::table::Table;
use vpm_core::timing::Course;

use crate::common::{ALWAYS, Bench, Machine, close};

/// A positioning axis: friction, delay, a cascade.
fn axis() -> Machine {
    let mut machine = Machine::new(&slider(95.0));
    machine
        .effect("viscous_friction", 0, &[("viscous", 200.0)])
        .effect("coulomb_friction", 0, &[("coulomb", 20.0), ("transition_velocity", 1e-3)])
        .actuator(0, &[("gain", 35.0), ("delay", 1e-3)])
        .controller("cascade", 0, 0, &[("position_gain", 160.0), ("velocity_gain", 243.0), ("limit", 10.0)]);
    machine
}

#[test]
fn restarts_are_pieces_of_the_free_run() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine.actuator(0, &[("gain", 1.5), ("delay", 0.025), ("lag", 0.05)]);
    let bench = Bench::new(&machine, 0.01, 3, Method::Rk4);
    let inputs: Vec<f64> = (0..50).map(|k| (0.3 * f64::from(k)).sin()).collect();
    let full = bench.free(&[0.1, 0.2, 0.0, 0.0, 0.0], &inputs);
    let (starts, horizon, width) = ([0, 13, 38], 12, bench.description.n_outputs());
    let states: Vec<f64> = starts.iter().flat_map(|&start| full.states[5 * start..5 * (start + 1)].to_vec()).collect();
    let pieces = bench.restart(&states, &starts, horizon, &inputs);
    for (number, &start) in starts.iter().enumerate() {
        let piece = &pieces.outputs[number * horizon * width..(number + 1) * horizon * width];
        assert_eq!(piece, &full.outputs[start * width..(start + horizon) * width]);
    }
}

#[test]
fn cascade_follows_a_ramp_behind_by_its_velocity_error() {
    // Steady state: u = Fv v/g + Fc/g and e = (v + u/kv)/kp.
    let bench = Bench::new(&axis(), 1e-3, 2, Method::LinearlyImplicit);
    let reference: Vec<f64> = (0..3000).map(|k| 0.05 * 1e-3 * f64::from(k)).collect();
    let run = bench.closed(&[0.0, 0.0], &reference, &[0.0; 3000]);
    let (position, command) = (bench.channel(&run, 0)[2999], bench.channel(&run, 4)[2999]);
    let steady = (200.0 * 0.05 + 20.0) / 35.0;
    close(command, steady, 1e-6);
    close(reference[2999] - position, (0.05 + steady / 243.0) / 160.0, 1e-8);
}

#[test]
fn disturbance_passes_the_limit_of_the_controller() {
    let bench = Bench::new(&axis(), 1e-3, 1, Method::Rk4);
    let run = bench.closed(&[0.0, 0.0], &[5.0; 20], &[3.0; 20]);
    assert_eq!(bench.channel(&run, 4), [13.0; 20]);
}

#[test]
fn closed_loop_commands_reproduce_the_run_as_free_run() {
    let bench = Bench::new(&axis(), 1e-3, 1, Method::LinearlyImplicit);
    let reference: Vec<f64> = (0..500).map(|k| 0.01 * (0.02 * f64::from(k)).sin()).collect();
    let closed = bench.closed(&[0.0, 0.0], &reference, &[0.0; 500]);
    let free = bench.free(&[0.0, 0.0], &bench.channel(&closed, 4));
    assert_eq!(free, closed);
}

#[test]
fn energy_changes_by_the_work_of_efforts_and_frictions() {
    let mut machine = Machine::new(&arm7());
    for joint in 0..7 {
        machine.effect("viscous_friction", joint, &[("viscous", 0.2)]);
        machine.effect("spring", joint, &[("stiffness", 3.0), ("rest", 0.1)]);
    }
    machine.effect("torque_ripple", 2, &[("period", 0.5), ("cosine", 0.3), ("sine", 0.2)]);
    machine.effect("bias_force", 3, &[("force", 0.4)]);
    machine.effect("coulomb_friction", 1, &[("coulomb", 0.5), ("transition_velocity", 0.2)]);
    machine.payload(6, 0.5, [0.0, 0.02, 0.1]).actuator(1, &[("gain", 2.0)]);
    let (bench, step) = (Bench::new(&machine, 2.5e-4, 1, Method::Rk4), 2.5e-4);
    let mut random = Random::new(1);
    let initial = random.numbers(14, 0.6);
    let run = bench.free(&initial, &[7.5; 2001]);
    let power = |k: usize| -> f64 {
        let v = &run.states[14 * k + 7..14 * (k + 1)];
        let friction: f64 = v.iter().map(|v| -0.2 * v * v).sum();
        15.0 * v[1] + friction - 0.5 * (v[1] / 0.2).tanh() * v[1]
    };
    // Simpson's rule over the record.
    let work: f64 = (0..2000).step_by(2).map(|k| step / 3.0 * (power(k) + 4.0 * power(k + 1) + power(k + 2))).sum();
    let energy = |k: usize| {
        let (q, v) = run.states[14 * k..14 * (k + 1)].split_at(7);
        let (kinetic, potential) = evaluate::energy(&bench.description, &bench.theta, q, v).unwrap();
        kinetic + potential
    };
    close(energy(2000) - energy(0), work, 1e-8);
    assert!(work.abs() > 0.1, "nothing to balance: {work} J");
}

#[test]
fn inverse_dynamics_recovers_the_effort_that_was_applied() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.1)])
        .effect("spring", 1, &[("stiffness", 2.0), ("rest", 0.3)])
        .payload(1, 0.3, [0.02, 0.05, -0.3])
        .actuator(0, &[("gain", 1.5), ("lag", 0.05)])
        .actuator(1, &[("gain", 0.5), ("dead_zone", 0.2)]);
    let bench = Bench::new(&machine, 1e-3, 1, Method::Rk4);
    let inputs: Vec<f64> = (0..800).flat_map(|k| [(0.01 * f64::from(k)).sin(), (0.02 * f64::from(k)).cos()]).collect();
    let run = bench.free(&[0.1, 0.2, 0.0, 0.0, inputs[0]], &inputs);
    let columns = |first: usize| -> Vec<f64> {
        (0..800).flat_map(|k| [run.outputs[12 * k + first], run.outputs[12 * k + 4 + first]]).collect()
    };
    let [q, v, a, effort] = [0, 1, 2, 3].map(columns);
    let table = |numbers| Table::new("motion", numbers, 800, 2).unwrap();
    let motion = Motion {
        position: table(&q),
        velocity: table(&v),
        acceleration: table(&a),
        inputs: table(&inputs),
        time_step: 1e-3,
    };
    let efforts = inverse_dynamics(&bench.description, &bench.theta, motion, &[], ALWAYS).unwrap();
    // What the motion needs is what acted at that very instant; what is applied is its mean over the two intervals around.
    for (required, acted) in efforts.required.iter().zip(&effort) {
        close(*required, *acted, 1e-11);
    }
    for (applied, acted) in efforts.applied.iter().zip(&effort).skip(2) {
        close(*applied, *acted, 0.03);
    }
    // With the lag the state at the sample is the mean of the neighbouring intervals' means up to second order of the step.
    let error = (1..800).map(|k| (efforts.applied[2 * k] - effort[2 * k]).abs()).fold(0.0, f64::max);
    assert!(error < 2e-4, "{error}");
}

#[test]
fn position_sensor_is_undone_before_the_inverse_dynamics() {
    // A slider in even motion seen through gain, offset and delay by an exact sensor: no effort but its friction.
    let mut machine = Machine::new(&slider(3.0));
    machine
        .effect("viscous_friction", 0, &[("viscous", 2.0)])
        .effect("spring", 0, &[("stiffness", 10.0), ("rest", 0.0)])
        .actuator(0, &[("gain", 1.0)])
        .sensor(json!({"kind": "position", "joint": 0}), &[("gain", 1.2), ("offset", 0.3), ("delay", 0.015)]);
    let description = machine.build();
    let (rows, speed) = (50, 0.7);
    let time = |k: usize| 0.01 * k as f64;
    let seen: Vec<f64> = (0..rows).map(|k| 1.2 * speed * (time(k) - 0.015) + 0.3).collect();
    let (rate, still) = (vec![1.2 * speed; rows], vec![0.0; rows]);
    let table = |numbers| Table::new("motion", numbers, rows, 1).unwrap();
    let motion = Motion {
        position: table(&seen),
        velocity: table(&rate),
        acceleration: table(&still),
        inputs: table(&still),
        time_step: 0.01,
    };
    let efforts = inverse_dynamics(&description, &machine.values, motion, &[], ALWAYS).unwrap();
    for k in 0..rows - 2 {
        close(efforts.required[k], 2.0 * speed + 10.0 * speed * time(k), 1e-12);
    }
    // At the end the record holds.
    close(efforts.required[rows - 1], 2.0 * speed + 10.0 * (seen[rows - 1] - 0.3) / 1.2, 1e-12);
}

#[test]
fn interrupt_stops_a_run() {
    let bench = Bench::new(&axis(), 1e-3, 100, Method::Rk4);
    let inputs = [0.0; 100];
    let setting = Setting { interrupt: &|| true, ..bench.setting() };
    let run = free_run(setting, &[0.0, 0.0], Table::new("inputs", &inputs, 100, 1).unwrap());
    assert_eq!(run, Err(Error::Interrupted));
}

#[test]
fn steps_are_timed_one_by_one() {
    let bench = Bench::new(&axis(), 1e-3, 1, Method::LinearlyImplicit);
    let inputs = [0.1; 10];
    let table = Table::new("inputs", &inputs, 10, 1).unwrap();
    let mut durations = [-1.0; 37];
    Course::new(bench.setting(), &[0.0, 0.0], table).unwrap().time(&mut durations).unwrap();
    assert!(durations.iter().all(|&duration| duration >= 0.0) && durations.iter().sum::<f64>() > 0.0);
}

#[test]
fn values_without_meaning_are_refused_by_name() {
    let mut machine = axis();
    machine.effect("torque_ripple", 0, &[("period", 0.1), ("cosine", 1.0), ("sine", 0.0)]);
    machine.actuator(0, &[("gain", 1.0), ("dead_zone", 0.1), ("saturation", 1.0), ("lag", 0.1)]);
    machine.sensor(json!({"kind": "position", "joint": 0}), &[("gain", 1.0), ("delay", 0.1)]);
    let description = machine.build();
    for (name, value) in [
        ("coulomb_friction.transition_velocity", 0.0),
        ("coulomb_friction.transition_velocity", -1.0),
        ("torque_ripple.period", 0.0),
        ("drive0.dead_zone", -0.1),
        ("drive0.saturation", 0.0),
        ("drive0.lag", 0.0),
        ("drive0.delay", -1e-3),
        ("sensor0.gain", 0.0),
        ("sensor0.delay", -1.0),
        ("servo0.limit", 0.0),
        ("viscous_friction.viscous", f64::NAN),
        ("carriage.0", -1.0),
    ] {
        let mut theta = machine.values.clone();
        theta[machine.index(name)] = value;
        let refused = description.check_values(&theta).unwrap_err().to_string();
        let subject = if name == "carriage.0" { "carriage.mass" } else { name };
        assert!(refused.contains(&format!("`{subject}`")) && refused.contains("must"), "{name}: {refused}");
    }
    assert!(description.check_values(&machine.values).is_ok());
}

#[test]
fn settings_and_shapes_out_of_range_are_refused() {
    let refused = |error: Error| error.to_string();
    assert!(refused(Stepping::new(0.0, 1, Method::Rk4).unwrap_err()).contains("time_step"));
    assert!(refused(Stepping::new(f64::NAN, 1, Method::Rk4).unwrap_err()).contains("time_step"));
    assert!(refused(Stepping::new(1e-3, 0, Method::Rk4).unwrap_err()).contains("substeps"));
    for name in ["euler", "adaptive(x)", "adaptive(1e-6", "adaptive()", "rk4(1e-6)"] {
        assert!(refused(Method::from_name(name).unwrap_err()).contains(&format!("no integrator `{name}`; use semi")));
    }
    for name in ["adaptive(0)", "adaptive(-1e-6)", "adaptive(nan)", "adaptive(1)", "adaptive(1e-13)"] {
        assert!(refused(Method::from_name(name).unwrap_err()).contains("tolerance of adaptive must lie between 1e-12"));
    }
    assert!(Stepping::new(1e-3, 1, Method::Adaptive { tolerance: 0.0 }).is_err());
    let bench = Bench::new(&axis(), 1e-3, 1, Method::Rk4);
    assert!(
        refused(bench.try_free(&[0.0], &[0.0; 5]).unwrap_err()).contains("initial_state must have 2 entries, got 1")
    );
    assert!(refused(bench.try_free(&[0.0, f64::NAN], &[0.0; 5]).unwrap_err()).contains("initial_state[1]"));
    assert!(refused(Table::new("inputs", &[0.0, f64::INFINITY], 2, 1).unwrap_err()).contains("inputs[1, 0]"));
    assert!(refused(Table::new("inputs", &[0.0; 5], 2, 3).unwrap_err()).contains("inputs must have 6 entries, got 5"));
    let short = Bench { theta: vec![1.0], ..Bench::new(&axis(), 1e-3, 1, Method::Rk4) };
    assert!(refused(short.try_free(&[0.0, 0.0], &[0.0; 5]).unwrap_err()).contains("theta"));
    let open = Bench::new(Machine::new(&pendulum(1.0, 1.0)).actuator(0, &[("gain", 1.0)]), 1e-3, 1, Method::Rk4);
    let none = Table::new("references", &[0.0; 5], 5, 1).unwrap();
    let loose = vpm_core::simulate::closed_loop(open.setting(), &[0.0, 0.0], none, none);
    assert!(refused(loose.unwrap_err()).contains("has no controller, so no loop is closed"));
}

#[test]
fn descriptions_that_cannot_be_right_are_refused() {
    let good: serde_json::Value = serde_json::from_str(&axis().json()).unwrap();
    let change = |pointer: &str, value: serde_json::Value| {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = value;
        Description::from_json(&bad.to_string()).unwrap_err().to_string()
    };
    assert!(change("/effects/0/type", json!("viscus_friction")).contains("viscus_friction"));
    assert!(change("/effects/0", json!({"type": "viscous_friction", "joint": 0, "viscos": 1})).contains("viscos"));
    assert!(change("/effects/0/joint", json!(4)).contains("effect number 0 refers to joint number 4"));
    assert!(change("/effects/0/viscous", json!(99)).contains("parameter number 99"));
    assert!(change("/actuators/0/on", json!({"joint": 1})).contains("actuator `drive0` refers to joint number 1"));
    assert!(change("/controllers/0/actuator", json!(1)).contains("actuator number 1"));
    assert!(change("/controllers/0/measures", json!({"kind": "velocity", "joint": 0})).contains("measures a position"));
    assert!(change("/bodies/0/on", json!({"body": 0})).contains("ring"));
    assert!(change("/bodies", json!([])).contains("no body"));
    assert!(change("/parameter_names", json!([])).contains("parameter_names"));
    assert!(change("/gravity", json!([0.0, 0.0])).contains("model description"));
    assert!(Description::from_json("{").unwrap_err().to_string().contains("line 1"));
}
