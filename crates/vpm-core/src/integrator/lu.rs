//! Small dense linear systems.

use crate::scalar::Scalar;

/// LU factors of a small square matrix, in buffers that are allocated once.
///
/// Law: `P A = L U` with row exchanges for the largest pivot (Golub & Van Loan 2013, "Matrix Computations", algorithm 3.4.1). What
/// solves is kept column by column, with the inverse of each pivot: columns are added as they stand, without sums that wait for
/// each other (algorithms 3.1.3 and 3.1.4 there).
/// A singular matrix gives infinite or undefined numbers, which the caller finds in its result.
#[derive(Clone, Debug)]
pub struct Lu<S> {
    dim: usize,
    /// The matrix, then L below and U above the diagonal, row by row.
    factors: Vec<S>,
    /// The same column by column, with the inverse of each pivot on the diagonal.
    columns: Vec<S>,
    order: Vec<usize>,
    scratch: Vec<S>,
}

impl<S: Scalar> Lu<S> {
    /// Buffers for matrices of `dim` rows.
    pub fn new(dim: usize) -> Self {
        let (square, line) = (vec![S::zero(); dim * dim], vec![S::zero(); dim]);
        Self { dim, factors: square.clone(), columns: square, order: (0..dim).collect(), scratch: line }
    }

    /// Rows of the matrix.
    pub(super) fn dim(&self) -> usize {
        self.dim
    }

    /// Makes the buffers fit matrices of `dim` rows; allocates only where they were never that large.
    pub fn resize(&mut self, dim: usize) {
        self.dim = dim;
        self.factors.resize(dim * dim, S::zero());
        self.columns.resize(dim * dim, S::zero());
        self.order.resize(dim, 0);
        self.scratch.resize(dim, S::zero());
    }

    /// The matrix to factorise next, row by row, overwritten by [`Lu::factorise`].
    pub fn matrix(&mut self) -> &mut [S] {
        &mut self.factors
    }

    /// Factorises the matrix in place.
    pub fn factorise(&mut self) {
        let n = self.dim;
        for (row, place) in self.order.iter_mut().enumerate() {
            *place = row;
        }
        for column in 0..n {
            self.exchange(column);
            let inverse = self.factors[column * n + column].recip();
            let (above, below) = self.factors.split_at_mut((column + 1) * n);
            let pivot_row = &above[column * n + column + 1..];
            for row in below.chunks_exact_mut(n) {
                let factor = row[column] * inverse;
                row[column] = factor;
                for (entry, &pivot) in row[column + 1..].iter_mut().zip(pivot_row) {
                    *entry -= factor * pivot;
                }
            }
            self.columns[column * n + column] = inverse;
        }
        self.turn();
    }

    /// Copies the factors beside the diagonal from rows to columns.
    fn turn(&mut self) {
        let n = self.dim;
        for (row, entries) in self.factors.chunks_exact(n.max(1)).enumerate() {
            let pivot = self.columns[row * n + row];
            for (target, &entry) in self.columns[row..].iter_mut().step_by(n).zip(entries) {
                *target = entry;
            }
            self.columns[row * n + row] = pivot;
        }
    }

    /// Brings the row with the largest pivot up; numbers that do not tell how they compare stay where they are.
    fn exchange(&mut self, column: usize) {
        let n = self.dim;
        let size = |row: usize| self.factors[row * n + column].abs();
        let (mut best, mut largest) = (column, size(column));
        for row in column + 1..n {
            let found = size(row);
            if largest.known_less(found) == Some(true) {
                (best, largest) = (row, found);
            }
        }
        if best != column {
            self.order.swap(column, best);
            let (upper, lower) = self.factors.split_at_mut(best * n);
            upper[column * n..(column + 1) * n].swap_with_slice(&mut lower[..n]);
        }
    }

    /// Replaces `b` by the solution x of `A x = b`.
    pub fn solve(&mut self, b: &mut [S]) {
        let n = self.dim;
        let Self { columns, order, scratch, .. } = self;
        for (entry, &row) in scratch.iter_mut().zip(&*order) {
            *entry = b[row];
        }
        for (k, column) in columns.chunks_exact(n.max(1)).enumerate() {
            let (known, below) = scratch.split_at_mut(k + 1);
            take(below, &column[k + 1..], known[k]);
        }
        for (k, column) in columns.chunks_exact(n.max(1)).enumerate().rev() {
            let (above, known) = scratch.split_at_mut(k);
            let value = known[0] * column[k];
            b[k] = value;
            take(above, &column[..k], value);
        }
    }
}

/// Takes `factor` times a column off.
#[inline]
fn take<S: Scalar>(entries: &mut [S], column: &[S], factor: S) {
    for (entry, &part) in entries.iter_mut().zip(column) {
        *entry -= part * factor;
    }
}
