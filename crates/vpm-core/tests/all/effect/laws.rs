//! Each physical effect against a closed form of the motion it gives, or an independent statement about it.

use std::f64::consts::PI;
use vpm_core::effect::{
    AsymmetricFriction, Backlash, BiasForce, CoulombFriction, CubicSpring, EndStop, Formula, JointCompliance,
    JointEffect, Law, LinkFlexibility, PositionDependentFriction, QuadraticDrag, Spring, StribeckFriction,
    TorqueRipple, ViscousFriction,
};
use vpm_core::evaluate;
use vpm_core::integrator::Method;
use vpm_core::samples::{Random, double_pendulum, slider};
use vpm_core::{Dual, Scalar};

use crate::common::{Bench, Machine, close};

/// Free motion of a 2 kg slider with one effect, from (q, v), for `rows` samples of 1 ms: positions and velocities.
fn slide(kind: &str, numbers: &[(&str, f64)], (q, v): (f64, f64), rows: usize) -> (Vec<f64>, Vec<f64>) {
    let mut machine = Machine::new(&slider(2.0));
    machine.effect(kind, 0, numbers).actuator(0, &[("gain", 1.0)]);
    let bench = Bench::new(&machine, 1e-3, 4, Method::Rk4);
    let run = bench.free(&[q, v], &vec![0.0; rows]);
    (bench.channel(&run, 0), bench.channel(&run, 1))
}

#[test]
fn viscous_friction_decays_exponentially() {
    let (_, velocity) = slide("viscous_friction", &[("viscous", 3.0)], (0.0, 0.7), 1001);
    for (k, v) in velocity.iter().enumerate() {
        close(*v, 0.7 * (-1.5e-3 * k as f64).exp(), 1e-12);
    }
}

#[test]
fn coulomb_friction_stops_within_the_work_of_the_force() {
    // Separation of variables: d = m/F ∫ v / tanh(v/vt) dv = m v0^2 / (2 F) + m vt^2 pi^2 / (12 F) for v0 >> vt.
    let (mass, speed, force, transition) = (2.0, 0.5, 1.0, 1e-3);
    let numbers = [("coulomb", force), ("transition_velocity", transition)];
    let (position, velocity) = slide("coulomb_friction", &numbers, (0.0, speed), 1200);
    let distance = mass / force * (0.5 * speed * speed + transition * transition * PI * PI / 12.0);
    close(position[1199], distance, 1e-9);
    assert!(velocity[1199].abs() < 1e-9);
    // Until then it brakes evenly.
    close(velocity[500], speed - force / mass * 0.5, 1e-9);
}

#[test]
fn spring_swings_as_a_sinusoid_about_its_rest() {
    let numbers = [("stiffness", 200.0), ("rest", 0.1)];
    let (position, _) = slide("spring", &numbers, (0.15, 0.0), 2001);
    for (k, q) in position.iter().enumerate() {
        close(*q, 0.1 + 0.05 * (10.0 * k as f64 * 1e-3).cos(), 1e-9);
    }
}

#[test]
fn bias_force_accelerates_evenly_against_the_motion() {
    let (position, _) = slide("bias_force", &[("force", 3.0)], (0.0, 0.0), 1001);
    close(position[1000], -0.5 * 1.5, 1e-12);
}

#[test]
fn stribeck_friction_peaks_where_its_slope_vanishes_and_fades() {
    // With a sharp corner the law is F exp(-(v/vs)^2): its value at vs is F/e, far beyond it nothing is left.
    let law = StribeckFriction { stribeck: 5.0, stribeck_velocity: 0.1, transition_velocity: 1e-4 };
    close(law.effort(0.0, 0.1), -5.0 / 1.0_f64.exp(), 1e-12);
    close(law.effort(0.0, -0.1), 5.0 / 1.0_f64.exp(), 1e-12);
    close(law.effort(0.0, 1.0), 0.0, 1e-40);
    // The peak of the rounded law: d/dv = 0 where (1 - tanh^2)/(vt tanh) = 2 v / vs^2, found here by scanning.
    let law = StribeckFriction { stribeck: 5.0, stribeck_velocity: 0.1, transition_velocity: 0.01 };
    let peak = (1..2000)
        .map(|k| f64::from(k) * 1e-4)
        .max_by(|a, b| law.effort(0.0, *b).total_cmp(&law.effort(0.0, *a)))
        .unwrap();
    let tanh = (peak / 0.01).tanh();
    close((1.0 - tanh * tanh) / (0.01 * tanh), 2.0 * peak / 0.01, 0.1);
    assert!(-law.effort(0.0, peak) > 0.85 * 5.0 && peak > 0.01 && peak < 0.1);
}

