//! The linear system of an implicit stage.

use super::lu::Lu;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// `1 - r A` of an implicit step, with the coordinates eliminated: they follow their rates.
///
/// Law: with `A = [0, 1, 0; B, C]`, the coordinates first, `(1 - r A) [k; w] = [a; b]` is `(1 - r C - r^2 B') w = b + r B a` and
/// `k = a + r v`, where v are the leading entries of w and B' is B below v, zero elsewhere. So a system of n coordinates and m states
/// costs the factors of m - n rows, an eighth of the work where there is nothing but coordinates and rates.
/// Source: elimination by blocks, Golub & Van Loan 2013, "Matrix Computations", section 3.2.9. Checked: against the whole system.
#[derive(Clone, Debug)]
pub(super) struct Stage<S> {
    /// A, row by row; then r B in the columns of the coordinates.
    matrix: Vec<S>,
    lu: Lu<S>,
    coordinates: usize,
    dim: usize,
    reach: f64,
}

impl<S: Scalar> Stage<S> {
    /// Buffers for systems of `dim` states.
    pub(super) fn new(dim: usize) -> Self {
        Self { matrix: vec![S::zero(); dim * dim], lu: Lu::new(dim), coordinates: 0, dim, reach: 0.0 }
    }

    /// Prepares `1 - reach A` with the `matrix` A that is written in its place.
    pub(super) fn factorise<O: Ode<S>>(&mut self, ode: &mut O, reach: f64, write: impl FnOnce(&mut O, &mut [S])) {
        write(ode, &mut self.matrix);
        (self.coordinates, self.reach) = (ode.coordinates(), reach);
        let (n, dim) = (self.coordinates, self.dim);
        let left = dim - n;
        if self.lu.dim() != left {
            self.lu.resize(left);
        }
        let rows = self.matrix.chunks_exact_mut(dim.max(1)).skip(n);
        for (k, (row, target)) in rows.zip(self.lu.matrix().chunks_exact_mut(left.max(1))).enumerate() {
            let (of_coordinates, others) = row.split_at_mut(n);
            for (target, &entry) in target.iter_mut().zip(&*others) {
                *target = entry * -reach;
            }
            for (target, entry) in target.iter_mut().zip(of_coordinates) {
                *entry = *entry * reach;
                *target -= *entry * reach;
            }
            target[k] = target[k] + 1.0;
        }
        self.lu.factorise();
    }

    /// Replaces `b` by the solution x of `(1 - reach A) x = b`.
    pub(super) fn solve(&mut self, b: &mut [S]) {
        let (coordinates, others) = b.split_at_mut(self.coordinates);
        for (entry, row) in others.iter_mut().zip(self.matrix.chunks_exact(self.dim.max(1)).skip(self.coordinates)) {
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
