//! The motor with its gear: current behind a locked joint, speed without load, and where the power goes.

use proptest::prelude::*;
use vpm_core::Dual;
use vpm_core::actuator::DcMotor;

use crate::common::close;

/// A motor of some 100 W behind a gear of 50.
fn motor() -> DcMotor<f64> {
    DcMotor {
        resistance: 0.6,
        time_constant: 5e-4,
        torque_constant: 0.05,
        back_emf: 0.05,
        gear_ratio: 50.0,
        efficiency: 0.8,
        transition_velocity: 0.02,
        rotor_inertia: Some(1e-5),
    }
}

/// One step of the classical fourth-order rule for `x' = f(x)`.
fn step(x: [f64; 2], h: f64, f: &impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
    let along = |k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
    let a = f(x);
    let b = f(along(a, 0.5 * h));
    let c = f(along(b, 0.5 * h));
    let d = f(along(c, h));
    [0, 1].map(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
}

#[test]
fn behind_a_locked_joint_the_current_rises_exponentially() {
    let (motor, h) = (motor(), 1e-5);
    let f = |x: [f64; 2]| [motor.current_rate(x[0], 24.0, 0.0), 0.0];
    let mut x = [0.0, 0.0];
    for k in 1..=300 {
        x = step(x, h, &f);
        // u / R (1 - exp(-t / tau_e)), times N k_t: no loss in a gear that stands.
        let current = 40.0 * (1.0 - (-h * f64::from(k) / 5e-4).exp());
        close(x[0], current, 40.0 * 1e-8);
        close(motor.effort(current, 0.0), 2.5 * current, 1e-12);
    }
}

#[test]
fn without_load_the_joint_turns_as_fast_as_the_voltage_allows() {
    // J dw/dt = tau, with the loss of the gear: it ends at w = u / (k_e N) with no current, whatever the efficiency.
    let (motor, h) = (motor(), 2e-5);
    let inertia = motor.reflected_inertia() + 0.01;
    close(inertia, 0.035, 1e-15);
    let f = |x: [f64; 2]| [motor.current_rate(x[0], 24.0, x[1]), motor.effort(x[0], x[1]) / inertia];
    let end = (0..20_000).fold([0.0, 0.0], |x, _| step(x, h, &f));
    close(end[1], 24.0 / (0.05 * 50.0), 1e-9);
    close(end[0], 0.0, 1e-9);
    // Without electrical time and gear loss it gets there with the mechanical time constant J R / (N^2 k_t k_e).
    let quick = DcMotor { time_constant: 1e-12, efficiency: 1.0, ..motor };
    let time = inertia * 0.6 / (50.0 * 50.0 * 0.05 * 0.05);
    let slow = |x: [f64; 2]| [0.0, quick.effort(quick.settled(24.0, x[1]), x[1]) / inertia];
    let (parts, mut x) = (1000, [0.0, 0.0]);
    for _ in 0..parts {
        x = step(x, time / f64::from(parts), &slow);
    }
    close(x[1], 9.6 * (1.0 - (-1.0_f64).exp()), 1e-10);
}

#[test]
fn of_the_power_of_a_driving_motor_the_efficiency_arrives() {
    let motor = motor();
    // At ten times the transition velocity tanh is 1 to nine digits.
    close(motor.effort(10.0, 0.2), 0.8 * 25.0, 1e-7);
    close(motor.effort(-10.0, -0.2), -0.8 * 25.0, 1e-7);
    // Driven back it holds more than it drives with.
    close(motor.effort(10.0, -0.2), 1.2 * 25.0, 1e-7);
    close(motor.effort(0.0, 3.0), 0.0, 0.0);
    // The loss is the chord from rest times the speed, also where the gear barely turns.
    for (current, rate) in [(10.0, 0.2), (-10.0, 0.03), (7.0, -1e-3), (3.0, -0.5)] {
        let driving = 2.5 * current;
        let loss = motor.gear_resistance(driving, rate) * rate;
        close(loss, 0.2 * driving.abs() * (rate / 0.02_f64).tanh(), 1e-12);
        close(motor.effort(current, rate), driving - loss, 1e-12);
    }
}

proptest! {
    /// u i = heat of the copper + growth of the field + loss of the gear + what the joint gets, and neither loss is negative.
    #[test]
    fn no_power_gets_lost(i in -40.0..40.0_f64, u in -48.0..48.0_f64, dq in -20.0..20.0_f64, eta in 0.0..1.0_f64) {
        let motor = DcMotor { efficiency: eta, ..motor() };
        let lifted = motor.map(&mut |&number| Dual::<f64, 1>::constant(number));
        let field = lifted.magnetic(Dual { value: i, gradient: [motor.current_rate(i, u, dq)] });
        let (copper, gear) = motor.losses(i, dq);
        let left = u * i - copper - field.gradient[0] - gear - motor.effort(i, dq) * dq;
        prop_assert!(left.abs() < 1e-9 * (1.0 + copper + (u * i).abs()), "{left} W of {} W", u * i);
        prop_assert!(copper >= 0.0 && gear >= 0.0, "{copper} {gear}");
    }

    /// With another voltage constant than torque constant the balance has a gap of exactly that difference: the check can fail.
    #[test]
    fn unequal_constants_show_in_the_balance(i in 1.0..40.0_f64, dq in 1.0..20.0_f64) {
        let motor = DcMotor { back_emf: 0.06, ..motor() };
        let lifted = motor.map(&mut |&number| Dual::<f64, 1>::constant(number));
        let field = lifted.magnetic(Dual { value: i, gradient: [motor.current_rate(i, 24.0, dq)] });
        let (copper, gear) = motor.losses(i, dq);
        let left = 24.0 * i - copper - field.gradient[0] - gear - motor.effort(i, dq) * dq;
        prop_assert!((left - 0.01 * 50.0 * i * dq).abs() < 1e-8);
    }
}

#[test]
fn every_number_has_its_domain() {
    let motor = motor();
    assert!(motor.domains().len() == 8 && motor.domains().iter().all(|(number, domain)| domain.contains(**number)));
    let wrong = [
        DcMotor { resistance: 0.0, ..motor },
        DcMotor { time_constant: -1.0, ..motor },
        DcMotor { gear_ratio: 0.0, ..motor },
        DcMotor { efficiency: -0.1, ..motor },
        DcMotor { transition_velocity: 0.0, ..motor },
        DcMotor { rotor_inertia: Some(-1.0), ..motor },
    ];
    for motor in wrong {
        let outside = motor.domains().into_iter().filter(|(number, domain)| !domain.contains(**number));
        assert_eq!(outside.count(), 1, "{motor:?}");
    }
    assert_eq!(DcMotor { rotor_inertia: None, ..motor }.reflected_inertia(), 0.0);
}