#[test]
fn asymmetric_friction_gives_each_direction_its_own_coefficients() {
    // Beside symmetric friction with the means (4, 30), the differences (1, 6) give (4.5, 33) forward and (3.5, 27) backward.
    let symmetric = [
        JointEffect::CoulombFriction(CoulombFriction { coulomb: 4.0, transition_velocity: 1e-4 }),
        JointEffect::ViscousFriction(ViscousFriction { viscous: 30.0 }),
    ];
    let difference = JointEffect::AsymmetricFriction(AsymmetricFriction {
        coulomb_difference: 1.0,
        viscous_difference: 6.0,
        transition_velocity: 1e-4,
    });
    let total =
        |v: f64| symmetric.iter().map(|law| law.law().effort(0.0, v)).sum::<f64>() + difference.law().effort(0.0, v);
    close(total(0.2), -(4.5 + 33.0 * 0.2), 1e-12);
    close(total(-0.2), 3.5 + 27.0 * 0.2, 1e-12);
    close(total(0.0), 0.0, 0.0);
}

#[test]
fn torque_ripple_repeats_and_stores_what_it_takes() {
    let law = TorqueRipple { period: 0.02, cosine: 0.3, sine: -0.4 };
    for q in [0.0, 0.0031, -0.017] {
        close(law.effort(q, 0.0), law.effort(q + 0.02, 0.0), 1e-13);
        close(law.effort(q, 0.0), -law.effort(q + 0.01, 0.0), 1e-13);
    }
    close(law.effort(0.0, 0.0), -0.3, 1e-15);
    close(law.effort(0.005, 0.0), 0.4, 1e-15);
    // Largest effort sqrt(0.3^2 + 0.4^2), over a period no work is done.
    let efforts: Vec<f64> = (0..1000).map(|k| law.effort_at_rest(f64::from(k) * 2e-5)).collect();
    close(efforts.iter().copied().fold(0.0, f64::max), 0.5, 1e-5);
    close(efforts.iter().sum::<f64>(), 0.0, 1e-10);
}

#[test]
fn backlash_lets_go_within_its_play_and_holds_beyond() {
    let law = Backlash { gap: 0.01, stiffness: 2e4, damping: 1.5, contact_damping: 40.0, width: 1e-6 };
    // Nearly nothing in the play but the damping, a spring from the contact on, the same on both sides.
    close(law.effort(0.0, 0.2), -0.3, 1e-6);
    close(law.effort(0.004, 0.0), 0.0, 1e-5);
    // A closed contact resists as well.
    close(law.effort(0.006, 0.2) - law.effort(0.006, 0.0), -41.5 * 0.2, 1e-5);
    for side in [1.0, -1.0] {
        close(law.effort(side * 0.006, 0.0), -side * 20.0, 1e-5);
        close(law.potential(side * 0.006), 0.5 * 2e4 * 1e-6, 1e-7);
    }
    close(law.potential(0.0), 0.0, 0.0);
    // The slope is nowhere negative and nowhere beyond the spring's, and no derivative breaks at the corners.
    let soft =
        JointEffect::Backlash(Backlash { gap: 0.01, stiffness: 2e4, damping: 0.0, contact_damping: 0.0, width: 1e-3 });
    let slopes: Vec<f64> = (-400..=400).map(|k| -soft.slope_at_rest(f64::from(k) * 5e-5)).collect();
    assert!(slopes.iter().all(|slope| (0.0..2e4).contains(slope)));
    assert!(slopes.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 2e4 * 0.03));
    // Without a gap it is a linear spring.
    let spring = Backlash { gap: 0.0, ..law };
    close(spring.effort(0.3, 0.0), -6000.0, 1e-9);
}

#[test]
fn potentials_are_what_the_efforts_integrate_to() {
    let laws = [
        JointEffect::BiasForce(BiasForce { force: 2.0 }),
        JointEffect::Spring(Spring { stiffness: 70.0, rest: 0.2 }),
        JointEffect::CubicSpring(CubicSpring { stiffness: 70.0, rest: 0.2 }),
        JointEffect::TorqueRipple(TorqueRipple { period: 0.3, cosine: 1.0, sine: 2.0 }),
        JointEffect::Backlash(Backlash { gap: 0.4, stiffness: 30.0, damping: 0.0, contact_damping: 0.0, width: 0.05 }),
        JointEffect::JointCompliance(JointCompliance { stiffness: 30.0, damping: 0.0 }),
        JointEffect::LinkFlexibility(LinkFlexibility { stiffness: 30.0, time: 0.0 }),
        JointEffect::EndStop(EndStop { stiffness: 30.0, damping: 0.0, low: -0.3, high: 0.2, width: 0.05 }),
        JointEffect::EndStop(EndStop { stiffness: 30.0, damping: 0.0, low: -1e9, high: 0.2, width: 1e-4 }),
    ];
    for law in laws {
        let lifted = law.map(&mut |&number| Dual::<f64, 1>::constant(number));
        for q in [-0.4, 0.0, 0.33] {
            let slope = lifted.law().potential(Dual::variable(q, 0)).gradient[0];
            close(law.law().effort(q, 0.9), -slope, 1e-12);
        }
    }
}

