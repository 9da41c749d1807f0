//! Sampled controllers in their loops: against exact discrete solutions, the linear dynamics of an error, and fixed points.

use serde_json::{Value, json};
use vpm_core::samples::{pendulum, slider};
use vpm_core::simulate::closed_loop;
use vpm_core::table::Table;

use crate::common::parts::{Parts, controller, position};
use crate::common::{Machine, close};

/// Exact step of `x' = A x + B u` with u held: the exponential of the matrix `[[A, B], [0, 0]] h`.
fn held_step(a: [[f64; 2]; 2], b: [f64; 2], h: f64) -> [[f64; 3]; 2] {
    let m = [[a[0][0], a[0][1], b[0]], [a[1][0], a[1][1], b[1]], [0.0; 3]].map(|row| row.map(|entry| entry * h));
    let product = |x: [[f64; 3]; 3], y: [[f64; 3]; 3]| {
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| x[i][k] * y[k][j]).sum::<f64>()))
    };
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (mut sum, mut term) = (unit, unit);
    for k in 1..30 {
        term = product(term, m).map(|row| row.map(|entry| entry / f64::from(k)));
        sum = [0, 1, 2].map(|i| [0, 1, 2].map(|j| sum[i][j] + term[i][j]));
    }
    [sum[0], sum[1]]
}

const ROWS: usize = 120;
const STEP: f64 = 0.01;

/// An axis of 2 kg with 3 N s/m under `(40 N/V) (proportional (r - y) - derivative dy)`, its reference, and its references' rows.
fn axis(extra: &[(&str, f64)]) -> (Machine, Value, Vec<f64>) {
    let mut machine = Machine::new(&slider(2.0));
    machine.effect("viscous_friction", 0, &[("viscous", 3.0)]).actuator(0, &[("gain", 40.0)]);
    let mut pd = controller("pd", 0, position(0));
    for (key, value) in extra {
        pd[*key] = json!(value);
    }
    (machine, pd, (0..ROWS).map(|k| 0.3 + 0.1 * (0.15 * k as f64).sin()).collect())
}

const GAINS: [(&str, &[f64]); 2] = [("proportional", &[5.0]), ("derivative", &[0.6])];

#[test]
fn an_axis_under_pd_is_the_exact_discrete_solution() {
    let exact = held_step([[0.0, 1.0], [0.0, -1.5]], [0.0, 20.0], STEP);
    for every in [1_usize, 2, 5] {
        for (delay, whole, fraction) in [(0.0, 0_usize, 0.0), (0.01, 1, 0.0), (0.015, 1, 0.5)] {
            let (machine, pd, references) = axis(&[("sample_time", every as f64 * STEP), ("delay", delay)]);
            let bench = Parts::of(&machine).add("controllers", pd, &GAINS).bench(STEP, 16);
            let run = bench.closed(&[0.1, -0.2], &references, &[0.0; ROWS]);
            let (mut x, mut drafts) = ([0.1, -0.2], Vec::<f64>::new());
            let mut worst = 0.0_f64;
            for k in 0..ROWS {
                worst = worst.max((run.states[2 * k] - x[0]).abs()).max((run.states[2 * k + 1] - x[1]).abs());
                let draft = 5.0 * (references[k] - x[0]) - 0.6 * x[1];
                drafts.push(if k % every == 0 { draft } else { drafts[k - 1] });
                let at = |late: usize| drafts[k.saturating_sub(late)];
                let u = (1.0 - fraction) * at(whole) + fraction * at(whole + 1);
                close(run.outputs[6 * k + 4], u, 1e-10);
                x = exact.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * u);
            }
            println!("every {every} samples, delay {delay} s: largest gap {worst:.1e}");
            assert!(worst < 1e-12, "every {every}, delay {delay}: {worst}");
        }
    }
}

