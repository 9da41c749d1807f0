//! Contact of a point with a plane: closed forms of impact and rest, energy, friction, and planes in any direction.

use proptest::prelude::*;
use vpm_core::contact::{Contact, ContactFriction, NormalContact, Plane};
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Vector2, Vector3};
use vpm_core::{Dual, Scalar};

use crate::common::close;

const GRAVITY: f64 = 9.81;

/// The foot of the leg in SI.
fn foot() -> NormalContact<f64> {
    NormalContact { stiffness: 2855.0 * 1000_f64.powf(1.1), exponent: 1.1, damping: 1000.0, damping_depth: 1e-4 }
}

fn rubber() -> ContactFriction<f64> {
    ContactFriction { static_coefficient: 0.7, static_velocity: 0.1, dynamic_coefficient: 0.55, dynamic_velocity: 1.0 }
}

/// One step of the classical Runge-Kutta method for a point mass on its height (m) and its speed upward (m/s).
fn fall(law: &NormalContact<f64>, mass: f64, [y, v]: [f64; 2], h: f64) -> [f64; 2] {
    let f = |[y, v]: [f64; 2]| [v, law.force(-y, -v) / mass - GRAVITY];
    let a = f([y, v]);
    let b = f([y + 0.5 * h * a[0], v + 0.5 * h * a[1]]);
    let c = f([y + 0.5 * h * b[0], v + 0.5 * h * b[1]]);
    let d = f([y + h * c[0], v + h * c[1]]);
    let mean = |k: usize| (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]) / 6.0;
    [y + h * mean(0), v + h * mean(1)]
}

#[test]
fn an_undamped_impact_goes_as_deep_as_its_energy_allows() {
    // 11.981 kg from 5 cm: m g (h + d) = k d^(n+1) / (n+1).
    let (law, mass, height) = (NormalContact { damping: 0.0, ..foot() }, 11.981, 0.05);
    let energy = |d: f64| mass * GRAVITY * (height + d) - law.potential(d);
    let (mut low, mut high) = (1e-6, 0.1);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        (low, high) = if energy(middle) > 0.0 { (middle, high) } else { (low, middle) };
    }
    let (mut state, mut deepest) = ([0.0, -(2.0 * GRAVITY * height).sqrt()], 0.0_f64);
    for _ in 0..20_000 {
        state = fall(&law, mass, state, 1e-6);
        deepest = deepest.max(-state[0]);
    }
    close(deepest, low, 1e-9);
    close(law.force(deepest, 0.0), 5_696_473.909 * low.powf(1.1), 0.01);
    // It leaves as fast as it came: nothing is lost.
    close(0.5 * mass * state[1] * state[1] + mass * GRAVITY * state[0], mass * GRAVITY * height, 1e-5);
    // The same without the fall during the impact, as a bound computed by hand: 2.008 mm and 6146 N.
    let depth = (mass * GRAVITY * height * 2.1 / law.stiffness).powf(1.0 / 2.1);
    close(depth, 2.008e-3, 5e-7);
    close(law.force(depth, 0.0), 6146.0, 0.5);
}

#[test]
fn bounces_get_lower_and_end_at_rest_where_the_spring_carries_the_weight() {
    let (law, mass) = (foot(), 11.981);
    let (mut state, mut apexes) = ([0.05, 0.0], vec![0.05]);
    for _ in 0..400_000 {
        let next = fall(&law, mass, state, 1e-5);
        if state[1] > 0.0 && next[1] <= 0.0 && next[0] > 0.0 {
            apexes.push(next[0]);
        }
        state = next;
    }
    assert!(apexes.len() > 3 && apexes.windows(2).all(|pair| pair[1] < pair[0]), "{apexes:?}");
    close(-state[0], (mass * GRAVITY / law.stiffness).powf(1.0 / 1.1), 1e-12);
    close(state[1], 0.0, 1e-10);
}

