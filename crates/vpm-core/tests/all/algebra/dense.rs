//! Matrices of any size: eigenvalues and solutions on both sides of the size from which on they are faer's.

use nalgebra::{Complex, DMatrix, DVector};
use vpm_core::algebra::dense::{LARGE, eigenvalues, solve};

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
