//! Terms left out part by part: velocity terms of single bodies and beams, and entries of the mass matrix across joints.

use vpm_core::Result;
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, flexible, rnea};
use vpm_core::model::{Model, Omissions, Parts};
use vpm_core::samples::{Random, arm7};

use crate::common::trees::everything;

fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(1.0, |most: f64, value| most.max(value.abs()));
    for (place, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() <= tolerance * size, "{place}: {found} beside {expected}");
    }
}

fn less(left: &[f64], right: &[f64]) -> Vec<f64> {
    left.iter().zip(right).map(|(left, right)| left - right).collect()
}

/// The seven-joint arm.
fn arm() -> Parts<f64> {
    let sample = arm7();
    Parts { gravity: sample.gravity, bodies: sample.bodies, ..Parts::default() }
}

fn without(parts: &Parts<f64>, omissions: Omissions) -> Result<Model<f64>> {
    Model::assemble(Parts { omissions, ..parts.clone() })
}

fn still(bodies: &[usize]) -> Omissions {
    Omissions { velocity_of_bodies: bodies.to_vec(), ..Omissions::default() }
}

/// Velocity terms of body k of the arm alone, by Christoffel symbols of its own part of the mass matrix (Featherstone 2008, section 2.14).
fn lagrange(body: usize, q: &[f64], v: &[f64]) -> Result<Vec<f64>> {
    let (n, step, parts) = (q.len(), 1e-5, arm());
    let mut heavier = parts.clone();
    if let Some(inertia) = &mut heavier.bodies[body].inertia {
        inertia.mass *= 2.0;
        inertia.moments = inertia.moments.map(|moment| 2.0 * moment);
    }
    let (once, twice) = (Model::assemble(parts)?, Model::assemble(heavier)?);
    let own = |q: &[f64]| less(crba(&twice, &mut Data::new(&twice), q), crba(&once, &mut Data::new(&once), q));
    let slopes: Vec<Vec<f64>> = (0..n)
        .map(|k| {
            let [ahead, behind] = [step, -step].map(|shift| {
                let mut moved = q.to_vec();
                moved[k] += shift;
                own(&moved)
            });
            less(&ahead, &behind).iter().map(|change| change / (2.0 * step)).collect()
        })
        .collect();
    let pairs = || (0..n).flat_map(|j| (0..n).map(move |k| (j, k)));
    let term = |i: usize, (j, k): (usize, usize)| (slopes[k][i * n + j] - 0.5 * slopes[i][j * n + k]) * v[j] * v[k];
    Ok((0..n).map(|i| pairs().map(|pair| term(i, pair)).sum()).collect())
}

#[test]
fn what_is_missing_of_single_bodies_are_their_terms_by_lagrange() -> Result<()> {
    let (parts, mut random) = (arm(), Random::new(3));
    let full = Model::assemble(parts.clone())?;
    for dropped in [&[6][..], &[0], &[3], &[4, 5, 6], &[0, 1, 2], &[1, 2, 5], &[0, 2, 4, 6]] {
        let model = without(&parts, still(dropped))?;
        let [q, v, a] = [3.0, 2.0, 5.0].map(|size| random.numbers(7, size));
        let all = rnea(&full, &mut Data::new(&full), &q, &v, &a).to_vec();
        let mut data = Data::new(&model);
        let rest = rnea(&model, &mut data, &q, &v, &a).to_vec();
        let mut expected = vec![0.0; 7];
        for &body in dropped {
            expected.iter_mut().zip(lagrange(body, &q, &v)?).for_each(|(sum, own)| *sum += own);
        }
        // The first body turns about an axis that stands still: it has none.
        assert_eq!(dropped != [0], expected.iter().any(|effort| effort.abs() > 1e-2));
        near(&less(&all, &rest), &expected, 1e-7);
        // The other algorithms say the same.
        near(aba(&model, &mut data, &q, &v, &rest), &a, 1e-9);
        flexible::terms(&model, &mut data, &q, &v);
        near(flexible::solve(&model, &mut data, &q, &v, &rest), &a, 1e-9);
    }
    Ok(())
}

#[test]
fn all_bodies_together_are_the_whole_machine() -> Result<()> {
    let (parts, mut random) = (arm(), Random::new(5));
    let (model, whole) = (
        without(&parts, still(&[0, 1, 2, 3, 4, 5, 6]))?,
        Model::assemble(Parts { drop_velocity_terms: true, ..parts.clone() })?,
    );
    let [q, v, tau] = [3.0, 2.0, 20.0].map(|size| random.numbers(7, size));
    let expected = aba(&whole, &mut Data::new(&whole), &q, &v, &tau).to_vec();
    near(aba(&model, &mut Data::new(&model), &q, &v, &tau), &expected, 0.0);
    Ok(())
}

/// Efforts that accelerations need, and the mass matrix.
fn required(model: &Model<f64>, [q, v, a]: [&[f64]; 3]) -> (Vec<f64>, Vec<f64>) {
    let (mut data, mut efforts) = (Data::new(model), vec![0.0; q.len()]);
    flexible::terms(model, &mut data, q, v);
    flexible::required(model, &data, (q, v), a, &mut efforts);
    (efforts, data.mass_matrix().to_vec())
}

/// A state of the tree with everything: coordinates, rates, accelerations.
fn state(model: &Model<f64>, seed: u64) -> [Vec<f64>; 3] {
    let (mut random, n, joints) = (Random::new(seed), model.n_coordinates(), model.n_joints());
    let q = [random.numbers(joints, 1.0), random.numbers(n - joints, 0.01)].concat();
    [q, random.numbers(n, 1.0), random.numbers(n, 2.0)]
}