proptest! {
    #[test]
    fn no_motion_gains_energy(n in 1.0..2.5_f64, c in 0.0..5e3_f64, d in -1e-3..3e-3_f64, rate in -3.0..3.0_f64) {
        let law = NormalContact { exponent: n, damping: c, ..foot() };
        let (force, lost) = (law.force(d, rate), law.dissipation(d, rate));
        prop_assert!(force >= 0.0 && (d > 0.0 || force == 0.0));
        prop_assert!(lost >= 0.0);
        // The spring alone is the slope of its energy.
        let along = law.map(&mut |&number| Dual::<f64, 1>::constant(number)).potential(Dual::variable(d, 0));
        prop_assert!((along.gradient[0] - law.spring(d)).abs() <= 1e-12 * law.spring(d));
        // Rounding is that of the larger of both powers: where the pull is cut off, the force is zero and the spring's power is not.
        let scale = 1.0 + (force * rate).abs() + (law.spring(d) * rate).abs();
        prop_assert!((along.gradient[0] * rate + lost - force * rate).abs() <= 1e-12 * scale);
    }

    #[test]
    fn friction_opposes_every_motion(x in -2.0..2.0_f64, y in -2.0..2.0_f64, normal in 0.0..1e3_f64) {
        let (law, v) = (rubber(), Vector2::new(x, y));
        let force = law.force(v, normal);
        prop_assert!(force.dot(v) <= 0.0 && force.cross(v).abs() <= 1e-12 * (1.0 + normal));
        prop_assert!(force.length() <= 0.7 * normal * (1.0 + 1e-15));
        prop_assert!(law.force(-v, normal) == -force);
        prop_assert!((force.length() - law.coefficient(v.length()) * normal).abs() <= 1e-12 * (1.0 + normal));
    }

    /// Seen from other axes the same force acts; a plane pushes to its free side only, whatever the length of its normal.
    #[test]
    fn the_force_turns_with_the_world(seed in 0_u64..1000, depth in -1e-3..2e-3_f64) {
        let random = &mut Random::new(seed);
        let turn = Matrix3::rotation(Vector3::from(random.direction()), 3.0 * random.symmetric());
        let shift = Vector3::from(random.vector(2.0));
        let (normal, on) = (Vector3::from(random.direction()), Vector3::from(random.vector(1.0)));
        let velocity = Vector3::from(random.vector(1.0));
        let aside = normal.cross(Vector3::from(random.vector(1.0)));
        let place = on - normal * depth + aside;
        let contact = Contact { normal: foot(), friction: Some(rubber()) };
        let plane = Plane::new(on, normal * 7.0).unwrap();
        prop_assert!((plane.depth(place) - depth).abs() < 1e-14);
        let here = contact.force(&plane, place, velocity);
        let turned = Plane::new(turn * on + shift, turn * normal).unwrap();
        let there = contact.force(&turned, turn * place + shift, turn * velocity);
        let gap = turn * here - there;
        // Rounding of places of a few metres counts at the stiffness of the contact.
        prop_assert!(gap.dot(gap).sqrt() < 1e-7, "{here:?} {there:?}");
        prop_assert!(here.dot(normal) >= 0.0);
        let sliding = velocity - normal * normal.dot(velocity);
        prop_assert!(here.dot(sliding) <= 1e-12);
        if depth < -1e-12 {
            prop_assert!(here == Vector3::zero());
        }
    }
}

#[test]
fn the_laws_take_their_named_values() {
    let law = rubber();
    for (speed, coefficient) in [(0.0, 0.0), (0.05, 0.35), (0.1, 0.7), (0.55, 0.625), (1.0, 0.55), (9.0, 0.55)] {
        close(law.coefficient(speed), coefficient, 1e-15);
    }
    // Half the damping at half its depth.
    let law = foot();
    close(law.force(5e-5, 0.2) - law.spring(5e-5), 0.5 * 1000.0 * 0.2, 1e-10);
    close(law.force(2e-4, 0.2) - law.spring(2e-4), 1000.0 * 0.2, 1e-10);
    // A point that leaves fast is not held back.
    close(law.force(2e-4, -2.0), 0.0, 0.0);
    assert!(law.force(f64::NAN, 1.0).is_nan() && law.force(1e-3, f64::NAN).is_nan());
}

