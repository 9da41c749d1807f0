//! Steps of controlled error, in whole simulations: as exact as asked, bounded, and with the derivatives of their own solution.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use vpm_core::error::{Diverged, Error};
use vpm_core::integrator::{Adaptive, Halt, Integrator, MOST_STEPS, Method};
use vpm_core::live::Live;
use vpm_core::motion::JointMotion;
use vpm_core::ode::Ode;
use vpm_core::samples::double_pendulum;
use vpm_core::simulate::{Setting, Stepping, free_run, prescribed};
use vpm_core::table::Table;

use crate::common::{Bench, Machine};

const TIGHT: Method = Method::Adaptive { tolerance: 1e-10 };
const START: [f64; 5] = [0.4, -0.3, 0.5, 0.2, 0.7];

/// A pendulum of two links with sharp friction, a stiff spring and a lag.
fn machine() -> Machine {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.02)])
        .effect("spring", 1, &[("stiffness", 400.0), ("rest", 0.3)])
        .actuator(0, &[("gain", 1.5), ("delay", 0.0137), ("lag", 0.003)])
        .actuator(1, &[("gain", 1.5)]);
    machine
}

/// Commands that jump at every sample.
fn commands(rows: usize) -> Vec<f64> {
    (0..2 * rows).map(|k| 2.0 * (0.37 * k as f64).sin()).collect()
}

fn largest_difference(left: &[f64], right: &[f64]) -> f64 {
    assert_eq!(left.len(), right.len());
    left.iter().zip(right).map(|(l, r)| (l - r).abs()).fold(0.0, f64::max)
}

#[test]
fn names_are_read_and_written() {
    for (name, tolerance) in [("adaptive", 1e-6), ("adaptive(1e-8)", 1e-8), ("adaptive( 0.001 )", 1e-3)] {
        let method = Method::from_name(name).unwrap();
        assert_eq!(method, Method::Adaptive { tolerance });
        assert_eq!(Method::from_name(&method.to_string()).unwrap(), method);
    }
    for method in Method::ALL {
        assert_eq!(Method::from_name(method.name()).unwrap(), method);
    }
}

#[test]
fn the_error_follows_the_tolerance_whatever_the_samples() {
    let inputs = commands(60);
    // The reference takes 3000 equal steps of another method through each sample.
    let exact = Bench::new(&machine(), 0.01, 3000, Method::Rosenbrock).free(&START, &inputs).states;
    for tolerance in [1e-4, 1e-6, 1e-8] {
        for pieces in [1, 3] {
            let bench = Bench::new(&machine(), 0.01, pieces, Method::Adaptive { tolerance });
            let error = largest_difference(&bench.free(&START, &inputs).states, &exact);
            println!("tolerance {tolerance:e}, {pieces} pieces: {error:.2e}");
            // Errors of single steps add up and grow with the motion.
            assert!(error < 200.0 * tolerance, "{error} with a tolerance of {tolerance} and {pieces} pieces");
        }
    }
}

/// Decay and swing of very different speed, with the number of evaluations.
struct Swing {
    drive: f64,
    evaluations: usize,
}

impl Ode<f64> for Swing {
    fn dim(&self) -> usize {
        3
    }
    fn coordinates(&self) -> usize {
        1
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        self.evaluations += 1;
        dxdt.copy_from_slice(&[x[1], -x[0], -1e6 * (x[2] - self.drive - x[0])]);
    }
    fn jacobian(&mut self, _: &[f64], jacobian: &mut [f64]) {
        jacobian.copy_from_slice(&[0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 1e6, 0.0, -1e6]);
    }
}

