//! The bushing: opposite wrenches, energy, and the same law in all axes.

use proptest::prelude::*;
use vpm_core::Dual;
use vpm_core::bushing::Bushing;
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3, Wrench};

type Grid = [[f64; 6]; 6];

/// `A^T A`, symmetric and positive.
fn square(random: &mut Random) -> Grid {
    let rows: Grid = std::array::from_fn(|_| std::array::from_fn(|_| random.symmetric()));
    std::array::from_fn(|i| std::array::from_fn(|j| rows.iter().map(|row| row[i] * row[j]).sum()))
}

fn bushing(random: &mut Random) -> Bushing<f64> {
    let preload = std::array::from_fn(|_| random.symmetric());
    Bushing { stiffness: square(random), damping: square(random), preload }
}

fn pose(random: &mut Random, angle: f64) -> Pose<f64> {
    let rotation = Matrix3::rotation(Vector3::from(random.direction()), angle);
    Pose::new(rotation, Vector3::from(random.vector(1.0)))
}

fn twist(random: &mut Random) -> Twist<f64> {
    Twist::new(Vector3::from(random.vector(1.0)), Vector3::from(random.vector(1.0)))
}

fn size(w: Wrench<f64>) -> f64 {
    (w.angular.dot(w.angular) + w.linear.dot(w.linear)).sqrt()
}

fn numbers(w: Wrench<f64>) -> [f64; 6] {
    let ([a, b, c], [x, y, z]) = (w.angular.to_array(), w.linear.to_array());
    [a, b, c, x, y, z]
}

/// `pose` with its frame moving along each of `N` twists in its own axes.
fn moving<const N: usize>(pose: &Pose<f64>, along: &[Twist<f64>; N]) -> Pose<Dual<f64, N>> {
    let lift = |value: Vector3<f64>, rate: &dyn Fn(&Twist<f64>) -> Vector3<f64>| {
        let rates = along.each_ref().map(rate);
        let entry = |value, pick: fn(&Vector3<f64>) -> f64| Dual { value, gradient: rates.each_ref().map(pick) };
        Vector3::new(entry(value.x, |r| r.x), entry(value.y, |r| r.y), entry(value.z, |r| r.z))
    };
    let [x, y, z] = Matrix3::identity().columns;
    let column = |unit: Vector3<f64>| lift(pose.rotation * unit, &|t| pose.rotation * t.angular.cross(unit));
    let rotation = Matrix3::from_columns(column(x), column(y), column(z));
    Pose::new(rotation, lift(pose.translation, &|t| pose.rotation * t.linear))
}

fn lifted<const N: usize>(law: &Bushing<f64>) -> Bushing<Dual<f64, N>> {
    law.map(&mut |&number| Dual::constant(number))
}

