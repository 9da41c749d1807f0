//! Exact sensitivities against central differences, for every parameter of every part, in every mode.

use serde_json::json;
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::samples::{Random, double_pendulum, random_tree};
use vpm_core::simulate::Hold;
use vpm_core::system::Kind;
use vpm_core::table::Table;

use crate::common::{ALWAYS, Bench, Machine};

const ROWS: usize = 60;

/// Two driven joints with every effect, link, sensor and controller there is.
fn everything() -> Machine {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("viscous_friction", 0, &[("viscous", 0.3)])
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .effect(
            "asymmetric_friction",
            0,
            &[("coulomb_difference", 0.1), ("viscous_difference", 0.05), ("transition_velocity", 0.4)],
        )
        .effect("stribeck_friction", 1, &[("stribeck", 0.2), ("stribeck_velocity", 2.0), ("transition_velocity", 0.5)])
        .effect("bias_force", 0, &[("force", 0.2)])
        .effect("spring", 1, &[("stiffness", 2.0), ("rest", 0.3)])
        .effect("torque_ripple", 0, &[("period", 0.7), ("cosine", 0.2), ("sine", -0.1)])
        .payload(1, 0.3, [0.02, 0.05, -0.3]);
    machine.actuator(0, &[("gain", 1.5), ("delay", 0.0137), ("dead_zone", 0.11), ("saturation", 1.9), ("lag", 0.06)]);
    machine.actuator(1, &[("gain", 0.8), ("delay", 0.0043)]);
    let joint = |kind: &str, joint: usize| json!({"kind": kind, "joint": joint});
    machine.sensor(joint("position", 0), &[("gain", 1.1), ("offset", 0.03), ("delay", 0.0172)]);
    machine.sensor(joint("velocity", 1), &[("gain", 0.9), ("offset", -0.02)]);
    machine.sensor(json!({"kind": "force", "actuator": 0}), &[("delay", 0.0056)]);
    machine.controller("cascade", 0, 0, &[("position_gain", 3.0), ("velocity_gain", 1.2), ("limit", 2.5)]);
    machine.controller("pid", 1, 1, &[("proportional", 2.0), ("integral", 1.0), ("derivative", 0.1), ("limit", 4.0)]);
    machine
}

fn initial() -> [f64; 5] {
    [0.4, -0.3, 0.5, 0.2, 0.7]
}

/// Two smooth commands, large enough to reach dead zone and saturation.
fn commands() -> Vec<f64> {
    (0..ROWS).flat_map(|k| [2.6 * (0.21 * k as f64).sin(), 1.1 * (0.13 * k as f64 + 1.0).cos()]).collect()
}

/// Central differences of `outputs(theta)` by every parameter of the machine, against the columns of `jacobian`.
pub fn check(machine: &Machine, jacobian: &[f64], what: &str, outputs: impl Fn(&[f64]) -> Vec<f64>) {
    let variables = machine.values.len();
    assert!(jacobian.iter().all(|slope| slope.is_finite()));
    for (k, name) in machine.names.iter().enumerate() {
        let step = 1e-6 * machine.values[k].abs().max(0.1);
        let at = |side: f64| {
            let mut theta = machine.values.clone();
            theta[k] += side * step;
            outputs(&theta)
        };
        let (ahead, behind) = (at(1.0), at(-1.0));
        let slopes: Vec<f64> = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * step)).collect();
        let size = slopes.iter().fold(0.0_f64, |size, slope| size.max(slope.abs()));
        for (place, slope) in slopes.iter().enumerate() {
            let exact = jacobian[place * variables + k];
            let gap = (exact - slope).abs();
            assert!(gap < 2e-6 * (1.0 + size), "{what}, {name}, place {place}: exact {exact}, difference {slope}");
        }
    }
}

fn bench(machine: &Machine, method: Method) -> Bench {
    let mut bench = Bench::new(machine, 0.01, 2, method);
    bench.sensitivities = (0..machine.values.len()).collect();
    bench
}

/// The bench with other parameters and without sensitivities.
fn moved(machine: &Machine, method: Method, theta: &[f64]) -> Bench {
    Bench { theta: theta.to_vec(), sensitivities: Vec::new(), ..bench(machine, method) }
}

/// Parameters that the differences cannot move because the body would lose its inertia: they stay at zero, one-sided.
pub(super) fn movable(mut machine: Machine) -> Machine {
    // Point masses have zero inertia, whose entries cannot be negative: give each body a small ball's.
    for (name, value) in machine.names.iter().zip(&mut machine.values) {
        let place: Option<usize> = name.split('.').nth(1).and_then(|place| place.parse().ok());
        if place.is_some_and(|place| (4..7).contains(&(place % 10))) {
            *value = 0.01;
        }
    }
    machine
}

