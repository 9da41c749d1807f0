//! The additive integrator on whole machines: order, agreement with other ways to the same step, stability, derivatives.

use crate::common;
use crate::common::two_beams;

use common::{Bench, Machine, close};
use proptest::prelude::*;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::samples::{Random, double_pendulum, slider};
use vpm_core::system::System;
use vpm_core::{Dual, Result};

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// State after `time` (s) in that many equal steps.
fn end(ode: &mut impl Ode<f64>, start: &[f64], method: Method, time: f64, steps: usize) -> Vec<f64> {
    let (mut x, mut integrator) = (start.to_vec(), Integrator::new(method, start.len()));
    for _ in 0..steps {
        integrator.step(ode, &mut x, time / steps as f64);
    }
    x
}

/// Orders from errors at `coarse`, twice and four times as many steps, against a finer run of another method.
#[track_caller]
fn orders(ode: &mut impl Ode<f64>, start: &[f64], time: f64, coarse: usize) -> Vec<f64> {
    let exact = end(ode, start, Method::Rosenbrock, time, 16 * coarse);
    let errors = [1, 2, 4].map(|finer| distance(&end(ode, start, Method::Additive, time, coarse * finer), &exact));
    assert!(errors[2] > 1e-12, "rounding hides the order: {errors:?}");
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Two joints with smooth friction, springs, a ripple, and a drive that lags.
fn smooth() -> Machine {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.8), ("transition_velocity", 1.5)])
        .effect("stribeck_friction", 1, &[("stribeck", 0.3), ("stribeck_velocity", 3.0), ("transition_velocity", 2.0)])
        .effect("viscous_friction", 1, &[("viscous", 0.2)])
        .effect("spring", 1, &[("stiffness", 6.0), ("rest", 0.3)])
        .effect("torque_ripple", 0, &[("period", 2.1), ("cosine", 0.2), ("sine", -0.1)]);
    machine.actuator(0, &[("gain", 1.5), ("lag", 0.06)]);
    machine
}

#[test]
fn a_rigid_machine_with_friction_springs_and_a_lag_converges_at_order_four() {
    let mut system = smooth().system();
    system.hold(0, 1.2);
    for order in orders(&mut system, &[0.4, -0.3, 1.5, -2.0, 0.7], 0.5, 40) {
        assert!((order - 4.0).abs() < 0.2, "order {order}");
    }
}

/// The two flexible links, their joints held by springs and rubbing.
fn rubbing(count: usize, transition: f64) -> Result<(System<f64>, Vec<f64>)> {
    let d = two_beams::machine(count, |content| {
        two_beams::hold(content);
        for joint in 0..2 {
            let numbers = [("coulomb", 0.3), ("transition_velocity", transition)];
            two_beams::effect(content, "coulomb_friction", joint, &numbers);
        }
    });
    let (n, system) = (d.n_coordinates(), d.system::<f64>(&d.parameters)?);
    let mut start = vec![0.0; 2 * n];
    (start[0], start[1]) = (0.3, -0.4);
    Ok((system, start))
}

#[test]
fn flexible_links_with_friction_converge_at_order_four() -> Result<()> {
    let (mut system, start) = rubbing(1, 3.0)?;
    for order in orders(&mut system, &start, 0.02, 80) {
        assert!((order - 4.0).abs() < 0.3, "order {order}");
    }
    Ok(())
}

/// A system that tells of its elasticity alone.
struct Told(System<f64>);

impl Ode<f64> for Told {
    fn dim(&self) -> usize {
        self.0.dim()
    }
    fn coordinates(&self) -> usize {
        self.0.coordinates()
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        self.0.rhs(x, dxdt);
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        self.0.jacobian(x, jacobian);
    }
    fn elasticity(&mut self, x: &[f64], block: &mut [f64]) -> bool {
        self.0.elasticity(x, block)
    }
}

#[test]
fn factors_of_the_mass_matrix_and_the_general_way_lead_to_the_same_steps() -> Result<()> {
    let d = two_beams::machine(3, |_| ());
    let (n, mut start) = (d.n_coordinates(), vec![0.0; 2 * d.n_coordinates()]);
    start[n] = 1.0;
    let [mut direct, general] = [d.system::<f64>(&d.parameters)?, d.system::<f64>(&d.parameters)?];
    let found = end(&mut direct, &start, Method::Additive, 0.1, 50);
    let expected = end(&mut Told(general), &start, Method::Additive, 0.1, 50);
    assert!(distance(&found, &start) > 1.0);
    assert!(distance(&found, &expected) < 1e-8 * distance(&found, &start), "{found:?}\n{expected:?}");
    Ok(())
}

