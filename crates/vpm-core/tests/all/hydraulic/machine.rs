//! The servo-cylinder as a drive of a machine, on a sliding joint and on a line, against its rig and against closed forms.

use allocation_counter::measure;
use serde_json::{Value, json};
use vpm_core::actuator::hydraulic::{EntrainedAir, PressedSeals, SealFriction};
use vpm_core::actuator::hydraulic::{ServoCylinder, ServoRig, ServoState};
use vpm_core::effect::{CoulombFriction, StribeckFriction, ViscousFriction};
use vpm_core::error::Error;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::{Dual, Result};

use crate::common::hydraulics::{Chirp, nominal};
use crate::common::servo_machine::{MIDDLE, On, leg, machine, rest};
use crate::common::values;
use crate::common::{Bench, Machine, close};

/// A step of 2 mA, then a chirp, held for 0.2 ms.
fn currents() -> Vec<f64> {
    let chirp = Chirp { amplitude: 1e-3, start: 12.0, slope: 300.0 };
    (0..1500).map(|k| if k < 500 { 2e-3 } else { chirp.current((k - 500) as f64 * 2e-4) }).collect()
}

/// Position, velocity, spool, spool rate, chambers of the rig after every sample.
fn of_rig(servo: &ServoCylinder<f64>, method: Method, currents: &[f64]) -> Result<Vec<[f64; 6]>> {
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(*servo)?);
    let mut integrator = Integrator::new(method, 6);
    let row = |x: &[f64; 6]| [x[0] + MIDDLE, x[2], x[1], x[3], x[4], x[5]];
    Ok(currents
        .iter()
        .map(|&current| {
            let shown = row(&x);
            rig.current = current;
            integrator.step(&mut rig, &mut x, 2e-4);
            shown
        })
        .collect())
}

#[test]
fn machine_moves_as_the_rig() {
    let (servo, currents) = (nominal(), currents());
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let expected = of_rig(&servo, method, &currents).unwrap();
        for on in [On::Joint, On::Line] {
            let machine = machine(&servo, on);
            let bench = Bench::new(&machine, 2e-4, 1, method);
            let run = bench.free(&rest(&machine), &currents);
            // The rig's position is counted from mid-stroke, here it has 9 digits less of the chambers' stiffness to itself.
            let sizes = [1e-3, 0.1, 2e-3, 1.0, 1e6, 1e6];
            for (k, (found, expected)) in run.states.chunks_exact(6).zip(&expected).enumerate() {
                for place in 0..6 {
                    let off = (found[place] - expected[place]).abs() / sizes[place];
                    assert!(off < 1e-8, "{} {on:?} sample {k}: {found:?} {expected:?}", method.name());
                }
            }
        }
    }
}

#[test]
fn outputs_show_the_drive() {
    let servo = nominal();
    let machine = machine(&servo, On::Line);
    let bench = Bench::new(&machine, 1e-3, 4, Method::LinearlyImplicit);
    let run = bench.free(&rest(&machine), &[2e-3; 60]);
    let layout = bench.description.layout();
    let (width, first) = (bench.description.n_outputs(), layout.hydraulics());
    assert_eq!((layout.hydraulics, layout.dc_motors, layout.supplies, width), (1, 0, 1, 4 + 2 + 3 + 5 + 2));
    let (last, state) = (&run.outputs[59 * width..], &run.states[59 * 6..]);
    let shown = &last[first..first + 5];
    assert_eq!(shown[..3], [state[2], state[4], state[5]]);
    let areas = servo.cylinder.areas();
    close(last[5], areas.a * state[4] - areas.b * state[5], 1e-9);
    let at = [state[0] - MIDDLE, state[2], state[1], state[3], state[4], state[5]];
    let flows = servo.flows(&ServoState::from_array(at));
    assert_eq!((shown[3], shown[4]), (flows.into_a, flows.out_of_b));
    let [pressure, flow]: [f64; 2] = last[first + 5..].try_into().unwrap();
    assert_eq!((pressure, flow), (servo.supply_pressure, shown[3]));
}

/// The nominal drive with everything that a drive can have.
fn complete() -> ServoCylinder<f64> {
    let mut servo = nominal();
    servo.fluid.air = Some(EntrainedAir { fraction: 0.005, exponent: 1.4, reference_pressure: 101_325.0 });
    servo.fluid.more_air = Some(EntrainedAir { fraction: 0.003, exponent: 1.2, reference_pressure: 1e5 });
    servo.valve.overlap.width = 2e-4;
    servo.valve.delay = Some(4e-4);
    servo.cylinder.external_leakage = 5e-14;
    servo.cylinder.worn_leakage = Some(3e-13);
    servo.cylinder.seal = SealFriction {
        viscous: Some(ViscousFriction { viscous: 120.0 }),
        coulomb: Some(CoulombFriction { coulomb: 30.0, transition_velocity: 0.01 }),
        stribeck: Some(StribeckFriction { stribeck: 15.0, stribeck_velocity: 0.02, transition_velocity: 0.01 }),
        pressed: Some(PressedSeals { share: 0.02, transition_velocity: 0.01 }),
    };
    servo
}