#[test]
fn the_step_goes_on_from_sample_to_sample() -> Result<(), Error> {
    let evaluations = |samples: usize, forget: bool| -> Result<usize, Error> {
        let (mut ode, mut adaptive) = (Swing { drive: 0.0, evaluations: 0 }, Adaptive::new(1e-6, 3)?);
        let mut x = [1.0, 0.0, 1.0];
        for _ in 0..samples {
            adaptive.advance(&mut ode, &mut x, 6.0 / samples as f64, &|| false)?;
            if forget {
                adaptive.reset();
            }
        }
        assert!((x[0] - 6.0_f64.cos()).abs() < 1e-5 && (x[2] - x[0]).abs() < 1e-5, "{x:?}");
        Ok(ode.evaluations)
    };
    // As many samples as steps cost no more than twice the steps; six steps of growth each where the step is forgotten.
    let (whole, cut, forgetful) = (evaluations(1, false)?, evaluations(100, false)?, evaluations(100, true)?);
    println!("{whole} evaluations in one go, {cut} in a hundred, {forgetful} if the step is forgotten");
    assert!(cut <= 2 * whole.max(600) && forgetful > 4 * cut, "{whole} {cut} {forgetful}");
    Ok(())
}

#[test]
fn an_input_that_jumps_costs_some_short_steps_and_no_accuracy() -> Result<(), Error> {
    let (mut ode, mut adaptive) = (Swing { drive: 0.0, evaluations: 0 }, Adaptive::new(1e-6, 3)?);
    let mut x = [1.0, 0.0, 1.0];
    adaptive.advance(&mut ode, &mut x, 1.0, &|| false)?;
    ode.drive = 5.0;
    let steps = adaptive.advance(&mut ode, &mut x, 2e-6, &|| false)?;
    // 1 us is the time constant: the closed form of a decay toward a place that hardly moves.
    let expected = 5.0 + 1.0_f64.cos() - 5.0 * (-2.0_f64).exp();
    assert!((x[2] - expected).abs() < 1e-4, "{} is not {expected} after {steps:?}", x[2]);
    assert!(steps.accepted < 40, "{steps:?}");
    Ok(())
}

#[test]
fn derivatives_are_those_of_the_steps_taken() {
    let (machine, inputs) = (machine(), commands(20));
    let run = |theta: &[f64], sensitivities: &[usize]| {
        let bench = Bench::new(&machine, 0.01, 1, TIGHT);
        Bench { theta: theta.to_vec(), sensitivities: sensitivities.to_vec(), ..bench }.free(&START, &inputs)
    };
    let by =
        [machine.index("coulomb_friction.coulomb"), machine.index("spring.stiffness"), machine.index("drive0.lag")];
    let exact = run(&machine.values, &by);
    // Values do not change with what is differentiated.
    assert!(largest_difference(&exact.states, &run(&machine.values, &[]).states) < 1e-12);
    for (column, &parameter) in by.iter().enumerate() {
        let step = 1e-4 * machine.values[parameter];
        let ends = [1.0, -1.0].map(|sign| {
            let mut theta = machine.values.clone();
            theta[parameter] += sign * step;
            run(&theta, &[]).outputs
        });
        let (mut worst, mut size) = (0.0_f64, 0.0_f64);
        for (place, (up, down)) in ends[0].iter().zip(&ends[1]).enumerate() {
            let (found, quotient) = (exact.jacobian[3 * place + column], (up - down) / (2.0 * step));
            worst = worst.max((found - quotient).abs());
            size = size.max(quotient.abs());
        }
        println!("parameter {parameter}: {:.1e} of {size:.2e}", worst / size);
        assert!(worst < 2e-5 * size, "parameter {parameter}: {worst} of {size}");
    }
}

#[test]
fn driven_from_outside_it_is_the_free_run() {
    let inputs = commands(100);
    let bench = Bench::new(&machine(), 0.01, 1, Method::Adaptive { tolerance: 1e-6 });
    let run = bench.free(&START, &inputs);
    let description = machine().build();
    let theta = description.parameters.clone();
    let mut live = Live::new(Arc::new(description), &theta, &START, bench.stepping).unwrap();
    for _ in 0..2 {
        for (k, row) in inputs.chunks_exact(2).enumerate().take(99) {
            assert_eq!(live.state(), &run.states[5 * k..5 * (k + 1)], "sample {k}");
            live.step(row).unwrap();
        }
        live.reset(&START).unwrap();
    }
}

