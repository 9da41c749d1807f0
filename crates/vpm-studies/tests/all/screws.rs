//! Screws and derivatives tell the same of random chains, and singular configurations are what geometry says they are.

use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};
use vpm_core::{Dual, Error, Result};
use vpm_studies::algebra::SingularValues;
use vpm_studies::kinematics::{
    Component, DenavitHartenberg, LowerPair, Screw, SerialChain, Singularity, Task, at_point,
};

/// Rounding of chains of some metres and some rad/s.
const TOLERANCE: f64 = 1e-11;
const PAIRS: [LowerPair; 7] = [
    LowerPair::Fixed,
    LowerPair::Revolute,
    LowerPair::Prismatic,
    LowerPair::Helical { pitch: 0.3 },
    LowerPair::Cylindrical,
    LowerPair::Spherical,
    LowerPair::Planar,
];

fn pose(random: &mut Random) -> Pose<f64> {
    let turn = Matrix3::rotation(Vector3::from(random.direction()), 3.0 * random.symmetric());
    Pose::new(turn, Vector3::from(random.vector(0.5)))
}

fn random_chain(random: &mut Random) -> SerialChain {
    let joints: Vec<_> = (0..6).map(|_| (pose(random), PAIRS[(random.unit() * 7.0) as usize])).collect();
    SerialChain::new(&joints, pose(random))
}

fn size(v: Vector3<f64>) -> f64 {
    v.dot(v).sqrt()
}

fn apart(a: Twist<f64>, b: Twist<f64>) -> f64 {
    size(a.angular - b.angular) + size(a.linear - b.linear)
}

fn pose_apart(a: Pose<f64>, b: Pose<f64>) -> f64 {
    let columns = a.rotation.columns.into_iter().zip(b.rotation.columns);
    size(a.translation - b.translation) + columns.map(|(left, right)| size(left - right)).sum::<f64>()
}

fn shifted(q: &[f64], v: &[f64], a: &[f64], t: f64) -> Vec<f64> {
    (0..q.len()).map(|k| q[k] + v[k] * t + 0.5 * a[k] * t * t).collect()
}

