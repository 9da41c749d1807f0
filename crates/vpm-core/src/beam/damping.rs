//! Damping matrices of clamped beams, with exact derivatives by the parameters.

use nalgebra::{DMatrix, DVector};

use super::eigen;
use super::entry::BeamEntry;
use crate::error::{Error, Result};
use crate::scalar::Scalar;

/// Newton steps on a mode: each makes one more order of derivatives exact, starting from exact values.
const STEPS: usize = 3;

/// Damping matrix `D = beta K + alpha M + sum_k 2 zeta_k omega_k (M a_k)(M a_k)^T`, row by row. `groups` are
/// coordinates that may couple at rest.
///
/// Source: Caughey & O'Kelly 1965, "Classical normal modes in damped linear dynamic systems", J. Appl. Mech. 32, for modal damping with
/// modes `a_k` of unit modal mass. Ratios of modes that a coarse level does not have damp nothing, so that a beam can change its level.
pub(super) fn damping<S: Scalar>(
    entry: &BeamEntry<S>,
    stiffness: &[S],
    mass: impl FnOnce() -> Vec<S>,
    groups: &[Vec<usize>],
) -> Result<Vec<S>> {
    let law = &entry.damping;
    let n = groups.iter().map(Vec::len).sum::<usize>();
    let beta = law.stiffness.unwrap_or_else(S::zero);
    let mut damping: Vec<S> = stiffness.iter().map(|&entry| entry * beta).collect();
    if n == 0 || (law.mass.is_none() && law.ratios.is_empty()) {
        return Ok(damping);
    }
    let mass = mass();
    if let Some(alpha) = law.mass {
        damping.iter_mut().zip(&mass).for_each(|(sum, &entry)| *sum += entry * alpha);
    }
    if !law.ratios.is_empty() {
        for (mode, &ratio) in clamped_modes(stiffness, &mass, groups)?.iter().zip(&law.ratios) {
            let momentum: Vec<S> = rows(&mass, n).map(|row| dot(row, &mode.shape)).collect();
            let factor = ratio * mode.square.sqrt() * 2.0;
            for i in 0..n {
                for j in 0..n {
                    damping[i * n + j] += factor * momentum[i] * momentum[j];
                }
            }
        }
    }
    Ok(damping)
}

/// A natural mode: squared frequency, shape of unit modal mass.
struct Mode<S> {
    square: S,
    shape: Vec<S>,
}

/// Modes of the clamped beam for its damping, slowest first. Modes of one group differ in frequency, so that each has
/// its derivatives; two groups may share one, as both planes of a round beam do.
fn clamped_modes<S: Scalar>(stiffness: &[S], mass: &[S], groups: &[Vec<usize>]) -> Result<Vec<Mode<S>>> {
    let n = groups.iter().map(Vec::len).sum::<usize>();
    let mut all = Vec::with_capacity(n);
    for group in groups.iter().filter(|group| !group.is_empty()) {
        let part = |matrix: &[S]| -> Vec<S> {
            group.iter().flat_map(|&i| group.iter().map(move |&j| (i, j))).map(|(i, j)| matrix[i * n + j]).collect()
        };
        for mode in modes(&part(stiffness), &part(mass), group.len())? {
            let mut shape = vec![S::zero(); n];
            group.iter().zip(&mode.shape).for_each(|(&at, &entry)| shape[at] = entry);
            all.push(Mode { square: mode.square, shape });
        }
    }
    all.sort_by(|a, b| a.square.re().total_cmp(&b.square.re()));
    Ok(all)
}

/// Modes of `K a = omega^2 M a` with derivatives, for modal damping.
///
/// Law: Newton's method on `K a - s M a = 0`, `1 - a^T M a = 0` from the values of the modes, its matrix that of the values alone: the
/// residual of the values is zero, so each step makes one order of derivatives exact (Griewank & Walther 2008, section 15.1).
fn modes<S: Scalar>(stiffness: &[S], mass: &[S], n: usize) -> Result<Vec<Mode<S>>> {
    let values = |matrix: &[S]| DMatrix::from_iterator(n, n, matrix.iter().map(Scalar::re)).transpose();
    let (k, m) = (values(stiffness), values(mass));
    let found = eigen::modes(&k, &m)?;
    let mut all = Vec::with_capacity(n);
    for (at, &frequency) in found.frequencies.iter().enumerate() {
        let start = found.shapes.column(at).into_owned();
        let inverse = bordered(&k, &m, frequency * frequency, &start)?;
        let mut mode =
            Mode { square: S::from_f64(frequency * frequency), shape: start.iter().map(|&x| S::from_f64(x)).collect() };
        for _ in 0..STEPS {
            correct(&mut mode, stiffness, mass, &inverse);
        }
        all.push(mode);
    }
    Ok(all)
}

/// Inverse of `[K - s M, -M a; -(M a)^T, 0]`, for derivatives of modal damping.
fn bordered(k: &DMatrix<f64>, m: &DMatrix<f64>, square: f64, shape: &DVector<f64>) -> Result<DMatrix<f64>> {
    let n = shape.len();
    let momentum = m * shape;
    let mut matrix = DMatrix::zeros(n + 1, n + 1);
    matrix.view_mut((0, 0), (n, n)).copy_from(&(k - m * square));
    matrix.view_mut((0, n), (n, 1)).copy_from(&-&momentum);
    matrix.view_mut((n, 0), (1, n)).copy_from(&-momentum.transpose());
    matrix.try_inverse().ok_or(Error::Setting {
        setting: "the frequencies of a beam's modes",
        condition: "differ from one another, so that each mode can be damped alone".to_owned(),
        value: square.abs().sqrt(),
        repair: "give the beam a damping by stiffness instead of ratios",
    })
}

fn correct<S: Scalar>(mode: &mut Mode<S>, stiffness: &[S], mass: &[S], inverse: &DMatrix<f64>) {
    let n = mode.shape.len();
    let momentum: Vec<S> = rows(mass, n).map(|row| dot(row, &mode.shape)).collect();
    let mut residual: Vec<S> = rows(stiffness, n)
        .zip(&momentum)
        .map(|(row, &momentum)| dot(row, &mode.shape) - mode.square * momentum)
        .collect();
    residual.push((S::one() - dot(&momentum, &mode.shape)) * 0.5);
    let step = |row: usize| residual.iter().enumerate().map(|(k, &entry)| entry * inverse[(row, k)]).sum::<S>();
    for (row, entry) in mode.shape.iter_mut().enumerate() {
        *entry -= step(row);
    }
    mode.square -= step(n);
}

fn rows<S>(matrix: &[S], n: usize) -> impl Iterator<Item = &[S]> {
    matrix.chunks_exact(n.max(1))
}

fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).map(|(&a, &b)| a * b).sum()
}
