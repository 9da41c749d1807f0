//! Poses form a group; power, kinetic energy and momentum do not depend on the frame they are written in.

use proptest::prelude::*;
use vpm_core::samples::Random;
use vpm_core::spatial::{
    ArticulatedInertia, Matrix3, Pose, SpatialInertia, Symmetric3, Twist, Vector3, Wrench, principal_moments,
};

const TOLERANCE: f64 = 1e-12;

fn vector(random: &mut Random) -> Vector3<f64> {
    Vector3::from(random.vector(2.0))
}

fn twist(random: &mut Random) -> Twist<f64> {
    Twist::new(vector(random), vector(random))
}

fn wrench(random: &mut Random) -> Wrench<f64> {
    Wrench::new(vector(random), vector(random))
}

fn pose(random: &mut Random) -> Pose<f64> {
    let axis = Vector3::from(random.direction());
    Pose::new(Matrix3::rotation(axis, 3.0 * random.symmetric()), vector(random))
}

/// A cloud of point masses, each with its position: what an inertia stands for.
fn cloud(random: &mut Random) -> Vec<(f64, Vector3<f64>)> {
    (0..5).map(|_| (0.1 + random.unit(), vector(random))).collect()
}

fn inertia(cloud: &[(f64, Vector3<f64>)]) -> SpatialInertia<f64> {
    cloud.iter().fold(SpatialInertia::zero(), |total, &(mass, at)| total + SpatialInertia::point_mass(mass, at))
}

fn distance(a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    (a - b).dot(a - b).sqrt()
}

fn twist_distance(a: Twist<f64>, b: Twist<f64>) -> f64 {
    distance(a.angular, b.angular) + distance(a.linear, b.linear)
}

fn wrench_distance(a: Wrench<f64>, b: Wrench<f64>) -> f64 {
    distance(a.angular, b.angular) + distance(a.linear, b.linear)
}

fn pose_distance(a: Pose<f64>, b: Pose<f64>) -> f64 {
    let columns = a.rotation.columns.into_iter().zip(b.rotation.columns);
    distance(a.translation, b.translation) + columns.map(|(left, right)| distance(left, right)).sum::<f64>()
}