#[test]
fn published_step_response_of_the_machine() -> Result<()> {
    let currents: Vec<f64> = (0..101).map(|ms| if ms < 50 { 2e-3 } else { -2e-3 }).collect();
    for on in [On::Joint, On::Line] {
        let machine = machine(&nominal(), on);
        let run = Bench::new(&machine, 1e-3, 100, Method::Rosenbrock).try_free(&rest(&machine), &currents)?;
        let found = [1, 2, 5, 10, 20, 50, 51, 55, 60, 100].map(|ms: usize| {
            let state = &run.states[6 * ms..];
            (format!("hyd.H1.step.t{ms:03}ms"), vec![state[4], state[5], state[0] - MIDDLE, state[1]])
        });
        let found = found.each_ref().map(|(name, numbers)| (name.as_str(), numbers.clone()));
        assert!(values::check_all("hyd.H1.", &found).is_ok());
    }
    Ok(())
}

#[test]
fn seals_air_and_overlap_are_those_of_the_rig() -> Result<()> {
    // With friction the iteration matrices differ, chords here and tangents there: both close in on one motion.
    let (servo, currents) = (complete(), currents());
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
    let mut integrator = Integrator::new(Method::Rosenbrock, 6);
    let machine = machine(&servo, On::Line);
    let run = Bench::new(&machine, 2e-4, 20, Method::Rosenbrock).try_free(&rest(&machine), &currents)?;
    for (found, &current) in run.states.chunks_exact(6).zip(&currents) {
        close(found[0] - MIDDLE, x[0], 1e-9);
        close(found[4], x[4], 20.0);
        rig.current = current;
        (0..20).for_each(|_| integrator.step(&mut rig, &mut x, 1e-5));
    }
    Ok(())
}

/// A state of the leg on its way: every law in action, away from kinks.
fn moving(start: &[f64]) -> Vec<f64> {
    let mut x = start.to_vec();
    (x[1], x[2], x[3], x[4]) = (0.4, 1e-3, 2e-3, -0.7);
    (x[5], x[6]) = (x[5] + 2e6, x[6] - 1e6);
    x
}

/// Supplies of every kind, with the number of their states.
fn sources() -> [(Value, usize); 4] {
    let sag = json!({"sagging": {"resistance": 2e10, "capacitance": 1e-12}});
    let lost = |own: Value| json!({"own": own, "drop": {"resistance": 1e10, "time_constant": 0.02}});
    [(json!("constant"), 0), (sag.clone(), 1), (lost(json!("constant")), 1), (lost(sag), 2)]
}

#[test]
fn state_jacobian_is_that_of_differences() {
    for (source, states) in sources() {
        check_jacobian(source, states);
    }
}

fn check_jacobian(source: Value, states: usize) {
    let (machine, start) = leg(&complete(), source);
    let (mut system, mut x) = (machine.system(), moving(&start));
    system.hold(0, 3e-3);
    let dim = x.len();
    assert_eq!(dim, 7 + states);
    // Of a drop something is lost.
    x.iter_mut().skip(7).for_each(|state| *state += 3e5);
    let (mut exact, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim]);
    system.jacobian(&x, &mut exact);
    system.scales(&mut sizes);
    let rates = |x: &[f64], system: &mut vpm_core::system::System<f64>| {
        let mut rates = vec![0.0; dim];
        system.rhs(x, &mut rates);
        rates
    };
    for column in 0..dim {
        let step = 1e-4 * sizes[column];
        let mut at = |side: f64| {
            let mut x = x.clone();
            x[column] += side * step;
            rates(&x, &mut system)
        };
        // Differences of fourth order.
        let [near, far] = [1.0, 2.0].map(|side| {
            let (ahead, behind) = (at(side), at(-side));
            ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * side * step)).collect::<Vec<_>>()
        });
        let size = |row: usize| sizes[column] / sizes[row];
        let largest = (0..dim).map(|row| (exact[row * dim + column] * size(row)).abs()).fold(0.0, f64::max);
        for row in 0..dim {
            let difference = (4.0 * near[row] - far[row]) / 3.0;
            let gap = (difference - exact[row * dim + column]).abs() * size(row);
            assert!(gap < 1e-6 * largest.max(1.0), "{row} {column}: {} {difference}", exact[row * dim + column]);
        }
    }
}

