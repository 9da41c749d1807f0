//! Dynamics without products of rates: what is missing is what Lagrange's equations say, and nothing else.

use vpm_core::Result;
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, flexible, rnea};
use vpm_core::model::{Model, Parts};
use vpm_core::samples::{Random, arm7};

use crate::common::trees::everything;

/// The seven-joint arm with and without velocity terms.
fn arms() -> Result<[Model<f64>; 2]> {
    let sample = arm7();
    let parts = Parts { gravity: sample.gravity, bodies: sample.bodies, ..Parts::default() };
    let without = Parts { drop_velocity_terms: true, ..parts.clone() };
    Ok([Model::assemble(parts)?, Model::assemble(without)?])
}

fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    let size = expected.iter().fold(1.0, |most: f64, value| most.max(value.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance * size, "{found} beside {expected}");
    }
}

fn mass(model: &Model<f64>, q: &[f64]) -> Vec<f64> {
    crba(model, &mut Data::new(model), q).to_vec()
}

/// `V_i = sum_jk (dM_ij/dq_k - dM_jk/dq_i / 2) v_j v_k`, from difference quotients of the mass matrix (Featherstone 2008, section 2.14).
fn lagrange(model: &Model<f64>, q: &[f64], v: &[f64]) -> Vec<f64> {
    let (n, step) = (q.len(), 1e-5);
    let slopes: Vec<Vec<f64>> = (0..n)
        .map(|k| {
            let [ahead, behind] = [step, -step].map(|shift| {
                let mut moved = q.to_vec();
                moved[k] += shift;
                mass(model, &moved)
            });
            ahead.iter().zip(&behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * step)).collect()
        })
        .collect();
    let pairs = || (0..n).flat_map(|j| (0..n).map(move |k| (j, k)));
    let term = |i: usize, (j, k): (usize, usize)| (slopes[k][i * n + j] - 0.5 * slopes[i][j * n + k]) * v[j] * v[k];
    (0..n).map(|i| pairs().map(|pair| term(i, pair)).sum()).collect()
}

#[test]
fn what_inverse_dynamics_miss_are_the_velocity_terms_of_lagrange() -> Result<()> {
    let [full, without] = arms()?;
    let mut random = Random::new(3);
    for _ in 0..5 {
        let [q, v, a] = [3.0, 2.0, 5.0].map(|size| random.numbers(7, size));
        let all = rnea(&full, &mut Data::new(&full), &q, &v, &a).to_vec();
        let rest = rnea(&without, &mut Data::new(&without), &q, &v, &a).to_vec();
        let missing: Vec<f64> = all.iter().zip(&rest).map(|(all, rest)| all - rest).collect();
        near(&missing, &lagrange(&full, &q, &v), 1e-7);
    }
    Ok(())
}

#[test]
fn a_machine_without_them_answers_in_motion_as_the_full_one_at_rest() -> Result<()> {
    let [full, without] = arms()?;
    let mut random = Random::new(4);
    let [q, v, tau] = [3.0, 2.0, 20.0].map(|size| random.numbers(7, size));
    let still = aba(&full, &mut Data::new(&full), &q, &[0.0; 7], &tau).to_vec();
    let mut data = Data::new(&without);
    near(aba(&without, &mut data, &q, &v, &tau), &still, 1e-13);
    // The other algorithm, by composite bodies, says the same.
    flexible::terms(&without, &mut data, &q, &v);
    near(flexible::solve(&without, &mut data, &q, &v, &tau), &still, 1e-10);
    Ok(())
}

#[test]
fn beams_and_lines_with_mass_leave_them_out_too_but_keep_their_damping() -> Result<()> {
    let parts = everything(3);
    let without = Model::assemble(Parts { drop_velocity_terms: true, ..parts.clone() })?;
    let full = Model::assemble(parts)?;
    let n = full.n_coordinates();
    let mut random = Random::new(6);
    let joints = full.n_joints();
    let q = [random.numbers(joints, 1.0), random.numbers(n - joints, 0.01)].concat();
    let (v, zero) = (random.numbers(n, 1.0), vec![0.0; n]);
    let required = |model: &Model<f64>, v: &[f64], a: &[f64]| {
        let (mut data, mut efforts) = (Data::new(model), vec![0.0; n]);
        flexible::terms(model, &mut data, &q, v);
        flexible::required(model, &data, (&q, v), a, &mut efforts);
        efforts
    };
    let a = random.numbers(n, 2.0);
    near(&required(&without, &zero, &a), &required(&full, &zero, &a), 1e-13);
    // What is left of the rates is linear in them: the damping of the beams.
    let of = |model: &Model<f64>, size: f64| -> Vec<f64> {
        let scaled: Vec<f64> = v.iter().map(|rate| size * rate).collect();
        let (moving, still) = (required(model, &scaled, &a), required(model, &zero, &a));
        moving.iter().zip(&still).map(|(moving, still)| moving - still).collect()
    };
    let twice: Vec<f64> = of(&without, 1.0).iter().map(|effort| 2.0 * effort).collect();
    near(&of(&without, 2.0), &twice, 1e-10);
    // What is dropped goes with the square of the rates.
    let dropped = |size: f64| -> Vec<f64> {
        of(&full, size).iter().zip(of(&without, size)).map(|(all, kept)| all - kept).collect()
    };
    let four_times: Vec<f64> = dropped(1.0).iter().map(|effort| 4.0 * effort).collect();
    assert!(four_times.iter().any(|effort| effort.abs() > 1e-3));
    near(&dropped(2.0), &four_times, 1e-9);
    Ok(())
}
