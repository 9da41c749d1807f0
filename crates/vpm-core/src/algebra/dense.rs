//! Matrices whose size only the machine knows: decomposed by nalgebra, and by faer where they are large.

use faer::Mat;
use faer::linalg::solvers::Solve;
use nalgebra::{Complex, DMatrix, DVector, Schur};

/// Rows from which on faer is faster. Eigenvalues take it a quarter of the time at 64 rows and a tenth at 256; linear systems take it a
/// third. Below, nalgebra is up to twice as fast.
const LARGE: usize = 64;
/// QR sweeps before an eigenproblem counts as lost.
const SWEEPS: usize = 10_000;

/// Eigenvalues of a square matrix in any order; none if the QR algorithm does not converge or an entry is not finite.
pub(crate) fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
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

/// The x of `A x = b`; none for a matrix that is singular to rounding.
pub(crate) fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn irregular(n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| ((3 * i * i + 7 * j + i * j) as f64).sin())
    }

    #[test]
    fn eigenvalues_are_roots_of_one_on_both_sides_of_the_size() {
        // The cyclic shift: the n-th roots of one.
        for n in [LARGE - 1, LARGE, 2 * LARGE + 1] {
            let shift = DMatrix::from_fn(n, n, |i, j| if (j + 1) % n == i { 1.0 } else { 0.0 });
            let mut angles: Vec<f64> = eigenvalues(shift).unwrap().iter().map(|value| value.arg()).collect();
            angles.sort_by(f64::total_cmp);
            let step = std::f64::consts::TAU / n as f64;
            assert!(angles.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() < 1e-10), "{n}: {angles:?}");
        }
    }

    #[test]
    fn sums_of_eigenvalues_are_the_trace() {
        for n in [LARGE - 1, LARGE + 1] {
            let matrix = irregular(n);
            let sum: Complex<f64> = eigenvalues(matrix.clone()).unwrap().into_iter().sum();
            assert!((sum.re - matrix.trace()).abs() < 1e-11 * n as f64 && sum.im.abs() < 1e-11, "{n}: {sum}");
        }
    }

    #[test]
    fn solutions_solve_and_singular_matrices_have_none() {
        for n in [LARGE - 1, LARGE + 1] {
            let (mut matrix, right) = (irregular(n), DVector::from_fn(n, |row, _| (row as f64).cos()));
            let found = solve(&matrix, &right).unwrap();
            assert!((&matrix * found - &right).amax() < 1e-10, "{n}");
            matrix.row_mut(3).fill(0.0);
            assert!(solve(&matrix, &right).is_none(), "{n}");
        }
    }

    #[test]
    fn what_is_no_number_has_no_eigenvalues() {
        assert!(eigenvalues(DMatrix::from_element(3, 3, f64::NAN)).is_none());
        assert!(eigenvalues(DMatrix::from_element(LARGE, LARGE, f64::INFINITY)).is_none());
    }
}
