//! Valves that follow at once and quasi-static pressures: limits of the full servo-cylinder, and steady motion in closed form.

use serde_json::json;
use vpm_core::actuator::hydraulic::{Chambers, PistonSize, ServoCylinder, chambers_under_load};
use vpm_core::integrator::Method;
use vpm_core::ode::Ode;

use crate::common::hydraulics::nominal;
use crate::common::servo_machine::{MIDDLE, with_pressures};
use crate::common::{Bench, Machine, close};

const STEP: f64 = 1e-4;

/// The rig with the pressures of a kind; a valve without a frequency follows at once.
fn machine(servo: &ServoCylinder<f64>, pressures: &str) -> Machine {
    with_pressures(servo, pressures, json!("constant"))
}

fn at_once(servo: &ServoCylinder<f64>) -> ServoCylinder<f64> {
    let mut servo = *servo;
    (servo.valve.frequency, servo.valve.damping) = (None, None);
    servo
}

/// Position, velocity and both pressures at each sample under `currents`, from rest at `place` from mid-stroke.
fn moved(machine: &Machine, place: f64, currents: &[f64]) -> [Vec<f64>; 4] {
    let bench = Bench::new(machine, STEP, 4, Method::Rosenbrock);
    let q = [MIDDLE + place];
    let mut start = vec![q[0], 0.0];
    start.extend(vpm_core::evaluate::internal_state(&bench.description, &machine.values, &q).unwrap_or_default());
    let (run, layout) = (bench.free(&start, currents), bench.description.layout());
    let width = bench.description.n_outputs();
    let column = |at: usize| run.outputs.chunks_exact(width).map(|row| row[at]).collect::<Vec<_>>();
    [0, 1, layout.hydraulics() + 1, layout.hydraulics() + 2].map(column)
}

/// Largest difference, relative to the largest change.
fn apart(found: &[f64], expected: &[f64]) -> f64 {
    let size = expected.iter().fold(0.0_f64, |most, value| most.max((value - expected[0]).abs()));
    found.iter().zip(expected).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / size
}

fn sine() -> Vec<f64> {
    (0..3000).map(|k| 2e-3 * (std::f64::consts::TAU * 8.0 * f64::from(k) * STEP).sin()).collect()
}

#[test]
fn a_fast_spool_comes_near_to_one_that_follows_at_once() {
    let (servo, currents) = (nominal(), sine());
    let [_, limit, ..] = moved(&machine(&at_once(&servo), "chambers"), 0.0, &currents);
    let errors = [1.0, 4.0, 16.0].map(|faster| {
        let mut quick = servo;
        quick.valve.frequency = servo.valve.frequency.map(|own| faster * own);
        apart(&moved(&machine(&quick, "chambers"), 0.0, &currents)[1], &limit)
    });
    // The delay of a spool is 2 D / w: a quarter of it for four times the frequency, within what the corners of the flow leave.
    assert!(errors[0] < 0.1 && errors[0] > 0.02, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] - 4.0).abs() < 0.8, "{errors:?}");
    }
}

#[test]
fn stiff_oil_comes_near_to_quasi_static_pressures() {
    // Both chambers of a moving piston share the load by the flows alone, the faster the stiffer the oil.
    let mut servo = nominal();
    servo.cylinder.internal_leakage = 0.0;
    let currents: Vec<f64> =
        (0..800).map(|k| 2e-3 + 1e-3 * (std::f64::consts::TAU * 30.0 * f64::from(k) * STEP).sin()).collect();
    let errors = [1.0, 8.0, 64.0].map(|stiffer| {
        let mut stiff = servo;
        stiff.fluid.bulk_modulus = stiffer * servo.fluid.bulk_modulus;
        let full = moved(&machine(&stiff, "chambers"), -0.01, &currents);
        let load = moved(&machine(&stiff, "load"), -0.01, &currents);
        assert!(apart(&load[0], &full[0]) < 0.02, "{}", apart(&load[0], &full[0]));
        [2, 3].map(|side| apart(&load[side][400..], &full[side][400..]))
    });
    assert!(errors[0].iter().all(|&gap| gap > 1e-3), "{errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[1][0] < 0.25 * pair[0][0] && pair[1][1] < 0.25 * pair[0][1], "{errors:?}");
    }
}