#[test]
fn free_run() {
    let machine = movable(everything());
    for (method, hold) in Method::FIXED.into_iter().flat_map(|method| Hold::ALL.map(|hold| (method, hold))) {
        let run = Bench { hold, ..bench(&machine, method) }.free(&initial(), &commands());
        check(&machine, &run.jacobian, &format!("{}, {}", method.name(), hold.name()), |theta| {
            Bench { hold, ..moved(&machine, method, theta) }.free(&initial(), &commands()).outputs
        });
    }
}

#[test]
fn matrices_too_large_to_record() {
    let mut machine = Machine::new(&random_tree(3, 40));
    machine.actuator(0, &[("gain", 1.5), ("lag", 0.06)]);
    let d = machine.build();
    assert!(d.program(&Kind::Linearised, &machine.values).unwrap().directions.is_some());
    let (state, commands) = (Random::new(4).numbers(d.n_states(), 0.5), [2.0, -1.0, 0.5, 1.0]);
    let parameters = [3, 17, machine.values.len() - 1];
    for (method, hold) in [(Method::Rosenbrock, Hold::FirstOrder), (Method::LinearlyImplicit, Hold::ZeroOrder)] {
        let bench = Bench { hold, sensitivities: parameters.to_vec(), ..bench(&machine, method) };
        let run = bench.free(&state, &commands);
        for (k, &parameter) in parameters.iter().enumerate() {
            let at = |side: f64| {
                let mut theta = machine.values.clone();
                theta[parameter] += side * 1e-5;
                Bench { hold, ..moved(&machine, method, &theta) }.free(&state, &commands).outputs
            };
            let slopes: Vec<f64> =
                at(1.0).iter().zip(at(-1.0)).map(|(ahead, behind)| (ahead - behind) / 2e-5).collect();
            let size = slopes.iter().fold(0.0_f64, |size, slope| size.max(slope.abs()));
            assert!(size > 1e-3, "parameter {parameter} does nothing");
            for (row, slope) in run.jacobian.chunks_exact(parameters.len()).zip(slopes) {
                assert!((row[k] - slope).abs() < 1e-7 * size, "{}: {} is not {slope}", method.name(), row[k]);
            }
        }
    }
}

#[test]
fn closed_loop() {
    let machine = movable(everything());
    let references: Vec<f64> =
        (0..ROWS).flat_map(|k| [0.4 + 0.01 * k as f64, -0.3 + 0.4 * (0.1 * k as f64).sin()]).collect();
    let disturbances: Vec<f64> = (0..ROWS).flat_map(|k| [if k > 30 { 0.5 } else { 0.0 }, 0.0]).collect();
    for method in Method::FIXED {
        let run = bench(&machine, method).closed(&initial(), &references, &disturbances);
        check(&machine, &run.jacobian, method.name(), |theta| {
            moved(&machine, method, theta).closed(&initial(), &references, &disturbances).outputs
        });
    }
}

#[test]
fn restarts() {
    let machine = movable(everything());
    let states = Random::new(8).numbers(3 * 5, 0.5);
    let starts = [0, 7, 41];
    for method in Method::FIXED {
        let run = bench(&machine, method).restart(&states, &starts, 12, &commands());
        check(&machine, &run.jacobian, method.name(), |theta| {
            moved(&machine, method, theta).restart(&states, &starts, 12, &commands()).outputs
        });
    }
}

#[test]
fn inverse() {
    let machine = movable(everything());
    let description = machine.build();
    let mut random = Random::new(4);
    let [q, v, a] = [1.0, 2.0, 5.0].map(|size| random.numbers(2 * ROWS, size));
    let inputs = commands();
    let table = |numbers| Table::new("motion", numbers, ROWS, 2).unwrap();
    let motion = Motion {
        position: table(&q),
        velocity: table(&v),
        acceleration: table(&a),
        inputs: table(&inputs),
        time_step: 0.01,
    };
    let all: Vec<usize> = (0..machine.values.len()).collect();
    let efforts = inverse_dynamics(&description, &machine.values, motion, &all, ALWAYS).unwrap();
    check(&machine, &efforts.jacobian, "inverse dynamics", |theta| {
        let moved = inverse_dynamics(&description, theta, motion, &[], ALWAYS).unwrap();
        moved.required.iter().zip(&moved.applied).map(|(required, applied)| required - applied).collect()
    });
}

#[test]
fn columns_come_in_the_order_asked_for() {
    let machine = movable(everything());
    let mut bench = bench(&machine, Method::Rk4);
    let full = bench.free(&initial(), &commands());
    let some = [machine.index("drive0.gain"), 3, machine.index("spring.rest"), 0, machine.index("drive0.lag"), 3];
    bench.sensitivities = some.to_vec();
    let run = bench.free(&initial(), &commands());
    assert_eq!(run.outputs, full.outputs);
    for place in 0..run.outputs.len() {
        for (k, column) in some.iter().enumerate() {
            assert_eq!(run.jacobian[place * some.len() + k], full.jacobian[place * machine.values.len() + column]);
        }
    }
}