#[test]
fn a_pd_sees_what_the_sensors_show() {
    let (mut machine, pd, references) = axis(&[("delay", 0.01)]);
    machine.sensor(position(0), &[("offset", 0.02)]);
    machine.sensor(json!({"kind": "velocity", "joint": 0}), &[("gain", 1.3), ("offset", -0.05), ("delay", 0.02)]);
    let bench = Parts::of(&machine).add("controllers", pd, &GAINS).bench(STEP, 4);
    let disturbances: Vec<f64> = (0..ROWS).map(|k| if k > 60 { 0.4 } else { 0.0 }).collect();
    let run = bench.closed(&[0.1, -0.2], &references, &disturbances);
    let truth = |k: usize, place: usize| run.states[2 * k + place];
    for (k, disturbance) in disturbances.iter().enumerate() {
        let draft = |k: usize| {
            let seen = [truth(k, 0) + 0.02, 1.3 * truth(k.saturating_sub(2), 1) - 0.05];
            5.0 * (references[k] - seen[0]) - 0.6 * seen[1]
        };
        // The disturbance is not delayed.
        close(run.outputs[6 * k + 4], draft(k.saturating_sub(1)) + disturbance, 1e-12);
    }
}

#[test]
fn a_pd_holds_the_length_of_a_line_as_a_joint() {
    let (machine, pd, references) = axis(&[]);
    let by_joint = Parts::of(&machine).add("controllers", pd, &GAINS).bench(STEP, 4);
    let run = by_joint.closed(&[0.1, -0.2], &references, &[0.0; ROWS]);
    // A line along the axis, 0.5 m longer than the coordinate, with an actuator of the same gain.
    let mut by_line = Machine::new(&slider(2.0));
    by_line.effect("viscous_friction", 0, &[("viscous", 3.0)]);
    let mut parts = Parts::of(&by_line);
    let length = json!({"kind": "length", "line": 0});
    parts.drive_line(0, [-0.5, 0.0, 0.0], [0.0; 3], 40.0, None).add("controllers", controller("pd", 0, length), &GAINS);
    let longer: Vec<f64> = references.iter().map(|r| r + 0.5).collect();
    let other = parts.bench(STEP, 4).closed(&[0.1, -0.2], &longer, &[0.0; ROWS]);
    for (found, expected) in other.states.iter().zip(&run.states) {
        close(*found, *expected, 1e-11);
    }
}

/// A pendulum about y with a line to its rod; `heavy` makes it stand still whatever pulls.
fn swing(mass: f64, gain: f64, lag: Option<f64>, numbers: &[(&str, &[f64])]) -> Parts {
    let mut sample = pendulum(mass, 0.5);
    sample.gravity = [0.0; 3];
    let mut parts = Parts::of(&Machine::new(&sample));
    parts.drive_line(0, [-0.3, 0.0, 0.1], [0.0, 0.0, -0.2], gain, lag);
    parts.add("controllers", controller("force_loop", 0, position(0)), numbers);
    parts
}

/// Length of that line at an angle, from the places of its ends: the rod hangs along -z and turns about y.
fn length(q: f64) -> f64 {
    (-0.2 * q.sin() + 0.3).hypot(-0.2 * q.cos() - 0.1)
}

#[test]
fn a_force_loop_turns_torque_into_force_and_measures_both() {
    let gains: [(&str, &[f64]); 4] =
        [("proportional", &[150.0]), ("derivative", &[6.0]), ("force_gain", &[0.02]), ("velocity_gain", &[7.0])];
    let bench = swing(3.0, 4.0, Some(0.05), &gains).bench(1e-3, 4);
    let (q, dq, step) = (0.7, -1.1, 1e-6);
    let run = bench.closed(&[q, dq, 12.0], &[0.9], &[0.0]);
    let arm = (length(q + step) - length(q - step)) / (2.0 * step);
    close(run.outputs[4 + 2], length(q), 1e-14);
    close(run.outputs[4 + 3], arm * dq, 1e-9);
    // The lag holds 12, so the actuator delivers 48 N before any command.
    let torque = 150.0 * (0.9 - q) - 6.0 * dq;
    close(run.outputs[4], 0.02 * (torque / arm - 48.0) + 7.0 * arm * dq, 1e-7);
}