#[test]
fn equal_chambers_need_no_second_state() {
    // With equal areas and volumes the sum of both pressures does not change: nothing is lost, where the piston is near the middle.
    let mut servo = nominal();
    servo.cylinder.size = PistonSize::Areas { area: 2e-4, area_ratio: 1.0 };
    servo.cylinder.line_a = 1e-2;
    servo.cylinder.line_b = 1e-2;
    let currents = sine();
    let full = moved(&machine(&servo, "chambers"), 0.0, &currents);
    let load = moved(&machine(&servo, "load"), 0.0, &currents);
    assert!(apart(&load[0], &full[0]) < 1e-4, "{}", apart(&load[0], &full[0]));
}

#[test]
fn steady_motion_is_that_of_the_flows() {
    // Without leakage and load: drops as 1 to alpha^2, and the speed that the edge of chamber a lets through.
    let mut servo = nominal();
    servo.cylinder.internal_leakage = 0.0;
    servo.load.damping = 0.0;
    let (alpha, area) = (servo.cylinder.areas().b / servo.cylinder.areas().a, servo.cylinder.areas().a);
    let (ps, pt) = (servo.supply_pressure, servo.tank_pressure);
    for (current, root) in [
        (1e-3, ((ps - alpha * pt) / (1.0 + alpha.powi(3))).sqrt()),
        (-1e-3, ((alpha * ps - pt) / (1.0 + alpha.powi(3))).sqrt()),
    ] {
        let speed = servo.valve.orifice.gain * current * root / area;
        for (reduced, pressures) in [(servo, "load"), (at_once(&servo), "load"), (at_once(&servo), "chambers")] {
            let [_, velocity, ..] = moved(&machine(&reduced, pressures), 0.0, &vec![current; 1500]);
            close(velocity[1499], speed, 2e-3 * speed.abs());
        }
    }
}

#[test]
fn shares_of_the_load_balance_the_flows() {
    let (supply, tank, alpha) = (16e6, 1e5, 0.61_f64);
    for load in [-3e6, 0.0, 5e6] {
        let Chambers { a, b } = chambers_under_load(load, 1.0, [supply, tank], alpha);
        close(a - alpha * b, load, 1e-6);
        close((b - tank).sqrt(), alpha * (supply - a).sqrt(), 1e-6);
        let Chambers { a, b } = chambers_under_load(load, -1.0, [supply, tank], alpha);
        close(a - alpha * b, load, 1e-6);
        close((supply - b).sqrt(), alpha * (a - tank).sqrt(), 1e-6);
        let Chambers { a, b } = chambers_under_load(load, 0.0, [supply, tank], alpha);
        close(a - alpha * b, load, 1e-6);
        close(a + b, supply + tank, 1e-6);
    }
}

#[test]
fn reduced_drives_have_fewer_states_and_exact_slopes() {
    let servo = nominal();
    for (servo, pressures, states) in
        [(servo, "load", 5), (at_once(&servo), "chambers", 4), (at_once(&servo), "load", 3)]
    {
        let machine = machine(&servo, pressures);
        let mut system = machine.system();
        assert_eq!(system.dim(), states);
        let mut x = vec![MIDDLE + 0.003, 0.05, 4e6, 7e6];
        if pressures == "load" {
            x = vec![MIDDLE + 0.003, 0.05, 2e6];
        }
        if servo.valve.frequency.is_some() {
            x.splice(2..2, [1e-3, 0.1]);
        }
        let mut exact = vec![0.0; states * states];
        let mut rate = vec![0.0; states];
        system.rhs(&x, &mut rate);
        system.jacobian(&x, &mut exact);
        let mut sizes = vec![0.0; states];
        system.scales(&mut sizes);
        for column in 0..states {
            let change = 1e-6 * sizes[column];
            let mut slope = vec![0.0; states];
            for sign in [1.0, -1.0] {
                let mut near = x.clone();
                near[column] += sign * change;
                system.rhs(&near, &mut rate);
                slope.iter_mut().zip(&rate).for_each(|(slope, rate)| *slope += sign * rate / (2.0 * change));
            }
            for row in 0..states {
                let found = exact[row * states + column];
                close(found, slope[row], 1e-4 * slope[row].abs().max(1e-3 * sizes[row] / sizes[column]));
            }
        }
    }
}
