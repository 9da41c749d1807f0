//! Recorded machines: programs against the direct evaluation of the same laws, derivatives against dual numbers.

use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::graph::Evaluator;
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::system::Recording;

use crate::common::trees;
use trees::{description, everything};

/// The largest difference relative to the largest number.
fn apart(found: &[f64], expected: &[f64]) -> f64 {
    let size = expected.iter().fold(1e-300_f64, |most, entry| most.max(entry.abs()));
    found.iter().zip(expected).fold(0.0, |most, (found, expected)| most.max((found - expected).abs() / size))
}

fn state(d: &Description, random: &mut Random) -> Vec<f64> {
    let n = d.n_coordinates();
    let joints = d.n_joints();
    [
        random.numbers(joints, 1.0),
        random.numbers(n - joints, 0.02),
        random.numbers(n, 0.3),
        random.numbers(d.n_states() - 2 * n, 0.3),
    ]
    .concat()
}

fn check(d: &Description, seed: u64) -> Result<()> {
    let random = &mut Random::new(seed);
    let theta: Vec<f64> = d.parameters.clone();
    let mut recording = Recording::new(d, &theta)?;
    let mut sample = Evaluator::new(&recording.sample());
    let (program, places) = recording.linearised();
    let mut linearised = Evaluator::new(&program);
    let mut direct = d.system::<f64>(&theta)?;
    let dim = d.n_states();
    for _ in 0..5 {
        let (x, u) = (state(d, random), random.numbers(d.n_inputs(), 2.0));
        for (number, &input) in u.iter().enumerate() {
            direct.hold(number, input);
        }
        let inputs = [x.clone(), u, vec![0.0; dim + 1], theta.clone()].concat();
        let (mut rates, mut outputs) = (vec![0.0; dim], vec![0.0; d.n_outputs()]);
        let mut found = vec![0.0; sample.n_outputs()];
        sample.run(&inputs, &mut found);
        direct.rhs(&x, &mut rates);
        direct.dynamics().observe(&x, &rates, &mut outputs);
        let error = apart(&found[..dim], &rates);
        assert!(error < 1e-11, "rates differ by {error}");
        let error = apart(&found[dim..], &outputs);
        assert!(error < 1e-11, "outputs differ by {error}");
        let mut jacobian = vec![0.0; dim * dim];
        direct.jacobian(&x, &mut jacobian);
        let mut entries = vec![0.0; linearised.n_outputs()];
        linearised.run(&inputs, &mut entries);
        let mut matrix = vec![0.0; dim * dim];
        for (&(row, column), &entry) in places.iter().zip(&entries[dim..]) {
            matrix[row * dim + column] = entry;
        }
        let error = apart(&matrix, &jacobian);
        assert!(error < 1e-10, "Jacobian differs by {error}");
    }
    Ok(())
}

#[test]
fn flexible_machines_with_everything_agree() -> Result<()> {
    for seed in 1..6 {
        check(&description(&everything(seed), |_| ()), seed)?;
    }
    Ok(())
}