#[test]
fn a_passive_joint_beside_a_prescribed_one() -> Result<(), Error> {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine.effect("spring", 1, &[("stiffness", 40.0), ("rest", 0.3)]);
    let description = machine.build();
    let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..101).flat_map(|k| [f(0.02 * f64::from(k)), 0.0]).collect() };
    let motion = [of(&|t| (3.0 * t).sin()), of(&|t| 3.0 * (3.0 * t).cos()), of(&|t| -9.0 * (3.0 * t).sin())];
    let run = |method, substeps| {
        let stepping = Stepping::new(0.02, substeps, method)?;
        let setting = Setting {
            description: &description,
            theta: &description.parameters,
            stepping,
            sensitivities: &[],
            interrupt: &|| false,
        };
        let table = |k: usize| Table::new("motion", &motion[k], 101, 2);
        prescribed(setting, JointMotion { position: table(0)?, velocity: table(1)?, acceleration: table(2)? }, &[1])
    };
    let (exact, found) = (run(Method::Rosenbrock, 100)?, run(Method::Adaptive { tolerance: 1e-8 }, 1)?);
    let error = largest_difference(&found.states, &exact.states);
    assert!(error < 1e-6, "{error}");
    Ok(())
}

/// `x' = 1 + x^2`: the tangent, which ends at pi/2.
struct Tangent;
impl Ode<f64> for Tangent {
    fn dim(&self) -> usize {
        1
    }
    fn coordinates(&self) -> usize {
        0
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt[0] = 1.0 + x[0] * x[0];
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        jacobian[0] = 2.0 * x[0];
    }
}

#[test]
fn what_no_step_can_follow_ends_the_run_with_the_place() -> Result<(), Error> {
    let (mut adaptive, mut x) = (Adaptive::new(1e-6, 1)?, [0.0]);
    let Err(Halt::Stuck(stuck)) = adaptive.advance(&mut Tangent, &mut x, 2.0, &|| false) else {
        panic!("it ends at {}", x[0])
    };
    assert!(!stuck.many && (stuck.reached - std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{stuck:?}");
    let sentence = Error::from(Halt::Stuck(stuck)).to_string();
    assert!(sentence.contains("state number 0 changes faster than any step can follow from 1.57"), "{sentence}");
    // One step of the enum says it with a number that is none.
    let (mut integrator, mut x) = (Integrator::new(Method::Adaptive { tolerance: 1e-6 }, 1), [0.0]);
    integrator.step(&mut Tangent, &mut x, 2.0);
    assert!(x[0].is_nan());
    Ok(())
}

#[test]
fn a_run_that_needs_too_many_steps_ends_with_what_it_had() {
    // A spring that swings some 80 times in the second sample interval of 1 s, at a tolerance that takes a thousand steps for each.
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine.effect("spring", 1, &[("stiffness", 4e4), ("rest", 0.3)]);
    let bench = Bench::new(&machine, 1.0, 1, Method::Adaptive { tolerance: 1e-11 });
    let description = machine.build();
    let inputs = Table::new("inputs", &[], 4, 0).unwrap();
    let error = free_run(bench.setting(), &[0.1, 0.2, 0.0, 0.0], inputs).unwrap_err();
    let Error::Diverged(partial) = &error else { panic!("{error}") };
    let Diverged { sample_index, time, outputs, states, method, .. } = &**partial;
    assert_eq!((*sample_index, method.as_str()), (1, "adaptive(1e-11)"));
    assert!(*time > 0.0 && *time < 1.0, "{time}");
    assert_eq!((outputs.len(), states.len()), (description.n_outputs(), description.n_states()));
    let sentence = error.to_string();
    assert!(sentence.contains(&format!("takes more than {MOST_STEPS} steps to follow at t = 0.")), "{sentence}");
    assert!(
        sentence.contains("with adaptive(1e-11) in steps of") && sentence.contains("larger tolerance"),
        "{sentence}"
    );
}

#[test]
fn it_can_be_interrupted_within_a_sample() -> Result<(), Error> {
    let asked = AtomicUsize::new(0);
    let ask = || asked.fetch_add(1, Ordering::Relaxed) > 0;
    let (mut adaptive, mut x) = (Adaptive::new(1e-12, 3)?, [1.0, 0.0, 1.0]);
    let halt = adaptive.advance(&mut Swing { drive: 0.0, evaluations: 0 }, &mut x, 100.0, &ask);
    assert_eq!(halt, Err(Halt::Interrupted));
    assert_eq!(asked.into_inner(), 2);
    Ok(())
}

#[test]
fn a_guarded_step_is_a_plain_one_where_nothing_happens() {
    let mut smooth = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    smooth.effect("viscous_friction", 0, &[("viscous", 0.2)]).actuator(0, &[("gain", 1.5)]);
    let inputs: Vec<f64> = (0..100).map(|k| (0.1 * f64::from(k)).sin()).collect();
    let run = |method| Bench::new(&smooth, 0.005, 1, method).free(&START[..4], &inputs).states;
    assert_eq!(run(Method::Guarded), run(Method::Rosenbrock));
}

/// Hides from a step that some of the states are coordinates.
struct Plain<O>(O);
impl<O: Ode<f64>> Ode<f64> for Plain<O> {
    fn dim(&self) -> usize {
        self.0.dim()
    }
    fn coordinates(&self) -> usize {
        0
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        self.0.rhs(x, dxdt);
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        self.0.jacobian(x, jacobian);
    }
    fn iteration_matrix(&mut self, x: &[f64], matrix: &mut [f64]) {
        self.0.iteration_matrix(x, matrix);
    }
}

#[test]
fn steps_without_their_coordinates_are_the_same() {
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let (mut left, mut right) = (machine().system(), Plain(machine().system()));
        let (mut x, mut y) = (START, START);
        let [mut short, mut whole] = [0; 2].map(|_| Integrator::new(method, 5));
        for _ in 0..50 {
            short.step(&mut left, &mut x, 0.002);
            whole.step(&mut right, &mut y, 0.002);
        }
        assert!(x != y && largest_difference(&x, &y) < 1e-11, "{}: {x:?} {y:?}", method.name());
    }
}

/// A mass that a constant force pushes away from the ground, a stiff spring, which it touches for a while if it comes fast enough.
struct Graze {
    /// Whether it says when it will touch the ground.
    tells: bool,
}

impl Graze {
    const PUSH: f64 = 9.0;
    const SPRING: f64 = 1e5;
}

impl Ode<f64> for Graze {
    fn dim(&self) -> usize {
        2
    }

    fn coordinates(&self) -> usize {
        1
    }

    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        (dxdt[0], dxdt[1]) = (x[1], Self::PUSH + Self::SPRING * (-x[0]).max(0.0));
    }

    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        jacobian.copy_from_slice(&[0.0, 1.0, if x[0] < 0.0 { -Self::SPRING } else { 0.0 }, 0.0]);
    }

    fn horizon(&mut self, x: &[f64]) -> f64 {
        if self.tells && x[0] > 0.0 && x[1] < 0.0 { x[0] / -x[1] } else { f64::INFINITY }
    }
}

