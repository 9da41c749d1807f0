//! All controllers in one machine: exact derivatives through the loop, no allocation, and what is said of impossible ones.

use allocation_counter::measure;
use serde_json::{Value, json};
use vpm_core::samples::random_tree;

use crate::common::parts::{Parts, controller, position};
use crate::common::{Bench, Machine};

/// A tree whose first two joints are under computed torque, the third under pd, and a line to its last body under a force loop; with
/// limits, sensors, delays and slower samples.
fn everything() -> Parts {
    let mut machine = Machine::new(&random_tree(11, 3));
    machine.effect("viscous_friction", 0, &[("viscous", 0.3)]).payload(2, 0.3, [0.02, 0.05, -0.3]);
    for joint in 0..3 {
        machine.actuator(joint, &[("gain", 2.0 + joint as f64), ("delay", 0.0043)]);
    }
    machine.sensor(position(0), &[("gain", 1.1), ("offset", 0.03), ("delay", 0.0172)]);
    machine.sensor(json!({"kind": "velocity", "joint": 2}), &[("gain", 0.9), ("offset", 0.02), ("delay", 0.006)]);
    machine.sensor(json!({"kind": "force", "actuator": 3}), &[("gain", 0.8)]);
    let mut parts = Parts::of(&machine);
    parts.drive_line(2, [0.8, 0.9, 0.7], [0.1, 0.0, 0.1], 1.5, Some(0.03));
    let two = json!({"type": "computed_torque", "name": "two", "actuators": [0, 1], "measures": [position(0), position(1)],
        "sample_time": 0.02, "delay": 0.015});
    parts.add(
        "controllers",
        two,
        &[("proportional", &[9.0, 16.0]), ("derivative", &[4.0, 5.0]), ("limit", &[3.0, 40.0])],
    );
    let mut pd = controller("pd", 2, position(2));
    pd["delay"] = json!(0.02);
    parts.add("controllers", pd, &[("proportional", &[2.0]), ("derivative", &[0.4]), ("limit", &[4.0])]);
    let mut force = controller("force_loop", 3, position(2));
    force["sample_time"] = json!(0.05);
    let gains: [(&str, &[f64]); 5] = [
        ("proportional", &[3.0]),
        ("derivative", &[0.4]),
        ("feed_forward", &[0.1]),
        ("force_gain", &[0.2]),
        ("velocity_gain", &[0.1]),
    ];
    parts.add("controllers", force, &gains);
    parts
}

const START: [f64; 7] = [0.2, -0.1, 0.3, 0.1, 0.4, -0.2, 0.05];

fn smooth(rows: usize) -> Vec<f64> {
    (0..4 * rows).map(|place| 0.2 + 0.3 * (0.1 * (place / 4) as f64 + (place % 4) as f64).sin()).collect()
}

#[test]
fn derivatives_through_the_loop_are_exact() {
    let (rows, parts) = (60, everything());
    let references = smooth(rows);
    let run = |theta: &[f64], sensitivities: Vec<usize>| {
        let bench = Bench { theta: theta.to_vec(), sensitivities, ..parts.bench(0.01, 2) };
        bench.closed(&START, &references, &vec![0.1; 4 * rows])
    };
    let theta = parts.try_build().unwrap().parameters;
    let exact = run(&theta, (0..theta.len()).collect());
    let mut largest = 0.0_f64;
    for (k, &value) in theta.iter().enumerate() {
        // Long enough that rounding does not show, short enough that the curvature does not.
        let step = 1e-4 * value.abs().max(0.1);
        let at = |side: f64| {
            let mut theta = theta.clone();
            theta[k] += side * step;
            run(&theta, Vec::new()).outputs
        };
        let slopes: Vec<f64> = at(1.0).iter().zip(&at(-1.0)).map(|(a, b)| (a - b) / (2.0 * step)).collect();
        let size = slopes.iter().fold(1.0_f64, |size, slope| size.max(slope.abs()));
        for (place, slope) in slopes.iter().enumerate() {
            let gap = (exact.jacobian[place * theta.len() + k] - slope).abs() / size;
            assert!(gap < 1e-6, "parameter {k}, place {place}: {gap}");
            largest = largest.max(gap);
        }
    }
    println!("largest gap between exact derivatives and differences, of the largest of its parameter: {largest:.1e}");
}

#[test]
fn controllers_allocate_nothing() {
    let parts = everything();
    for sensitivities in [vec![], vec![0, 3, 20, 25]] {
        let bench = Bench { sensitivities, ..parts.bench(0.01, 2) };
        let references = smooth(200);
        let zeros = vec![0.0; references.len()];
        let count = |rows: usize| {
            measure(|| drop(bench.closed(&START, &references[..4 * rows], &zeros[..4 * rows]))).count_total
        };
        // What is recorded in the first run is kept.
        count(20);
        let (short, long) = (count(20), count(200));
        assert_eq!(short, long);
        assert!(short > 0, "the counter sees nothing");
    }
}

/// What is said about the controllers `controllers` of a machine of three joints, an actuator on each of them and one on a line.
fn said(change: impl FnOnce(&mut Value)) -> String {
    let mut parts = everything();
    change(&mut parts.0["controllers"]);
    parts.try_build().map(|_| String::new()).unwrap_or_else(|error| error.to_string())
}

#[test]
fn what_a_controller_cannot_do_is_said() {
    assert_eq!(said(|_| ()), "");
    let cases = [
        (said(|all| all[0]["actuators"] = json!([0])), "lists 1 actuators, 2 measures, 2 proportional"),
        (said(|all| all[0]["actuators"] = json!([1, 0])), "acts on the joint it measures in the same place"),
        (said(|all| all[0]["actuators"] = json!([0, 3])), "pair each actuator with its own joint"),
        (said(|all| all[0]["actuators"] = json!([0, 0])), "pair each actuator with its own joint"),
        (said(|all| all[0]["actuators"] = json!([0, 9])), "refers to actuator number 9"),
        (said(|all| all[1]["actuator"] = json!(1)), "both command the same actuator"),
        (
            said(|all| all[1]["measures"] = json!({"kind": "velocity", "joint": 2})),
            "a pd measures a position or a length",
        ),
        (said(|all| all[2]["measures"] = json!({"kind": "length", "line": 0})), "a controller measures a position"),
        (said(|all| all[2]["actuator"] = json!(2)), "both command the same actuator"),
        (said(|all| all[2]["measures"] = json!({"kind": "position", "joint": 7})), "refers to joint number 7"),
        (said(|all| all[1]["delay"] = json!(-0.1)), "`of 2.delay` must be a time in s that is not negative, got -0.1"),
        (said(|all| all[1]["sample_time"] = json!(0.0)), "`of 2.sample_time` must be a positive time in s, got 0"),
        (said(|all| all[1]["sample_tme"] = json!(0.1)), "unknown field `sample_tme`"),
        (said(|all| all[1]["derivative"] = json!(999)), "refers to parameter number 999"),
        (
            said(|all| {
                all[2]["actuator"] = json!(1);
                all.as_array_mut().unwrap().remove(0);
            }),
            "acts on a line or the joint it measures",
        ),
    ];
    for (found, expected) in cases {
        assert!(found.contains(expected), "`{found}` instead of `{expected}`");
    }
}
