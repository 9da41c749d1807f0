//! Whether a step is short enough for a linear system, and which of its modes says no.
//!
//! For analysis before a run: this allocates.

use nalgebra::{Cholesky, Complex, DMatrix, DVector};

use super::Method;
use crate::algebra::dense;
use crate::error::{Error, Result};

/// By how much a step may let a mode grow before it counts as unstable: eigenvalues that coincide are known to half of the digits only.
pub(super) const SLACK: f64 = 1e-6;

/// A linear system `M q'' + D q' + K q = 0`, matrices row by row, with a name for every coordinate.
///
/// For [`Method::SemiImplicit`] K and D are what acts explicitly, such as springs and friction of joints.
#[derive(Clone, Copy, Debug)]
pub struct LinearSystem<'a> {
    /// M, symmetric and positive definite.
    pub mass: &'a [f64],
    /// K.
    pub stiffness: &'a [f64],
    /// D.
    pub damping: &'a [f64],
    /// Names of the coordinates.
    pub names: &'a [String],
}

/// How a mode fares under a method.
struct Mode {
    /// Shape in the coordinates.
    shape: DVector<Complex<f64>>,
    /// Natural frequency in rad/s.
    frequency: f64,
    /// Largest stable step in s; infinite if there is none.
    limit: f64,
}

/// Checks the stability of `step` (s) with `method` for `system`. The error names the mode that allows the shortest
/// step.
///
/// Law: `rk4` multiplies a mode `e^(s t)` by `R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24`, `z = h s`, at every step (Hairer & Wanner 1996,
/// section IV.2), `semi_implicit` turns `(q, v)` by `[1 - h^2 K, h (1 - h D); -h K, 1 - h D]`, with M = 1. None may grow, unless the
/// system itself does. The implicit methods are L-stable and always pass.
/// Checked: sizes, finite entries, M positive definite; closed forms of single and coupled oscillators.
pub fn check(method: Method, step: f64, system: &LinearSystem<'_>) -> Result<()> {
    let explicit = matches!(method, Method::Rk4 | Method::SemiImplicit);
    let reduced = Reduced::new(system)?;
    if !explicit || system.names.is_empty() {
        return Ok(());
    }
    let modes = if method == Method::Rk4 { reduced.rk4_modes()? } else { reduced.semi_implicit_modes(step)? };
    let Some(worst) = modes.into_iter().min_by(|a, b| a.limit.total_cmp(&b.limit)) else { return Ok(()) };
    if step <= worst.limit {
        return Ok(());
    }
    let coordinate = system.names[reduced.largest_part(&worst.shape)].clone();
    let frequency = worst.frequency / std::f64::consts::TAU;
    Err(Error::StepTooLarge { method: method.name(), step, coordinate, frequency, limit: worst.limit })
}

/// The system in coordinates `z = L^T q`, `M = L L^T`, in which its mass is 1.
struct Reduced {
    lower: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
}

impl Reduced {
    fn new(system: &LinearSystem<'_>) -> Result<Self> {
        let n = system.names.len();
        for (what, matrix) in [("mass", system.mass), ("stiffness", system.stiffness), ("damping", system.damping)] {
            if matrix.len() != n * n {
                let (what, each) = (format!("the {what} matrix of a linear system"), "pair of coordinates".to_owned());
                return Err(Error::Dimension { what, expected: n * n, found: matrix.len(), each });
            }
            if let Some(&value) = matrix.iter().find(|entry| !entry.is_finite()) {
                return Err(Error::NonFinite { path: format!("linear_system.{what}"), value });
            }
        }
        let [mass, stiffness, damping] =
            [system.mass, system.stiffness, system.damping].map(|entries| DMatrix::from_row_slice(n, n, entries));
        let smallest = mass.diagonal().iter().copied().fold(f64::INFINITY, f64::min);
        let Some(factor) = Cholesky::new(mass) else {
            let path = "linear_system.mass".to_owned();
            let condition = "be positive definite, which shows in its smallest diagonal entry at the latest";
            return Err(Error::Domain { path, condition, value: smallest });
        };
        let lower = factor.l();
        let reduce = |matrix: DMatrix<f64>| {
            let half = solve_lower(&lower, matrix);
            solve_lower(&lower, half.transpose()).transpose()
        };
        let [stiffness, damping] = [reduce(stiffness), reduce(damping)];
        Ok(Self { lower, stiffness, damping })
    }

    /// Eigenvalues `s` of `s^2 + s D + K` for stability, from the companion matrix in scaled time. K and 1 are of one
    /// size in that time.
    fn eigenvalues(&self) -> Result<Vec<Complex<f64>>> {
        let n = self.stiffness.nrows();
        let size =
            Some(self.stiffness.norm().sqrt().max(self.damping.norm())).filter(|&size| size > 0.0).unwrap_or(1.0);
        let mut companion = DMatrix::zeros(2 * n, 2 * n);
        companion.view_mut((0, n), (n, n)).fill_with_identity();
        companion.view_mut((n, 0), (n, n)).copy_from(&(&self.stiffness / -(size * size)));
        companion.view_mut((n, n), (n, n)).copy_from(&(&self.damping / -size));
        Ok(eigenvalues(companion)?.into_iter().map(|value| value * size).collect())
    }