/// Central differences of a run by every parameter that can move both ways, relative to the largest slope of each channel.
fn check_sensitivities(machine: &Machine, start: &[f64], inputs: &[f64], method: Method) {
    let mut bench = Bench::new(machine, 1e-3, 2, method);
    bench.sensitivities = (0..machine.values.len()).collect();
    let (variables, width) = (machine.values.len(), bench.description.n_outputs());
    let exact = bench.free(start, inputs).jacobian;
    bench.sensitivities.clear();
    for (k, name) in machine.names.iter().enumerate().filter(|(k, _)| machine.values[*k] != 0.0) {
        let step = 1e-5 * machine.values[k].abs();
        let mut at = |side: f64| {
            bench.theta[k] = machine.values[k] + side * step;
            bench.free(start, inputs).outputs
        };
        let (ahead, behind, ahead_far, behind_far) = (at(1.0), at(-1.0), at(2.0), at(-2.0));
        bench.theta[k] = machine.values[k];
        let slope = |place: usize| {
            (8.0 * (ahead[place] - behind[place]) - (ahead_far[place] - behind_far[place])) / (12.0 * step)
        };
        for column in 0..width {
            let places: Vec<usize> = (column..ahead.len()).step_by(width).collect();
            let largest = places.iter().map(|&place| slope(place).abs()).fold(0.0, f64::max);
            let value = places.iter().map(|&place| ahead[place].abs()).fold(0.0, f64::max);
            // Rounding of the value, over the step, is what the differences cannot see below.
            let allowed = 2e-6 * largest + 1e-11 * value / step;
            for place in places {
                let gap = (exact[place * variables + k] - slope(place)).abs();
                assert!(
                    gap <= allowed,
                    "{} {name} {column}: {} {}",
                    method.name(),
                    exact[place * variables + k],
                    slope(place)
                );
            }
        }
    }
}

#[test]
fn sensitivities_are_those_of_differences() {
    for (source, _) in &sources()[1..] {
        let (machine, start) = leg(&complete(), source.clone());
        for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
            check_sensitivities(&machine, &moving(&start), &[3e-3; 12], method);
        }
    }
}

#[test]
fn machine_in_numbers_with_derivatives_allocates_nothing_in_a_step() {
    let (machine, start) = leg(&complete(), json!("constant"));
    let theta: Vec<_> = machine.values.iter().map(|&value| Dual::<f64, 4>::constant(value)).collect();
    let mut system = machine.build().system(&theta).unwrap();
    let mut x: Vec<_> = start.iter().map(|&value| Dual::constant(value)).collect();
    for method in Method::ALL {
        let mut integrator = Integrator::new(method, x.len());
        integrator.step(&mut system, &mut x, 1e-5);
        let counted = measure(|| integrator.step(&mut system, &mut x, 1e-5));
        assert_eq!(counted.count_total, 0, "{}", method.name());
    }
}

#[test]
fn an_explicit_step_too_long_for_the_oil_is_refused() {
    // A slow spool and no damping leave the vibration of the mass on the oil, whose closed form is that of the rig.
    let mut servo = nominal();
    servo.valve.frequency = Some(20.0);
    servo.load.damping = 0.0;
    servo.cylinder.internal_leakage = 0.0;
    let machine = machine(&servo, On::Line);
    let stiffness = servo.cylinder.oil_stiffness(&servo.fluid, servo.rest().chambers, 0.0) + servo.load.stiffness;
    let omega = (stiffness / servo.load.mass).sqrt();
    let refused =
        |method: Method, step: f64| Bench::new(&machine, step, 1, method).try_free(&rest(&machine), &[0.0; 2]);
    let error = refused(Method::Rk4, 5e-3).unwrap_err();
    let Error::StepTooLarge { frequency, limit, .. } = error else { panic!("{error}") };
    close(frequency * std::f64::consts::TAU, omega, 1e-6 * omega);
    close(limit, 8.0_f64.sqrt() / omega, 1e-5 / omega);
    assert!(refused(Method::Rk4, 0.99 * limit).is_ok());
    // Without damping the explicit rule of the chambers lets the oil grow at every step.
    assert!(refused(Method::SemiImplicit, 1e-5).is_err());
    assert!(refused(Method::LinearlyImplicit, 5e-3).is_ok());
}

#[test]
fn natural_sizes_are_those_of_the_parts() {
    let (machine, _) = leg(&complete(), json!({"sagging": {"resistance": 2e10, "capacitance": 1e-12}}));
    let mut sizes = [0.0; 8];
    machine.system().scales(&mut sizes);
    let valve = &complete().valve;
    // The spool as it is: 0.4 ms come on top of the inverse of its frequency.
    let rate = valve.stroke / (1.0 / valve.frequency.unwrap() + 4e-4);
    close(sizes[4], rate, 1e-12 * rate);
    sizes[4] = 0.0;
    assert_eq!(sizes, [1e-2, 1.0, 5e-3, valve.stroke, 0.0, 1e5, 1e5, 1e5]);
}