#[test]
fn forces_have_finite_derivatives_everywhere() {
    let numbers = foot().map(&mut |&number| Dual::<f64, 2>::constant(number));
    for d in [-1.0, 0.0, 5e-324, 1e-300, 1e-12, 1e-4, 2e-3] {
        for rate in [-1.0, 0.0, 1.0] {
            let force = numbers.force(Dual::variable(d, 0), Dual::variable(rate, 1));
            assert!(force.is_finite(), "{d} {rate} {force:?}");
        }
    }
    // By its own parameters as well.
    let exponent = Dual::<f64, 2>::variable(1.1, 0);
    let force = NormalContact { exponent, ..numbers }.force(Dual::constant(1e-3), Dual::constant(0.0));
    close(force.gradient[0] / force.value, 1e-3_f64.ln(), 1e-12);

    let law = rubber().map(&mut |&number| Dual::<f64, 2>::constant(number));
    let slope = |x: f64| {
        let v = Vector2::new(Dual::<f64, 2>::variable(x, 0), Dual::variable(0.0, 1));
        let force = law.force(v, Dual::constant(1.0));
        assert!(force.x.is_finite() && force.y.is_finite(), "at {x}: {force:?}");
        force.x.gradient[0]
    };
    for x in [0.0, 5e-324, 1e-170, 1e-150, 1e-9] {
        close(slope(x), 0.0, 1e-6);
    }
    // The slope is continuous where the steps meet.
    for x in [0.1, 1.0] {
        close(slope(x - 1e-9), slope(x + 1e-9), 1e-5);
    }
}

/// A block on a slope, held by friction; its speed downhill after two seconds.
fn slide(angle: f64) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let rate = |v: f64| GRAVITY * sine + rubber().force(Vector2::new(v, 0.0), GRAVITY * cosine).x;
    let (mut v, h) = (0.0, 1e-4);
    for _ in 0..20_000 {
        let middle = v + 0.5 * h * rate(v);
        v += h * rate(middle);
    }
    v
}

#[test]
fn a_held_block_creeps_below_the_static_velocity() {
    for tangent in [0.01_f64, 0.1, 0.35, 0.5, 0.69] {
        let speed = slide(tangent.atan());
        assert!(speed < 0.1, "{speed} m/s at a slope of {tangent}");
        close(rubber().coefficient(speed), tangent, 1e-6);
    }
    // A small load: mu = 3 mu_s (v / v_s)^2.
    close(slide(0.01_f64.atan()), 0.1 * (0.01_f64 / 2.1).sqrt(), 2e-4);
    // Beyond the static coefficient it slides away: a = g (sin - mu_d cos) once it is fast.
    let steep = 0.8_f64.atan();
    let slow = slide(steep);
    assert!(slow > 2.0 && slow < 2.0 * GRAVITY * (steep.sin() - 0.55 * steep.cos()), "{slow}");
}

#[test]
fn a_plane_needs_a_direction_and_a_description_its_numbers() {
    assert!(Plane::new(Vector3::<f64>::zero(), Vector3::zero()).is_err());
    assert!(Plane::new(Vector3::zero(), Vector3::new(0.0, f64::NAN, 1.0)).is_err());
    let tiny = Plane::new(Vector3::zero(), Vector3::new(0.0, 3e-200, 4e-200)).unwrap();
    close(tiny.normal().y, 0.6, 1e-15);
    let text = r#"{"normal": {"stiffness": 0, "exponent": 1, "damping": 2, "damping_depth": 3}}"#;
    let smooth: Contact<usize> = serde_json::from_str(text).unwrap();
    let numbers = [4.0, 1.0, 0.0, 1.0];
    let law = smooth.map(&mut |&place| numbers[place]);
    assert!(smooth.domains().len() == 4 && law.domains().iter().all(|(number, domain)| domain.contains(**number)));
    let ground = Plane::new(Vector3::zero(), Vector3::new(0.0, 0.0, 1.0)).unwrap();
    let force = law.force(&ground, Vector3::new(5.0, 6.0, -0.5), Vector3::new(1.0, 1.0, 0.0));
    assert_eq!(force, Vector3::new(0.0, 0.0, 2.0));
    let rough = Contact { normal: foot(), friction: Some(rubber()) };
    assert!(rough.domains().len() == 8 && rough.domains().iter().all(|(number, domain)| domain.contains(**number)));
}
