//! What a method says it damps is what its runs damp.

use crate::common;

use common::{Bench, Machine, close};
use proptest::prelude::*;
use serde_json::{Value, json};
use vpm_core::Error;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::integrator::resolution::{Taken, bends, sticks};
use vpm_core::samples::{double_pendulum, slider};
use vpm_core::simulate::{Hold, Stepping, resolution, unstuck};

/// A mass of 1 kg on a spring with a damper.
fn oscillator(frequency: f64, ratio: f64) -> Machine {
    let speed = std::f64::consts::TAU * frequency;
    let mut machine = Machine::new(&slider(1.0));
    let numbers = [("stiffness", speed * speed), ("damping", 2.0 * ratio * speed)];
    machine.effect("joint_compliance", 0, &numbers).actuator(0, &[("gain", 1.0)]);
    machine
}

/// Amplitude at the end of a run of 0.5 s by that at its beginning.
fn decay(machine: &Machine, frequency: f64, method: Method) -> f64 {
    let bench = Bench::new(machine, 1e-3, 1, method);
    let run = bench.free(&[1.0, 0.0], &[0.0; 501]);
    let amplitude = |k: usize| run.states[2 * k].hypot(run.states[2 * k + 1] / (std::f64::consts::TAU * frequency));
    amplitude(500) / amplitude(0)
}

#[test]
fn a_fast_spring_is_told_to_die() {
    let machine = oscillator(312.0, 0.0);
    let d = machine.build();
    for (method, left) in [(Method::LinearlyImplicit, 1.3e-7), (Method::Additive, 0.82)] {
        let stepping = Stepping::new(1e-3, 1, method).unwrap();
        let found = resolution(&d, &machine.values, &[1.0, 0.0], stepping, 0.5).unwrap();
        let [mode] = found.damped[..] else { panic!("{}: {found:?}", method.name()) };
        let seen = decay(&machine, 312.0, method);
        close(mode.frequency, 312.0, 1e-6);
        close(mode.time, 0.5, 0.0);
        // The first and the last amplitude are not taken at the same phase of the numerical vibration: a few percent.
        assert!((mode.left / seen).ln().abs() < 0.1, "{}: {} against {seen}", method.name(), mode.left);
        assert!((mode.left / left).ln().abs() < 0.05, "{}: {}", method.name(), mode.left);
        assert!(found.limit < 312.0 && found.limit > 10.0);
    }
    for method in [Method::Adaptive { tolerance: 1e-6 }, Method::SemiImplicit] {
        let stepping = Stepping::new(1e-4, 1, method).unwrap();
        let found = resolution(&d, &machine.values, &[1.0, 0.0], stepping, 0.5).unwrap();
        assert!(found.damped.is_empty() && found.limit > 312.0, "{}: {found:?}", method.name());
    }
}

#[test]
fn explicit_steps_that_move_a_frequency_or_let_it_grow_are_told() {
    // Symplectic steps turn by the angle a with 2 sin(a / 2) = h omega.
    let machine = oscillator(312.0, 0.0);
    let stepping = Stepping::new(1e-3, 1, Method::SemiImplicit).unwrap();
    let reach = std::f64::consts::TAU * 0.312;
    let found = resolution(&machine.build(), &machine.values, &[1.0, 0.0], stepping, 0.5).unwrap();
    let [mode] = found.damped[..] else { panic!("{found:?}") };
    close(mode.shift, 2.0 * (0.5 * reach).asin() / reach - 1.0, 1e-6);
    close(mode.left, 1.0, 1e-9);
    // Beyond h omega = 2 they grow, and so do those of rk4 beyond 2.83, also where the spring is damped well.
    for (method, hertz, ratio, grows) in [
        (Method::SemiImplicit, 330.0, 0.0, true),
        (Method::Rk4, 460.0, 0.0, true),
        (Method::Rk4, 900.0, 0.5, true),
        (Method::Rk4, 200.0, 0.5, false),
        (Method::LinearlyImplicit, 900.0, 0.5, false),
    ] {
        let machine = oscillator(hertz, ratio);
        let stepping = Stepping::new(1e-3, 1, method).unwrap();
        let found = resolution(&machine.build(), &machine.values, &[1.0, 0.0], stepping, 0.5).unwrap();
        assert_eq!(found.damped.iter().any(|mode| mode.left > 1.0), grows, "{} {hertz}: {found:?}", method.name());
    }
}

