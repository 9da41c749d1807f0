//! Efforts looked up by command and velocity: what a table reproduces, how smooth it is, where it ends.

use serde_json::{Value, json};
use vpm_core::actuator::TableDrive;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::samples::slider;
use vpm_core::{Dual, Scalar};

use crate::common::{Bench, Machine, close};

const COMMANDS: [f64; 5] = [-1.0, -0.3, 0.0, 0.4, 1.0];
const VELOCITIES: [f64; 4] = [-2.0, -0.5, 0.25, 2.0];

fn written(f: impl Fn(f64, f64) -> f64, commands: &[f64], velocities: &[f64]) -> Value {
    let efforts: Vec<f64> =
        commands.iter().flat_map(|&u| velocities.iter().map(move |&v| (u, v))).map(|(u, v)| f(u, v)).collect();
    json!({"commands": commands, "velocities": velocities, "efforts": efforts})
}

fn table(f: impl Fn(f64, f64) -> f64) -> serde_json::Result<TableDrive> {
    serde_json::from_value(written(f, &COMMANDS, &VELOCITIES))
}

/// Monotone in both directions, steep in the middle.
fn steep(u: f64, v: f64) -> f64 {
    (6.0 * u).tanh() * 3.0 - v * v.abs() + u
}

#[test]
fn planes_and_their_products_are_exact() {
    let plane = |u: f64, v: f64| 2.0 + 3.0 * u - 4.0 * v + 5.0 * u * v;
    let found = table(plane).unwrap();
    for u in [-1.0, -0.77, -0.3, 0.1, 0.39, 0.9, 1.0] {
        for v in [-2.0, -1.1, 0.0, 0.3, 1.7] {
            close(found.effort(u, v), plane(u, v), 1e-13 * 20.0);
        }
    }
}

#[test]
fn nodes_are_met_and_nothing_overshoots_between_them() {
    let found = table(steep).unwrap();
    for &u in &COMMANDS {
        VELOCITIES.iter().for_each(|&v| close(found.effort(u, v), steep(u, v), 1e-13));
        for pair in VELOCITIES.windows(2) {
            for k in 0..50 {
                let v = pair[0] + (pair[1] - pair[0]) * f64::from(k) / 49.0;
                let effort = found.effort(u, v);
                assert!(
                    effort <= steep(u, pair[0]) + 1e-12 && effort >= steep(u, pair[1]) - 1e-12,
                    "{u} {v}: {effort}"
                );
            }
        }
    }
}

#[test]
fn slopes_are_those_of_differences_and_continuous() {
    let found = table(steep).unwrap();
    let slopes = |u: f64, v: f64| found.effort(Dual::<f64, 2>::variable(u, 0), Dual::variable(v, 1)).gradient;
    for (u, v) in [(-0.8, 1.0), (-0.1, -0.3), (0.2, 0.0), (0.7, -1.2)] {
        let step = 1e-6;
        let [by_u, by_v] = slopes(u, v);
        close(by_u, (found.effort(u + step, v) - found.effort(u - step, v)) / (2.0 * step), 1e-7);
        close(by_v, (found.effort(u, v + step) - found.effort(u, v - step)) / (2.0 * step), 1e-7);
    }
    // On both sides of every line of nodes.
    for &u in &COMMANDS[1..4] {
        for v in [-1.3, 0.1, 0.9] {
            let (left, right) = (slopes(u - 1e-9, v), slopes(u + 1e-9, v));
            (0..2).for_each(|lane| close(left[lane], right[lane], 1e-6));
        }
    }
    for &v in &VELOCITIES[1..3] {
        let (left, right) = (slopes(0.15, v - 1e-9), slopes(0.15, v + 1e-9));
        (0..2).for_each(|lane| close(left[lane], right[lane], 1e-6));
    }
}

#[test]
fn slopes_at_nodes_are_those_of_fritsch_and_butland() {
    // Over unequal steps h with secants s: inside 1/slope is the mean of 1/s with the weights h_left + 2 h_right and 2 h_left + h_right,
    // nothing where the secants differ in sign; at an end the slope of the parabola through three nodes, of the secant's sign and at most
    // three times as steep. Source: Fritsch & Butland 1984, "A method for constructing local monotone piecewise cubic interpolants".
    let u = [0.0, 1.0, 3.0];
    for (values, slopes) in [
        ([0.0, 1.0, 7.0], [1.0 / 3.0, 27.0 / 19.0, 13.0 / 3.0]),
        ([0.0, -1.0, -7.0], [-1.0 / 3.0, -27.0 / 19.0, -13.0 / 3.0]),
        ([0.0, 1.0, -17.0], [3.0, 0.0, -47.0 / 3.0]),
        ([0.0, 1.0, 19.0], [0.0, 81.0 / 49.0, 43.0 / 3.0]),
    ] {
        let by = |node: f64| values[u.iter().position(|&place| place == node).unwrap()];
        let along_u: TableDrive = serde_json::from_value(written(|node, _| by(node), &u, &[-1.0, 1.0])).unwrap();
        let along_v: TableDrive = serde_json::from_value(written(|_, node| by(node), &[-1.0, 1.0], &u)).unwrap();
        for (node, slope) in u.into_iter().zip(slopes) {
            // A little inside, since beyond its ends a table goes on as it does there.
            let place = (node + 1e-9).min(3.0 - 1e-9);
            let (variable, other) = (Dual::<f64, 1>::variable(place, 0), Dual::from_f64(0.2));
            close(along_u.effort(variable, other).gradient[0], slope, 1e-6);
            close(along_v.effort(other, variable).gradient[0], slope, 1e-6);
        }
    }
}

