//! Computed torque: the linear dynamics of its error on trees, and what it does with joints that it does not command.

use serde_json::json;
use vpm_core::samples::random_tree;

use crate::common::parts::{Parts, position};
use crate::common::{Machine, close};

/// Three joints in a random tree with effects and a payload, driven with gains 2, 3, 4, all by one controller.
fn tree(seed: u64) -> Parts {
    let mut machine = Machine::new(&random_tree(seed, 3));
    machine.effect("viscous_friction", 0, &[("viscous", 0.3)]).effect(
        "spring",
        1,
        &[("stiffness", 2.0), ("rest", 0.3)],
    );
    machine.payload(2, 0.3, [0.02, 0.05, -0.3]);
    for joint in 0..3 {
        machine.actuator(joint, &[("gain", 2.0 + joint as f64)]);
    }
    let all = json!({"type": "computed_torque", "name": "all", "actuators": [2, 0, 1],
        "measures": [position(2), position(0), position(1)]});
    let mut parts = Parts::of(&machine);
    parts.add("controllers", all, &[("proportional", &[100.0, 100.0, 64.0]), ("derivative", &[20.0, 20.0, 16.0])]);
    parts
}

/// Largest gap between the error of each joint and the linear dynamics `e'' + D e' + P e = 0`, over one second, in steps of `h`.
fn gap_to_linear(seed: u64, h: f64) -> f64 {
    let bench = tree(seed).bench(h, 1);
    let rows = (1.0 / h).round() as usize;
    let reference = |t: f64, i: usize| 0.5 * ((1.0 + i as f64) * t + 0.3 * i as f64).sin();
    let rate = |t: f64, i: usize| 0.5 * (1.0 + i as f64) * ((1.0 + i as f64) * t + 0.3 * i as f64).cos();
    let references: Vec<f64> = (0..rows * 3).map(|place| reference(h * (place / 3) as f64, place % 3)).collect();
    // An error of 0.1 m or rad at rest relative to the reference; both poles of each joint in -sqrt(P).
    let initial: Vec<f64> = (0..3).map(|i| reference(0.0, i) - 0.1).chain((0..3).map(|i| rate(0.0, i))).collect();
    let run = bench.closed(&initial, &references, &vec![0.0; rows * 3]);
    let mut worst = 0.0_f64;
    for k in 0..rows {
        for i in 0..3 {
            let (t, pole) = (h * k as f64, [10.0, 8.0, 10.0][i]);
            let exact = 0.1 * (1.0 + pole * t) * (-pole * t).exp();
            worst = worst.max((references[3 * k + i] - run.states[6 * k + i] - exact).abs());
        }
    }
    worst
}

#[test]
fn under_computed_torque_the_error_obeys_its_linear_dynamics() {
    for seed in [3, 8, 21] {
        let gaps = [4e-3, 2e-3, 1e-3, 5e-4].map(|h| gap_to_linear(seed, h));
        println!("tree {seed}: {gaps:?} m or rad at 4, 2, 1, 0.5 ms");
        // The held torque and the differences of the reference are late by a share of a sample: first order.
        for pair in gaps.windows(2) {
            assert!((pair[0] / pair[1] - 2.0).abs() < 0.25, "tree {seed}: {gaps:?}");
        }
        assert!(gaps[3] < 1.5e-3, "tree {seed}: {gaps:?}");
    }
}