    fn rk4_modes(&self) -> Result<Vec<Mode>> {
        let modes = self.eigenvalues()?.into_iter().filter(|value| value.norm() > 0.0 && value.im >= 0.0);
        Ok(modes
            .map(|value| {
                let matrix = DMatrix::from_fn(self.stiffness.nrows(), self.stiffness.ncols(), |i, j| {
                    let unit = if i == j { value * value } else { Complex::from(0.0) };
                    unit + value * self.damping[(i, j)] + self.stiffness[(i, j)]
                });
                let shape = self.shape(matrix);
                Mode { shape, frequency: value.norm(), limit: rk4_limit(value) }
            })
            .collect())
    }

    /// Mode that limits the stability of `semi_implicit`, if `step` is too long.
    fn semi_implicit_modes(&self, step: f64) -> Result<Vec<Mode>> {
        let growth = |step: f64| -> Result<Complex<f64>> {
            let factors = eigenvalues(self.semi_implicit_turn(step))?;
            Ok(factors.into_iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default())
        };
        // A system that grows by itself is not the fault of the step.
        let natural = self.eigenvalues()?.into_iter().map(|value| value.re).fold(0.0, f64::max);
        let stable = |step: f64, factor: Complex<f64>| factor.norm() <= (step * natural).exp() * (1.0 + SLACK);
        if stable(step, growth(step)?) {
            return Ok(Vec::new());
        }
        let (mut low, mut high) = (0.0, step);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if stable(middle, growth(middle)?) { low = middle } else { high = middle }
        }
        let factor = growth(high)?;
        // (r - 1)^2 / (h^2 r) + D (r - 1) / (h r) + K leaves the mode that is multiplied by r alone.
        let (over, inverse) = ((factor - 1.0) / high, factor.inv());
        let matrix = DMatrix::from_fn(self.stiffness.nrows(), self.stiffness.ncols(), |i, j| {
            let unit = if i == j { over * over * inverse } else { Complex::from(0.0) };
            unit + over * inverse * self.damping[(i, j)] + self.stiffness[(i, j)]
        });
        let shape = self.shape(matrix);
        let reduced = self.lower.transpose().map(Complex::from) * &shape;
        let stretched = self.stiffness.map(Complex::from) * &reduced;
        let frequency = (reduced.dotc(&stretched).norm() / reduced.norm_squared()).sqrt();
        Ok(vec![Mode { shape, frequency, limit: low }])
    }

    fn semi_implicit_turn(&self, step: f64) -> DMatrix<f64> {
        let n = self.stiffness.nrows();
        let damped = DMatrix::identity(n, n) - &self.damping * step;
        let mut turn = DMatrix::zeros(2 * n, 2 * n);
        // Rates in units of the step, so that both blocks are of one size.
        turn.view_mut((0, 0), (n, n)).copy_from(&(DMatrix::identity(n, n) - &self.stiffness * (step * step)));
        turn.view_mut((0, n), (n, n)).copy_from(&damped);
        turn.view_mut((n, 0), (n, n)).copy_from(&(&self.stiffness * -(step * step)));
        turn.view_mut((n, n), (n, n)).copy_from(&damped);
        turn
    }

    /// Shape of a mode in a stability check: null vector in the coordinates of the system.
    fn shape(&self, matrix: DMatrix<Complex<f64>>) -> DVector<Complex<f64>> {
        let n = matrix.nrows();
        let decomposed = matrix.svd(false, true);
        let last = decomposed.singular_values.imin();
        let null = decomposed.v_t.map_or_else(|| DVector::zeros(n), |rows| rows.row(last).adjoint());
        self.lower.map(Complex::from).ad_solve_lower_triangular(&null).unwrap_or(null)
    }

    /// Coordinate with the largest kinetic energy in a mode of the stability check, whatever its units.
    fn largest_part(&self, shape: &DVector<Complex<f64>>) -> usize {
        let lower = self.lower.map(Complex::from);
        let momentum = &lower * (lower.adjoint() * shape);
        let parts = shape.iter().zip(&momentum).map(|(q, p)| (q.conj() * p).re);
        parts.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(place, _)| place)
    }
}

/// Stability limit of `rk4`: the largest step that lets `e^(value t)` grow no more than by itself.
pub(super) fn rk4_limit(value: Complex<f64>) -> f64 {
    let stable = |reach: f64| {
        let z = value * (reach / value.norm());
        let growth = (((z / 4.0 + 1.0) * z / 3.0 + 1.0) * z / 2.0 + 1.0) * z + 1.0;
        growth.norm() <= z.re.exp().max(1.0) * (1.0 + 1e-9)
    };
    // The border lies within |z| < 3; what grows by itself has none.
    let Some(first) = (1..=400).map(|k| f64::from(k) / 100.0).find(|&reach| !stable(reach)) else {
        return f64::INFINITY;
    };
    let (mut low, mut high) = (first - 0.01, first);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if stable(middle) { low = middle } else { high = middle }
    }
    low / value.norm()
}

pub(super) fn eigenvalues(matrix: DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    let size = matrix.nrows() as f64;
    dense::eigenvalues(matrix).ok_or(Error::Setting {
        setting: "the size of a linear system's eigenproblem",
        condition: "be such that the QR algorithm converges".to_owned(),
        value: size,
        repair: "check the matrices for entries of very different size",
    })
}

fn solve_lower(lower: &DMatrix<f64>, mut right: DMatrix<f64>) -> DMatrix<f64> {
    lower.solve_lower_triangular_mut(&mut right);
    right
}