/// Rates of a stage at one and the same state, with a reach, against `f(x) + reach J_I f`, the first order of the implicit argument.
#[test]
fn a_stage_moves_the_stiff_forces_to_its_end() {
    let machine = smooth();
    let mut system = machine.system();
    system.hold(0, 1.2);
    let x = [0.4, -0.3, 1.5, -2.0, 0.7];
    let (mut rates, mut stage) = ([0.0; 5], [0.0; 5]);
    system.rhs(&x, &mut rates);
    let gap = |system: &mut System<f64>, stage: &mut [f64; 5], reach| {
        system.additive_rates(&x, &x, 0.0, stage);
        assert!(system.additive_rates(&x, &x, reach, stage));
        distance(stage, &rates)
    };
    let [coarse, fine] = [1e-4, 1e-5].map(|reach| gap(&mut system, &mut stage, reach));
    close(coarse / fine, 10.0, 0.15);
    assert!(gap(&mut system, &mut stage, 0.0) < 1e-14);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_linear_oscillator_is_multiplied_by_the_stability_function(frequency in 1.0f64..5e3, ratio in 0.0f64..0.9, step in 1e-4f64..1e-2) {
        // The implicit table on x' = z x, by its stages in complex numbers; the machine in real ones.
        let (stiffness, damping) = (frequency * frequency, 2.0 * ratio * frequency);
        let mut machine = Machine::new(&slider(1.0));
        machine.effect("joint_compliance", 0, &[("stiffness", stiffness), ("damping", damping)]);
        let mut system = machine.system();
        let z = nalgebra::Complex::new(-ratio, (1.0 - ratio * ratio).sqrt()) * (frequency * step);
        let growth = stability(z);
        // In the real state (q, v) = (Re c, Re s c) with c the factor of the mode.
        let s = z / step;
        let start = [1.0, s.re];
        let x = end(&mut system, &start, Method::Additive, step, 1);
        prop_assert!((x[0] - growth.re).abs() < 1e-9, "{} {}", x[0], growth.re);
        prop_assert!((x[1] - (s * growth).re).abs() < 1e-9 * frequency);
    }
}

/// R(z) of the implicit table: `1 + z b^T (1 - z A)^-1 1`.
fn stability(z: nalgebra::Complex<f64>) -> nalgebra::Complex<f64> {
    const B: [f64; 6] = [82889.0 / 524_892.0, 0.0, 15625.0 / 83664.0, 69875.0 / 102_672.0, -2260.0 / 8211.0, 0.25];
    const A: [[f64; 6]; 6] = [
        [0.0; 6],
        [0.25, 0.25, 0.0, 0.0, 0.0, 0.0],
        [8611.0 / 62500.0, -1743.0 / 31250.0, 0.25, 0.0, 0.0, 0.0],
        [5_012_029.0 / 34_652_500.0, -654_441.0 / 2_922_500.0, 174_375.0 / 388_108.0, 0.25, 0.0, 0.0],
        [
            15_267_082_809.0 / 155_376_265_600.0,
            -71_443_401.0 / 120_774_400.0,
            730_878_875.0 / 902_184_768.0,
            2_285_395.0 / 8_070_912.0,
            0.25,
            0.0,
        ],
        B,
    ];
    let left = nalgebra::Matrix6::from_fn(|i, j| nalgebra::Complex::from(if i == j { 1.0 } else { 0.0 }) - z * A[i][j]);
    let stages = left.lu().solve(&nalgebra::Vector6::from_element(1.0.into())).unwrap();
    let sum: nalgebra::Complex<f64> = stages.iter().zip(B).map(|(stage, b)| stage * b).sum();
    nalgebra::Complex::from(1.0) + z * sum
}

#[test]
fn sharp_friction_limits_no_step() {
    // Friction changes the velocity by 1e-3 m/s a step, 10^5 times the transition velocity.
    for extra in 0..20 {
        let mut machine = Machine::new(&slider(1.0));
        machine.effect("coulomb_friction", 0, &[("coulomb", 1.0), ("transition_velocity", 1e-8)]);
        machine.actuator(0, &[("gain", 1.0)]);
        let bench = Bench::new(&machine, 1e-3, 1, Method::Additive);
        let speed = 0.1 + 5e-5 * f64::from(extra);
        let run = bench.free(&[0.0, speed], &[0.0; 400]);
        let position = bench.channel(&run, 0);
        close(position[399], 0.5 * speed * speed, 5e-6);
        close(position[399], position[200], 1e-9);
    }
    // It holds against loads below it and creeps as the law says, with 10^4 times the transition velocity a step.
    for load in [0.1, 0.6, 0.9, -0.95] {
        let mut machine = Machine::new(&slider(1.0));
        machine.effect("coulomb_friction", 0, &[("coulomb", 1.0), ("transition_velocity", 1e-7)]);
        machine.actuator(0, &[("gain", 1.0)]);
        let bench = Bench::new(&machine, 1e-3, 1, Method::Additive);
        let run = bench.free(&[0.0, 0.0], &[load; 500]);
        close(bench.channel(&run, 1)[499], 1e-7 * f64::atanh(load), 1e-11);
    }
}