#[test]
fn contacts_shorter_than_a_step_are_met() {
    // From far away, through 1 s of free flight, to a touch of 8 ms at 0.1 m/s, 1.5 s after the start; then up again.
    let (arrival, speed) = (1.5, 0.1);
    let start = |time: f64| [speed * time + 0.5 * Graze::PUSH * time * time, -speed - Graze::PUSH * time];
    let fly = |tells: bool| {
        let (mut ode, mut x) = (Graze { tells }, start(arrival).to_vec());
        let mut adaptive = Adaptive::new(1e-6, 2).unwrap();
        for _ in 0..3 {
            adaptive.advance(&mut ode, &mut x, 1.0, &|| false).unwrap();
        }
        x
    };
    // On the ground it swings about PUSH / SPRING, begins at the surface with `speed`, and leaves with it.
    let (rate, sag) = (Graze::SPRING.sqrt(), Graze::PUSH / Graze::SPRING);
    let touch = 2.0 * (speed / rate / sag).atan() / rate;
    let after = 3.0 - arrival - touch;
    let exact = [speed * after + 0.5 * Graze::PUSH * after * after, speed + Graze::PUSH * after];
    let met = fly(true);
    assert!(largest_difference(&met, &exact) < 1e-4, "{met:?} is not {exact:?}");
    // Without a word of it the steps go on as if there were no ground: the flight is a parabola to the end.
    let free = start(arrival - 3.0);
    let missed = fly(false);
    assert!(largest_difference(&missed, &free) < 1e-9, "{missed:?} is not {free:?}");
}