#[test]
fn every_law_splits_into_rest_and_resistance() {
    let mut random = Random::new(3);
    let laws = [
        JointEffect::ViscousFriction(ViscousFriction { viscous: 2.0 }),
        JointEffect::CoulombFriction(CoulombFriction { coulomb: 3.0, transition_velocity: 0.02 }),
        JointEffect::AsymmetricFriction(AsymmetricFriction {
            coulomb_difference: 1.0,
            viscous_difference: -2.0,
            transition_velocity: 0.05,
        }),
        JointEffect::StribeckFriction(StribeckFriction {
            stribeck: 2.0,
            stribeck_velocity: 0.3,
            transition_velocity: 0.04,
        }),
        JointEffect::QuadraticDrag(QuadraticDrag { drag: 3.0 }),
        JointEffect::PositionDependentFriction(PositionDependentFriction {
            period: 0.3,
            cosine: 1.0,
            sine: 2.0,
            transition_velocity: 0.04,
        }),
        JointEffect::BiasForce(BiasForce { force: 2.0 }),
        JointEffect::Spring(Spring { stiffness: 70.0, rest: 0.2 }),
        JointEffect::CubicSpring(CubicSpring { stiffness: 70.0, rest: 0.2 }),
        JointEffect::TorqueRipple(TorqueRipple { period: 0.3, cosine: 1.0, sine: 2.0 }),
        JointEffect::Backlash(Backlash { gap: 0.4, stiffness: 30.0, damping: 3.0, contact_damping: 2.0, width: 0.05 }),
        JointEffect::JointCompliance(JointCompliance { stiffness: 30.0, damping: 2.0 }),
        JointEffect::LinkFlexibility(LinkFlexibility { stiffness: 30.0, time: 0.02 }),
        JointEffect::EndStop(EndStop { stiffness: 30.0, damping: 0.7, low: -0.3, high: 0.2, width: 0.05 }),
        JointEffect::Formula(formula().unwrap()),
    ];
    for effect in laws {
        let law = effect.law();
        for v in [0.0, 1e-9, -1e-7, 0.003, -0.02, random.symmetric(), 50.0] {
            let q = random.symmetric();
            close(
                law.effort_at_rest(q) - law.resistance(q, v) * v,
                law.effort(q, v),
                1e-13 * (1.0 + law.effort(q, v).abs()),
            );
        }
        // At rest the chord is the tangent.
        let lifted = effect.map(&mut |&number| Dual::<f64, 1>::constant(number));
        let slope = lifted.law().effort(Dual::constant(0.1), Dual::variable(0.0, 0)).gradient[0];
        close(-law.resistance(0.1, 0.0), slope, 1e-12);
    }
}

/// `-a tanh(v/b) cos(2 q)`, written in postfix order.
fn formula() -> serde_json::Result<Formula<f64>> {
    let text = r#"{"program": ["velocity", {"parameter": 1}, "divide", "tanh", {"constant": 0}, "position", "multiply", "cos",
        "multiply", {"parameter": 0}, "multiply", "negate"], "constants": [2.0], "parameters": [3.0, 0.04]}"#;
    serde_json::from_str(text)
}

