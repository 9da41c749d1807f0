//! Square linear systems of a size that the type knows.

use vpm_core::scalar::Scalar;

/// A pivot below this fraction of its row's largest entry counts as zero.
const SINGULAR: f64 = 1e-13;

/// Solves `A x = b` for a matrix of known size. For a singular matrix it gives the smallest pivot, as a fraction of its
/// row's largest entry.
///
/// Law: Gaussian elimination with scaled row pivoting (Golub & Van Loan 2013, "Matrix Computations", section 3.4): rows
/// may have different units. Allocates nothing.
pub fn solve<S: Scalar, const N: usize>(mut a: [[S; N]; N], mut b: [S; N]) -> Result<[S; N], f64> {
    let mut scale = [0.0_f64; N];
    for (size, row) in scale.iter_mut().zip(&a) {
        *size = row.iter().fold(f64::MIN_POSITIVE, |largest, entry| largest.max(entry.re().abs()));
    }
    for column in 0..N {
        let ratio = |row: usize| a[row][column].re().abs() / scale[row];
        let best = (column + 1..N).fold(column, |best, row| if ratio(row) > ratio(best) { row } else { best });
        let pivot = ratio(best);
        if pivot.is_nan() || pivot < SINGULAR {
            return Err(pivot);
        }
        a.swap(column, best);
        b.swap(column, best);
        scale.swap(column, best);
        eliminate(&mut a, &mut b, column);
    }
    for row in (0..N).rev() {
        let known: S = (row + 1..N).map(|k| a[row][k] * b[k]).sum();
        b[row] = (b[row] - known) / a[row][row];
    }
    Ok(b)
}

/// Elimination to solve a system: rows below become zero in `column` by multiples of that row.
fn eliminate<S: Scalar, const N: usize>(a: &mut [[S; N]; N], b: &mut [S; N], column: usize) {
    let (pivot_row, pivot_right) = (a[column], b[column]);
    for row in column + 1..N {
        let factor = a[row][column] / pivot_row[column];
        for (entry, &pivot) in a[row].iter_mut().zip(&pivot_row).skip(column) {
            *entry -= factor * pivot;
        }
        b[row] -= factor * pivot_right;
    }
}