#[test]
fn a_force_loop_reaches_its_fixed_point_as_the_sampled_lag_does() {
    // A joint that stands: 100 N m/rad times 0.2 rad ask for 20 N m, around a loop gain of 4 N/V times 10 V/N.
    let gains: [(&str, &[f64]); 4] =
        [("proportional", &[100.0]), ("derivative", &[0.0]), ("force_gain", &[10.0]), ("velocity_gain", &[0.0])];
    let (rows, step, lag) = (400, 1e-3, 0.05);
    let bench = swing(1e12, 4.0, Some(lag), &gains).bench(step, 4);
    let run = bench.closed(&[0.1, 0.0, 0.0], &vec![0.3; rows], &vec![0.0; rows]);
    let arm = (length(0.1 + 1e-6) - length(0.1 - 1e-6)) / 2e-6;
    let (wanted, share) = (20.0 / arm, 40.0 / 41.0);
    // F[k+1] = F + (g u - F)(1 - exp(-h/T)) with u = 10 (F_d - F): a factor per sample about the fixed point.
    let factor = 1.0 - 41.0 * (1.0 - (-step / lag).exp());
    let width = bench.description.n_outputs();
    for k in 0..rows {
        let force = run.outputs[k * width + 5];
        close(force, wanted * share * (1.0 - factor.powi(k as i32)), 1e-6 * wanted.abs());
    }
    let torque = run.outputs[(rows - 1) * width + 5] * arm;
    println!("asked for 20 N m, reached {torque:.4} N m with a loop gain of 40");
    close(torque, 20.0 * share, 1e-4);
}

#[test]
fn with_its_feed_forward_an_ideal_actuator_gives_the_torque_itself() {
    let gains: [(&str, &[f64]); 5] = [
        ("proportional", &[150.0]),
        ("derivative", &[6.0]),
        ("feed_forward", &[0.25]),
        ("force_gain", &[0.0]),
        ("velocity_gain", &[0.0]),
    ];
    let (rows, bench) = (300, swing(3.0, 4.0, None, &gains).bench(1e-3, 4));
    let run = bench.closed(&[0.7, -1.1], &vec![0.9; rows], &vec![0.0; rows]);
    let width = bench.description.n_outputs();
    for k in 0..rows {
        let (q, dq) = (run.states[2 * k], run.states[2 * k + 1]);
        let arm = (length(q + 1e-6) - length(q - 1e-6)) / 2e-6;
        close(run.outputs[k * width + 5] * arm, 150.0 * (0.9 - q) - 6.0 * dq, 1e-6);
    }
}

#[test]
fn a_force_loop_on_the_joint_itself_has_the_arm_one() {
    let mut machine = Machine::new(&slider(2.0));
    machine.actuator(0, &[("gain", 4.0)]);
    let gains: [(&str, &[f64]); 4] =
        [("proportional", &[100.0]), ("derivative", &[3.0]), ("force_gain", &[0.1]), ("velocity_gain", &[0.7])];
    let bench = Parts::of(&machine).add("controllers", controller("force_loop", 0, position(0)), &gains).bench(0.01, 1);
    let run = bench.closed(&[0.1, -0.2], &[0.3, 0.3], &[0.0; 2]);
    let first = 0.1 * (100.0 * 0.2 + 3.0 * 0.2) - 0.7 * 0.2;
    close(run.outputs[4], first, 1e-14);
    // At the second sample it feels the force of the first command, which is still held.
    let (q, v) = (run.states[2], run.states[3]);
    close(run.outputs[6 + 4], 0.1 * (100.0 * (0.3 - q) - 3.0 * v - 4.0 * first) + 0.7 * v, 1e-12);
}

#[test]
fn a_sample_time_has_to_fit_the_record() {
    let refused = |sample_time: f64, step: f64| {
        let (machine, pd, references) = axis(&[("sample_time", sample_time)]);
        let bench = Parts::of(&machine).add("controllers", pd, &GAINS).bench(step, 1);
        let table = |numbers| Table::new("references", numbers, ROWS, 1).unwrap();
        let zeros = [0.0; ROWS];
        closed_loop(bench.setting(), &[0.0; 2], table(&references), table(&zeros))
            .err()
            .map(|error| error.to_string())
            // Such long steps may end the run as well.
            .filter(|text| text.contains("whole multiple"))
    };
    assert_eq!(refused(0.003, 0.001), None);
    // 0.1 and 0.3 are no exact multiples in binary numbers.
    assert_eq!(refused(0.3, 0.1), None);
    let error = refused(0.0025, 0.001).unwrap();
    assert_eq!(
        error,
        "controller `of 0` samples every 0.0025 s, which is no whole multiple of the record's time step of 0.001 s; give it the \
         sample_time 0.003 s, or resample the record"
    );
    assert!(refused(0.33, 0.1).unwrap().contains("sample_time 0.3 s,"));
    assert!(refused(0.001, 0.002).unwrap().contains("sample_time 0.002 s"));
    assert!(refused(0.001 * (1.0 + 1e-8), 0.001).is_some() && refused(0.001 * (1.0 + 1e-10), 0.001).is_none());
}
