//! Drag, stiffening springs, a winding's ripple, friction that depends on place, load, warmth and path: against closed forms.

use std::f64::consts::PI;

use vpm_core::Result;
use vpm_core::effect::{
    CubicSpring, CurrentRipple, Hysteresis, Law, LoadDependentFriction, LugreFriction, MemoryLaw,
    PositionDependentFriction, WarmingFriction,
};
use vpm_core::evaluate;
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::samples::{Random, slider};
use vpm_core::table::Table;

use crate::common::{ALWAYS, Bench, Machine, close};

/// A slider of 2 kg with one effect and a drive.
fn machine(kind: &str, numbers: &[(&str, f64)]) -> Machine {
    let mut machine = Machine::new(&slider(2.0));
    machine.effect(kind, 0, numbers).actuator(0, &[("gain", 1.0)]);
    machine
}

/// Its free motion from `state` for `rows` samples of 1 ms.
fn bench(kind: &str, numbers: &[(&str, f64)]) -> Bench {
    Bench::new(&machine(kind, numbers), 1e-3, 4, Method::Rk4)
}

#[test]
fn quadratic_drag_slows_as_a_hyperbola() {
    let bench = bench("quadratic_drag", &[("drag", 5.0)]);
    for start in [1.5, -1.5] {
        let run = bench.free(&[0.0, start], &[0.0; 1001]);
        for (k, v) in bench.channel(&run, 1).into_iter().enumerate() {
            close(v, start / (1.0 + 2.5 * 1.5 * k as f64 * 1e-3), 1e-10);
        }
    }
}

#[test]
fn a_cubic_spring_swings_with_its_amplitude() {
    // 4 K(1/sqrt 2) / (A sqrt(k / m)), K the complete elliptic integral of the first kind.
    let (stiffness, amplitude) = (800.0, 0.2_f64);
    let period = 4.0 * 1.854_074_677_301_372 / (amplitude * (stiffness / 2.0_f64).sqrt());
    let machine = machine("cubic_spring", &[("stiffness", stiffness), ("rest", 0.1)]);
    let bench = Bench::new(&machine, period / 1000.0, 4, Method::Rk4);
    let position = bench.channel(&bench.free(&[0.1 + amplitude, 0.0], &[0.0; 1001]), 0);
    close(position[1000], 0.1 + amplitude, 1e-9);
    close(position[500], 0.1 - amplitude, 1e-9);
    close(position[250], 0.1, 1e-6);
    close(CubicSpring { stiffness, rest: 0.1 }.potential(0.3), 0.25 * stiffness * amplitude.powi(4), 1e-12);
}

#[test]
fn friction_of_a_place_takes_work_there_alone() {
    let (period, cosine, sine) = (0.3, 2.0, 5.0);
    let law = PositionDependentFriction { period, cosine, sine, transition_velocity: 1e-4 };
    let work = |from: f64, to: f64| {
        let (pieces, way) = (4000, to - from);
        let middle = |k: i32| from + way * (f64::from(k) + 0.5) / f64::from(pieces);
        -(0..pieces).map(|k| law.effort(middle(k), way)).sum::<f64>() * way / f64::from(pieces)
    };
    close(work(0.0, period), 0.0, 1e-12);
    // The integral of the sine over its half wave is period/pi, that of the cosine nothing; both ways take the same.
    close(work(0.0, 0.5 * period), sine * period / PI, 1e-6);
    close(work(0.5 * period, 0.0), sine * period / PI, 1e-6);
    close(work(-0.25 * period, 0.25 * period), cosine * period / PI, 1e-6);
}

#[test]
fn gears_lose_one_share_driving_and_another_driven() {
    let law = LoadDependentFriction { driving: 0.2, driven: 0.1, transition_velocity: 1e-3 };
    for (v, u, share) in [(1.0, 7.0, 0.2), (-1.0, -7.0, -0.2), (1.0, -7.0, 0.1), (-1.0, 7.0, -0.1), (0.0, 7.0, 0.0)] {
        close(law.share_of_load(0.0, v, u), share, 1e-15);
    }
    let mut random = Random::new(4);
    for _ in 0..50 {
        let (v, u) = (1e-3 * random.symmetric(), random.symmetric());
        close(law.resistance_per_load(v, u) * v, law.share_of_load(0.0, v, u), 1e-14);
    }
}

