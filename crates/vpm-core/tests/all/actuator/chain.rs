//! Each link of the actuator chain, sensors and controllers, as rigs of their own and inside a simulation.

use proptest::prelude::*;
use serde_json::json;
use vpm_core::actuator::{DeadZone, InputDelay, Lag, Saturation};
use vpm_core::controller::{Cascade, ControlMemory, Pid};
use vpm_core::delay::SampleDelay;
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::samples::slider;
use vpm_core::table::Table;

use crate::common::{Bench, Machine, close};

const COMMAND: [f64; 8] = [0.0, 1.0, -2.0, 3.0, 5.0, -1.0, 0.5, 4.0];

#[test]
fn whole_delay_shifts_by_samples_and_holds_the_first_value() {
    let delay = InputDelay { time: 0.003 };
    for k in 0..8 {
        close(delay.held(k, 0.001, |i| COMMAND[i]), COMMAND[k.saturating_sub(3)], 1e-12);
    }
    let forever = InputDelay { time: 1e300 };
    close(forever.held(7, 0.001, |i| COMMAND[i]), COMMAND[0], 0.0);
}

proptest! {
    /// The mean over an interval of a held signal that arrives late, against adding up a fine staircase.
    #[test]
    fn delayed_mean_is_that_of_the_held_signal(time in 0.0..6.0_f64, k in 0_usize..8) {
        const FINE: usize = 4000;
        let held = |t: f64| COMMAND[t.floor().max(0.0) as usize];
        let sum: f64 = (0..FINE).map(|i| held(k as f64 + (i as f64 + 0.5) / FINE as f64 - time)).sum();
        let found = InputDelay { time }.held(k, 1.0, |i| COMMAND[i]);
        prop_assert!((found - sum / FINE as f64).abs() < 6.0 / FINE as f64);
    }

    /// Reading late and then looking ahead by the same time gives a straight line back.
    #[test]
    fn advanced_undoes_delayed(time in 0.0..5.0_f64, k in 6_usize..14) {
        let delay = SampleDelay::new(time, 1.0);
        let late = |i: usize| delay.delayed(i, |j| 0.3 * j as f64 - 1.0);
        prop_assert!((delay.advanced(k, 100, late) - (0.3 * k as f64 - 1.0)).abs() < 1e-12);
    }

    #[test]
    fn dead_zone_and_saturation_are_odd_and_continuous(u in -5.0..5.0_f64, size in 0.01..3.0_f64) {
        let (dead_zone, saturation) = (DeadZone { width: size }, Saturation { limit: size });
        prop_assert_eq!(dead_zone.apply(-u), -dead_zone.apply(u));
        prop_assert_eq!(saturation.apply(-u), -saturation.apply(u));
        // What one lets through the other takes away.
        prop_assert!((dead_zone.apply(u) + saturation.apply(u) - u).abs() < 1e-15);
        prop_assert!(saturation.apply(u).abs() <= size);
    }
}

#[test]
fn lag_follows_a_step_exponentially() {
    let lag = Lag { time_constant: 0.02 };
    let (mut x, mut integral) = (0.0, 0.0);
    for k in 1..=50 {
        let (next, mean) = lag.interval(x, 3.0, 0.004);
        integral += mean * 0.004;
        x = next;
        let t = 0.004 * f64::from(k);
        close(x, 3.0 * (1.0 - (-t / 0.02_f64).exp()), 1e-13);
        // T x' = w - x, integrated once: T x = w t - integral of x.
        close(0.02 * x, 3.0 * t - integral, 1e-13);
    }
    // A time constant far below the step: there at once, without overflow.
    let (x, mean) = Lag { time_constant: 1e-12 }.interval(-7.0, 3.0, 0.004);
    close(x, 3.0, 1e-12);
    close(mean, 3.0, 1e-8);
}

/// A slider without friction whose drive has all links; commands of 1 V steps.
fn chain(links: &[(&str, f64)]) -> Bench {
    let mut machine = Machine::new(&slider(2.0));
    machine.actuator(0, links);
    Bench::new(&machine, 0.01, 4, Method::Rk4)
}

