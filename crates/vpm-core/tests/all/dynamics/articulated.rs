//! Forward dynamics of flexible trees with a cost linear in their parts, against mass matrices by composite bodies.

use nalgebra::DMatrix;
use proptest::prelude::*;
use vpm_core::algebra::Cholesky;
use vpm_core::beam::{Component, DampingEntry, Level};
use vpm_core::body::{PointMass, Site};
use vpm_core::data::Data;
use vpm_core::dynamics::articulated::{Shift, articulated, response, shifted};
use vpm_core::dynamics::{aba, flexible};
use vpm_core::joint::JointKind;
use vpm_core::model::{Model, Parts};
use vpm_core::mount::Mount;
use vpm_core::samples::{Random, random_tree};
use vpm_core::{Dual, Result};

use crate::common::random_machine;
use crate::common::trees;
use random_machine::machine;
use trees::{beam, body, model};

/// Coordinates, rates and efforts.
fn state(tree: &Model<f64>, seed: u64) -> [Vec<f64>; 3] {
    let (n, random) = (tree.n_coordinates(), &mut Random::new(seed ^ 0xabc));
    let [mut q, v, tau] = [0.2, 1.0, 3.0].map(|size| random.numbers(n, size));
    q.iter_mut().take(tree.n_joints()).for_each(|angle| *angle *= 10.0);
    [q, v, tau]
}

/// The error of accelerations in the norm of the mass matrix, as a share of their size in it.
///
/// Numbers of very different size stand side by side, so that the natural measure is the kinetic energy of the error.
fn error(matrix: &[f64], found: &[f64], expected: &[f64]) -> f64 {
    // Both vanish where nothing pushes at anything.
    distance(matrix, found, expected) / size(matrix, expected).max(f64::MIN_POSITIVE.sqrt())
}

/// The norm of the difference of two vectors by which kinetic energy is reckoned.
fn distance(matrix: &[f64], found: &[f64], expected: &[f64]) -> f64 {
    let difference: Vec<f64> = found.iter().zip(expected).map(|(found, expected)| found - expected).collect();
    size(matrix, &difference)
}

/// The norm by which kinetic energy is reckoned.
fn size(matrix: &[f64], x: &[f64]) -> f64 {
    let n = x.len();
    let row = |i: usize| x[i] * (0..n).map(|j| matrix[i * n + j] * x[j]).sum::<f64>();
    (0..n).map(row).sum::<f64>().max(0.0).sqrt()
}

/// `g D + g^2 K` of the beams and `g R` of the joints, added to a matrix.
fn stiffen(tree: &Model<f64>, matrix: &mut [f64], reach: f64, resistances: &[f64]) {
    let n = tree.n_coordinates();
    for (beam, first) in (0..tree.n_beams()).filter_map(|number| tree.beam(number)) {
        for (i, j) in (0..beam.len()).flat_map(|i| (0..beam.len()).map(move |j| (i, j))) {
            let at = i * beam.len() + j;
            matrix[(first + i) * n + first + j] += reach * beam.damping()[at] + reach * reach * beam.stiffness()[at];
        }
    }
    for (joint, resistance) in resistances.iter().enumerate() {
        matrix[joint * n + joint] += reach * resistance;
    }
}

/// What `M a = tau - bias` and the same with an implicit step need: mass matrix and `tau - bias`.
fn dense(tree: &Model<f64>, [q, v, tau]: &[Vec<f64>; 3]) -> (Vec<f64>, Vec<f64>) {
    let n = tree.n_coordinates();
    let (mut data, zero, mut bias) = (Data::new(tree), vec![0.0; n], vec![0.0; n]);
    flexible::terms(tree, &mut data, q, v);
    flexible::required(tree, &data, (&zero, &zero), &zero, &mut bias);
    (data.mass_matrix().to_vec(), tau.iter().zip(&bias).map(|(tau, bias)| tau - bias).collect())
}

fn solved(matrix: &[f64], load: &[f64]) -> Vec<f64> {
    let (mut factors, mut x) = (Cholesky::new(load.len()), load.to_vec());
    factors.factorise(matrix);
    factors.solve(&mut x);
    x
}

/// Condition of a matrix (n, n) with rows and columns scaled.
fn condition(matrix: &[f64], n: usize) -> f64 {
    let scaled = |i: usize, j: usize| matrix[i * n + j] / (matrix[i * n + i] * matrix[j * n + j]).sqrt();
    let values = DMatrix::from_fn(n, n, scaled).symmetric_eigenvalues();
    values.max() / values.min()
}