proptest! {
    /// At every angle below half a turn, on both sides of where the series ends.
    #[test]
    fn the_two_wrenches_balance_about_any_point(seed in 0_u64..1000, angle in 0.0..3.0_f64) {
        let random = &mut Random::new(seed);
        let (law, world_b, relative) = (bushing(random), pose(random, 2.0), pose(random, angle));
        let found = law.wrenches(&relative, twist(random));
        let world_a = world_b * relative;
        let (on_a, on_b) = (world_a.wrench(found.on_a), world_b.wrench(found.on_b));
        let about = |w: Wrench<f64>, p: Vector3<f64>| w.angular - p.cross(w.linear);
        let p = Vector3::from(random.vector(3.0));
        let moment = about(on_a, p) + about(on_b, p);
        prop_assert!(size(Wrench::new(moment, on_a.linear + on_b.linear)) < 1e-12 * (1.0 + size(on_a)));
        // The printed arm, from B to A in the axes of B: T_b = -T_a - delta x F_a.
        let (force, torque) = (relative.rotation * found.on_a.linear, relative.rotation * found.on_a.angular);
        let expected = Wrench::new(-torque - relative.translation.cross(force), -force);
        prop_assert!(size(found.on_b - expected) < 1e-13 * (1.0 + size(expected)));
    }

    /// Power on both bodies in the world = - rate of the potential - dissipation.
    #[test]
    fn power_is_lost_energy(seed in 0_u64..1000, angle in 0.0..3.0_f64) {
        let random = &mut Random::new(seed);
        let (law, relative) = (bushing(random), pose(random, angle));
        let (of_a, of_b) = (twist(random), twist(random));
        let motion = of_a - relative.inverse_twist(of_b);
        let found = law.wrenches(&relative, motion);
        let power = of_a.power(found.on_a) + of_b.power(found.on_b);
        let stored = lifted::<1>(&law).potential(&moving(&relative, &[motion])).gradient[0];
        let lost = law.dissipation(&relative, motion);
        prop_assert!(lost >= 0.0);
        prop_assert!((power + stored + lost).abs() < 1e-11 * (1.0 + lost + stored.abs()), "{power} {stored} {lost}");
    }

    /// The wrench at rest is minus the gradient of the potential along the six motions of A.
    #[test]
    fn the_wrench_is_the_slope_of_the_potential(seed in 0_u64..1000, angle in 0.0..3.0_f64) {
        let random = &mut Random::new(seed);
        let (law, relative) = (bushing(random), pose(random, angle));
        let along: [Twist<f64>; 6] = std::array::from_fn(|lane| {
            let unit = |from: usize| Vector3::from([0, 1, 2].map(|k| if from + k == lane { 1.0 } else { 0.0 }));
            Twist::new(unit(0), unit(3))
        });
        let slopes = lifted::<6>(&law).potential(&moving(&relative, &along)).gradient;
        for (force, slope) in numbers(law.wrenches(&relative, Twist::zero()).on_a).into_iter().zip(slopes) {
            prop_assert!((force + slope).abs() < 1e-11 * (1.0 + slope.abs()), "{force} {slope}");
        }
    }

    /// Axes of both frames turned by Q, matrices with them: `K' = Q^T K Q` in each of the four blocks.
    #[test]
    fn turned_axes_see_the_same_wrenches(seed in 0_u64..1000, angle in 0.0..3.0_f64) {
        let random = &mut Random::new(seed);
        let (law, relative, motion) = (bushing(random), pose(random, angle), twist(random));
        let turn = pose(random, 1.7).rotation;
        let q: Grid = std::array::from_fn(|i| std::array::from_fn(|j| {
            if i / 3 == j / 3 { turn.columns[j % 3].to_array()[i % 3] } else { 0.0 }
        }));
        let inner = |i: usize, j: usize, grid: &Grid| {
            (0..36).map(|k| q[k / 6][i] * grid[k / 6][k % 6] * q[k % 6][j]).sum::<f64>()
        };
        let turned = |grid: &Grid| std::array::from_fn(|i| std::array::from_fn(|j| inner(i, j, grid)));
        let preload = std::array::from_fn(|i| (0..6).map(|k| q[k][i] * law.preload[k]).sum());
        let there = Bushing { stiffness: turned(&law.stiffness), damping: turned(&law.damping), preload };
        let axes = Pose::new(turn, Vector3::zero());
        let found = there.wrenches(&(axes.inverse() * relative * axes), axes.inverse_twist(motion));
        let here = law.wrenches(&relative, motion);
        prop_assert!(size(axes.wrench(found.on_a) - here.on_a) < 1e-11 * (1.0 + size(here.on_a)));
        prop_assert!(size(axes.wrench(found.on_b) - here.on_b) < 1e-11 * (1.0 + size(here.on_b)));
    }

    /// `w_a = -K d - C v + w_0` to first order in the angle, with d and v in the order of the matrices.
    #[test]
    fn small_displacements_follow_the_printed_law(seed in 0_u64..1000) {
        let random = &mut Random::new(seed);
        let (law, motion) = (bushing(random), twist(random));
        let (axis, angle, place) = (Vector3::from(random.direction()), 1e-7, Vector3::from(random.vector(1.0)));
        let relative = Pose::new(Matrix3::rotation(axis, angle), place);
        let ([a, b, c], [x, y, z]) = ((axis * angle).to_array(), place.to_array());
        let ([p, q, r], [u, v, w]) = (motion.angular.to_array(), motion.linear.to_array());
        let (d, rate) = ([a, b, c, x, y, z], [p, q, r, u, v, w]);
        let found = numbers(law.wrenches(&relative, motion).on_a);
        for (i, found) in found.into_iter().enumerate() {
            let sum = |row: &[f64; 6], column: &[f64; 6]| row.iter().zip(column).map(|(l, r)| l * r).sum::<f64>();
            let expected = law.preload[i] - sum(&law.stiffness[i], &d) - sum(&law.damping[i], &rate);
            prop_assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
    }
}

#[test]
fn rates_are_those_of_the_displacement() {
    let random = &mut Random::new(7);
    // Around the end of the series (a^2 = 0.1) to rounding, where its last terms count; farther out as the closed form allows.
    for (angle, tolerance) in
        [(1e-9, 1e-15), (0.1, 1e-15), (0.3162, 3e-15), (0.3163, 3e-14), (1.5, 1e-14), (3.1, 1e-13)]
    {
        for _ in 0..50 {
            let (relative, motion) = (pose(random, angle), twist(random));
            let d = Bushing::displacement(&moving(&relative, &[motion]));
            for (entry, rate) in d.into_iter().zip(Bushing::displacement_rate(&relative, motion)) {
                let gap = (entry.gradient[0] - rate).abs();
                assert!(gap < tolerance, "{gap:e} at {angle}");
            }
        }
    }
}

#[test]
fn single_directions_have_closed_forms() {
    let stiffness = [10.0, 20.0, 30.0, 100.0, 200.0, 300.0];
    let law = Bushing::diagonal(stiffness, stiffness.map(|k| 0.1 * k));
    let (z, still) = (Vector3::new(0.0, 0.0, 1.0), Twist::zero());
    // Turned by one radian about z: a moment of 30 N m back, nothing else.
    let turned = Pose::new(Matrix3::rotation(z, 1.0), Vector3::zero());
    let found = law.wrenches(&turned, still);
    assert!(size(found.on_a - Wrench::new(z * -30.0, Vector3::zero())) < 1e-13, "{found:?}");
    assert!((law.potential(&turned) - 15.0).abs() < 1e-13);
    // Moved by 0.2 m along x: -20 N on A, in whose axes it stands, and no moment about either origin.
    let moved = Pose::new(Matrix3::identity(), Vector3::new(0.2, 0.0, 0.0));
    let found = law.wrenches(&moved, still);
    assert!(size(found.on_a - Wrench::new(Vector3::zero(), Vector3::new(-20.0, 0.0, 0.0))) < 1e-13);
    assert!(size(found.on_b - Wrench::new(Vector3::zero(), Vector3::new(20.0, 0.0, 0.0))) < 1e-13);
    // Moved along x, drawn along y by the damper: the moment on B has the arm of 0.2 m, -0.2 * (-20 * 3).
    let found = law.wrenches(&moved, Twist::new(Vector3::zero(), Vector3::new(0.0, 3.0, 0.0)));
    assert!((found.on_a.linear.y + 60.0).abs() < 1e-13 && (found.on_b.angular.z - 12.0).abs() < 1e-13, "{found:?}");
    assert!(found.on_a.angular.dot(found.on_a.angular) < 1e-26);
}

#[test]
fn derivatives_are_finite_without_displacement() {
    let law = bushing(&mut Random::new(3));
    let along = [twist(&mut Random::new(4))];
    let found = lifted::<1>(&law).wrenches(&moving(&Pose::identity(), &along), Twist::zero());
    // At zero the slope is the stiffness itself, but for the preload, whose axes turn with A.
    let Twist { angular, linear } = along[0];
    let ([a, b, c], [x, y, z]) = (angular.to_array(), linear.to_array());
    let d = [a, b, c, x, y, z];
    let spring: [f64; 6] = std::array::from_fn(|i| -(0..6).map(|j| law.stiffness[i][j] * d[j]).sum::<f64>());
    let [px, py, pz, fx, fy, fz] = law.preload;
    let (moment, force) = (Vector3::new(px, py, pz), Vector3::new(fx, fy, fz));
    let (moment_rate, force_rate) = (angular.cross(moment) * -0.5, -angular.cross(force));
    let turned = numbers(Wrench::new(moment_rate, force_rate));
    let slope = |v: Vector3<Dual<f64, 1>>| v.to_array().map(|entry| entry.gradient[0]);
    let found = Wrench::new(Vector3::from(slope(found.on_a.angular)), Vector3::from(slope(found.on_a.linear)));
    for ((found, spring), turned) in numbers(found).into_iter().zip(spring).zip(turned) {
        assert!((found - spring - turned).abs() < 1e-12, "{found} {spring} {turned}");
    }
}

#[test]
fn every_entry_has_its_domain() {
    let law = bushing(&mut Random::new(5));
    assert!(law.domains().len() == 78 && law.domains().iter().all(|(number, domain)| domain.contains(**number)));
    let negative = Bushing::diagonal([1.0, 1.0, 1.0, -1.0, 1.0, 1.0], [1.0; 6]);
    assert_eq!(negative.domains().iter().filter(|(number, domain)| !domain.contains(**number)).count(), 1);
}
