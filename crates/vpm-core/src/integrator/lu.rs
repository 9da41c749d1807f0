//! Small dense linear systems.

use crate::scalar::Scalar;

/// LU factors of a small square matrix, in buffers that are allocated once.
///
/// Law: `P A = L U` with row exchanges for the largest pivot (Golub & Van Loan 2013, "Matrix Computations", algorithm 3.4.1).
/// A singular matrix gives infinite or undefined numbers, which the caller finds in its result.
#[derive(Clone, Debug)]
pub struct Lu<S> {
    dim: usize,
    factors: Vec<S>,
    order: Vec<usize>,
    scratch: Vec<S>,
}

impl<S: Scalar> Lu<S> {
    /// Buffers for matrices of `dim` rows.
    pub fn new(dim: usize) -> Self {
        Self { dim, factors: vec![S::zero(); dim * dim], order: (0..dim).collect(), scratch: vec![S::zero(); dim] }
    }

    /// Makes the buffers fit matrices of `dim` rows; allocates only where they were never that large.
    pub fn resize(&mut self, dim: usize) {
        self.dim = dim;
        self.factors.resize(dim * dim, S::zero());
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
        }
    }

    /// Brings the row with the largest pivot up.
    fn exchange(&mut self, column: usize) {
        let n = self.dim;
        let size = |row: usize| self.factors[row * n + column].re().abs();
        let best = (column + 1..n).fold(column, |best, row| if size(row) > size(best) { row } else { best });
        if best != column {
            self.order.swap(column, best);
            let (upper, lower) = self.factors.split_at_mut(best * n);
            upper[column * n..(column + 1) * n].swap_with_slice(&mut lower[..n]);
        }
    }

    /// Replaces `b` by the solution x of `A x = b`.
    pub fn solve(&mut self, b: &mut [S]) {
        let n = self.dim;
        for (entry, &row) in self.scratch.iter_mut().zip(&self.order) {
            *entry = b[row];
        }
        b.copy_from_slice(&self.scratch);
        for row in 0..n {
            let (known, rest) = b.split_at_mut(row);
            rest[0] -= dot(&self.factors[row * n..row * n + row], known);
        }
        for row in (0..n).rev() {
            let (rest, known) = b.split_at_mut(row + 1);
            let sum = dot(&self.factors[row * n + row + 1..(row + 1) * n], known);
            rest[row] = (rest[row] - sum) / self.factors[row * n + row];
        }
    }
}

fn dot<S: Scalar>(left: &[S], right: &[S]) -> S {
    left.iter().zip(right).map(|(&l, &r)| l * r).sum()
}