#[test]
fn chain_acts_in_its_order() {
    // 5 V, less a dead zone of 1 V, cut at 3 V, times 10 N/V; the other order would give 20 N.
    let bench = chain(&[("gain", 10.0), ("dead_zone", 1.0), ("saturation", 3.0)]);
    let run = bench.free(&[0.0, 0.0], &[5.0; 4]);
    assert_eq!(bench.channel(&run, 4), [5.0; 4]);
    assert_eq!(bench.channel(&run, 5), [30.0; 4]);
    assert_eq!(bench.channel(&run, 3), [30.0; 4]);
    assert_eq!(bench.channel(&run, 2), [15.0; 4]);
}

#[test]
fn a_drive_rubs_in_proportion_to_its_own_effort() {
    let mut machine = Machine::new(&slider(2.0));
    machine.actuator(0, &[("gain", 1.0)]).rubbing_actuator(0, 1.0, [0.2, 0.3, 1e-3]);
    let bench = Bench::new(&machine, 0.01, 4, Method::Rk4);
    // The acceleration of the slider at 1 m/s either way, far beyond the transition velocity: (u + p - share |p| sign v) / m.
    for (speed, [u, p], effort) in [
        (1.0, [7.0, 5.0], 7.0 + 5.0 - 0.2 * 5.0),
        (1.0, [7.0, -5.0], 7.0 - 5.0 - 0.3 * 5.0),
        (-1.0, [7.0, -5.0], 7.0 - 5.0 + 0.2 * 5.0),
        (-1.0, [-7.0, 5.0], -7.0 + 5.0 + 0.3 * 5.0),
        (1.0, [7.0, 0.0], 7.0),
        (0.0, [7.0, 5.0], 12.0),
    ] {
        let run = bench.free(&[0.0, speed], &[u, p]);
        close(bench.channel(&run, 2)[0], effort / 2.0, 1e-12);
        // Nothing is lost of the other drive, and the joint feels both.
        close(bench.channel(&run, 5)[0], u, 1e-12);
        close(bench.channel(&run, 7)[0], effort - u, 1e-12);
        close(bench.channel(&run, 3)[0], effort, 1e-12);
    }
}

#[test]
fn a_drive_that_rubs_holds_a_load_that_it_could_not_push_back() {
    // It is pressed with 10 N against a load of 8 N: 0.3 of its own effort holds what is left, and a load of 14 N breaks it loose.
    let mut machine = Machine::new(&slider(2.0));
    machine.actuator(0, &[("gain", 1.0)]).rubbing_actuator(0, 1.0, [0.3, 0.3, 1e-4]);
    let bench = Bench::new(&machine, 0.01, 100, Method::LinearlyImplicit);
    let held: Vec<f64> = [-8.0, 10.0].repeat(101);
    let run = bench.free(&[0.0, 0.0], &held);
    // Creep below the transition velocity: tanh(v / 1e-4) = 2 N / 3 N.
    close(*bench.channel(&run, 1).last().unwrap(), 1e-4 * (2.0_f64 / 3.0).atanh(), 1e-9);
    let loose: Vec<f64> = [-14.0, 10.0].repeat(101);
    let run = bench.free(&[0.0, 0.0], &loose);
    close(*bench.channel(&run, 1).last().unwrap(), -0.5, 1e-3);
}

#[test]
fn efforts_of_a_drive_that_rubs_are_no_matter_of_its_command() {
    let mut machine = Machine::new(&slider(2.0));
    machine.rubbing_actuator(0, 1.0, [0.2, 0.3, 1e-3]);
    let description = machine.build();
    let zeros = [0.0; 3];
    let table = |numbers| Table::new("motion", numbers, 3, 1).unwrap();
    let inputs = table(&zeros);
    let motion = Motion {
        position: table(&zeros),
        velocity: table(&zeros),
        acceleration: table(&zeros),
        inputs,
        time_step: 0.01,
    };
    let error = inverse_dynamics(&description, &description.parameters, motion, &[], &|| false).unwrap_err();
    assert!(error.to_string().contains("`pressed` of type ideal with friction"), "{error}");
}

#[test]
fn simulated_delay_shifts_the_force() {
    let bench = chain(&[("gain", 2.0), ("delay", 0.025)]);
    let run = bench.free(&[0.0, 0.0], &COMMAND);
    let force = bench.channel(&run, 5);
    for k in 3..8 {
        close(force[k], 2.0 * 0.5 * (COMMAND[k - 2] + COMMAND[k - 3]), 1e-12);
    }
    assert_eq!(bench.channel(&run, 4), COMMAND);
}