#[test]
fn joints_that_stick_carry_a_flexible_arm() -> Result<()> {
    // Without springs the arm would fall; friction beyond its weight holds it, in steps of 2 ms, whatever shakes in the links.
    let d = two_beams::machine(3, |content| {
        for (joint, coulomb) in [25.0, 3.0].into_iter().enumerate() {
            let numbers = [("coulomb", coulomb), ("transition_velocity", 1e-6)];
            two_beams::effect(content, "coulomb_friction", joint, &numbers);
        }
    });
    let mut system = d.system::<f64>(&d.parameters)?;
    let x = end(&mut system, &vec![0.0; 2 * d.n_coordinates()], Method::Additive, 2.0, 1000);
    let n = d.n_coordinates();
    for joint in 0..2 {
        assert!(x[joint].abs() < 1e-2 && x[n + joint].abs() < 1e-4, "joint {joint}: {} {}", x[joint], x[n + joint]);
    }
    // What it carries bends it.
    assert!(x[2].abs() > 1e-3, "{x:?}");
    Ok(())
}

#[test]
fn stiff_links_and_memories_limit_no_step() -> Result<()> {
    // Curvature coordinates up to some 10^5 rad/s, and pre-sliding of 0.1 urad: an explicit step would have to stay below 10 us.
    let d = two_beams::machine(6, |content| {
        two_beams::hold(content);
        two_beams::effect(content, "hysteresis", 0, &[("force", 0.2), ("displacement", 1e-7), ("shape", 1.0)]);
    });
    let mut system = d.system::<f64>(&d.parameters)?;
    let dim = d.n_states();
    let mut start = vec![0.0; dim];
    start[0] = 0.3;
    let explicit = end(&mut system, &start, Method::Rk4, 0.02, 20);
    assert!(explicit.iter().any(|x| !x.is_finite() || x.abs() > 1e6), "the step would do explicitly: {explicit:?}");
    let x = end(&mut system, &start, Method::Additive, 1.0, 1000);
    let reference = end(&mut system, &start, Method::LinearlyImplicit, 1.0, 20_000);
    for joint in 0..2 {
        close(x[joint], reference[joint], 1e-3);
    }
    assert!(x[dim - 1].abs() <= 1.0 + 1e-6, "the memory left its range: {}", x[dim - 1]);
    Ok(())
}

#[test]
fn derivatives_of_steps_are_those_of_the_discrete_solution() -> Result<()> {
    // By the coordinates of the start, through friction, elasticity and all turns of the resistances.
    let (mut system, start) = rubbing(2, 0.05)?;
    let d = two_beams::machine(2, |content| {
        two_beams::hold(content);
        for joint in 0..2 {
            let numbers = [("coulomb", 0.3), ("transition_velocity", 0.05)];
            two_beams::effect(content, "coulomb_friction", joint, &numbers);
        }
    });
    let lifted: Vec<Dual<f64, 1>> = d.parameters.iter().map(|&value| Dual::constant(value)).collect();
    let mut duals = d.system::<Dual<f64, 1>>(&lifted)?;
    for place in [0, 1, 3, 7] {
        let mut x: Vec<Dual<f64, 1>> = start.iter().map(|&value| Dual::constant(value)).collect();
        x[place].gradient[0] = 1.0;
        let mut integrator = Integrator::new(Method::Additive, x.len());
        for _ in 0..20 {
            integrator.step(&mut duals, &mut x, 1e-3);
        }
        let mut side = |change: f64| {
            let mut moved = start.clone();
            moved[place] += change;
            end(&mut system, &moved, Method::Additive, 0.02, 20)
        };
        let (ahead, behind) = (side(1e-6), side(-1e-6));
        let size = x.iter().map(|x| x.gradient[0].abs()).fold(0.0, f64::max);
        for (x, (ahead, behind)) in x.iter().zip(ahead.iter().zip(&behind)) {
            close(x.gradient[0], (ahead - behind) / 2e-6, 1e-6 * size);
        }
    }
    Ok(())
}

#[test]
fn steps_allocate_nothing() -> Result<()> {
    let (mut system, mut x) = rubbing(2, 0.05)?;
    let mut integrator = Integrator::new(Method::Additive, x.len());
    let mut random = Random::new(4);
    x.iter_mut().for_each(|x| *x += 1e-4 * random.symmetric());
    let count = allocation_counter::measure(|| integrator.step(&mut system, &mut x, 1e-3)).count_total;
    assert_eq!(count, 0);
    Ok(())
}