#[test]
fn parts_of_a_flexible_tree_add_up_and_its_lines_keep_theirs() -> Result<()> {
    let parts = everything(3);
    let full = Model::assemble(parts.clone())?;
    let [q, v, a] = state(&full, 6);
    let moving = |model: &Model<f64>| required(model, [&q, &v, &a]).0;
    let all = moving(&full);
    let missing = |bodies: &[usize], beams: &[usize]| -> Result<Vec<f64>> {
        let omissions = Omissions {
            velocity_of_bodies: bodies.to_vec(),
            velocity_of_beams: beams.to_vec(),
            ..Omissions::default()
        };
        Ok(less(&all, &moving(&without(&parts, omissions)?)))
    };
    let mut sum = vec![0.0; q.len()];
    for body in 0..5 {
        sum.iter_mut().zip(missing(&[body], &[])?).for_each(|(sum, own)| *sum += own);
    }
    for beam in 0..2 {
        sum.iter_mut().zip(missing(&[], &[beam])?).for_each(|(sum, own)| *sum += own);
    }
    near(&missing(&[0, 1, 2, 3, 4], &[0, 1])?, &sum, 1e-11);
    near(&less(&missing(&[1, 3], &[0])?, &missing(&[3], &[])?), &missing(&[1], &[0])?, 1e-11);
    // What is left are the lines', which is what they add to the full tree.
    let bare = Model::assemble(Parts { lines: Vec::new(), ..parts.clone() })?;
    let still = vec![0.0; v.len()];
    let of_rates = |model: &Model<f64>| less(&moving(model), &required(model, [&q, &still, &a]).0);
    let by_lines = less(&of_rates(&full), &of_rates(&bare));
    let all_but_lines = Model::assemble(Parts { lines: Vec::new(), drop_velocity_terms: true, ..parts.clone() })?;
    let kept = less(&of_rates(&full), &missing(&[0, 1, 2, 3, 4], &[0, 1])?);
    near(&less(&kept, &of_rates(&all_but_lines)), &by_lines, 1e-10);
    assert!(by_lines.iter().any(|effort| effort.abs() > 1e-2));
    Ok(())
}

#[test]
fn a_joint_that_does_not_couple_cuts_the_mass_matrix_and_nothing_else() -> Result<()> {
    let parts = everything(3);
    let full = Model::assemble(parts.clone())?;
    let [q, v, a] = state(&full, 7);
    let (n, (efforts, whole)) = (q.len(), required(&full, [&q, &v, &a]));
    // The elbow (0) sits on the upper beam, whose root is on the shoulder (1); the slider (2) on the lower beam on the elbow.
    let upper = |place: usize| place == 1 || place == 3 || place == 4 || (5..8).contains(&place);
    let cut = Omissions { coupling: vec![0], ..Omissions::default() };
    let model = without(&parts, cut)?;
    assert!(!model.couples() && full.couples());
    let (found, mass) = required(&model, [&q, &v, &a]);
    let expected: Vec<f64> =
        (0..n * n).map(|at| if upper(at / n) == upper(at % n) { whole[at] } else { 0.0 }).collect();
    near(&mass, &expected, 1e-13);
    assert!(whole.iter().zip(&expected).any(|(all, kept)| (all - kept).abs() > 1e-2));
    let dropped: Vec<f64> =
        (0..n).map(|i| (0..n).map(|j| (whole[i * n + j] - expected[i * n + j]) * a[j]).sum()).collect();
    near(&less(&efforts, &found), &dropped, 1e-12);
    // Accelerations from efforts, block by block.
    let mut data = Data::new(&model);
    flexible::terms(&model, &mut data, &q, &v);
    near(flexible::solve(&model, &mut data, &q, &v, &found), &a, 1e-9);
    Ok(())
}

#[test]
fn with_no_joint_that_couples_the_mass_matrix_of_an_arm_is_its_diagonal() -> Result<()> {
    let (parts, mut random) = (arm(), Random::new(8));
    let full = Model::assemble(parts.clone())?;
    let model = without(&parts, Omissions { coupling: (0..7).collect(), ..Omissions::default() })?;
    let first = without(&parts, Omissions { coupling: vec![0], ..Omissions::default() })?;
    assert!(full.is_recursive() && first.is_recursive() && !model.is_recursive());
    let [q, v, a] = [3.0, 2.0, 5.0].map(|size| random.numbers(7, size));
    let whole = crba(&full, &mut Data::new(&full), &q).to_vec();
    let (efforts, mass) = required(&model, [&q, &v, &a]);
    let bias = rnea(&full, &mut Data::new(&full), &q, &v, &[0.0; 7]).to_vec();
    let expected: Vec<f64> = (0..7).map(|i| whole[8 * i] * a[i] + bias[i]).collect();
    near(&efforts, &expected, 1e-12);
    let diagonal: Vec<f64> = (0..49).map(|at| if at % 8 == 0 { whole[at] } else { 0.0 }).collect();
    near(&mass, &diagonal, 1e-13);
    Ok(())
}

#[test]
fn numbers_without_a_part_are_refused() {
    for (omissions, name) in [
        (still(&[7]), "body"),
        (Omissions { coupling: vec![9], ..Omissions::default() }, "joint"),
        (Omissions { second_order: vec![0], ..Omissions::default() }, "beam"),
        (Omissions { velocity_of_beams: vec![0], ..Omissions::default() }, "beam"),
    ] {
        let message = without(&arm(), omissions).map_or_else(|error| error.to_string(), |_| "none".to_owned());
        assert!(message.contains("what is left out") && message.contains(name), "{message}");
    }
}
