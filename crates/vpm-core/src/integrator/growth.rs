//! Whether a step is short enough for a linear system of first-order equations: drives with oil and currents beside what moves.
//!
//! For analysis before a run: this allocates.

use nalgebra::{Complex, DMatrix};

use super::Method;
use super::stability::{SLACK, eigenvalues, rk4_limit};
use crate::error::{Error, Result};

/// A linear system `x' = A x` whose first states are coordinates and their rates, matrices row by row.
#[derive(Clone, Copy, Debug)]
pub struct Rates<'a> {
    /// A.
    pub jacobian: &'a [f64],
    /// How many coordinates lead the state.
    pub coordinates: usize,
    /// What of the accelerations [`Method::SemiImplicit`] takes implicitly, see [`crate::ode::Ode::elasticity`].
    pub elasticity: Option<&'a [f64]>,
    /// Natural size of every state.
    pub sizes: &'a [f64],
    /// Name of every state.
    pub names: &'a [String],
}

/// Checks that a `step` (s) with `method` lets no first-order mode of `system` grow. The error names the state with the
/// largest part in the mode that allows the shortest step.
///
/// Law: as in [`super::stability::check`], with the states that are no coordinates by the explicit Euler rule in `semi_implicit`.
/// Checked: closed forms of a decay and of a vibration; the limits of second-order systems are those of that function.
pub fn check_rates(method: Method, step: f64, system: &Rates<'_>) -> Result<()> {
    let scaled = Scaled::new(system);
    let worst = match method {
        Method::Rk4 => scaled.rk4()?,
        Method::SemiImplicit => scaled.stepped(step, |step| scaled.turn(step))?,
        _ => None,
    };
    judge(method, step, system, worst)
}

/// Checks growth as [`check_rates`], for any method of fixed steps. `derivative` is that of the state after a step (s)
/// by the state before, row by row. Of a method of several steps it is that of the last states, newest first, by those
/// before.
///
/// Checked: against the stability functions of the methods.
pub fn check_steps(
    method: Method,
    step: f64,
    system: &Rates<'_>,
    mut derivative: impl FnMut(f64) -> Vec<f64>,
) -> Result<()> {
    let (scaled, sizes) = (Scaled::new(system), system.sizes);
    let dim = sizes.len();
    let size = |i: usize, j: usize| sizes[j % dim] / sizes[i % dim];
    let turn = |step: f64| {
        let entries = derivative(step);
        let whole = entries.len().isqrt();
        DMatrix::from_fn(whole, whole, |i, j| entries[i * whole + j] * size(i, j))
    };
    judge(method, step, system, scaled.stepped(step, turn)?)
}

fn judge(method: Method, step: f64, system: &Rates<'_>, worst: Option<Worst>) -> Result<()> {
    match worst {
        Some(Worst { place, frequency, limit }) if step > limit => {
            let (coordinate, frequency) = (system.names[place].clone(), frequency / std::f64::consts::TAU);
            Err(Error::StepTooLarge { method: method.name(), step, coordinate, frequency, limit })
        }
        _ => Ok(()),
    }
}

/// The mode that allows the shortest step.
struct Worst {
    /// The state with the largest part in it.
    place: usize,
    /// In rad/s.
    frequency: f64,
    /// Largest stable step in s.
    limit: f64,
}

/// The system in states of size 1.
struct Scaled {
    matrix: DMatrix<f64>,
    /// `[-M^-1 K, -M^-1 D]` of what is taken implicitly.
    implicit: Option<DMatrix<f64>>,
    coordinates: usize,
}

impl Scaled {
    fn new(Rates { jacobian, coordinates, elasticity, sizes, .. }: &Rates<'_>) -> Self {
        let (n, count) = (sizes.len(), *coordinates);
        let size = |i: usize, j: usize| sizes[j] / sizes[i];
        let matrix = DMatrix::from_fn(n, n, |i, j| jacobian[i * n + j] * size(i, j));
        let implicit = elasticity
            .map(|block| DMatrix::from_fn(count, 2 * count, |i, j| block[i * 2 * count + j] * size(count + i, j)));
        Self { matrix, implicit, coordinates: count }
    }