#[test]
fn a_formula_gives_what_its_expression_gives() {
    let mut random = Random::new(5);
    for _ in 0..20 {
        let (q, v) = (random.symmetric(), random.symmetric());
        close(formula().unwrap().effort(q, v), -3.0 * (v / 0.04).tanh() * (2.0 * q).cos(), 1e-13);
    }
    for (program, words) in [
        (r#"["add"]"#, "finds no number"),
        (r#"["position", "velocity"]"#, "leaves 2 numbers"),
        (r#"[{"parameter": 2}]"#, "finds no number"),
        (r#"[]"#, "leaves 0 numbers"),
    ] {
        let text = format!(r#"{{"program": {program}, "constants": [], "parameters": [1.0]}}"#);
        let error = serde_json::from_str::<Formula<f64>>(&text).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn end_stops_push_back_only_and_take_energy_out() {
    let law = EndStop { stiffness: 2e3, damping: 0.4, low: -0.3, high: 0.2, width: 1e-3 };
    let mut random = Random::new(8);
    for _ in 0..500 {
        let (q, v) = (0.5 * random.symmetric(), 9.0 * random.symmetric());
        let effort = law.effort(q, v);
        if q > 0.2 {
            assert!(effort < 0.0);
        } else if q < -0.3 {
            assert!(effort > 0.0);
        }
        assert!((effort - law.effort(q, 0.0)) * v <= 0.0);
    }
    close(law.effort(0.25, 0.0), -100.0, 1e-2);
    close(law.effort(0.25, 1.0), -140.0, 0.5);
    close(law.effort(0.0, 3.0), 0.0, 1e-2);
}

#[test]
fn end_stops_follow_hyperbolas() {
    // p and r are the positive roots of p (p - x) = width^2/4 and of r (r - y - b) = e^2/4, y = damping times the approaching speed.
    let (stiffness, damping, width, e) = (2e3, 0.4, 0.05, 0.1);
    let b = 1.0 - 0.25 * e * e;
    for side in [1.0, -1.0] {
        // The other end is so far away that it pushes by less than rounding.
        let [low, high] = if side > 0.0 { [-1e15, 0.2] } else { [-0.2, 1e15] };
        let law = EndStop { stiffness, damping, low, high, width };
        for depth in [-0.3, -0.02, 0.0, 0.1] {
            let q = side * (0.2 + depth);
            let p = -side * law.effort(q, 0.0) / stiffness;
            assert!(p > 0.0);
            close(p * (p - depth), 0.25 * width * width, 1e-15);
            for y in [-30.0, -1.5, -1.0, -0.3, 0.2, 4.0] {
                let r = -side * law.effort(q, side * y / damping) / (stiffness * p);
                close(r * (r - y - b), 0.25 * e * e, 1e-11);
            }
        }
    }
}

#[test]
fn fast_motion_over_a_sharp_corner_stays_finite_with_its_derivatives() {
    let law = CoulombFriction { coulomb: 2.0, transition_velocity: 1e-9 }
        .map(&mut |&number| Dual::<f64, 3>::constant(number));
    for v in [1e3, -1e3, 0.0] {
        assert!(law.effort(Dual::zero(), Dual::variable(v, 0)).is_finite());
        assert!(law.resistance(Dual::zero(), Dual::variable(v, 0)).is_finite());
    }
}

#[test]
fn payload_adds_its_inertia_to_the_mass_matrix() {
    // On the lower arm of a double pendulum, at its tip: the same as a heavier bob (a point mass itself).
    let mut loaded = Machine::new(&double_pendulum([1.0, 2.0], [0.5, 0.7]));
    loaded.payload(1, 0.8, [0.0, 0.0, -0.7]);
    let heavier = Machine::new(&double_pendulum([1.0, 2.8], [0.5, 0.7]));
    for q in [[0.0, 0.0], [0.4, -1.1], [PI / 3.0, 2.0]] {
        let with = evaluate::mass_matrix(&loaded.build(), &loaded.values, &q).unwrap();
        let reference = evaluate::mass_matrix(&heavier.build(), &heavier.values, &q).unwrap();
        for (found, expected) in with.iter().zip(reference) {
            close(*found, expected, 1e-13);
        }
    }
    // Off the joint axis it adds m r^2 about it.
    let mut loaded = Machine::new(&double_pendulum([1.0, 2.0], [0.5, 0.7]));
    loaded.payload(1, 0.8, [0.3, 0.9, -0.4]);
    let bare = Machine::new(&double_pendulum([1.0, 2.0], [0.5, 0.7]));
    let entry = |machine: &Machine| evaluate::mass_matrix(&machine.build(), &machine.values, &[0.2, 0.5]).unwrap()[3];
    close(entry(&loaded) - entry(&bare), 0.8 * (0.09 + 0.16), 1e-13);
}

#[test]
fn forward_dynamics_hears_every_effect() {
    let mut machine = Machine::new(&slider(4.0));
    machine.effect("viscous_friction", 0, &[("viscous", 3.0)]).effect("bias_force", 0, &[("force", -2.0)]);
    let acceleration = evaluate::accelerations(&machine.build(), &machine.values, &[0.0], &[0.5], &[6.0]).unwrap();
    close(acceleration[0], (6.0 - 1.5 + 2.0) / 4.0, 1e-14);
}