#[test]
fn friction_that_does_not_stick_is_told() {
    // A slider of 1 kg that 1 N brakes, from 0.01 m/s, in 300 steps of 1 ms, under loads that it holds where it creeps by the law itself.
    for method in Method::ALL {
        for turn in [0.5_f64, 1.5, 2.0, 8.0, 50.0, 5e3] {
            let width = 1e-3 / turn;
            let mut machine = Machine::new(&slider(1.0));
            machine.effect("coulomb_friction", 0, &[("coulomb", 1.0), ("transition_velocity", width)]);
            machine.actuator(0, &[("gain", 1.0)]);
            let bench = Bench::new(&machine, 1e-3, 1, method);
            let largest = |from: f64, load: f64| {
                let run = bench.free(&[0.0, from], &[load; 300]);
                run.states.chunks_exact(2).rev().take(20).map(|state| state[1].abs()).fold(0.0, f64::max)
            };
            let rests = [0.0_f64, 0.3, 0.5, 0.62, 0.8].into_iter().all(|load| {
                (0..8).all(|k| largest(1e-2 + f64::from(k) * 1.25e-4, load) <= width * (1.0 + load.atanh()))
            });
            let found = unstuck(&bench.description, &bench.theta, &[0.0, 0.01], &[0.0], bench.stepping).unwrap();
            assert_eq!(found.is_empty(), rests, "{} {turn}: {found:?}", method.name());
            assert_eq!(sticks(method, turn, Taken::Implicitly), rests, "{} {turn}", method.name());
            for friction in found {
                close(friction.turn / turn, 1.0, 1e-6);
                assert_eq!(friction.site, format!("joint `{}`", bench.description.bodies[0].joint.name));
            }
        }
    }
}

#[test]
fn friction_that_bends_and_does_not_stick_is_told() {
    // The same slider on bristles, whose stiffness times the square of a step over its mass is the turn; damped by 0 or 0.7.
    for (method, turn, ratio) in Method::ALL
        .into_iter()
        .flat_map(|method| [0.5_f64, 3.0, 50.0, 500.0].map(|turn| (method, turn)))
        .flat_map(|(method, turn)| [0.0, 0.7].map(|ratio| (method, turn, ratio)))
    {
        let way = 1e-6 / turn;
        let numbers = [
            ("coulomb", 1.0),
            ("displacement", way),
            ("damping", 2.0 * ratio / way.sqrt()),
            ("excess", 0.0),
            ("stribeck_velocity", 0.01),
        ];
        let mut machine = Machine::new(&slider(1.0));
        machine.effect("lugre_friction", 0, &numbers).actuator(0, &[("gain", 1.0)]);
        let bench = Bench::new(&machine, 1e-3, 1, method);
        let slow = |from: f64| {
            let Ok(run) = bench.try_free(&[0.0, from, 0.0], &[0.0; 300]) else { return false };
            run.states.chunks_exact(3).rev().take(20).all(|state| state[1].abs() <= way.sqrt())
        };
        let rests = (0..8).all(|k| slow(1e-2 + f64::from(k) * 1.25e-4));
        let what = format!("{} {turn} {ratio}", method.name());
        assert_eq!(bends(method, [turn, 2.0 * ratio * turn.sqrt()]), rests, "{what}");
        let found = unstuck(&bench.description, &bench.theta, &[0.0, 0.01, 0.0], &[0.0], bench.stepping).unwrap();
        assert_eq!(found.is_empty(), rests, "{what}: {found:?}");
        found.iter().for_each(|friction| close(friction.turn / turn, 1.0, 1e-6));
    }
}