/// Asserts that accelerations solve `matrix a = load`: row by row up to rounding, and as well as the matrix decides them.
///
/// A row may miss by 1e-12 of the numbers in it; the accelerations by 1e-10, or by what a relative error of 1e-14 in the entries of a matrix
/// of that condition does to them, rows and columns scaled.
fn check(matrix: &[f64], found: &[f64], load: &[f64]) -> std::result::Result<(), TestCaseError> {
    let n = load.len();
    for (i, &load) in load.iter().enumerate() {
        let terms: Vec<f64> = (0..n).map(|j| matrix[i * n + j] * found[j]).collect();
        let size = terms.iter().map(|term| term.abs()).sum::<f64>() + load.abs();
        let residual = (terms.iter().sum::<f64>() - load).abs();
        prop_assert!(residual <= 1e-12 * size, "row {i} of {n} misses by {residual} of {size}");
    }
    let (error, condition) = (error(matrix, found, &solved(matrix, load)), condition(matrix, n));
    prop_assert!(error < f64::max(1e-10, 1e-14 * condition), "error {error} of {n} coordinates, condition {condition}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn accelerations_are_those_of_the_mass_matrix(seed in any::<u64>()) {
        let tree = model::<f64>(&machine(seed)).unwrap();
        prop_assume!(tree.n_coordinates() > 0);
        let state = state(&tree, seed);
        let [q, v, tau] = &state;
        let (matrix, load) = dense(&tree, &state);
        let mut data = Data::new(&tree);
        check(&matrix, articulated(&tree, &mut data, q, v, tau), &load)?;
    }

    #[test]
    fn implicit_steps_are_those_of_the_shifted_matrix(seed in any::<u64>(), exponent in -5.0..-1.0_f64) {
        let tree = model::<f64>(&machine(seed)).unwrap();
        prop_assume!(tree.n_coordinates() > 0);
        let (state, reach) = (state(&tree, seed), 10.0_f64.powf(exponent));
        let [q, v, tau] = &state;
        let resistances: Vec<f64> = Random::new(seed).numbers(tree.n_joints(), 2.0).into_iter().map(f64::abs).collect();
        let (mut matrix, load) = dense(&tree, &state);
        stiffen(&tree, &mut matrix, reach, &resistances);
        let mut data = Data::new(&tree);
        check(&matrix, shifted(&tree, &mut data, (q, v), tau, Shift { reach, resistances: &resistances }), &load)?;
    }

    #[test]
    fn responses_are_those_of_the_shifted_matrix_alone(seed in any::<u64>(), exponent in -5.0..-1.0_f64) {
        let tree = model::<f64>(&machine(seed)).unwrap();
        prop_assume!(tree.n_coordinates() > 0);
        let (state, reach) = (state(&tree, seed), 10.0_f64.powf(exponent));
        let [q, v, tau] = &state;
        let mut random = Random::new(seed);
        let resistances: Vec<f64> = random.numbers(tree.n_joints(), 2.0).into_iter().map(f64::abs).collect();
        let (mut matrix, _) = dense(&tree, &state);
        stiffen(&tree, &mut matrix, reach, &resistances);
        let mut data = Data::new(&tree);
        shifted(&tree, &mut data, (q, v), tau, Shift { reach, resistances: &resistances });
        for _ in 0..2 {
            let push = random.numbers(tree.n_coordinates(), 1.0);
            check(&matrix, response(&tree, &mut data, &push), &push)?;
        }
    }

    #[test]
    fn slopes_are_differences(seed in any::<u64>()) {
        let parts = machine(seed);
        let tree = model::<Dual<f64, 1>>(&parts).unwrap();
        let n = tree.n_coordinates();
        prop_assume!(n > 0);
        let plain = model::<f64>(&parts).unwrap();
        let [q, v, tau] = state(&plain, seed);
        let way = Random::new(seed ^ 7).numbers(n, 1.0);
        let moving = |x: &[f64]| x.iter().zip(&way).map(|(&value, &slope)| Dual { value, gradient: [slope] }).collect::<Vec<_>>();
        let held: Vec<_> = tau.iter().map(|&value| Dual::constant(value)).collect();
        let mut data = Data::new(&tree);
        let found: Vec<f64> =
            articulated(&tree, &mut data, &moving(&q), &moving(&v), &held).iter().map(|number| number.gradient[0]).collect();
        let mut data = Data::new(&plain);
        let mut at = |step: f64| {
            let go = |x: &[f64]| x.iter().zip(&way).map(|(x, slope)| x + step * slope).collect::<Vec<_>>();
            articulated(&plain, &mut data, &go(&q), &go(&v), &tau).to_vec()
        };
        // Four points: the error goes with the fourth power of the step.
        let h = 2e-4;
        let [a, b, c, d] = [-2.0 * h, -h, h, 2.0 * h].map(&mut at);
        let expected: Vec<f64> = (0..n).map(|k| (a[k] - d[k] + 8.0 * (c[k] - b[k])) / (12.0 * h)).collect();
        let (matrix, _) = dense(&plain, &[q, v, tau]);
        let (error, apart) = (error(&matrix, &found, &expected), distance(&matrix, &found, &expected) / size(&matrix, &b));
        // Differences have the rounding of the accelerations, over the step: all of it where nothing depends on the state.
        let rounding = f64::max(1e-10, f64::EPSILON * condition(&matrix, n) / h);
        prop_assert!(error < 1e-4 || apart < rounding, "error {error}, {apart} of the accelerations beside {rounding}");
    }
}

