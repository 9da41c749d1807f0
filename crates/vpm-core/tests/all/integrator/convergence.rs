//! Order of convergence, stability on stiff systems, and exactness of the state Jacobian.

use vpm_core::Dual;
use vpm_core::Scalar;
use vpm_core::error::Error;
use vpm_core::integrator::{Integrator, Lu, Method};
use vpm_core::ode::Ode;
use vpm_core::samples::{Random, arm7, double_pendulum, pendulum, slider};
use vpm_core::simulate::restarts;
use vpm_core::table::Table;

use crate::common::distance;
use crate::common::{Bench, Machine, close};

/// A swinging double pendulum with friction of every kind, a spring, and a drive with lag.
fn smooth() -> Machine {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("viscous_friction", 0, &[("viscous", 0.3)])
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 1.0)])
        .effect("stribeck_friction", 1, &[("stribeck", 0.2), ("stribeck_velocity", 2.0), ("transition_velocity", 1.5)])
        .effect("spring", 1, &[("stiffness", 2.0), ("rest", 0.3)])
        .effect("torque_ripple", 0, &[("period", 2.0), ("cosine", 0.2), ("sine", -0.1)])
        .actuator(0, &[("gain", 1.5), ("lag", 0.2)]);
    machine
}

/// Final state after 0.8 s in one sample interval of `steps` steps.
fn final_state(method: Method, steps: usize) -> Vec<f64> {
    let bench = Bench::new(&smooth(), 0.8, steps, method);
    let run = bench.free(&[0.6, -0.4, 0.5, 0.2, 0.0], &[2.0, 2.0]);
    run.states[5..].to_vec()
}

#[test]
fn integrators_converge_with_their_order() {
    let reference = final_state(Method::Rk4, 8192);
    for (method, order, coarse) in [
        (Method::SemiImplicit, 1.0, 512),
        (Method::Rk4, 4.0, 128),
        (Method::LinearlyImplicit, 2.0, 512),
        (Method::Rosenbrock, 4.0, 128),
    ] {
        let errors = [coarse, 2 * coarse, 4 * coarse].map(|steps| distance(&final_state(method, steps), &reference));
        for pair in errors.windows(2) {
            let found = (pair[0] / pair[1]).log2();
            assert!((found - order).abs() < 0.15, "{}: order {found} from errors {errors:?}", method.name());
        }
    }
}

#[test]
fn symplectic_euler_keeps_the_energy_of_an_oscillator() {
    // Over 1600 periods at 63 steps each, the amplitude neither grows nor decays (explicit Euler would grow by e^500).
    let mut machine = Machine::new(&slider(1.0));
    machine.effect("spring", 0, &[("stiffness", 1.0), ("rest", 0.0)]).actuator(0, &[("gain", 1.0)]);
    let bench = Bench::new(&machine, 0.1, 1, Method::SemiImplicit);
    let run = bench.free(&[1.0, 0.0], &vec![0.0; 100_000]);
    let energy = |k: usize| 0.5 * (run.states[2 * k].powi(2) + run.states[2 * k + 1].powi(2));
    let largest = (90_000..100_000).map(energy).fold(0.0, f64::max);
    let smallest = (90_000..100_000).map(energy).fold(f64::MAX, f64::min);
    assert!(largest < 0.53 && smallest > 0.47, "energy between {smallest} and {largest}, began at 0.5");
}

/// A stiff slider: viscous friction with a time constant of 0.1 ms, stepped at 1 ms.
fn stiff(method: Method) -> (Bench, vpm_core::Result<vpm_core::simulate::Run>) {
    let mut machine = Machine::new(&slider(1.0));
    machine.effect("viscous_friction", 0, &[("viscous", 1e4)]).actuator(0, &[("gain", 1.0)]);
    let bench = Bench::new(&machine, 1e-3, 1, method);
    let run = bench.try_free(&[0.0, 1.0], &[3.0; 400]);
    (bench, run)
}

