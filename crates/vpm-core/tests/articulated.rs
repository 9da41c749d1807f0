//! Forward dynamics of flexible trees with a cost linear in their parts, against mass matrices by composite bodies.

use proptest::prelude::*;
use vpm_core::algebra::Cholesky;
use vpm_core::beam::{Component, DampingEntry, Level};
use vpm_core::body::{PointMass, Site, Weld};
use vpm_core::data::Data;
use vpm_core::dynamics::articulated::{Shift, articulated, shifted};
use vpm_core::dynamics::{aba, flexible};
use vpm_core::joint::JointKind;
use vpm_core::model::{Model, Parts};
use vpm_core::mount::Mount;
use vpm_core::samples::{Random, random_tree};
use vpm_core::{Dual, Result, Scalar};

#[path = "common/flexible.rs"]
mod trees;
use trees::{beam, body, inertia, model, section, turn};

/// One of so many, evenly.
fn pick(random: &mut Random, count: usize) -> usize {
    ((random.unit() * count as f64) as usize).min(count - 1)
}

fn level(random: &mut Random) -> Level {
    let size = 1 + pick(random, 4);
    match pick(random, 10) {
        0 => Level::Rigid,
        1..3 => Level::Lumped(size),
        3 => Level::Strain(size),
        4 => Level::Bezier(size + 1),
        5 => Level::Hermite(size),
        6 => Level::Modal(1 + size / 3),
        _ => Level::Elements(size),
    }
}

fn deforms(random: &mut Random) -> Vec<Component> {
    if random.unit() < 0.3 {
        return vec![[Component::BendingX, Component::BendingY][pick(random, 2)]];
    }
    let some: Vec<_> = Component::ALL.into_iter().filter(|_| random.unit() < 0.5).collect();
    if some.is_empty() { vec![Component::Torsion] } else { some }
}

fn damping(random: &mut Random) -> DampingEntry<f64> {
    let mass = (random.unit() < 0.2).then_some(0.3);
    DampingEntry { stiffness: (random.unit() < 0.8).then_some(1e-3), mass, ratios: Vec::new() }
}

/// Anything before, anywhere along it: at its root, at its tip, at a node of its elements, or elsewhere.
fn carrier(random: &mut Random, parts: &Parts<f64>) -> Mount {
    let (bodies, beams) = (parts.bodies.len(), parts.beams.len());
    let share = [0.0, 0.25, 0.5, 1.0, random.unit()][pick(random, 5)];
    match pick(random, bodies + 2 * beams + 1) {
        0 => Mount::World,
        k if k <= bodies => Mount::Body(k - 1),
        k => section(parts, (k - bodies - 1) / 2, share),
    }
}

/// Bodies and beams on each other, with what is welded to them.
fn machine(seed: u64) -> Parts<f64> {
    let random = &mut Random::new(seed);
    let mut parts = Parts { gravity: [0.4, -9.0, 2.0], ..Parts::default() };
    for number in 0..3 + pick(random, 5) {
        let on = carrier(random, &parts);
        if random.unit() < 0.5 {
            let kind = [JointKind::Revolute, JointKind::Prismatic, JointKind::Helical { pitch: 0.1 }][pick(random, 3)];
            parts.bodies.push(body(random, &format!("body {number}"), on, kind));
        } else {
            let (level, deforms) = (level(random), deforms(random));
            let mut entry = beam(random, &format!("beam {number}"), on, level, &deforms);
            entry.damping = damping(random);
            parts.beams.push(entry);
        }
    }
    for number in 0..pick(random, 3) {
        let (on, translation, rotation) = (carrier(random, &parts), random.vector(0.1), turn(random));
        if on != Mount::World {
            let name = format!("weld {number}");
            parts.welds.push(Weld { name, on, translation, rotation, inertia: inertia(random) });
        }
    }
    for beam in 0..parts.beams.len() {
        if random.unit() < 0.4 {
            let point = PointMass { on: Site::Tip(beam), mass: 0.2 + random.unit(), position: random.vector(0.1) };
            parts.point_masses.push(point);
        }
    }
    parts.drop_velocity_terms = random.unit() < 0.1;
    parts
}

/// Coordinates, rates and efforts.
fn state(tree: &Model<f64>, seed: u64) -> [Vec<f64>; 3] {
    let (n, random) = (tree.n_coordinates(), &mut Random::new(seed ^ 0xabc));
    let [mut q, v, tau] = [0.2, 1.0, 3.0].map(|size| random.numbers(n, size));
    q.iter_mut().take(tree.n_joints()).for_each(|angle| *angle *= 10.0);
    [q, v, tau]
}

/// The largest error of accelerations in the norm of the mass matrix, as a share of their size in it.
///
/// Numbers of very different size stand side by side, so that the natural measure is the kinetic energy of the error.
fn error(matrix: &[f64], found: &[f64], expected: &[f64]) -> f64 {
    let n = found.len();
    let square = |x: &[f64]| -> f64 {
        (0..n).map(|i| x[i] * (0..n).map(|j| matrix[i * n + j] * x[j]).sum::<f64>()).sum::<f64>().max(0.0)
    };
    let difference: Vec<f64> = found.iter().zip(expected).map(|(found, expected)| found - expected).collect();
    (square(&difference) / square(expected)).sqrt()
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn accelerations_are_those_of_the_mass_matrix(seed in any::<u64>()) {
        let tree = model::<f64>(&machine(seed)).unwrap();
        prop_assume!(tree.n_coordinates() > 0);
        let state = state(&tree, seed);
        let [q, v, tau] = &state;
        let (matrix, load) = dense(&tree, &state);
        let expected = solved(&matrix, &load);
        let mut data = Data::new(&tree);
        let found = articulated(&tree, &mut data, q, v, tau);
        let error = error(&matrix, found, &expected);
        prop_assert!(error < 1e-10, "error {error} of {} coordinates", tree.n_coordinates());
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
        let expected = solved(&matrix, &load);
        let mut data = Data::new(&tree);
        let found = shifted(&tree, &mut data, (q, v), tau, Shift { reach, resistances: &resistances });
        let error = error(&matrix, found, &expected);
        prop_assert!(error < 1e-10, "error {error} of {} coordinates", tree.n_coordinates());
    }
}
