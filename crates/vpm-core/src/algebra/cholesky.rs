//! Symmetric positive definite systems.

use crate::scalar::Scalar;

/// Cholesky factors of a symmetric positive definite matrix, in a buffer that is allocated once.
///
/// Law: `A = L L^T` (Golub & Van Loan 2013, "Matrix Computations", algorithm 4.2.1). A matrix that is not positive definite gives
/// undefined numbers, which the caller finds in its result.
#[derive(Clone, Debug)]
pub struct Cholesky<S> {
    dim: usize,
    /// L row by row, with the inverses of its diagonal in their places.
    lower: Vec<S>,
}

impl<S: Scalar> Cholesky<S> {
    /// Cholesky buffer for matrices of `dim` rows.
    pub fn new(dim: usize) -> Self {
        Self { dim, lower: vec![S::zero(); dim * dim] }
    }

    /// Cholesky factorisation of `matrix`, of which the lower triangle counts, row by row.
    pub fn factorise(&mut self, matrix: &[S]) {
        let n = self.dim;
        self.factorise_by(|row, column| matrix[row * n + column]);
    }

    /// Cholesky factorisation of the matrix of these entries, of which the lower triangle is asked for.
    #[inline]
    pub(super) fn factorise_by(&mut self, entry: impl Fn(usize, usize) -> S) {
        let n = self.dim;
        for row in 0..n {
            let (above, rest) = self.lower.split_at_mut(row * n);
            let own = &mut rest[..n];
            for column in 0..row {
                let other = &above[column * n..column * n + column];
                let sum = dot(&own[..column], other);
                own[column] = (entry(row, column) - sum) * above[column * n + column];
            }
            let square = dot(&own[..row], &own[..row]);
            own[row] = (entry(row, row) - square).sqrt().recip();
        }
    }

    /// Solves `A x = b` by Cholesky factors: x takes the place of `b`.
    pub fn solve(&self, b: &mut [S]) {
        let n = self.dim;
        for row in 0..n {
            let (known, rest) = b.split_at_mut(row);
            rest[0] = (rest[0] - dot(&self.lower[row * n..row * n + row], known)) * self.lower[row * n + row];
        }
        for row in (0..n).rev() {
            let (rest, known) = b.split_at_mut(row + 1);
            let below = self.lower.chunks_exact(n).skip(row + 1).map(|line| line[row]);
            let sum: S = below.zip(known.iter()).map(|(entry, &x)| entry * x).sum();
            rest[row] = (rest[row] - sum) * self.lower[row * n + row];
        }
    }

    /// As [`Cholesky::solve`], with entry i of b at `places[i]`.
    pub(super) fn solve_at(&self, b: &mut [S], places: &[usize]) {
        let n = self.dim;
        for (row, &place) in places.iter().enumerate() {
            let known = self.lower[row * n..row * n + row].iter().zip(places);
            let sum: S = known.map(|(&entry, &known)| entry * b[known]).sum();
            b[place] = (b[place] - sum) * self.lower[row * n + row];
        }
        for (row, &place) in places.iter().enumerate().rev() {
            let below = (row + 1..n).map(|line| self.lower[line * n + row] * b[places[line]]);
            let sum: S = below.sum();
            b[place] = (b[place] - sum) * self.lower[row * n + row];
        }
    }

    /// Square of a row's Cholesky pivot: its diagonal entry less the rows before it.
    pub fn pivot(&self, row: usize) -> S {
        let inverse = self.lower[row * self.dim + row];
        (inverse * inverse).recip()
    }
}

fn dot<S: Scalar>(left: &[S], right: &[S]) -> S {
    left.iter().zip(right).map(|(&l, &r)| l * r).sum()
}
