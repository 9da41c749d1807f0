//! The integrator of one evaluation a step on whole machines: order, characteristic polynomial, stiffness, energy, jumps, memory.

use nalgebra::Complex;
use serde_json::json;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::samples::{double_pendulum, slider};
use vpm_core::system::System;
use vpm_core::{Dual, Result};

use crate::common::{Machine, close, two_beams, two_link};

const METHOD: Method = Method::CrankNicolson;

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// State after `time` (s) in that many equal steps.
fn end(system: &mut System<f64>, start: &[f64], (method, time, steps): (Method, f64, usize)) -> Vec<f64> {
    let (mut x, mut integrator) = (start.to_vec(), Integrator::new(method, start.len()));
    for _ in 0..steps {
        integrator.step(system, &mut x, time / steps as f64);
    }
    x
}

#[track_caller]
fn has_order_two(system: &mut System<f64>, start: &[f64], time: f64, coarse: usize) {
    let exact = end(system, start, (Method::Rosenbrock, time, 16 * coarse));
    let errors = [1, 2, 4].map(|finer| distance(&end(system, start, (METHOD, time, coarse * finer)), &exact));
    for pair in errors.windows(2) {
        close((pair[0] / pair[1]).log2(), 2.0, 0.2);
    }
}

#[test]
fn a_rigid_machine_with_friction_springs_and_a_lag_converges_at_order_two() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.8), ("transition_velocity", 1.5)])
        .effect("viscous_friction", 1, &[("viscous", 0.2)])
        .effect("spring", 1, &[("stiffness", 6.0), ("rest", 0.3)]);
    machine.actuator(0, &[("gain", 1.5), ("lag", 0.06)]);
    let mut system = machine.system();
    system.hold(0, 1.2);
    has_order_two(&mut system, &[0.4, -0.3, 1.5, -2.0, 0.7], 0.5, 100);
}

#[test]
fn links_of_elements_converge_at_order_two() -> Result<()> {
    let d = two_link::arm(&json!({"elements": 3}))?;
    let mut system = d.system::<f64>(&d.parameters)?;
    system.hold(0, 2.0);
    let mut start = vec![0.0; d.n_states()];
    (start[0], start[1]) = (0.1, -0.1);
    // From where fast vibrations have died away: a damped mode that a step does not resolve has no order.
    let start = end(&mut system, &start, (Method::Rosenbrock, 0.2, 2000));
    system.hold(0, -1.0);
    has_order_two(&mut system, &start, 0.1, 200);
    Ok(())
}

#[test]
fn a_mode_obeys_the_characteristic_polynomial() {
    // y = v - conj(s) q of an oscillator obeys y' = s y; stiff and light, from 0.05 to 50 rad a step.
    for (reach, ratio) in [(0.05_f64, 0.0_f64), (0.6, 0.3), (3.0, 0.02), (50.0, 0.9)] {
        let step = 1e-3;
        let frequency = reach / step;
        let mut machine = Machine::new(&slider(1.0));
        let numbers = [("stiffness", frequency * frequency), ("damping", 2.0 * ratio * frequency)];
        machine.effect("joint_compliance", 0, &numbers);
        let (mut system, mut integrator) = (machine.system(), Integrator::new(METHOD, 2));
        let s = Complex::new(-ratio, (1.0 - ratio * ratio).sqrt()) * frequency;
        let mut x = [1.0, 0.0];
        let mut modes = Vec::new();
        for _ in 0..6 {
            modes.push(Complex::from(x[1]) - s.conj() * x[0]);
            integrator.step(&mut system, &mut x, step);
        }
        for three in modes.windows(3) {
            let mean = three[2] * (9.0 / 16.0) + three[1] * (3.0 / 8.0) + three[0] / 16.0;
            let left = three[2] - three[1] - s * step * mean;
            assert!(left.norm() < 1e-10 * (1.0 + reach) * frequency, "{reach} {ratio}: {left}");
        }
    }
}

#[test]
fn what_is_far_too_stiff_dies_away() -> Result<()> {
    // Curvature up to some 10^5 rad/s, in steps of 1 ms.
    let d = two_beams::machine(6, two_beams::hold);
    let mut system = d.system::<f64>(&d.parameters)?;
    let mut start = vec![0.0; d.n_states()];
    start[0] = 0.3;
    let x = end(&mut system, &start, (METHOD, 1.0, 1000));
    let reference = end(&mut system, &start, (Method::LinearlyImplicit, 1.0, 20_000));
    for joint in 0..2 {
        close(x[joint], reference[joint], 1e-3);
    }
    Ok(())
}

