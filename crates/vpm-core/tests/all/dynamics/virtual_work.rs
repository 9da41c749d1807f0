//! Virtual work over single bodies says of random trees in space what the recursive algorithms say, also when a few
//! coordinates drive all the others.

use proptest::prelude::*;
use vpm_core::data::Data;
use vpm_core::dynamics::{Carried, Rate, Terms, crba, effort_of_wrench, kinematics, rnea, virtual_work};
use vpm_core::samples::{Random, Sample, random_tree};
use vpm_core::spatial::{Matrix3, Pose, Symmetric3, Twist, Vector3, Wrench};
use vpm_core::{Error, Result, Scalar};

const TOLERANCE: f64 = 1e-11;
/// Joints of the trees.
const B: usize = 5;

fn moving(q: &[f64], v: &[f64]) -> Vec<Rate<f64>> {
    q.iter().zip(v).map(|(&value, &rate)| Rate { value, gradient: [rate] }).collect()
}

fn value(v: Vector3<Rate<f64>>) -> Vector3<f64> {
    Vector3::from(v.to_array().map(|entry| entry.re()))
}

/// The bodies of a tree, with their Jacobians about their centres of mass and those Jacobians' rates.
fn carried(tree: &Sample, q: &[f64], v: &[f64]) -> Result<Vec<Carried<f64, B>>> {
    let model = tree.model::<Rate<f64>>()?;
    let (mut data, angles) = (Data::new(&model), moving(q, v));
    let mut bodies = Vec::new();
    for (k, body) in tree.bodies.iter().enumerate() {
        let mut jacobian = [Twist::zero(); B];
        let inertia = body.inertia.unwrap_or_default();
        let (center, mut pose) = (Vector3::from_f64(inertia.center_of_mass), Pose::identity());
        for (b, column) in jacobian.iter_mut().enumerate() {
            let unit: Vec<_> = (0..B).map(|joint| Rate::constant(if joint == b { 1.0 } else { 0.0 })).collect();
            kinematics(&model, &mut data, &angles, &unit);
            let missing = Error::PayloadBody { payload: 0, body: k, bodies: B };
            let (at, twist) = data.pose(k).zip(data.twist(k)).ok_or(missing)?;
            pose = at;
            let velocity = twist.linear + twist.angular.cross(center);
            *column = Twist::new(pose.rotation * twist.angular, pose.rotation * velocity);
        }
        let [x, y, z] = pose.rotation.columns.map(value);
        let turned = Matrix3::from_columns(x, y, z);
        bodies.push(Carried {
            mass: inertia.mass,
            inertia: Symmetric3::from_array(inertia.moments).rotated(turned),
            jacobian,
        });
    }
    Ok(bodies)
}

fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().map(f64::abs).fold(1.0, f64::max)
}

/// Dependent coordinates as functions of two independent ones: `amplitude sin(q . wave)`, with gradients and their
/// rates.
struct Coupling {
    amplitudes: [f64; B],
    waves: [[f64; 2]; B],
}

impl Coupling {
    fn of(random: &mut Random) -> Self {
        let amplitudes = std::array::from_fn(|_| 0.5 + random.unit());
        Self { amplitudes, waves: std::array::from_fn(|_| [random.symmetric(), random.symmetric()]) }
    }

    fn coordinates<S: Scalar>(&self, q: [S; 2]) -> [S; B] {
        std::array::from_fn(|b| (q[0] * self.waves[b][0] + q[1] * self.waves[b][1]).sin() * self.amplitudes[b])
    }

    fn gradients<S: Scalar>(&self, q: [S; 2]) -> [[S; 2]; B] {
        std::array::from_fn(|b| {
            let slope = (q[0] * self.waves[b][0] + q[1] * self.waves[b][1]).cos() * self.amplitudes[b];
            self.waves[b].map(|wave| slope * wave)
        })
    }
}