#[test]
fn lifting_takes_more_and_lowering_less_than_the_weight() -> Result<()> {
    // u (1 - driving) = weight upwards, u (1 + driven) = weight downwards; and forward dynamics stands still under these.
    let mut machine =
        machine("load_dependent_friction", &[("driving", 0.2), ("driven", 0.1), ("transition_velocity", 1e-3)]);
    machine.effect("bias_force", 0, &[("force", 20.0)]);
    let d = machine.build();
    for (v, effort) in [(0.5, 20.0 / 0.8), (-0.5, 20.0 / 1.1)] {
        let accelerations = evaluate::accelerations(&d, &machine.values, &[0.3], &[v], &[effort])?;
        close(accelerations[0], 0.0, 1e-12);
        let (q, v, a) = ([0.3; 3], [v; 3], [0.0; 3]);
        let table = |numbers| Table::new("motion", numbers, 3, 1);
        let motion = Motion {
            position: table(&q)?,
            velocity: table(&v)?,
            acceleration: table(&a)?,
            inputs: table(&a)?,
            time_step: 1e-3,
        };
        close(inverse_dynamics(&d, &machine.values, motion, &[], ALWAYS)?.required[0], effort, 1e-12);
    }
    Ok(())
}

#[test]
fn a_ripple_of_the_current_takes_no_work_over_a_turn() {
    let (period, cosine, sine) = (0.4, 0.3, -0.2);
    let law = CurrentRipple { period, cosine, sine };
    let work = |u: f64, turns: f64| {
        let middle = |k: i32| turns * period * (f64::from(k) + 0.5) / 4000.0;
        (0..4000).map(|k| law.effort_under(middle(k), 1.0, u)).sum::<f64>() * turns * period / 4000.0
    };
    for u in [7.0, -7.0] {
        close(work(u, 1.0), 0.0, 1e-12);
        // The integral of the sine over its half wave is period/pi, that of the cosine nothing.
        close(work(u, 0.5), -u * sine * period / PI, 1e-6);
    }
    // Nothing of it is friction, and at its largest it leaves something of the effort.
    close(law.share_of_load(0.1, -3.0, 2.0), law.share_of_load(0.1, 3.0, 2.0), 1e-15);
    close(CurrentRipple { period, cosine: 4.0, sine }.share_of_load(0.0, 0.0, 1.0), 0.95, 1e-15);
}

#[test]
fn a_motion_needs_the_effort_that_its_ripple_leaves() -> Result<()> {
    let mut machine = machine("current_ripple", &[("period", 0.4), ("cosine", 0.3), ("sine", -0.2)]);
    machine.effect("bias_force", 0, &[("force", 20.0)]);
    let d = machine.build();
    let (q, v, a) = (0.13, 0.7, 4.0);
    let table = |numbers| Table::new("motion", numbers, 3, 1);
    let (position, velocity, acceleration) = ([q; 3], [v; 3], [a; 3]);
    let motion = Motion {
        position: table(&position)?,
        velocity: table(&velocity)?,
        acceleration: table(&acceleration)?,
        inputs: table(&acceleration)?,
        time_step: 1e-3,
    };
    let needed = inverse_dynamics(&d, &machine.values, motion, &[], ALWAYS)?.required[0];
    let phase = 2.0 * PI * q / 0.4;
    close(needed, (2.0 * a + 20.0) / (1.0 - 0.3 * phase.cos() + 0.2 * phase.sin()), 1e-12);
    close(evaluate::accelerations(&d, &machine.values, &[q], &[v], &[needed])?[0], a, 1e-12);
    Ok(())
}

#[test]
fn warming_friction_fades_with_time_alone() {
    let (viscous, time) = (8.0, 0.3);
    let numbers = [("coulomb", 0.0), ("viscous", viscous), ("time_constant", time), ("transition_velocity", 0.1)];
    for method in [Method::Rk4, Method::Rosenbrock, Method::Additive] {
        let bench = Bench::new(&machine("warming_friction", &numbers), 1e-3, 2, method);
        let run = bench.free(&[0.0, 0.7, 0.0], &[0.0; 1001]);
        // m dv/dt = -viscous e^(-t/T) v.
        for (k, v) in bench.channel(&run, 1).into_iter().enumerate() {
            let gone = time * (1.0 - (-1e-3 * k as f64 / time).exp());
            let expected = 0.7 * (-0.5 * viscous * gone).exp();
            assert!((v - expected).abs() < 1e-7, "{method:?} at {k}: {v} instead of {expected}");
        }
        for (k, w) in bench.state(&run, 2).into_iter().enumerate() {
            close(w, 1.0 - (-1e-3 * k as f64 / time).exp(), 1e-7);
        }
    }
    let law = WarmingFriction { coulomb: 3.0, viscous, time_constant: time, transition_velocity: 1e-3 };
    close(law.effort(0.5, 0.0), -(3.0 + 0.5 * viscous), 1e-12);
    close(law.effort(-0.5, 0.75), 0.25 * (3.0 + 0.5 * viscous), 1e-12);
    close(law.advance(0.2, 1e3, 0.1), law.advance(law.advance(0.2, 0.0, 0.04), -5.0, 0.06), 1e-14);
}