    fn rk4(&self) -> Result<Option<Worst>> {
        let values =
            eigenvalues(self.matrix.clone())?.into_iter().filter(|value| value.norm() > 0.0 && value.im >= 0.0);
        let worst = values.map(|value| (value, rk4_limit(value))).min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(worst.map(|(value, limit)| Worst {
            place: self.largest_part(&self.matrix, value),
            frequency: value.norm(),
            limit,
        }))
    }

    /// Mode of the largest growth by a step, which makes `turn` of the state, if that exceeds its own growth.
    fn stepped(&self, step: f64, mut turn: impl FnMut(f64) -> DMatrix<f64>) -> Result<Option<Worst>> {
        // A system that grows by itself is not the fault of the step.
        let own = eigenvalues(self.matrix.clone())?;
        let natural = own.iter().map(|value| value.re).fold(0.0, f64::max);
        let mut largest = |step: f64| -> Result<Option<Complex<f64>>> {
            let matrix = turn(step);
            // Numbers that are none have outgrown all others.
            if matrix.iter().any(|entry| !entry.is_finite()) {
                return Ok(Some(Complex::from(f64::INFINITY)));
            }
            let factors = eigenvalues(matrix)?;
            let most = factors.into_iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default();
            Ok(Some(most).filter(|factor| factor.norm() > (step * natural).exp() * (1.0 + SLACK)))
        };
        let Some(mut factor) = largest(step)? else { return Ok(None) };
        let (mut low, mut high) = (0.0, step);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match largest(middle)? {
                Some(found) => (high, factor) = (middle, found),
                None => low = middle,
            }
        }
        let matrix = turn(high);
        let finite = matrix.iter().all(|entry| entry.is_finite());
        let place = if finite { self.largest_part(&matrix, factor) % self.matrix.nrows() } else { 0 };
        // What grows is the fastest of its modes, or one much like it.
        let frequency = own.iter().map(|value| value.norm()).fold(0.0, f64::max);
        Ok(Some(Worst { place, frequency, limit: low }))
    }

    /// Growth matrix of a semi-implicit step.
    fn turn(&self, step: f64) -> DMatrix<f64> {
        let (n, count) = (self.matrix.nrows(), self.coordinates);
        let mut turn = DMatrix::identity(n, n) + &self.matrix * step;
        if let Some(block) = &self.implicit {
            let (stiff, damped) = (block.columns(0, count), block.columns(count, count));
            // A rate in units of its coordinate's size: both sizes are those of the rows.
            let over = self.matrix.view((0, count), (count, count)).into_owned();
            let left = DMatrix::identity(count, count) - damped * step - stiff * &over * (step * step);
            let mut right = self.matrix.rows(count, count).into_owned();
            let mut of_rates = right.columns_mut(count, count);
            of_rates += stiff * &over * step;
            if let Some(accelerations) = left.lu().solve(&right) {
                let mut rows = turn.rows_mut(count, count);
                rows.fill(0.0);
                (0..count).for_each(|k| rows[(k, count + k)] = 1.0);
                rows += accelerations * step;
            }
        }
        let over = self.matrix.rows(0, count).into_owned();
        let mut moved = over.columns(count, count) * turn.rows(count, count) * step;
        (0..count).for_each(|k| moved[(k, k)] += 1.0);
        turn.rows_mut(0, count).copy_from(&moved);
        turn
    }

    /// State with the largest part in the growing mode of `matrix` with that eigenvalue.
    fn largest_part(&self, matrix: &DMatrix<f64>, value: Complex<f64>) -> usize {
        let n = matrix.nrows();
        let shifted = DMatrix::from_fn(n, n, |i, j| {
            Complex::from(matrix[(i, j)]) - if i == j { value } else { Complex::default() }
        });
        let decomposed = shifted.svd(false, true);
        let last = decomposed.singular_values.imin();
        decomposed.v_t.map_or(0, |rows| {
            rows.row(last)
                .iter()
                .enumerate()
                .max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))
                .map_or(0, |(place, _)| place)
        })
    }
}