#[test]
fn twists_at_nodes_are_exact_for_parabolas() {
    // f = v g(u), g = (2 u^2 + u)/3: along u the slope at v = 1/4 is Hermite's polynomial of its slopes at v = 0 and 1, that of the limited
    // g among them, and of the slopes g' of f_v at both.
    let g = |u: f64| (2.0 * u * u + u) / 3.0;
    let found: TableDrive = serde_json::from_value(written(|u, v| v * g(u), &[0.0, 1.0, 3.0], &[0.0, 1.0])).unwrap();
    let (value, slopes) = (5.0 / 32.0, 3.0 / 32.0);
    for (u, limited, exact) in
        [(0.0, 1.0 / 3.0, 1.0 / 3.0), (1.0, 27.0 / 19.0, 5.0 / 3.0), (3.0, 13.0 / 3.0, 13.0 / 3.0)]
    {
        let place = f64::min(u + 1e-9, 3.0 - 1e-9);
        let by_u = found.effort(Dual::<f64, 1>::variable(place, 0), Dual::from_f64(0.25)).gradient[0];
        close(by_u, value * limited + slopes * exact, 1e-6);
    }
}

#[test]
fn closer_nodes_come_nearer() {
    let smooth = |u: f64, v: f64| (0.7 * u).exp() * 2.0 - (0.4 * v).exp();
    let gap = |count: u32| {
        let axis =
            |reach: f64| (0..=count).map(|k| reach * (2.0 * f64::from(k) / f64::from(count) - 1.0)).collect::<Vec<_>>();
        let found: TableDrive = serde_json::from_value(written(smooth, &axis(1.0), &axis(2.0))).unwrap();
        let points = (0..40).map(|k| (0.9 * (1.7 * f64::from(k)).sin(), 1.8 * (0.6 * f64::from(k)).cos()));
        points.fold(0.0_f64, |most, (u, v)| most.max((found.effort(u, v) - smooth(u, v)).abs()))
    };
    let gaps = [gap(8), gap(16), gap(32)];
    assert!(gaps[0] < 2e-2 && gaps[1] < 0.3 * gaps[0] && gaps[2] < 0.3 * gaps[1], "{gaps:?}");
}

#[test]
fn its_ends_stand_for_all_beyond() {
    let found = table(steep).unwrap();
    for (u, v, near) in [(7.0, 0.1, (1.0, 0.1)), (-9.0, 1.5, (-1.0, 1.5)), (f64::INFINITY, 0.0, (1.0, 0.0))] {
        let [at_u, at_v] = [(0, u), (1, v)].map(|(lane, value)| Dual::<f64, 2>::variable(value, lane));
        let effort = found.effort(at_u, at_v);
        close(effort.re(), found.effort(near.0, near.1), 1e-12);
        if u.abs() > 1.0 {
            assert_eq!(effort.gradient[0], 0.0);
        }
    }
    // Straight on along the velocity.
    for (u, end, far) in [(0.2, 2.0, 50.0), (-0.6, -2.0, -9.0)] {
        let slope = |v: f64| found.effort(Dual::from_f64(u), Dual::<f64, 1>::variable(v, 0)).gradient[0];
        close(found.effort(u, far), found.effort(u, end) + slope(end) * (far - end), 1e-10);
        close(slope(far), slope(end), 1e-12);
        assert!(slope(end) < -1.0);
    }
    assert!(found.effort(f64::NAN, 0.1).is_finite() && found.effort(0.1, f64::NAN).is_finite());
}

fn machine(drive: Value) -> Machine {
    let mut machine = Machine::new(&slider(3.0));
    let mut law = drive;
    law["type"] = json!("table");
    machine.add("actuators", json!({"name": "servo", "on": {"joint": 0}, "drive": law}), json!({}));
    machine
}

#[test]
fn a_machine_settles_where_the_table_says() {
    // F = 1000 u - 400 v: 0.5 of the command are 1.25 m/s, after 3 kg / 400 N s/m.
    let machine = machine(written(|u, v| 1000.0 * u - 400.0 * v, &COMMANDS, &VELOCITIES));
    let bench = Bench::new(&machine, 1e-3, 1, Method::LinearlyImplicit);
    let run = bench.free(&[0.5, 0.0], &[0.5; 200]);
    close(run.states[2 * 199 + 1], 1.25, 1e-9);
    let (time, constant) = (5e-3, 3.0 / 400.0_f64);
    close(run.states[2 * 5 + 1], 1.25 * (1.0 - (-time / constant).exp()), 1e-3);
}

#[test]
fn what_is_no_table_is_refused() {
    let refusal = |drive: Value| Description::from_json(&machine(drive).json()).map(|_| ()).unwrap_err().to_string();
    for (drive, part) in [
        (json!({"commands": [0.0], "velocities": [0.0, 1.0], "efforts": [1.0, 2.0]}), "has 1 of commands"),
        (
            json!({"commands": [0.0, 1.0], "velocities": [1.0, 1.0], "efforts": [1.0, 1.0, 1.0, 1.0]}),
            "do not rise: 1, then 1",
        ),
        (json!({"commands": [0.0, 1.0], "velocities": [0.0, 1.0], "efforts": [1.0, 1.0, 1.0]}), "has 3 efforts"),
    ] {
        let told = refusal(drive);
        assert!(told.contains("table of actuator `servo`") && told.contains(part), "{told}");
    }
}
