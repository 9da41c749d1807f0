//! A leg that stands on and falls on its foot: rest, ground reaction, and the drop from 5 cm.

use proptest::prelude::*;
use vpm_core::{Dual, Scalar};

use crate::free_leg::{Balance, FreeLeg, GRAVITY, desired, foot, leg, rest};
use crate::values::check_all;

const DROP: f64 = 0.05;
const STEP: f64 = 1e-5;

/// What a drop from 5 cm shows.
struct Drop {
    touchdown: [f64; 2],
    peak: [f64; 2],
    heights: Vec<f64>,
    early_force: f64,
    lost_impulse: f64,
}

fn drop_leg(gain: f64) -> Drop {
    let free = FreeLeg::new(0.0, gain);
    let [a, b] = desired();
    let height = free.height(desired());
    let (mut x, mut t) = ([height + DROP, a, b, 0.0, 0.0, 0.0, 0.0], 0.0);
    // The joints stay where they are, so the foot is at y - height: to the ground, the last step by Newton's method.
    while free.step(x, 1e-3)[0] > height {
        (x, t) = (free.step(x, 1e-3), t + 1e-3);
    }
    let mut last = 1e-3;
    for _ in 0..20 {
        let end = free.step(x, last);
        last -= (end[0] - height) / end[3];
    }
    (x, t) = (free.step(x, last), t + last);
    let (touchdown, start) = ([t, -x[3]], free.vertical_momentum(x));
    x[6] = 0.0;
    let (mut peak, mut heights, mut early_force) = ([0.0; 2], Vec::new(), 0.0);
    for sample in [0.15, 0.2, 0.3, 0.4] {
        let steps = ((sample - t) / STEP).ceil();
        let (h, from) = ((sample - t) / steps, t);
        for k in 1..=steps as usize {
            x = free.step(x, h);
            t = from + h * k as f64;
            let force = free.rate(x)[6];
            assert!(force > 0.0, "the foot leaves the ground again at {t} s");
            if force > peak[0] {
                peak = [force, t - touchdown[0]];
            }
        }
        if heights.is_empty() {
            early_force = free.rate(x)[6];
        }
        heights.push(x[0]);
    }
    let mass: f64 = free.leg.masses().iter().map(|(mass, _)| mass).sum();
    let gained = free.vertical_momentum(x) - start + mass * GRAVITY * (t - touchdown[0]);
    Drop { touchdown, peak, heights, early_force, lost_impulse: x[6] - gained }
}

#[test]
fn every_value_of_the_leg_on_its_foot_is_met() {
    let mut found: Vec<(&str, Vec<f64>)> = Vec::new();
    let normal = foot().normal;
    found.push(("hyl.contact.kc_SI", vec![normal.stiffness]));
    found.push(("hyl.contact.cc_SI", vec![normal.force(1e-3, 1.0) - normal.force(1e-3, 0.0)]));
    for payload in [0.0, 3.0, 7.0] {
        let leg = leg(payload);
        let ground = leg.newton_euler([0.5, -1.5], [0.0; 2], [0.0; 2]).unwrap().ground;
        found.push((format!("hyl.static_grf.payload{payload}").leak(), vec![ground]));
        for gain in [150.0, 300.0] {
            let q = rest(&leg, gain);
            let pose = vec![q[0].to_degrees(), q[1].to_degrees(), leg.points(q).hip.y];
            found.push((format!("hyl.static_pose.P{gain}.payload{payload}").leak(), pose));
        }
    }
    let drops = [150.0, 300.0].map(drop_leg);
    found.push(("hyl.touchdown", drops[0].touchdown.to_vec()));
    found.push(("hyl.drop.peak_grf", drops.iter().map(|drop| drop.peak[0]).collect()));
    found.push(("hyl.drop.hip_height", drops.iter().flat_map(|drop| drop.heights.clone()).collect()));
    let lost = drops.iter().map(|drop| drop.lost_impulse.abs()).fold(0.0, f64::max);
    found.push(("hyl.drop.impulse_balance", vec![lost]));
    check_all("hyl.", &found).unwrap();
    for (drop, force) in drops.iter().zip([225.2, 303.2]) {
        println!("peak {:.2} N after {:.3} ms, {:.2} N at 0.15 s", drop.peak[0], 1e3 * drop.peak[1], drop.early_force);
        assert!((drop.peak[1] - 0.35e-3).abs() < 1e-5);
        assert!((drop.early_force - force).abs() < 0.05);
    }
}

#[test]
fn the_contact_carries_the_leg_at_rest() {
    for (payload, gain) in [(0.0, 150.0), (7.0, 300.0)] {
        let free = FreeLeg::new(payload, gain);
        let q = rest(&free.leg, gain);
        let weight = GRAVITY * free.leg.masses().iter().map(|(mass, _)| mass).sum::<f64>();
        let depth = (weight / free.contact.normal.stiffness).powf(1.0 / 1.1);
        let (acceleration, ground) = free.acceleration([free.height(q) - depth, q[0], q[1]], [0.0; 3]);
        assert!((ground - weight).abs() < 1e-8, "{ground} N under {weight} N");
        assert!(acceleration.iter().all(|a| a.abs() < 1e-6), "{acceleration:?}");
    }
}

proptest! {
    /// With the foot held on the ground, the free leg is the leg that slides: `Z^T (M z'' + V + G) = tau`.
    #[test]
    fn the_free_leg_is_the_leg_on_the_ground(
        q in [-0.5..1.0_f64, -2.3..-0.4_f64], v in [-5.0..5.0_f64, -5.0..5.0_f64], a in [-5.0..5.0_f64, -5.0..5.0_f64]
    ) {
        let free = FreeLeg::new(2.0, 0.0);
        // Height of the hip with its slopes, their rates, and through them its velocity and acceleration.
        let lifted: [Dual<Dual<f64, 1>, 2>; 2] =
            std::array::from_fn(|k| Dual::variable(Dual { value: q[k], gradient: [v[k]] }, k));
        let y = free.leg.points(lifted).hip.y;
        let slope = y.gradient.map(|part| part.value);
        let climb: f64 = (0..2).map(|k| slope[k] * a[k] + y.gradient[k].gradient[0] * v[k]).sum();
        let Balance { mass, bias, .. } = free.balance([y.re(), q[0], q[1]], [y.value.gradient[0], v[0], v[1]]);
        let motion = [climb, a[0], a[1]];
        let effort: [f64; 3] = std::array::from_fn(|i| bias[i] + (0..3).map(|j| mass[i][j] * motion[j]).sum::<f64>());
        let expected = free.leg.terms(q, v).effort(&a);
        for k in 0..2 {
            let found = slope[k] * effort[0] + effort[1 + k];
            prop_assert!((found - expected[k]).abs() < 1e-10 * (1.0 + effort[0].abs()), "{found} {}", expected[k]);
        }
    }
}