const BRISTLES: LugreFriction<f64> =
    LugreFriction { coulomb: 4.0, displacement: 1e-3, damping: 30.0, excess: 0.5, stribeck_velocity: 0.05 };

#[test]
fn bristles_have_stribecks_curve_in_steady_motion() {
    for v in [1e-4, 0.02, -0.05, 0.3, -2.0] {
        let z = BRISTLES.advance(0.3, 1e4 * v, 1e4);
        let level = 1.0 + 0.5 * (-(v / 0.05) * (v / 0.05)).exp();
        close(BRISTLES.rate(v, z), 0.0, 1e-9);
        close(BRISTLES.effort(v, z), -4.0 * level * v.signum(), 1e-9);
    }
}

#[test]
fn bristles_are_a_spring_before_they_slide() {
    // Slowly and little: -coulomb/displacement q, and the damping of the bristles beside it.
    let way = 1e-7;
    close(BRISTLES.effort(0.0, BRISTLES.advance(0.0, way, 1.0)) / way, -4e3, 1.0);
    close(BRISTLES.effort(1e-6, 0.0) / 1e-6, -30.0, 1e-9);
    // A block on them swings with that stiffness.
    let numbers =
        [("coulomb", 4.0), ("displacement", 1e-3), ("damping", 0.0), ("excess", 0.5), ("stribeck_velocity", 0.05)];
    for method in [Method::Rk4, Method::Rosenbrock, Method::Additive] {
        let bench = Bench::new(&machine("lugre_friction", &numbers), 1e-3, 2, method);
        let position = bench.channel(&bench.free(&[0.0, 1e-6, 0.0], &[0.0; 150]), 0);
        let rate = (4e3_f64 / 2.0).sqrt();
        for (k, q) in position.into_iter().enumerate() {
            close(q, 1e-6 / rate * (rate * 1e-3 * k as f64).sin(), 2e-10);
        }
    }
}

#[test]
fn bristles_without_excess_and_damping_are_dahls() {
    let plain = LugreFriction { damping: 0.0, excess: 0.0, ..BRISTLES };
    let dahl = Hysteresis { force: 4.0, displacement: 1e-3, shape: 1.0 };
    let mut random = Random::new(6);
    for _ in 0..100 {
        let (v, z, way) = (random.symmetric(), random.symmetric(), 5e-3 * random.symmetric());
        close(plain.rate(v, z), dahl.rate(v, z), 1e-11);
        close(plain.effort(v, z), dahl.effort(v, z), 1e-14);
        close(plain.advance(z, way, 0.1), dahl.advance(z, way, 0.1), 1e-14);
    }
}

#[test]
fn bristles_only_take_energy_where_they_are_damped_little() {
    let mut random = Random::new(8);
    let lost = |v: f64, z: f64| -BRISTLES.effort(v, z) * v - 4.0 * 1e-3 * z * BRISTLES.rate(v, z);
    for _ in 0..1000 {
        // 30 |v| stays below 16.
        let (v, z) = (0.5 * random.symmetric(), 1.5 * random.symmetric());
        assert!(lost(v, z) >= -1e-12, "{v} {z}: {}", lost(v, z));
    }
    // Faster ones give some back of what slow sliding bent.
    assert!(lost(2.0, 1.4) < 0.0);
}

#[test]
fn the_way_of_bristles_is_the_integral_of_their_rate_and_takes_energy() {
    let (v, time, pieces) = (0.03, 0.1, 20_000);
    for start in [-1.0, 0.0, 0.7] {
        let (mut z, h) = (start, time / f64::from(pieces));
        for _ in 0..pieces {
            let middle = z + 0.5 * h * BRISTLES.rate(v, z);
            z += h * BRISTLES.rate(v, middle);
        }
        close(BRISTLES.advance(start, v * time, time), z, 1e-7);
    }
    // Sliding back and forth by far more than the bristles bend takes nearly the work of the steady curve.
    let (half, step) = (50_000, 1e-4);
    let (mut z, mut work) = (-1.0, 0.0);
    for k in 0..2 * half {
        let v = if k < half { 0.5 } else { -0.5 };
        let next = BRISTLES.advance(z, v * step, step);
        work -= 0.5 * (BRISTLES.effort(v, z) + BRISTLES.effort(v, next)) * v * step;
        z = next;
    }
    // Along each of 2 ways of 2.5 m z goes from -1 to 1 as 1 - 2 e^(-q/d): it lacks 2 d of the friction, and bending damps over 2 d.
    close(work, 2.0 * (4.0 * (2.5 - 2e-3) + 30.0 * 0.5 * 2e-3), 1e-4);
}