proptest! {
    #[test]
    fn both_jacobians_agree(seed: u64) {
        let random = &mut Random::new(seed);
        let chain = random_chain(random);
        let n = chain.n_coordinates();
        let q = random.numbers(n, 2.0);
        let (mut screws, mut partial) = (vec![Twist::zero(); n], vec![Twist::zero(); n]);
        let end = chain.screw_jacobian(&q, &mut screws);
        prop_assert!(pose_apart(end, chain.conventional_jacobian(&q, &mut partial)) < TOLERANCE);
        for (screw, column) in screws.iter().zip(&partial) {
            prop_assert!(apart(at_point(*screw, end.translation), *column) < TOLERANCE);
        }
    }

    #[test]
    fn both_accelerations_agree(seed: u64) {
        let random = &mut Random::new(seed);
        let chain = random_chain(random);
        let n = chain.n_coordinates();
        let (q, v, a) = (random.numbers(n, 2.0), random.numbers(n, 2.0), random.numbers(n, 2.0));
        let (left, right) = (chain.motion_by_screws(&q, &v, &a), chain.motion_by_differentiation(&q, &v, &a));
        prop_assert!(pose_apart(left.pose, right.pose) < TOLERANCE);
        prop_assert!(apart(left.velocity, right.velocity) < TOLERANCE);
        let scale = 1.0 + size(left.acceleration.linear) + size(left.acceleration.angular);
        prop_assert!(apart(left.acceleration, right.acceleration) < TOLERANCE * scale);
        // J a + J_dot v: the part with a is the Jacobian's.
        let mut columns = vec![Twist::zero(); n];
        chain.conventional_jacobian(&q, &mut columns);
        let bias = chain.motion_by_screws(&q, &v, &vec![0.0; n]).acceleration;
        let total = columns.iter().zip(&a).fold(bias, |sum, (column, &a)| sum + *column * a);
        prop_assert!(apart(total, right.acceleration) < TOLERANCE * scale);
    }

    #[test]
    fn motion_is_what_finite_differences_of_the_pose_say(seed: u64) {
        let random = &mut Random::new(seed);
        let chain = random_chain(random);
        let n = chain.n_coordinates();
        let (q, v, a) = (random.numbers(n, 2.0), random.numbers(n, 1.0), random.numbers(n, 1.0));
        let motion = chain.motion_by_screws(&q, &v, &a);
        let h = 1e-4;
        let at = |t: f64| chain.motion_by_screws(&shifted(&q, &v, &a, t), &shifted(&v, &a, &vec![0.0; n], t), &a);
        let (before, after) = (at(-h), at(h));
        let slope = (after.pose.translation - before.pose.translation) * (0.5 / h);
        let scale = 1.0 + size(motion.acceleration.linear) + size(motion.acceleration.angular);
        // Central differences: h^2 times third derivatives, which grow with the cube of the rates.
        prop_assert!(size(slope - motion.velocity.linear) < 1e-5 * scale);
        let change = (after.velocity - before.velocity) * (0.5 / h);
        prop_assert!(apart(change, motion.acceleration) < 1e-5 * scale * scale);
    }

    #[test]
    fn a_screw_is_the_derivative_of_its_displacement(seed: u64) {
        let random = &mut Random::new(seed);
        let (direction, point, q) = (random.direction(), random.vector(1.0), random.symmetric() * 3.0);
        let screws = [
            Screw::revolute(direction, point), Screw::prismatic(direction),
            Screw::helical(direction, point, random.symmetric()),
        ];
        for screw in screws {
            let screw = screw.unwrap();
            let moved = screw.displacement(Dual::<f64, 1>::variable(q, 0));
            let body = Vector3::<f64>::from(random.vector(1.0));
            let tip = moved.point(Vector3::from_f64(body.to_array()));
            let place = Vector3::new(tip.x.value, tip.y.value, tip.z.value);
            let speed = Vector3::new(tip.x.gradient[0], tip.y.gradient[0], tip.z.gradient[0]);
            prop_assert!(size(at_point(screw.twist(), place).linear - speed) < TOLERANCE);
        }
    }

    #[test]
    fn pairs_allow_what_the_table_of_lower_pairs_allows(seed: u64) {
        let random = &mut Random::new(seed);
        for pair in PAIRS {
            let chain = SerialChain::new(&[(Pose::identity(), pair)], Pose::identity());
            let q = random.numbers(chain.n_coordinates(), 1.5);
            let end = chain.pose(&q);
            let d = end.translation;
            let tilt = size(end.rotation.columns[2] - Vector3::from_f64([0.0, 0.0, 1.0]));
            let turn = size(end.rotation.columns[0] - Vector3::from_f64([1.0, 0.0, 0.0]));
            let (flat, upright) = (d.x.hypot(d.y), tilt < TOLERANCE);
            let as_listed = match pair {
                LowerPair::Fixed => size(d) + tilt + turn == 0.0,
                LowerPair::Revolute => size(d) == 0.0 && upright && turn > 0.0,
                LowerPair::Prismatic => flat + tilt + turn == 0.0 && d.z == q[0],
                LowerPair::Helical { pitch } => flat == 0.0 && upright && (d.z - pitch * q[0]).abs() < TOLERANCE,
                LowerPair::Cylindrical => flat == 0.0 && upright && d.z == q[0] && turn > 0.0,
                LowerPair::Spherical => size(d) == 0.0 && tilt > 0.0 && turn > 0.0,
                LowerPair::Planar => d.x == q[0] && d.y == q[1] && d.z == 0.0 && upright,
            };
            prop_assert!(as_listed);
            prop_assert_eq!(pair.freedoms(), q.len());
            let mut columns = vec![Twist::zero(); q.len()];
            chain.screw_jacobian(&q, &mut columns);
            let wide: Vec<Vec<f64>> = columns.iter().map(|t| [t.angular.to_array(), t.linear.to_array()].concat()).collect();
            prop_assert!(SingularValues::new(&wide).values.iter().all(|&value| value > 1e-3), "independent freedoms");
        }
    }
}

fn link(a: f64, alpha: f64) -> DenavitHartenberg {
    DenavitHartenberg { theta: 0.0, d: 0.0, alpha, a, pair: LowerPair::Revolute }
}

fn in_plane() -> Task {
    Task { components: vec![Component::Translation(0), Component::Translation(1)], length: 1.0, tolerance: 1e-9 }
}

fn kind(chain: &SerialChain, q: &[f64], task: &Task) -> Result<Singularity> {
    Ok(chain.analyse(q, task)?.kind)
}

#[test]
fn denavit_hartenberg_gives_the_textbook_poses_of_a_planar_arm() {
    let chain = SerialChain::from_denavit_hartenberg(&[link(0.4, 0.0), link(0.3, 0.0)]);
    let (q1, q2) = (0.7_f64, -1.2_f64);
    let end = chain.pose(&[q1, q2]).translation;
    assert!((end.x - 0.4 * q1.cos() - 0.3 * (q1 + q2).cos()).abs() < 1e-15);
    assert!((end.y - 0.4 * q1.sin() - 0.3 * (q1 + q2).sin()).abs() < 1e-15);
    let mut frames = [Pose::identity(); 2];
    assert!(pose_apart(chain.frames(&[q1, q2], &mut frames), chain.pose(&[q1, q2])) == 0.0);
    let elbow = Vector3::from_f64([0.4 * q1.cos(), 0.4 * q1.sin(), 0.0]);
    assert!(pose_apart(frames[0], Pose::identity()) == 0.0 && size(frames[1].translation - elbow) < 1e-15);
    // A sliding joint adds to d; alpha turns the next axis.
    let slide = DenavitHartenberg { theta: 0.3, d: 0.2, alpha: FRAC_PI_2, a: 0.1, pair: LowerPair::Prismatic };
    let end = SerialChain::from_denavit_hartenberg(&[slide]).pose(&[0.5]);
    assert!(size(end.translation - Vector3::from_f64([0.1 * 0.3_f64.cos(), 0.1 * 0.3_f64.sin(), 0.7])) < 1e-15);
    assert!(size(end.rotation.columns[2] - Vector3::from_f64([0.3_f64.sin(), -0.3_f64.cos(), 0.0])) < 1e-15);
}

