//! Trees of rigid bodies and beams of every kind against derivations that share nothing with them but the maps of poses.

use vpm_core::data::Data;
use vpm_core::dynamics::{crba, flexible, rnea};
use vpm_core::samples::{Random, random_tree};
use vpm_core::spatial::{SpatialInertia, Twist, Vector3};
use vpm_core::{Dual, Result, Scalar};

use crate::common::places::{Heavy, Places};
use crate::common::trees::{everything, model};

/// Coordinates of the tree of everything: five joints, three and five elastic ones.
const N: usize = 13;
type First = Dual<f64, N>;
type Second = Dual<First, N>;

fn value(v: Vector3<Second>) -> Vector3<First> {
    Vector3::from(v.to_array().map(|number| number.value))
}

fn slope(v: Vector3<Second>, k: usize) -> Vector3<First> {
    Vector3::from(v.to_array().map(|number| number.gradient[k]))
}

fn lifted(inertia: SpatialInertia<f64>) -> SpatialInertia<First> {
    SpatialInertia {
        mass: inertia.mass.into(),
        first_moment: Vector3::from(inertia.first_moment.to_array().map(First::from)),
        rotational: vpm_core::spatial::Symmetric3::from_array(inertia.rotational.to_array().map(First::from)),
    }
}

/// The mass matrix with its derivatives by the coordinates, from the first and second derivatives of poses in the world.
fn witness_mass(heavy: &[Heavy<Second>]) -> Vec<First> {
    let mut mass = vec![First::zero(); N * N];
    for part in heavy {
        match part {
            Heavy::Body(pose, inertia) => {
                let [x, y, z] = pose.rotation.columns;
                let columns: [Twist<First>; N] = std::array::from_fn(|k| {
                    let turning =
                        Vector3::new(value(z).dot(slope(y, k)), value(x).dot(slope(z, k)), value(y).dot(slope(x, k)));
                    let moving = [x, y, z].map(|axis| value(axis).dot(slope(pose.translation, k)));
                    Twist::new(turning, Vector3::from(moving))
                });
                for (i, column) in columns.iter().enumerate() {
                    let momentum = lifted(*inertia).apply(*column);
                    for (j, other) in columns.iter().enumerate() {
                        mass[i * N + j] += other.power(momentum);
                    }
                }
            }
            Heavy::Needle { center, direction, mass: weight, inertia } => {
                for i in 0..N {
                    for j in 0..N {
                        mass[i * N + j] += slope(*center, i).dot(slope(*center, j)) * *weight
                            + slope(*direction, i).dot(slope(*direction, j)) * *inertia;
                    }
                }
            }
        }
    }
    mass
}

fn witness_potential(heavy: &[Heavy<First>], gravity: [f64; 3]) -> First {
    let gravity = Vector3::from_f64(gravity);
    let weight = |part: &Heavy<First>| match part {
        Heavy::Body(pose, inertia) => {
            let inertia = lifted(*inertia);
            gravity.dot(pose.rotation * inertia.first_moment + pose.translation * inertia.mass)
        }
        Heavy::Needle { center, mass, .. } => gravity.dot(*center) * *mass,
    };
    -heavy.iter().map(weight).sum::<First>()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    let size = expected.iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < tolerance * size, "{what} {k}: {found} is not {expected}");
    }
}

#[test]
fn mass_matrix_and_bias_are_those_of_lagranges_equations() -> Result<()> {
    for seed in 0..6 {
        let (parts, random) = (everything(seed), &mut Random::new(seed + 100));
        let tree = model::<f64>(&parts)?;
        assert_eq!((tree.n_coordinates(), tree.n_joints(), tree.is_recursive()), (N, 5, false));
        let [mut q, v] = [0.5, 1.0].map(|size| random.numbers(N, size));
        q.iter_mut().take(5).for_each(|angle| *angle *= 4.0);
        let second: Vec<Second> = (0..N).map(|k| Dual::variable(Dual::variable(q[k], k), k)).collect();
        let mass = witness_mass(&Places::new(&parts)?.heavy(&second));
        let first: Vec<First> = (0..N).map(|k| Dual::variable(q[k], k)).collect();
        let potential = witness_potential(&Places::new(&parts)?.heavy(&first), parts.gravity);
        let bias: Vec<f64> = (0..N)
            .map(|i| {
                let mut sum = potential.gradient[i];
                for j in 0..N {
                    for k in 0..N {
                        let slopes = mass[i * N + j].gradient[k] - 0.5 * mass[j * N + k].gradient[i];
                        sum += slopes * v[j] * v[k];
                    }
                }
                sum
            })
            .collect();
        let mut data = Data::new(&tree);
        flexible::terms(&tree, &mut data, &q, &v);
        let expected: Vec<f64> = mass.iter().map(|entry| entry.value).collect();
        close(data.mass_matrix(), &expected, 1e-10, "mass matrix");
        let mut found = vec![0.0; N];
        flexible::required(&tree, &data, (&[0.0; N], &[0.0; N]), &[0.0; N], &mut found);
        close(&found, &bias, 1e-10, "bias");
    }
    Ok(())
}

#[test]
fn on_rigid_trees_it_is_the_recursive_algorithms() -> Result<()> {
    for seed in 0..20 {
        let (sample, mut random) = (random_tree(seed, 7), Random::new(seed));
        let (tree, [q, v, a]) = (sample.model::<f64>()?, [2.0, 3.0, 4.0].map(|size| random.numbers(7, size)));
        let (mut data, mut other, mut efforts) = (Data::new(&tree), Data::new(&tree), vec![0.0; 7]);
        assert!(tree.is_recursive());
        flexible::terms(&tree, &mut data, &q, &v);
        close(data.mass_matrix(), crba(&tree, &mut other, &q), 1e-12, "mass matrix");
        flexible::required(&tree, &data, (&q, &v), &a, &mut efforts);
        close(&efforts, rnea(&tree, &mut other, &q, &v, &a), 1e-12, "efforts");
        let found = flexible::solve(&tree, &mut data, &q, &v, &efforts).to_vec();
        close(&found, &a, 1e-10, "accelerations");
    }
    Ok(())
}