#[test]
fn rigid_trees_are_those_of_the_recursion_for_joints() -> Result<()> {
    for seed in 0..20 {
        let (tree, mut random) = (random_tree(seed, 7).model::<f64>()?, Random::new(seed));
        let [q, v, tau] = [2.0, 3.0, 4.0].map(|size| random.numbers(7, size));
        let (mut data, mut other) = (Data::new(&tree), Data::new(&tree));
        assert_eq!(articulated(&tree, &mut data, &q, &v, &tau), aba(&tree, &mut other, &q, &v, &tau));
    }
    Ok(())
}

#[test]
fn lines_with_mass_and_parts_left_out_need_a_mass_matrix() -> Result<()> {
    let mut parts = trees::everything(1);
    assert!(!model::<f64>(&parts)?.is_segmented());
    parts.lines.clear();
    assert!(model::<f64>(&parts)?.is_segmented());
    parts.omissions.velocity_of_bodies.push(0);
    assert!(!model::<f64>(&parts)?.is_segmented());
    parts.omissions.velocity_of_bodies.clear();
    parts.omissions.coupling.push(0);
    assert!(!model::<f64>(&parts)?.is_segmented());
    Ok(())
}

/// A beam of forty elements on a joint, bent, in a swing under gravity with a payload, and the joint's axis askew.
#[test]
fn the_energy_of_a_swing_is_conserved() -> Result<()> {
    let random = &mut Random::new(3);
    let mut entry = beam(random, "swing", Mount::Body(0), Level::Elements(40), &[Component::BendingX]);
    entry.damping = DampingEntry::default();
    let mut parts = Parts { gravity: [0.4, -9.0, 2.0], beams: vec![entry], ..Parts::default() };
    parts.bodies.push(body(random, "hub", Mount::World, JointKind::Revolute));
    parts.point_masses.push(PointMass { on: Site::Tip(0), mass: 0.1, position: [0.0; 3] });
    let tree = model::<f64>(&parts)?;
    assert!(tree.is_articulated());
    let (n, mut data) = (tree.n_coordinates(), Data::new(&tree));
    // A curvature that vanishes at the free tip, as that of slow modes.
    let shape = |k: usize| if k == 0 { 1.0 } else { (1.0 - (k - 1) as f64 / 40.0).powi(2) };
    let mut drift = |step: f64| {
        let mut x: Vec<f64> = (0..2 * n).map(|k| shape(k % n) * if k < n { 0.5 } else { 4.0 }).collect();
        let begin = flexible::energy(&tree, &mut data, &x[..n], &x[n..]);
        let (mut kinetic, mut worst) = (begin.kinetic, 0.0_f64);
        for count in 1..=(16e-3 / step).round() as usize {
            runge_kutta(&tree, &mut data, &mut x, step);
            if count % 20 == 0 {
                let now = flexible::energy(&tree, &mut data, &x[..n], &x[n..]);
                kinetic = kinetic.max(now.kinetic);
                // Not by `max`, which would lose what is not a number.
                let change = (now.kinetic + now.potential - begin.kinetic - begin.potential).abs();
                worst = if change <= worst { worst } else { change };
            }
        }
        worst / kinetic
    };
    let [coarse, fine] = [1e-5, 5e-6].map(&mut drift);
    assert!(coarse < 1e-9, "the energy changes by {coarse} of the largest kinetic energy");
    assert!(fine < 0.5 * coarse, "from {coarse} to {fine} at half the step: not an error of the steps");
    Ok(())
}

/// The classical step of fourth order (Hairer, Norsett & Wanner 1993, section II.1) under the elastic efforts alone.
fn runge_kutta(tree: &Model<f64>, data: &mut Data<f64>, x: &mut [f64], step: f64) {
    let n = tree.n_coordinates();
    let (start, mut sum, mut slope) = (x.to_vec(), vec![0.0; 2 * n], vec![0.0; 2 * n]);
    for (reach, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
        let at: Vec<f64> = start.iter().zip(&slope).map(|(x, slope)| x + reach * step * slope).collect();
        let (q, v) = at.split_at(n);
        let mut efforts = vec![0.0; n];
        let Some((beam, first)) = tree.beam(0) else { return };
        for (row, effort) in efforts[first..].iter_mut().enumerate() {
            *effort = -(0..beam.len()).map(|k| beam.stiffness()[row * beam.len() + k] * q[first + k]).sum::<f64>();
        }
        slope[..n].copy_from_slice(v);
        slope[n..].copy_from_slice(articulated(tree, data, q, v, &efforts));
        sum.iter_mut().zip(&slope).for_each(|(sum, slope)| *sum += weight / 6.0 * slope);
    }
    x.iter_mut().zip(&sum).for_each(|(x, sum)| *x += step * sum);
}
