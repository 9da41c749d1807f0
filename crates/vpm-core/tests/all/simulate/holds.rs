//! What inputs do between samples: exact motions under efforts that are polynomials of time, orders of all integrators, pieces.

use vpm_core::integrator::Method;
use vpm_core::samples::{double_pendulum, slider};
use vpm_core::simulate::Hold;

use crate::common::{Bench, Machine, close};

const STEP: f64 = 0.05;

fn bench(machine: &Machine, hold: Hold, substeps: usize, method: Method) -> Bench {
    Bench { hold, ..Bench::new(machine, STEP, substeps, method) }
}

/// Samples of a signal of time.
fn sampled(count: usize, signal: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..count).map(|k| signal(k as f64 * STEP)).collect()
}

#[test]
fn a_free_mass_moves_by_the_double_integral_of_its_effort() {
    let mut machine = Machine::new(&slider(4.0));
    machine.actuator(0, &[("gain", 2.0)]);
    // u = a + b t + c t^2 gives q = 2 / 4 (a t^2 / 2 + b t^3 / 6 + c t^4 / 12).
    for (hold, [a, b, c]) in
        [(Hold::ZeroOrder, [1.5, 0.0, 0.0]), (Hold::FirstOrder, [0.3, -0.7, 0.0]), (Hold::Cubic, [0.3, -0.7, 0.9])]
    {
        let inputs = sampled(41, |t| a + (b + c * t) * t);
        let end = |t: f64| 0.5 * t * t * (a / 2.0 + (b / 6.0 + c * t / 12.0) * t);
        for method in [Method::Rk4, Method::Rosenbrock, Method::Additive] {
            let bench = bench(&machine, hold, 1, method);
            let found = bench.channel(&bench.free(&[0.0, 0.0], &inputs), 0);
            for (k, &position) in found.iter().enumerate() {
                close(position, end(k as f64 * STEP), 1e-12);
            }
        }
    }
}

#[test]
fn integrators_keep_their_orders_where_inputs_move() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("viscous_friction", 0, &[("viscous", 0.3)])
        .actuator(0, &[("gain", 1.5), ("delay", 0.0137), ("lag", 0.3)])
        .actuator(1, &[("gain", 0.8)]);
    let (first, second) = (sampled(21, |t| (4.0 * t).sin()), sampled(21, |t| (3.0 * t).cos()));
    let inputs: Vec<f64> = first.into_iter().zip(second).flat_map(|pair| [pair.0, pair.1]).collect();
    for hold in [Hold::FirstOrder, Hold::Cubic] {
        let end = |substeps: usize, method: Method| {
            let run = bench(&machine, hold, substeps, method).free(&[0.4, -0.3, 0.5, 0.2, 0.7], &inputs);
            run.states[run.states.len() - 5..].to_vec()
        };
        let wanted = end(64, Method::Rk4);
        let error = |substeps: usize, method: Method| {
            end(substeps, method)
                .iter()
                .zip(&wanted)
                .fold(0.0_f64, |worst, (one, other)| worst.max((one - other).abs()))
        };
        for (method, order) in Method::FIXED.into_iter().zip([1.0, 4.0, 2.0, 4.0, 4.0, 2.0]) {
            let found = (error(2, method) / error(4, method)).log2();
            assert!(found > order - 0.35, "{}, {}: order {found}", method.name(), hold.name());
        }
        assert!(error(1, Method::Adaptive { tolerance: 1e-9 }) < 1e-7);
        assert!(error(1, Method::Guarded) < 1e-3);
    }
}

#[test]
fn restarts_are_pieces_of_the_free_run() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine.actuator(0, &[("gain", 1.5), ("delay", 0.025), ("lag", 0.05)]);
    let bench = bench(&machine, Hold::FirstOrder, 2, Method::LinearlyImplicit);
    let inputs = sampled(50, |t| (6.0 * t).sin());
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
fn machine_code_sees_moving_inputs_as_the_laws_do() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("viscous_friction", 1, &[("viscous", 0.3)])
        .actuator(0, &[("gain", 1.5)])
        .actuator(1, &[("gain", 0.2)]);
    let inputs: Vec<f64> = sampled(801, |t| (4.0 * t).sin()).into_iter().flat_map(|u| [u, 1.0 - u]).collect();
    for method in [Method::Rk4, Method::Additive] {
        let bench = bench(&machine, Hold::Cubic, 8, method);
        let (long, short) =
            (bench.free(&[0.4, -0.3, 0.0, 0.0], &inputs), bench.free(&[0.4, -0.3, 0.0, 0.0], &inputs[..40]));
        // The last courses of the short record end otherwise.
        let known = short.outputs.len() / 20 * 17;
        for (long, short) in long.outputs[..known].iter().zip(&short.outputs[..known]) {
            close(*long, *short, 1e-10);
        }
    }
}