#[test]
fn a_planar_arm_is_singular_at_its_two_boundaries() {
    let chain = SerialChain::from_denavit_hartenberg(&[link(0.4, 0.0), link(0.3, 0.0)]);
    let regular = chain.analyse(&[0.3, 1.1], &in_plane()).unwrap();
    assert_eq!(regular.kind, Singularity::Regular);
    // det J = l1 l2 sin q2.
    assert!((regular.determinant.unwrap() - 0.12 * 1.1_f64.sin()).abs() < 1e-15);
    assert_eq!(kind(&chain, &[0.3, 0.0], &in_plane()), Ok(Singularity::Boundary));
    assert_eq!(kind(&chain, &[0.3, PI], &in_plane()), Ok(Singularity::Boundary));
}

#[test]
fn a_redundant_arm_is_at_its_boundary_only_when_it_cannot_pass() {
    let chain = SerialChain::from_denavit_hartenberg(&[link(0.4, 0.0), link(0.3, 0.0), link(0.2, 0.0)]);
    assert_eq!(kind(&chain, &[0.5, 0.0, 0.0], &in_plane()), Ok(Singularity::Boundary));
    assert_eq!(kind(&chain, &[0.5, 0.0, PI], &in_plane()), Ok(Singularity::Interior));
    assert_eq!(kind(&chain, &[0.5, PI, 0.0], &in_plane()), Ok(Singularity::Interior));
    let regular = chain.analyse(&[0.5, 0.4, 0.0], &in_plane()).unwrap();
    assert_eq!((regular.kind, regular.determinant), (Singularity::Regular, None));
}

#[test]
fn a_wrist_is_singular_inside_and_a_stretched_elbow_at_the_boundary() {
    let wrist = [link(0.0, -FRAC_PI_2), link(0.0, FRAC_PI_2), link(0.0, 0.0)];
    let mut links = vec![link(0.0, FRAC_PI_2), link(0.4, 0.0), link(0.0, FRAC_PI_2)];
    links.push(DenavitHartenberg { d: 0.35, ..wrist[0] });
    links.extend([wrist[1], wrist[2]]);
    let chain = SerialChain::from_denavit_hartenberg(&links);
    let components = (0..3).map(Component::Rotation).chain((0..3).map(Component::Translation)).collect();
    let task = Task { components, length: 0.5, tolerance: 1e-9 };
    assert_eq!(kind(&chain, &[0.2, 0.3, 0.8, 0.4, 0.9, 0.1], &task), Ok(Singularity::Regular));
    assert_eq!(kind(&chain, &[0.2, 0.3, 0.8, 0.4, 0.0, 0.1], &task), Ok(Singularity::Interior));
    // The upper arm along x2, the forearm along z3, which is turned by 90 deg: stretched at q3 = 90 deg.
    assert_eq!(kind(&chain, &[0.2, 0.3, FRAC_PI_2, 0.4, 0.9, 0.1], &task), Ok(Singularity::Boundary));
}

#[test]
fn a_mistake_is_one_sentence_with_its_numbers() {
    let text = Screw::revolute([0.0, 0.0, 2.0], [0.0; 3]).unwrap_err().to_string();
    assert_eq!(
        text,
        "the length of a screw's direction must be 1 within 1e-9, got 2; divide the direction by its length"
    );
    let chain = SerialChain::from_denavit_hartenberg(&[link(0.4, 0.0), link(0.3, 0.0)]);
    assert!(matches!(chain.analyse(&[0.0], &in_plane()), Err(Error::Dimension { expected: 2, found: 1, .. })));
    let spatial = Task { components: (0..3).map(Component::Translation).collect(), ..in_plane() };
    let text = chain.analyse(&[0.0, 1.0], &spatial).unwrap_err().to_string();
    assert!(text.contains("between 1 and the chain's 2 coordinates, got 3"), "{text}");
    let wrong = Task { components: vec![Component::Translation(3)], ..in_plane() };
    assert!(matches!(chain.analyse(&[0.0, 1.0], &wrong), Err(Error::Reference { index: 3, count: 3, .. })));
}