#[test]
fn linearly_implicit_is_stable_where_explicit_methods_diverge_with_the_repair() {
    let (bench, run) = stiff(Method::LinearlyImplicit);
    let velocity = bench.channel(&run.unwrap(), 1);
    close(velocity[399], 3e-4, 1e-12);
    for method in [Method::Rk4, Method::SemiImplicit] {
        let (bench, run) = stiff(method);
        let Err(Error::Diverged(partial)) = run else { panic!("{} should diverge", method.name()) };
        let text = partial.to_string();
        for word in ["joint `axis`", "t = 0.", method.name(), "linearly_implicit"] {
            assert!(text.contains(word), "{text}");
        }
        let rows = partial.sample_index;
        assert!(rows > 2 && rows < 400 && (partial.time - rows as f64 * 1e-3).abs() < 1e-12);
        assert_eq!(partial.states.len(), rows * 2);
        assert_eq!(partial.outputs.len(), rows * bench.description.n_outputs());
        assert!(partial.outputs.iter().chain(&partial.states).all(|number| number.is_finite()));
    }
}

#[test]
fn divergence_names_the_joint_of_a_chain_and_the_sample_of_the_record() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine.effect("viscous_friction", 1, &[("viscous", 1e4)]).actuator(0, &[("gain", 1.0)]);
    let bench = Bench::new(&machine, 1e-3, 1, Method::Rk4);
    let inputs = [0.0; 200];
    let states = Table::new("initial_states", &[0.0, 0.0, 0.0, 1.0], 1, 4).unwrap();
    let run = restarts(bench.setting(), states, &[50], 100, Table::new("inputs", &inputs, 200, 1).unwrap());
    let Err(Error::Diverged(partial)) = run else { panic!("it should diverge") };
    assert!(partial.what.contains("joint `shoulder`") || partial.what.contains("joint `elbow`"), "{partial}");
    assert_eq!(partial.states.len(), (partial.sample_index - 50) * 4);
}

#[test]
fn linearly_implicit_stops_on_dry_friction_far_sharper_than_its_step() {
    // Friction decelerates by 1e-3 m/s a step, 10^5 times the transition velocity. Whatever the phase in which the slider comes to
    // rest, it stays: a few percent of a step's change of speed in alternating sign, no creep.
    for extra in 0..20 {
        let mut machine = Machine::new(&slider(1.0));
        machine.effect("coulomb_friction", 0, &[("coulomb", 1.0), ("transition_velocity", 1e-8)]);
        machine.actuator(0, &[("gain", 1.0)]);
        let bench = Bench::new(&machine, 1e-3, 1, Method::LinearlyImplicit);
        let speed = 0.1 + 5e-5 * f64::from(extra);
        let run = bench.free(&[0.0, speed], &[0.0; 4000]);
        let position = bench.channel(&run, 0);
        close(position[3999], 0.5 * speed * speed, 5e-6);
        close(position[3999], position[2000], 1e-6);
        assert!(bench.channel(&run, 1)[3999].abs() < 1e-4);
    }
}

#[test]
fn dry_friction_holds_against_a_load_below_it() {
    // 0.6 N against 1 N of friction: it creeps at vt artanh(0.6) and no faster.
    let mut machine = Machine::new(&slider(1.0));
    machine.effect("coulomb_friction", 0, &[("coulomb", 1.0), ("transition_velocity", 1e-3)]);
    machine.actuator(0, &[("gain", 1.0)]);
    let bench = Bench::new(&machine, 1e-3, 1, Method::LinearlyImplicit);
    let run = bench.free(&[0.0, 0.1], &[0.6; 2000]);
    close(bench.channel(&run, 1)[1999], 1e-3 * 0.6_f64.atanh(), 1e-12);
}

/// Jacobian against central differences of the right-hand side, at random states.
fn check_jacobian(machine: &Machine, states: usize) {
    let mut system = machine.system();
    let mut random = Random::new(11);
    assert_eq!(system.dim(), states);
    for _ in 0..5 {
        let x = random.numbers(states, 1.0);
        let mut jacobian = vec![0.0; states * states];
        system.jacobian(&x, &mut jacobian);
        for column in 0..states {
            let mut side = |step: f64| {
                let (mut moved, mut rate) = (x.clone(), vec![0.0; states]);
                moved[column] += step;
                system.rhs(&moved, &mut rate);
                rate
            };
            let (ahead, behind) = (side(1e-6), side(-1e-6));
            for row in 0..states {
                let difference = (ahead[row] - behind[row]) / 2e-6;
                close(jacobian[row * states + column], difference, 1e-6 * (1.0 + difference.abs()));
            }
        }
    }
}

