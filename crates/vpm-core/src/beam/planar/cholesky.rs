//! Small symmetric positive definite systems of a size known to the compiler.

use crate::scalar::Scalar;

/// The factor of `A = L D L^T` with unit lower triangular L, in place and on the stack.
///
/// Source: Golub & Van Loan 2013, "Matrix Computations", algorithm 4.1.2, without the division in the inner loops. A matrix that is not
/// positive definite gives infinite or undefined numbers, which the caller finds in its result.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky<S, const N: usize> {
    lower: [[S; N]; N],
    inverse: [S; N],
}

impl<S: Scalar, const N: usize> Cholesky<S, N> {
    /// Factorises `matrix`, of which it reads the lower triangle.
    #[inline]
    pub fn new(matrix: &[[S; N]; N]) -> Self {
        let mut lower = *matrix;
        let mut inverse = [S::zero(); N];
        for j in 0..N {
            inverse[j] = lower[j][j].recip();
            for i in j + 1..N {
                let (above, rest) = lower.split_at_mut(i);
                let row = &mut rest[0];
                let factor = row[j] * inverse[j];
                // Column j still holds L D; the trailing triangle loses L D L^T.
                for (entry, other) in row[j + 1..i].iter_mut().zip(&above[j + 1..]) {
                    *entry -= factor * other[j];
                }
                row[i] -= factor * row[j];
            }
            for row in lower.iter_mut().skip(j + 1) {
                row[j] *= inverse[j];
            }
        }
        Self { lower, inverse }
    }

    /// The solution x of `A x = b`.
    #[inline]
    pub fn solve(&self, b: &[S; N]) -> [S; N] {
        let mut x = *b;
        for (i, row) in self.lower.iter().enumerate() {
            let (known, rest) = x.split_at_mut(i);
            for (&entry, &known) in row.iter().zip(&*known) {
                rest[0] -= entry * known;
            }
        }
        for (entry, &inverse) in x.iter_mut().zip(&self.inverse) {
            *entry *= inverse;
        }
        for (i, row) in self.lower.iter().enumerate().rev() {
            let (rest, known) = x.split_at_mut(i);
            for (rest, &entry) in rest.iter_mut().zip(row) {
                *rest -= entry * known[0];
            }
        }
        x
    }
}