#[test]
fn a_vibration_at_the_limit_loses_a_tenth() {
    for method in [Method::LinearlyImplicit, Method::Rosenbrock, Method::Additive, Method::Rk4] {
        let stepping = Stepping::new(1e-3, 1, method).unwrap();
        let machine = oscillator(20.0, 0.0);
        let found = resolution(&machine.build(), &machine.values, &[1.0, 0.0], stepping, 0.5).unwrap();
        let at = oscillator(found.limit, 0.0);
        close(decay(&at, found.limit, method), 0.9, 0.02);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn linearly_implicit_steps_have_their_stability_function(frequency in 5.0f64..600.0, ratio in 0.0f64..0.09) {
        // R(z) = (1 + (1 - 2 g) z)/(1 - g z)^2.
        let gamma = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
        let machine = oscillator(frequency, ratio);
        let stepping = Stepping::new(1e-3, 1, Method::LinearlyImplicit).unwrap();
        let found = resolution(&machine.build(), &machine.values, &[1.0, 0.0], stepping, 2.0).unwrap();
        let speed = std::f64::consts::TAU * frequency;
        let z = nalgebra::Complex::new(-ratio, (1.0 - ratio * ratio).sqrt()) * (speed * 1e-3);
        let factor = ((z * (1.0 - 2.0 * gamma) + 1.0) / (z * -gamma + 1.0).powi(2)).norm() * (-z.re).exp();
        let time = if ratio > 0.0 { 2.0_f64.min(1.0 / (ratio * speed)) } else { 2.0 };
        let left = factor.powf(time / 1e-3);
        prop_assume!((left - 0.9).abs() > 1e-6);
        match found.damped[..] {
            [mode] => prop_assert!((mode.left - left).abs() < 1e-6 * (1.0 + left), "{} {}", mode.left, left),
            _ => prop_assert!(left > 0.9),
        }
    }
}

#[test]
fn damped_modes_and_friction_say_nothing() {
    let mut machine = oscillator(300.0, 0.3);
    machine.effect("coulomb_friction", 0, &[("coulomb", 1.0), ("transition_velocity", 1e-3)]);
    let stepping = Stepping::new(1e-3, 1, Method::LinearlyImplicit).unwrap();
    let found = resolution(&machine.build(), &machine.values, &[0.0; 2], stepping, 1.0).unwrap();
    assert!(found.damped.is_empty(), "{found:?}");
    // A pendulum swings slowly enough for any of them.
    let machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    let found = resolution(&machine.build(), &machine.values, &[0.0; 4], stepping, 1.0).unwrap();
    assert!(found.damped.is_empty(), "{found:?}");
}

#[test]
fn drives_too_fast_for_the_explicit_part_are_refused_and_lags_are_not() {
    let mut machine = Machine::new(&slider(1.0));
    machine.actuator(0, &[("gain", 1.0), ("lag", 1e-6)]);
    let run = Bench::new(&machine, 1e-3, 1, Method::Additive).free(&[0.0; 3], &[1.0; 1001]);
    // The lag is over at once: v = t.
    close(run.states[3 * 1000 + 1], 1.0, 2e-3);
    // Explicitly the current bears 4.2 of its time constants in a step.
    let motor = |time_constant: f64| {
        let mut machine = Machine::new(&slider(1.0));
        let numbers = json!({"drive": {"resistance": 2.0, "time_constant": time_constant, "torque_constant": 0.5,
            "back_emf": 0.5, "gear_ratio": 1.0, "efficiency": 1.0, "transition_velocity": 0.1}});
        machine.add("actuators", json!({"name": "motor", "on": {"joint": 0}}), numbers);
        let mut d: Value = serde_json::from_str(&machine.json()).unwrap();
        d["actuators"][0]["drive"]["type"] = json!("dc_motor");
        let d = Description::from_json(&d.to_string()).unwrap();
        let stepping = Stepping::new(1e-3, 1, Method::Additive).unwrap();
        let bench =
            Bench { description: d, theta: machine.values, stepping, sensitivities: Vec::new(), hold: Hold::default() };
        bench.try_free(&[0.0; 3], &[1.0; 20])
    };
    assert!(motor(2.5e-4).is_ok(), "{:?}", motor(2.5e-4).err());
    let Err(Error::StepTooLarge { method, limit, .. }) = motor(1e-4) else { panic!("ten time constants in a step") };
    assert_eq!(method, "additive");
    close(limit, 4.234e-4, 2e-6);
}