#[test]
fn energy_drifts_no_more_than_the_law_says() {
    // A pendulum of small swings is an explicit oscillator of w = sqrt(3 g / 2 l) or so: its amplitude grows by 7/64 (w h)^4 a step.
    let machine = Machine::new(&double_pendulum([1.0, 1e-9], [0.5, 0.4]));
    let (mut system, step, steps) = (machine.system(), 0.01, 20_000);
    let mut integrator = Integrator::new(METHOD, 4);
    let mut x = [1e-3, 0.0, 0.0, 0.0];
    let mut jacobian = [0.0; 16];
    system.jacobian(&[0.0; 4], &mut jacobian);
    let square = -jacobian[8];
    assert!(square > 1.0, "gravity does not pull it back: {jacobian:?}");
    let energy = |x: &[f64; 4]| 0.5 * (x[2] * x[2] + square * x[0] * x[0]);
    let first = energy(&x);
    (0..steps).for_each(|_| integrator.step(&mut system, &mut x, step));
    let growth = 2.0 * 7.0 / 64.0 * (square * step * step).powi(2) * f64::from(steps);
    close((energy(&x) / first).ln() / growth, 1.0, 0.2);
}

#[test]
fn commands_that_jump_cost_no_order() -> Result<()> {
    let d = two_link::arm(&json!({"strain": 2}))?;
    let mut system = d.system::<f64>(&d.parameters)?;
    let mut run = |method: Method, steps: usize| {
        let mut x = vec![0.0; d.n_states()];
        let mut integrator = Integrator::new(method, x.len());
        for half in 0..2 {
            system.hold(0, [0.5, -0.5][half]);
            (0..steps).for_each(|_| integrator.step(&mut system, &mut x, 0.05 / steps as f64));
        }
        x[..2].to_vec()
    };
    let exact = run(Method::Rosenbrock, 4000);
    let errors = [200, 400, 800].map(|steps| distance(&run(METHOD, steps), &exact));
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(order > 1.7, "order {order}: {errors:?}");
    }
    Ok(())
}

#[test]
fn a_run_that_goes_on_elsewhere_is_a_new_one() -> Result<()> {
    let d = two_link::arm(&json!({"elements": 5}))?;
    let mut system = d.system::<f64>(&d.parameters)?;
    let start: Vec<f64> = (0..d.n_states()).map(|k| 1e-3 * (1.0 + k as f64).sin()).collect();
    let mut used = Integrator::new(METHOD, start.len());
    let mut elsewhere = vec![0.0; start.len()];
    (0..5).for_each(|_| used.step(&mut system, &mut elsewhere, 1e-3));
    let (mut x, mut y) = (start.clone(), start.clone());
    let mut fresh = Integrator::new(METHOD, start.len());
    for _ in 0..5 {
        used.step(&mut system, &mut x, 1e-3);
        fresh.step(&mut system, &mut y, 1e-3);
    }
    assert_eq!(x, y);
    let count = allocation_counter::measure(|| used.step(&mut system, &mut x, 1e-3)).count_total;
    assert_eq!(count, 0);
    Ok(())
}

#[test]
fn derivatives_of_steps_are_those_of_the_discrete_solution() -> Result<()> {
    let d = two_link::arm(&json!({"elements": 4}))?;
    let mut system = d.system::<f64>(&d.parameters)?;
    let lifted: Vec<Dual<f64, 1>> = d.parameters.iter().map(|&value| Dual::constant(value)).collect();
    let mut duals = d.system::<Dual<f64, 1>>(&lifted)?;
    let start = vec![0.0; d.n_states()];
    for place in [0, 1, 4] {
        let mut x: Vec<Dual<f64, 1>> = start.iter().map(|&value| Dual::constant(value)).collect();
        x[place].gradient[0] = 1.0;
        let mut integrator = Integrator::new(METHOD, x.len());
        (0..20).for_each(|_| integrator.step(&mut duals, &mut x, 1e-3));
        let mut side = |change: f64| {
            let mut moved = start.clone();
            moved[place] += change;
            end(&mut system, &moved, (METHOD, 0.02, 20))
        };
        let (ahead, behind) = (side(1e-6), side(-1e-6));
        let size = x.iter().map(|x| x.gradient[0].abs()).fold(0.0, f64::max);
        for (x, (ahead, behind)) in x.iter().zip(ahead.iter().zip(&behind)) {
            close(x.gradient[0], (ahead - behind) / 2e-6, 1e-6 * size);
        }
    }
    Ok(())
}