proptest! {
    #[test]
    fn poses_form_a_group(seed: u64) {
        let random = &mut Random::new(seed);
        let (a, b, c) = (pose(random), pose(random), pose(random));
        prop_assert!(pose_distance((a * b) * c, a * (b * c)) < TOLERANCE);
        prop_assert!(pose_distance(a * Pose::identity(), a) == 0.0);
        prop_assert!(pose_distance(a * a.inverse(), Pose::identity()) < TOLERANCE);
        prop_assert!(pose_distance(a.inverse() * a, Pose::identity()) < TOLERANCE);
        let p = vector(random);
        prop_assert!(distance((a * b).point(p), a.point(b.point(p))) < TOLERANCE);
        prop_assert!((a.rotation.determinant() - 1.0).abs() < TOLERANCE);
    }

    #[test]
    fn transforms_compose_and_invert(seed: u64) {
        let random = &mut Random::new(seed);
        let (a, b) = (pose(random), pose(random));
        let (v, f) = (twist(random), wrench(random));
        prop_assert!(twist_distance((a * b).twist(v), a.twist(b.twist(v))) < 10.0 * TOLERANCE);
        prop_assert!(wrench_distance((a * b).wrench(f), a.wrench(b.wrench(f))) < 10.0 * TOLERANCE);
        prop_assert!(twist_distance(a.inverse_twist(v), a.inverse().twist(v)) < TOLERANCE);
        prop_assert!(wrench_distance(a.inverse_wrench(f), a.inverse().wrench(f)) < TOLERANCE);
    }

    #[test]
    fn a_twist_moves_points_alike_in_every_frame(seed: u64) {
        let random = &mut Random::new(seed);
        let (x, v, p) = (pose(random), twist(random), vector(random));
        let moved = x.twist(v);
        let in_b = v.linear + v.angular.cross(p);
        let in_a = moved.linear + moved.angular.cross(x.point(p));
        prop_assert!(distance(in_a, x.rotation * in_b) < 10.0 * TOLERANCE);
    }

    #[test]
    fn power_is_the_same_in_every_frame(seed: u64) {
        let random = &mut Random::new(seed);
        let (x, v, f) = (pose(random), twist(random), wrench(random));
        prop_assert!((x.twist(v).power(x.wrench(f)) - v.power(f)).abs() < 100.0 * TOLERANCE);
    }

    #[test]
    fn cross_products_are_dual_and_follow_the_frame(seed: u64) {
        let random = &mut Random::new(seed);
        let (x, v, u, f) = (pose(random), twist(random), twist(random), wrench(random));
        prop_assert!((v.cross(u).power(f) + u.power(v.cross_wrench(f))).abs() < 100.0 * TOLERANCE);
        prop_assert!(twist_distance(x.twist(v.cross(u)), x.twist(v).cross(x.twist(u))) < 100.0 * TOLERANCE);
        prop_assert!(twist_distance(v.cross(v), Twist::zero()) < TOLERANCE);
    }

    #[test]
    fn inertia_is_that_of_its_points(seed: u64) {
        let random = &mut Random::new(seed);
        let (points, v) = (cloud(random), twist(random));
        let body = inertia(&points);
        let energy: f64 = points.iter().map(|&(mass, at)| {
            let speed = v.linear + v.angular.cross(at);
            0.5 * mass * speed.dot(speed)
        }).sum();
        prop_assert!((body.kinetic_energy(v) - energy).abs() < 100.0 * TOLERANCE * (1.0 + energy));
        let again = SpatialInertia::new(body.mass, body.center_of_mass(), body.central());
        prop_assert!(wrench_distance(again.apply(v), body.apply(v)) < 100.0 * TOLERANCE);
    }

    #[test]
    fn inertia_transform_keeps_kinetic_energy_and_momentum(seed: u64) {
        let random = &mut Random::new(seed);
        let (x, v) = (pose(random), twist(random));
        let body = inertia(&cloud(random));
        let (moved, moved_twist) = (x.inertia(body), x.twist(v));
        let energy = body.kinetic_energy(v);
        prop_assert!((moved.kinetic_energy(moved_twist) - energy).abs() < 1000.0 * TOLERANCE * (1.0 + energy));
        prop_assert!(wrench_distance(moved.apply(moved_twist), x.wrench(body.apply(v))) < 1000.0 * TOLERANCE);
    }

    #[test]
    fn articulated_inertia_moves_like_the_wrenches_it_makes(seed: u64) {
        let random = &mut Random::new(seed);
        let (x, a, u) = (pose(random), twist(random), wrench(random));
        let body = ArticulatedInertia::from(inertia(&cloud(random)));
        let felt = body.deflated(u, 0.1 * random.unit());
        let moved = x.articulated_inertia(felt).apply(x.twist(a));
        prop_assert!(wrench_distance(moved, x.wrench(felt.apply(a))) < 10_000.0 * TOLERANCE);
    }

    #[test]
    fn deflation_makes_the_joint_motion_free(seed: u64) {
        let random = &mut Random::new(seed);
        let motion = twist(random);
        let body = ArticulatedInertia::from(inertia(&cloud(random)));
        let u = body.apply(motion);
        let felt = body.deflated(u, 1.0 / motion.power(u));
        prop_assert!(wrench_distance(felt.apply(motion), Wrench::zero()) < 1000.0 * TOLERANCE);
    }

    #[test]
    fn principal_moments_survive_rotation(seed: u64) {
        let random = &mut Random::new(seed);
        let mut expected = random.vector(3.0);
        let [xx, yy, zz] = expected;
        let turned = Symmetric3 { xx, yy, zz, xy: 0.0, xz: 0.0, yz: 0.0 }.rotated(pose(random).rotation);
        expected.sort_by(f64::total_cmp);
        for (found, moment) in principal_moments(turned).into_iter().zip(expected) {
            prop_assert!((found - moment).abs() < 10.0 * TOLERANCE);
        }
    }
}

#[test]
fn a_right_angle_turns_x_into_y() {
    let rotation = Matrix3::rotation(Vector3::new(0.0, 0.0, 1.0), std::f64::consts::FRAC_PI_2);
    assert!(distance(rotation * Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0)) < TOLERANCE);
}
