//! Singular values, null spaces, determinants and definiteness of small matrices. For analysis: these allocate.

/// Two columns count as orthogonal when their cosine is below this.
const ORTHOGONAL: f64 = 1e-15;
/// Convergence is quadratic: a dozen sweeps are plenty for any small matrix.
const SWEEPS: usize = 40;

/// Singular values of an m x n matrix with the right singular vectors, all n of them.
///
/// Law: one-sided Jacobi rotations, `A V = U S` (Golub & Van Loan 2013, section 8.6.3), which gives small singular
/// values to the rounding of the largest, where the eigenvalues of `A^T A` would lose half of the digits.
#[derive(Clone, Debug, PartialEq)]
pub struct SingularValues {
    /// n values, descending; those beyond the m-th are zero up to rounding.
    pub values: Vec<f64>,
    /// The right singular vector of each value, of length n.
    pub vectors: Vec<Vec<f64>>,
}

impl SingularValues {
    /// Works out the singular values of the matrix with these columns.
    pub fn new(columns: &[Vec<f64>]) -> Self {
        let n = columns.len();
        let identity = |k| (0..n).map(|row| if row == k { 1.0 } else { 0.0 }).collect();
        let mut pairs: Vec<(Vec<f64>, Vec<f64>)> = columns.iter().cloned().zip((0..n).map(identity)).collect();
        for _ in 0..SWEEPS {
            let mut largest = 0.0_f64;
            for p in 0..n {
                for q in p + 1..n {
                    let (left, right) = pairs.split_at_mut(q);
                    largest = largest.max(orthogonalise(&mut left[p], &mut right[0]));
                }
            }
            if largest < ORTHOGONAL {
                break;
            }
        }
        let mut named: Vec<(f64, Vec<f64>)> =
            pairs.into_iter().map(|(column, vector)| (dot(&column, &column).sqrt(), vector)).collect();
        named.sort_by(|left, right| right.0.total_cmp(&left.0));
        let (values, vectors) = named.into_iter().unzip();
        Self { values, vectors }
    }
}

/// Jacobi turn for singular values: two columns become orthogonal; returns their cosine before that. What belongs to
/// the columns turns too.
fn orthogonalise(left: &mut (Vec<f64>, Vec<f64>), right: &mut (Vec<f64>, Vec<f64>)) -> f64 {
    let (a, b, product) = (dot(&left.0, &left.0), dot(&right.0, &right.0), dot(&left.0, &right.0));
    let size = (a * b).sqrt();
    if size == 0.0 || product.abs() <= ORTHOGONAL * size {
        return 0.0;
    }
    let ratio = (b - a) / (2.0 * product);
    let tangent = 1.0_f64.copysign(ratio) / (ratio.abs() + ratio.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let sine = tangent * cosine;
    for (l, r) in left.0.iter_mut().zip(&mut right.0).chain(left.1.iter_mut().zip(&mut right.1)) {
        (*l, *r) = (cosine * *l - sine * *r, sine * *l + cosine * *r);
    }
    product.abs() / size
}

fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(l, r)| l * r).sum()
}

/// Determinant of the matrix with these columns, by elimination: zero if it is singular. With column pivoting.
pub fn determinant(columns: &[Vec<f64>]) -> f64 {
    let mut a = columns.to_vec();
    let mut product = 1.0;
    for row in 0..a.len() {
        let best = (row + 1..a.len())
            .fold(row, |best, next| if a[next][row].abs() > a[best][row].abs() { next } else { best });
        if a[best][row] == 0.0 {
            return 0.0;
        }
        if best != row {
            a.swap(best, row);
            product = -product;
        }
        let pivot = a[row].clone();
        product *= pivot[row];
        for column in &mut a[row + 1..] {
            let factor = column[row] / pivot[row];
            column.iter_mut().zip(&pivot).for_each(|(entry, part)| *entry -= factor * part);
        }
    }
    product
}

/// Whether no eigenvalue of a symmetric matrix makes it singular or indefinite. All have one sign and stand clear of
/// `floor`, by elimination.
pub fn is_definite(matrix: &[Vec<f64>], floor: f64) -> bool {
    let sign = matrix.first().and_then(|row| row.first()).map_or(0.0, |entry| entry.signum());
    let mut a: Vec<Vec<f64>> = matrix.iter().map(|row| row.iter().map(|entry| sign * entry).collect()).collect();
    for k in 0..a.len() {
        let pivot = a[k].clone();
        if pivot[k].is_nan() || pivot[k] <= floor {
            return false;
        }
        for row in &mut a[k + 1..] {
            let factor = row[k] / pivot[k];
            row.iter_mut().zip(&pivot).for_each(|(entry, part)| *entry -= factor * part);
        }
    }
    !a.is_empty()
}