proptest! {
    #[test]
    fn trees_in_space_have_the_same_terms(seed: u64) {
        let random = &mut Random::new(!seed);
        let tree = random_tree(seed, B);
        let (q, v) = (random.numbers(B, 3.0), random.numbers(B, 2.0));
        let identity = std::array::from_fn(|b| std::array::from_fn(|n| Rate::constant(if n == b { 1.0 } else { 0.0 })));
        let rates: [f64; B] = std::array::from_fn(|k| v[k]);
        let terms = virtual_work(&carried(&tree, &q, &v)?, &identity, &rates, tree.gravity);
        let model = tree.model::<f64>()?;
        let mut data = Data::new(&model);
        let rest = [0.0; B];
        let bias = rnea(&model, &mut data, &q, &v, &rest).to_vec();
        let weight = rnea(&model, &mut data, &q, &rest, &rest).to_vec();
        let matrix = crba(&model, &mut data, &q);
        for (found, expected) in terms.mass_matrix.as_flattened().iter().zip(matrix) {
            prop_assert!((found - expected).abs() < TOLERANCE * largest(matrix.iter().copied()));
        }
        let scale = largest(bias.iter().chain(&weight).copied());
        for k in 0..B {
            prop_assert!((terms.velocity[k] + terms.gravity[k] - bias[k]).abs() < TOLERANCE * scale);
            prop_assert!((terms.gravity[k] - weight[k]).abs() < TOLERANCE * scale);
        }
    }

    #[test]
    fn coupled_joints_have_the_projected_equation_of_motion(seed: u64) {
        let random = &mut Random::new(!seed);
        let (tree, coupling) = (random_tree(seed, B), Coupling::of(random));
        let mut pair = |size: f64| [size * random.symmetric(), size * random.symmetric()];
        let (q, v, a) = (pair(2.0), pair(2.0), pair(5.0));
        let in_time: [Rate<f64>; 2] = std::array::from_fn(|k| Rate { value: q[k], gradient: [v[k]] });
        let (dependent, psi) = (coupling.coordinates(in_time), coupling.gradients(in_time));
        let (place, speed) = (dependent.map(|entry| entry.value), dependent.map(|entry| entry.gradient[0]));
        let terms: Terms<f64, 2> = virtual_work(&carried(&tree, &place, &speed)?, &psi, &v, tree.gravity);
        // Psi^T times the efforts of the tree for the accelerations Psi a + Psi_dot v.
        let whole = psi.map(|row| (0..2).map(|n| row[n].value * a[n] + row[n].gradient[0] * v[n]).sum::<f64>());
        let model = tree.model::<f64>()?;
        let mut data = Data::new(&model);
        let efforts = rnea(&model, &mut data, &place, &speed, &whole);
        let found = terms.effort(&a);
        for n in 0..2 {
            let expected: f64 = psi.iter().zip(efforts).map(|(row, effort)| row[n].value * effort).sum();
            prop_assert!((found[n] - expected).abs() < TOLERANCE * largest(efforts.iter().copied()));
        }
    }
}

#[test]
fn a_wrench_on_a_body_gives_the_efforts_of_its_power() {
    // One body on two coordinates, the second dependent on the first twice as fast.
    let fixed = |value: f64| Rate::<f64>::constant(value);
    let column = |spin: f64, x: f64| {
        let (zero, none) = (fixed(0.0), Vector3::<Rate<f64>>::zero());
        Twist::new(Vector3::new(zero, zero, fixed(spin)), Vector3 { x: fixed(x), ..none })
    };
    let wrench = Wrench::new(Vector3::from_f64([0.0, 0.0, 5.0]), Vector3::from_f64([7.0, 100.0, 0.0]));
    let efforts = effort_of_wrench(&[column(1.0, 0.3), column(0.0, 0.5)], &[[fixed(1.0)], [fixed(2.0)]], wrench);
    assert!((efforts[0] - (5.0 + 7.0 * (0.3 + 2.0 * 0.5))).abs() < 1e-14);
}