#[test]
fn state_jacobian_is_exact() {
    check_jacobian(&smooth(), 5);
    check_jacobian(&Machine::new(&arm7()), 14);
}

#[test]
fn iteration_matrix_is_the_jacobian_but_for_chords_of_friction() {
    // Without dry friction they are the same; with it they differ in the velocity columns only.
    let mut machine = Machine::new(&pendulum(1.0, 0.5));
    machine.effect("viscous_friction", 0, &[("viscous", 0.7)]).effect(
        "spring",
        0,
        &[("stiffness", 3.0), ("rest", 0.0)],
    );
    let mut system = machine.system();
    let (mut exact, mut chosen) = ([0.0; 4], [0.0; 4]);
    system.jacobian(&[0.3, 0.8], &mut exact);
    system.iteration_matrix(&[0.3, 0.8], &mut chosen);
    for (exact, chosen) in exact.iter().zip(chosen) {
        close(chosen, *exact, 1e-13);
    }
    machine.effect("coulomb_friction", 0, &[("coulomb", 2.0), ("transition_velocity", 0.01)]);
    let mut system = machine.system();
    system.iteration_matrix(&[0.3, 0.8], &mut chosen);
    close(chosen[3], exact[3] - 2.0 / 0.8 / 0.25, 1e-12);
    close(chosen[2], exact[2], 1e-12);
}

#[test]
fn integrators_carry_nested_derivatives() {
    // d/dk of the state of a harmonic oscillator after one second, k = stiffness: against the closed form, through every integrator.
    struct Oscillator<S>(S);
    impl<S: Scalar> Ode<S> for Oscillator<S> {
        fn dim(&self) -> usize {
            2
        }
        fn coordinates(&self) -> usize {
            1
        }
        fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
            (dxdt[0], dxdt[1]) = (x[1], -(self.0 * x[0]));
        }
        fn jacobian(&mut self, _: &[S], jacobian: &mut [S]) {
            jacobian.copy_from_slice(&[S::zero(), S::one(), -self.0, S::zero()]);
        }
    }
    for (method, tolerance) in [
        (Method::SemiImplicit, 2e-3),
        (Method::Rk4, 1e-9),
        (Method::LinearlyImplicit, 2e-6),
        (Method::Rosenbrock, 1e-9),
    ] {
        let mut ode = Oscillator(Dual::<f64, 1>::variable(4.0, 0));
        let mut state = [Dual::constant(1.0), Dual::constant(0.0)];
        let mut integrator = Integrator::new(method, 2);
        for _ in 0..1000 {
            integrator.step(&mut ode, &mut state, 1e-3);
        }
        close(state[0].value, 2.0_f64.cos(), tolerance);
        // d cos(sqrt(k) t)/dk = -t sin(sqrt(k) t) / (2 sqrt(k)).
        close(state[0].gradient[0], -(2.0_f64.sin()) / 4.0, tolerance);
    }
}

#[test]
fn lu_solves_what_needs_row_exchanges() {
    let mut random = Random::new(2);
    for n in 1..8 {
        let mut matrix = random.numbers(n * n, 1.0);
        matrix[0] = 0.0;
        if n == 1 {
            matrix[0] = 0.3;
        }
        let x = random.numbers(n, 1.0);
        let mut b: Vec<f64> = matrix.chunks(n).map(|row| row.iter().zip(&x).map(|(a, x)| a * x).sum()).collect();
        let mut lu = Lu::new(n);
        lu.matrix().copy_from_slice(&matrix);
        lu.factorise();
        lu.solve(&mut b);
        for (found, expected) in b.iter().zip(&x) {
            close(*found, *expected, 1e-10);
        }
    }
}
