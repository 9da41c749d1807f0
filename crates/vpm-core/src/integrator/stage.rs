//! The linear system of an implicit stage.

use super::lu::Lu;
use crate::scalar::Scalar;

/// `1 - r A` of an implicit step, with the coordinates eliminated: they follow their rates.
///
/// Law: with `A = [0, 1, 0; B, C]`, the coordinates first, `(1 - r A) [k; w] = [a; b]` is `(1 - r C - r^2 B') w = b + r B a` and
/// `k = a + r v`, where v are the leading entries of w and B' is B below v, zero elsewhere. So a system of n coordinates and m states
/// costs the factors of m - n rows, an eighth of the work where there is nothing but coordinates and rates.
/// Source: elimination by blocks, Golub & Van Loan 2013, "Matrix Computations", section 3.2.9. Checked: against the whole system.
#[derive(Clone, Debug)]
pub(super) struct Stage<S> {
    /// A, row by row.
    matrix: Vec<S>,
    /// r B, row by row.
    coupling: Vec<S>,
    lu: Lu<S>,
    coordinates: usize,
    dim: usize,
    reach: f64,
}

impl<S: Scalar> Stage<S> {
    /// Buffers for systems of `dim` states.
    pub(super) fn new(dim: usize) -> Self {
        let (matrix, coupling) = (vec![S::zero(); dim * dim], vec![S::zero(); dim * dim]);
        Self { matrix, coupling, lu: Lu::new(dim), coordinates: 0, dim, reach: 0.0 }
    }

    /// Where A has to be written, row by row, before it is factorised; it stays there.
    pub(super) fn matrix(&mut self) -> &mut [S] {
        &mut self.matrix
    }

    /// Prepares `1 - reach A`, where that many coordinates lead the state.
    pub(super) fn factorise(&mut self, coordinates: usize, reach: f64) {
        (self.coordinates, self.reach) = (coordinates, reach);
        let (n, dim, left) = (coordinates, self.dim, self.dim - coordinates);
        if self.lu.dim() != left {
            self.lu.resize(left);
        }
        let rows = self.matrix.chunks_exact(dim.max(1)).skip(n).zip(self.coupling.chunks_exact_mut(n.max(1)));
        for (k, ((row, coupling), target)) in rows.zip(self.lu.matrix().chunks_exact_mut(left.max(1))).enumerate() {
            let (of_coordinates, others) = row.split_at(n);
            for (target, &entry) in target.iter_mut().zip(others) {
                *target = entry * -reach;
            }
            for ((target, coupling), &entry) in target.iter_mut().zip(coupling).zip(of_coordinates) {
                *coupling = entry * reach;
                *target -= *coupling * reach;
            }
            target[k] = target[k] + 1.0;
        }
        self.lu.factorise();
    }

    /// Replaces `b` by the solution x of `(1 - reach A) x = b`.
    pub(super) fn solve(&mut self, b: &mut [S]) {
        let (coordinates, others) = b.split_at_mut(self.coordinates);
        for (entry, row) in others.iter_mut().zip(self.coupling.chunks_exact(self.coordinates.max(1))) {
            for (&part, &coordinate) in row.iter().zip(&*coordinates) {
                *entry += part * coordinate;
            }
        }
        self.lu.solve(others);
        for (coordinate, &rate) in coordinates.iter_mut().zip(&*others) {
            *coordinate += rate * self.reach;
        }
    }
}