#[test]
fn joints_without_command_count_as_not_accelerating() {
    // Without the second joint's actuator, which makes the third one number 1.
    let mut parts = tree(5);
    parts.0["actuators"].as_array_mut().unwrap().remove(1);
    let all = &mut parts.0["controllers"][0];
    all["actuators"] = json!([1, 0]);
    all["measures"] = json!([position(2), position(0)]);
    for gains in ["proportional", "derivative"] {
        all[gains].as_array_mut().unwrap().pop();
    }
    let bench = parts.bench(1e-3, 1);
    let state = [0.2, -0.4, 0.6, 0.5, 1.0, -0.7];
    let references = [0.3, 0.9];
    let run = bench.closed(&state, &references, &[0.0; 2]);
    let mut system = bench.description.system(&bench.theta).unwrap();
    let (mut efforts, [q, v]) = ([0.0; 3], [&state[..3], &state[3..]]);
    let wanted = |r: f64, joint: usize| 100.0 * (r - q[joint]) - 20.0 * v[joint];
    system.dynamics().inverse_dynamics(q, v, &[wanted(0.3, 0), 0.0, wanted(0.9, 2)], &mut efforts);
    close(run.outputs[12 + 1], efforts[0], 1e-9);
    close(run.outputs[12 + 3], efforts[2], 1e-9);
    close(run.outputs[12], efforts[0] / 2.0, 1e-9);
}

#[test]
fn forces_of_contacts_are_unknown_to_computed_torque() {
    let command = |touching: bool| {
        let mut parts = tree(5);
        if touching {
            let numbers = [("stiffness", 1e5), ("exponent", 1.1), ("damping", 100.0), ("damping_depth", 1e-3)];
            let normal: serde_json::Map<_, _> =
                numbers.into_iter().map(|(key, value)| (key.to_owned(), json!(parts.number(key, value)))).collect();
            let contact = json!({"name": "foot", "on": {"body": 2}, "point": [0.1, 0.2, 0.3],
                "plane": {"point": [0.0, 0.0, 5.0], "normal": [0.0, 0.0, 1.0]}, "normal": normal, "friction": null});
            parts.add("contacts", contact, &[]);
        }
        let bench = parts.bench(1e-3, 1);
        let run = bench.closed(&[0.2, -0.4, 0.6, 0.5, 1.0, -0.7], &[0.3, 0.1, 0.9], &[0.0; 3]);
        // Commands of the three actuators, and an acceleration, which the contact does change.
        [12, 14, 16, 2].map(|column| run.outputs[column])
    };
    let (free, touching) = (command(false), command(true));
    assert_eq!(free[..3], touching[..3]);
    assert!((free[3] - touching[3]).abs() > 1.0);
}

#[test]
fn the_rates_of_a_reference_need_samples_behind_it() {
    let mut differences = vpm_core::controller::Differences::default();
    let parabola = |k: usize| 2.0 + 3.0 * k as f64 + 0.5 * (k * k) as f64;
    for k in 0..6_usize {
        let [r, dr, ddr] = differences.next(parabola(k), 0.1);
        close(r, parabola(k), 0.0);
        close(dr, if k > 0 { (3.0 + k as f64 - 0.5) / 0.1 } else { 0.0 }, 1e-11);
        close(ddr, if k > 1 { 1.0 / 0.01 } else { 0.0 }, 1e-9);
    }
}

#[test]
fn computed_torque_needs_every_coordinate_to_be_measured() {
    let mut parts = tree(5);
    let (young, poisson, density) = (parts.number("e", 2e9), parts.number("n", 0.3), parts.number("d", 1500.0));
    let (width, height) = (parts.number("w", 0.03), parts.number("h", 0.01));
    let beam = json!({"name": "whip", "on": {"body": 2}, "translation": [0.0, 0.0, 0.0],
        "rotation": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], "length": 0.5, "level": {"strain": 2}, "deforms": ["bending_x"],
        "material": {"young": young, "poisson": poisson, "density": density},
        "sections": [{"at": 0.0, "shape": {"shape": "rectangle", "width": width, "height": height}}],
        "damping": {"stiffness": null, "mass": null, "ratios": []}});
    parts.add("beams", beam, &[]);
    let error = parts.try_build().unwrap_err().to_string();
    assert!(error.contains("controller `all` inverts the model") && error.contains("beam `whip`"), "{error}");
    parts.0["beams"][0]["level"] = json!("rigid");
    assert!(parts.try_build().is_ok());
}
