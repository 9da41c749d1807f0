//! Laws along a line: spring with damper, and the visco-elastic element with its exact interval.

use proptest::prelude::*;
use vpm_core::Dual;
use vpm_core::actuator::{Maxwell, SpringDamper};

use crate::common::close;

fn element() -> Maxwell<f64> {
    Maxwell { stiffness: 8e4, free_length: 0.3, fast_stiffness: 5e4, relaxation_time: 4e-3 }
}

proptest! {
    #[test]
    fn a_spring_with_a_damper_loses_what_the_damper_takes(s in 0.2..0.4_f64, rate in -1.0..1.0_f64) {
        let law = SpringDamper { stiffness: 8.23e4, free_length: 0.31, damping: 3.3e3 };
        let stored = law.map(&mut |&number| Dual::<f64, 1>::constant(number)).potential(Dual { value: s, gradient: [rate] });
        let balance = law.force(s, rate) * rate + stored.gradient[0] + 3.3e3 * rate * rate;
        prop_assert!(balance.abs() < 1e-9);
        // A line that is too short is pushed apart.
        prop_assert!(law.force(0.3, 0.0) > 0.0 && law.force(0.31, 0.1) < 0.0);
    }

    /// The state form obeys the law and loses only what its damper takes, in any motion.
    #[test]
    fn the_state_form_is_the_law(s in 0.2..0.4_f64, x in -0.1..0.1_f64, ds in -1.0..1.0_f64) {
        let law = element();
        let dx = law.rate(s, x);
        let lifted = law.map(&mut |&number| Dual::<f64, 1>::constant(number));
        let (s_t, x_t) = (Dual { value: s, gradient: [ds] }, Dual { value: x, gradient: [dx] });
        let force = lifted.force(s_t, x_t);
        let left = force.value + 4e-3 * force.gradient[0];
        prop_assert!((left - 8e4 * (s - 0.3) - 4e-3 * 13e4 * ds).abs() < 1e-8);
        let given = force.value * ds;
        let balance = given - lifted.potential(s_t, x_t).gradient[0] - law.dissipation(s, x);
        prop_assert!(balance.abs() < 1e-7 * (1.0 + given.abs()) && law.dissipation(s, x) >= 0.0);
    }

    /// One interval is as good as many, since it is exact for a length that changes evenly.
    #[test]
    fn one_interval_is_as_exact_as_many(h in 1e-5..0.1_f64, end in 0.25..0.35_f64, force in -1e3..1e3_f64) {
        const PARTS: i32 = 64;
        let law = element();
        let whole = law.interval(force, 0.31, end, h);
        let at = |k: i32| 0.31 + (end - 0.31) * f64::from(k) / f64::from(PARTS);
        let steps = (0..PARTS).fold(force, |f, k| law.interval(f, at(k), at(k + 1), h / f64::from(PARTS)));
        prop_assert!((whole - steps).abs() < 1e-8, "{whole} {steps}");
    }
}

/// Largest error of a signal of 1 kN against its closed form, in steps of `h`.
fn error(h: f64) -> f64 {
    // F + tau F' = k0 e + tau k s' for e = A sin(w t): F in phase and in quadrature, from the complex stiffness.
    let (law, size, w) = (element(), 0.01, 2.0 * std::f64::consts::PI * 5.0);
    let tau = law.relaxation_time;
    let ratio = w * tau / (1.0 + w * w * tau * tau);
    let (real, imaginary) = (law.stiffness + law.fast_stiffness * ratio * w * tau, law.fast_stiffness * ratio);
    let exact = |t: f64| size * (real * (w * t).sin() + imaginary * (w * t).cos());
    let length = |t: f64| law.free_length + size * (w * t).sin();
    let steps = (0.4 / h).round() as i32;
    let (mut force, mut worst) = (exact(0.0), 0.0_f64);
    for k in 0..steps {
        let t = f64::from(k) * h;
        force = law.interval(force, length(t), length(t + h), h);
        worst = worst.max((force - exact(t + h)).abs());
    }
    worst
}

#[test]
fn a_smooth_motion_is_met_to_second_order() {
    let (coarse, fine) = (error(2e-3), error(1e-3));
    println!("largest error {coarse:.2e} N at 2 ms, {fine:.2e} N at 1 ms");
    assert!(fine < 0.05 && (coarse / fine - 4.0).abs() < 0.2, "{coarse} {fine}");
}

#[test]
fn a_step_relaxes_from_the_fast_to_the_slow_stiffness() {
    let law = element();
    // Stretched by 1 mm at once: (k0 + k1) e, then k0 e + k1 e exp(-t / tau).
    let start = law.force(0.301, law.settled(0.3));
    close(start, 130.0, 1e-9);
    close(law.interval(start, 0.301, 0.301, 4e-3), 80.0 + 50.0 * (-1.0_f64).exp(), 1e-9);
    close(law.force(0.301, law.settled(0.301)), 80.0, 1e-9);
    // A step that no relaxation time can follow, and one far below it.
    close(law.interval(start, 0.301, 0.301, 1e3), 80.0, 1e-9);
    close(Maxwell { relaxation_time: 1e9, ..law }.interval(0.0, 0.3, 0.301, 1e-3), 130.0, 1e-6);
    close(Maxwell { relaxation_time: 1e-15, ..law }.interval(0.0, 0.3, 0.301, 1e-3), 80.0, 1e-6);
}

#[test]
fn every_number_has_its_domain() {
    let law = element();
    assert!(law.domains().iter().all(|(number, domain)| domain.contains(**number)));
    let wrong = Maxwell { relaxation_time: 0.0, ..law };
    assert_eq!(wrong.domains().iter().filter(|(number, domain)| !domain.contains(**number)).count(), 1);
    let line = SpringDamper { stiffness: 1.0, free_length: 0.0, damping: 0.0 };
    assert!(line.domains().len() == 3 && line.domains().iter().all(|(number, domain)| domain.contains(**number)));
}
