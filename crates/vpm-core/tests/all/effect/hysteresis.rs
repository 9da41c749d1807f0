//! Friction with memory against Dahl's closed form, the second law, and itself under other integrators and number types.

use serde_json::json;
use vpm_core::effect::{Hysteresis, MemoryLaw};
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::ode::Ode;
use vpm_core::samples::{double_pendulum, slider};
use vpm_core::simulate::{Setting, Stepping};
use vpm_core::table::Table;
use vpm_core::{Dual, Scalar};

use crate::common::{ALWAYS, Bench, Machine, close};

const DAHL: Hysteresis<f64> = Hysteresis { force: 3.0, displacement: 2e-3, shape: 1.0 };
const SHAPES: [f64; 4] = [0.0, 0.3, 1.0, 4.0];

fn shaped(shape: f64) -> Hysteresis<f64> {
    Hysteresis { shape, ..DAHL }
}

/// Memory after the rate has been integrated over `way` in `pieces` steps of the classical Runge-Kutta method.
fn stepped(law: &Hysteresis<f64>, mut z: f64, way: f64, pieces: usize) -> f64 {
    let h = way / pieces as f64;
    let (v, h) = (h.signum(), h.abs());
    for _ in 0..pieces {
        let a = law.rate(v, z);
        let b = law.rate(v, z + 0.5 * h * a);
        let c = law.rate(v, z + 0.5 * h * b);
        let d = law.rate(v, z + h * c);
        z += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    z
}

#[test]
fn dahl_friction_follows_its_closed_form() {
    // dz/dq = (1 - z)/d forward: z = 1 - (1 - z0) e^(-q/d) with either sign of z0; backward likewise with the signs turned.
    for z in [-0.95_f64, -0.2, 0.0, 0.4, 0.99] {
        for way in [1e-5, 4e-4, 3e-3, 2e-2] {
            close(DAHL.advance(z, way, 0.0), 1.0 - (1.0 - z) * (-way / 2e-3).exp(), 1e-14);
            close(DAHL.advance(z, -way, 0.0), -1.0 + (1.0 + z) * (-way / 2e-3).exp(), 1e-14);
        }
    }
    close(DAHL.effort(0.0, DAHL.advance(0.0, 1.0, 0.0)), -3.0, 1e-15);
}

#[test]
fn the_exact_way_is_the_integral_of_the_rate() {
    for shape in SHAPES {
        let law = shaped(shape);
        for z in [-0.9, -0.3, 0.0, 0.5, 1.0] {
            for way in [-7e-3, -8e-4, 3e-4, 5e-3] {
                close(law.advance(z, way, 0.0), stepped(&law, z, way, 4000), 2e-7);
                let half = law.advance(law.advance(z, 0.3 * way, 0.0), 0.7 * way, 0.0);
                close(law.advance(z, way, 0.0), half, 1e-13);
            }
        }
    }
}

#[test]
fn stored_energy_is_the_integral_of_the_unloading_force() {
    // Unloading, dz/dq = (1 + b |z|)/d: the energy is F d times the integral of s/(1 + b s), here by Simpson's rule. 9e-6 is within the series.
    for shape in [0.0, 9e-6, 0.3, 4.0] {
        for z in [-1.0_f64, 0.3, 0.8] {
            let (pieces, of) = (1000, |s: f64| s / (1.0 + shape * s));
            let h = z.abs() / f64::from(pieces);
            let middle = |k: i32| f64::from(k) * h;
            let parts = (0..pieces).map(|k| of(middle(k)) + 4.0 * of(middle(k) + 0.5 * h) + of(middle(k + 1)));
            close(shaped(shape).stored(z), 3.0 * 2e-3 * parts.sum::<f64>() * h / 6.0, 1e-12);
        }
    }
}

#[test]
fn small_shapes_go_as_their_closed_form() {
    // dy/du = 1 - b y up to y = 0, at u = ln(1 - b y)/b, and 1 - y from there, both accurate near b = 0.
    let shape = 9e-6_f64;
    let law = shaped(shape);
    for z in [-0.9_f64, -0.4] {
        let to_zero = (-shape * z).ln_1p() / shape;
        for u in [0.1, 0.35, 1.0, 2.0] {
            let gone = -(-shape * u).exp_m1();
            let expected = if u < to_zero { z + gone / shape - z * gone } else { -(-(u - to_zero)).exp_m1() };
            close(law.advance(z, 2e-3 * u, 0.0), expected, 3e-15);
            close(law.advance(-z, -2e-3 * u, 0.0), -expected, 3e-15);
        }
    }
}

#[test]
fn stiffness_about_rest_and_on_reversal() {
    for shape in SHAPES {
        let law = shaped(shape);
        let slope = |z: f64, way: f64| (law.effort(0.0, law.advance(z, way, 0.0)) - law.effort(0.0, z)) / way;
        close(slope(0.0, 1e-9), -3.0 / 2e-3, 1e-3);
        close(slope(1.0, -1e-9) / (-3.0 / 2e-3), 1.0 + shape, 1e-5);
    }
}

#[test]
fn closed_loops_only_take_energy() {
    for shape in SHAPES {
        let law = shaped(shape);
        let (mut z, mut work, mut least) = (0.0, 0.0, f64::INFINITY);
        let way = |k: usize| 4e-3 * ((k as f64) * 0.001).sin() + 1.5e-3 * ((k as f64) * 0.00271).sin();
        for k in 0..600_000 {
            let step = way(k + 1) - way(k);
            let (stored, middle) = (law.stored(z), law.advance(z, 0.5 * step, 0.0));
            let next = law.advance(z, step, 0.0);
            // Simpson's rule for the work against the element along the step.
            let taken = -step / 6.0 * (law.effort(0.0, z) + 4.0 * law.effort(0.0, middle) + law.effort(0.0, next));
            least = least.min(taken - (law.stored(next) - stored));
            work += taken;
            z = next;
            assert!(z.abs() <= 1.0);
        }
        assert!(least > -1e-12, "shape {shape}: {least}");
        assert!(work > 0.5, "shape {shape}: {work}");
    }
}

#[test]
fn a_wide_loop_takes_the_work_of_dry_friction() {
    // Dahl: the force rises from -F to F along 2 F e^(-q/d), so that a loop of width w takes 2 F (w - 2 d (1 - e^(-w/d))).
    let (width, pieces) = (0.05, 20_000);
    let (mut z, mut work) = (-DAHL.advance(0.0, 1.0, 0.0), 0.0);
    for k in 0..2 * pieces {
        let step = if k < pieces { width } else { -width } / pieces as f64;
        let next = DAHL.advance(z, step, 0.0);
        work -= 0.5 * (DAHL.effort(0.0, z) + DAHL.effort(0.0, next)) * step;
        z = next;
    }
    close(work, 2.0 * 3.0 * (width - 2.0 * 2e-3), 1e-6);
}

#[test]
fn the_loop_closes_and_knows_no_speed() {
    // After one period the loop of a given amplitude is its limit cycle, symmetric, and the same at every speed and division.
    for shape in SHAPES {
        let law = shaped(shape);
        let cycle = |mut z: f64, pieces: usize| {
            for _ in 0..200 {
                for k in 0..4 * pieces {
                    let sign = if (pieces..3 * pieces).contains(&k) { -1.0 } else { 1.0 };
                    z = law.advance(z, sign * 1.3e-3 / pieces as f64, 0.0);
                }
            }
            z
        };
        let (slow, fast) = (cycle(0.0, 64), cycle(0.0, 3));
        close(slow, fast, 1e-11);
        if shape > 0.0 {
            close(cycle(0.8, 7), slow, 1e-9);
        }
        close(law.rate(0.7, 0.3), 10.0 * law.rate(0.07, 0.3), 1e-9);
    }
}

#[test]
fn the_exact_way_has_exact_derivatives() {
    for shape in [0.0, 1e-6, 0.3, 1.0, 4.0] {
        let numbers = [2e-3, shape, -0.6, 1.9e-3];
        let end = |n: [f64; 4]| Hysteresis { force: 1.0, displacement: n[0], shape: n[1] }.advance(n[2], n[3], 0.0);
        let dual = numbers.map(Dual::<f64, 4>::constant);
        let lifted: [Dual<f64, 4>; 4] = std::array::from_fn(|k| Dual::variable(dual[k].value, k));
        let [displacement, shape_of, z, way] = lifted;
        let slopes =
            Hysteresis { force: Dual::one(), displacement, shape: shape_of }.advance(z, way, Dual::zero()).gradient;
        for (k, slope) in slopes.into_iter().enumerate() {
            let step = if k == 1 { 1e-5 } else { 1e-6 * numbers[k].abs() };
            let moved = |by: f64| {
                let mut other = numbers;
                other[k] += by;
                end(other)
            };
            // Forward, since a shape of zero is the end of its range.
            let difference = (-3.0 * moved(0.0) + 4.0 * moved(step) - moved(2.0 * step)) / (2.0 * step);
            close(slope / (1.0 + difference.abs()), difference / (1.0 + difference.abs()), 1e-5);
        }
    }
}

fn rough(shape: f64) -> Machine {
    let mut machine = Machine::new(&slider(2.0));
    machine
        .effect("hysteresis", 0, &[("force", 3.0), ("displacement", 2e-3), ("shape", shape)])
        .actuator(0, &[("gain", 1.0)]);
    machine
}

#[test]
fn every_integrator_finds_the_same_motion_with_a_stick() {
    // A push over the limit, one below it, nothing: slides, turns, and rings about a place that its memory holds.
    let inputs: Vec<f64> = (0..900).map(|k| [5.0, -4.0, 0.0][k / 300]).collect();
    let run = |method: Method, substeps: usize| {
        let machine = rough(1.0);
        let bench = Bench::new(&machine, 1e-3, substeps, method);
        bench.channel(&bench.free(&[0.0; 3], &inputs), 0)
    };
    let reference = run(Method::Rk4, 64);
    for (method, substeps, tolerance) in [
        (Method::SemiImplicit, 64, 2e-5),
        (Method::LinearlyImplicit, 16, 2e-5),
        (Method::Rosenbrock, 16, 2e-5),
        (Method::Rk4, 4, 1e-6),
    ] {
        for (k, (found, expected)) in run(method, substeps).iter().zip(&reference).enumerate() {
            assert!((found - expected).abs() < tolerance, "{method:?} at {k}: {found} instead of {expected}");
        }
    }
}

#[test]
fn linearly_implicit_steps_far_beyond_the_stiffness_stay_bounded() {
    // 3 N over 20 nm on 2 kg: 1.4 kHz, with steps of 5 ms, over reversals of a push of 4 N. What fades in a step, fades fast.
    let mut machine = Machine::new(&slider(2.0));
    machine
        .effect("hysteresis", 0, &[("force", 3.0), ("displacement", 2e-8), ("shape", 1.0)])
        .actuator(0, &[("gain", 1.0)]);
    let inputs: Vec<f64> = (0..400).map(|k| if (k / 50) % 2 == 0 { 4.0 } else { -4.0 }).collect();
    let bench = Bench::new(&machine, 5e-3, 1, Method::LinearlyImplicit);
    let run = bench.free(&[0.0; 3], &inputs);
    let velocity = bench.channel(&run, 1);
    // It never gets faster than by 1 N on 2 kg for 0.25 s, and what is left of the time before.
    assert!(velocity.iter().all(|v| v.abs() < 0.15));
    // Pushed evenly it accelerates with 1 N on 2 kg in the end, in either direction.
    for phase in 0..8 {
        let (last, sign) = (50 * phase + 48, if phase % 2 == 0 { 1.0 } else { -1.0 });
        close(sign * (velocity[last] - velocity[last - 10]), 0.5 * 10.0 * 5e-3, 1e-4);
    }
}

#[test]
fn the_state_jacobian_is_that_of_differences() {
    // Narrow (one joint), wide (two joints), and with a drive of its own kind.
    let law = [("force", 1.5), ("displacement", 0.02), ("shape", 0.4)];
    let mut wide = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    wide.effect("hysteresis", 1, &law).effect("hysteresis", 0, &law).actuator(0, &[("gain", 2.0), ("lag", 0.02)]);
    let mut driven = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    let motor = json!({"type": "dc_motor", "resistance": 0.5, "time_constant": 2e-3, "torque_constant": 0.06,
        "back_emf": 0.06, "gear_ratio": 50.0, "efficiency": 0.8, "transition_velocity": 1e-3, "rotor_inertia": 2e-5});
    driven.add("actuators", json!({"name": "hip", "on": {"joint": 0}}), json!({"drive": motor}));
    driven.effect("hysteresis", 1, &law).effect("hysteresis", 0, &law);
    let of_two = vec![0.2, -0.3, 0.7, -0.4, 0.5, 0.6, -0.2];
    let states = [vec![0.1, 0.3, -0.4], of_two.clone(), of_two];
    for (machine, x) in [&rough(0.4), &wide, &driven].into_iter().zip(&states) {
        let mut system = machine.system();
        let dim = system.dim();
        assert_eq!(dim, x.len());
        let (mut matrix, mut ahead, mut behind) = (vec![0.0; dim * dim], vec![0.0; dim], vec![0.0; dim]);
        system.jacobian(x, &mut matrix);
        for column in 0..dim {
            let mut moved = x.clone();
            moved[column] += 1e-6;
            system.rhs(&moved, &mut ahead);
            moved[column] -= 2e-6;
            system.rhs(&moved, &mut behind);
            for row in 0..dim {
                let difference = (ahead[row] - behind[row]) / 2e-6;
                close(matrix[row * dim + column], difference, 1e-6 * (1.0 + difference.abs()));
            }
        }
    }
}

#[test]
fn sensitivities_are_those_of_differences() {
    let machine = rough(0.4);
    let inputs: Vec<f64> = (0..300).map(|k| [5.0, -4.0, 2.0][k / 100]).collect();
    let names = ["hysteresis.force", "hysteresis.displacement", "hysteresis.shape"];
    let places = names.map(|name| machine.index(name));
    for method in [Method::Rk4, Method::SemiImplicit, Method::LinearlyImplicit] {
        let description = machine.build();
        let stepping = Stepping::new(1e-3, 8, method).unwrap();
        let table = Table::new("inputs", &inputs, 300, 1).unwrap();
        let run = |theta: &[f64], sensitivities: &[usize]| {
            let setting = Setting { description: &description, theta, stepping, sensitivities, interrupt: ALWAYS };
            vpm_core::simulate::free_run(setting, &[0.0; 3], table).unwrap()
        };
        let exact = run(&machine.values, &places);
        let (outputs, last) = (description.n_outputs(), 299);
        for (k, &place) in places.iter().enumerate() {
            let step = 1e-5 * machine.values[place];
            let moved = |by: f64| {
                let mut theta = machine.values.clone();
                theta[place] += by;
                run(&theta, &[]).outputs[last * outputs]
            };
            let difference = (moved(step) - moved(-step)) / (2.0 * step);
            let found = exact.jacobian[(last * outputs) * 3 + k];
            assert!(
                (found - difference).abs() < 2e-3 * (difference.abs() + 1e-4),
                "{method:?} {k}: {found} {difference}"
            );
        }
    }
}

#[test]
fn inverse_dynamics_follow_the_path_of_a_simulation() {
    let machine = rough(0.4);
    let inputs: Vec<f64> = (0..900).map(|k| 5.0 * (k as f64 * 0.02).sin()).collect();
    let bench = Bench::new(&machine, 1e-3, 32, Method::Rk4);
    let run = bench.free(&[0.0; 3], &inputs);
    let [position, velocity, acceleration] = [0, 1, 2].map(|channel| bench.channel(&run, channel));
    let table = |numbers| Table::new("motion", numbers, 900, 1).unwrap();
    let motion = Motion {
        position: table(&position),
        velocity: table(&velocity),
        acceleration: table(&acceleration),
        inputs: table(&inputs),
        time_step: 1e-3,
    };
    let efforts = inverse_dynamics(&machine.build(), &machine.values, motion, &[], ALWAYS).unwrap();
    for (k, (required, input)) in efforts.required.iter().zip(&inputs).enumerate() {
        // Only an interval in which the motion turns is not of one direction.
        assert!((required - input).abs() < 2e-3, "{k}: {required} instead of {input}");
    }
    let memory: Vec<f64> = run.states.chunks_exact(3).map(|state| state[2]).collect();
    assert!(memory.iter().any(|z| *z > 0.9) && memory.iter().any(|z| *z < -0.9));
}