#[test]
fn simulated_lag_matches_the_exponential() {
    let bench = chain(&[("gain", 2.0), ("lag", 0.05)]);
    assert_eq!(bench.description.n_states(), 3);
    let run = bench.free(&[0.0, 0.0, 0.0], &[1.0; 30]);
    for (k, force) in bench.channel(&run, 5).iter().enumerate() {
        close(*force, 2.0 * (1.0 - (-0.2 * k as f64).exp()), 1e-6);
    }
}

#[test]
fn sensor_shows_gain_offset_and_delay() {
    let mut machine = Machine::new(&slider(2.0));
    machine.actuator(0, &[("gain", 1.0)]);
    let joint = |kind: &str| json!({"kind": kind, "joint": 0});
    machine.sensor(joint("position"), &[("gain", 1.5), ("offset", 0.2), ("delay", 0.025)]);
    machine.sensor(json!({"kind": "command", "actuator": 0}), &[("offset", -1.0)]);
    let bench = Bench::new(&machine, 0.01, 1, Method::Rk4);
    let run = bench.free(&[0.0, 3.0], &[0.0; 10]);
    let position = bench.channel(&run, 0);
    // x = 3 t, seen 25 ms late and interpolated between the samples; nothing is known of the time before the first.
    let truth = |t: f64| 3.0 * t.max(0.0);
    for (k, reading) in position.iter().enumerate() {
        let arrived = 0.5 * (truth(0.01 * (k as f64 - 2.0)) + truth(0.01 * (k as f64 - 3.0)));
        close(*reading, 1.5 * arrived + 0.2, 1e-12);
    }
    assert_eq!(bench.channel(&run, 4), [-1.0; 10]);
    // The true velocity is untouched.
    assert_eq!(bench.channel(&run, 1), [3.0; 10]);
}

#[test]
fn cascade_is_its_formula() {
    let law = Cascade { position_gain: 10.0, velocity_gain: 4.0, limit: Some(Saturation { limit: 5.0 }) };
    let (mut memory, dt) = (ControlMemory::default(), 0.01);
    let y = [0.0, 0.01, 0.03, 0.02, 0.0];
    let r = [0.0, 0.05, 0.02, 0.03, 9.0];
    let mean = |k: usize| 0.5 * (y[k] + y[k.saturating_sub(1)]);
    for k in 0..5 {
        let difference = if k == 0 { 0.0 } else { (mean(k) - mean(k - 1)) / dt };
        let expected: f64 = 4.0 * (10.0 * (r[k] - y[k]) - difference);
        close(law.command(&mut memory, r[k], y[k], dt), expected.clamp(-5.0, 5.0), 1e-12);
    }
}

#[test]
fn pid_integral_does_not_wind_up() {
    let pid = |limit| Pid { proportional: 1.0, integral: 2.0, derivative: 0.0, limit };
    let dt = 0.1;
    // Without a limit: kp e + ki (sum of e) dt.
    let mut memory = ControlMemory::default();
    for k in 1..=10 {
        close(pid(None).command(&mut memory, 1.0, 0.0, dt), 1.0 + 2.0 * 0.1 * f64::from(k), 1e-12);
    }
    // With one: an error of 1 for 10 s drives into the limit; when it turns to -1 the output leaves the limit at once, since what
    // has been integrated is no more than fits under the limit.
    let limited = pid(Some(Saturation { limit: 1.5 }));
    let mut memory = ControlMemory::default();
    for _ in 0..100 {
        assert!(limited.command(&mut memory, 1.0, 0.0, dt) <= 1.5);
    }
    let after = limited.command(&mut memory, -1.0, 0.0, dt);
    assert!(after < 0.0, "still {after} after the error turned around");
}

#[test]
fn pid_derivative_is_the_backward_difference() {
    let law = Pid { proportional: 0.0, integral: 0.0, derivative: 0.5, limit: None };
    let mut memory = ControlMemory::default();
    assert_eq!(law.command(&mut memory, 1.0, 0.0, 0.1), 0.0);
    close(law.command(&mut memory, 1.0, 0.2, 0.1), 0.5 * -0.2 / 0.1, 1e-14);
}
