//! Assembly by Newton's method.

use super::ClosedLinkage;
use super::constraint::{linearised, singular};
use crate::algebra::solve;
use crate::error::{LinkageError, Result};
use vpm_core::Error;

/// Settings of Newton's method on constraint equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newton {
    /// Largest constraint violation of a solution, in the unit of the constraints.
    pub tolerance: f64,
    /// Newton steps at most.
    pub max_iterations: usize,
}

/// Coordinates that close a linkage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<const N: usize> {
    /// The coordinates.
    pub q: [f64; N],
    /// Largest constraint violation left.
    pub residual: f64,
    /// Newton steps taken.
    pub iterations: usize,
}

impl Default for Newton {
    /// Newton's method with tolerance 1e-14 in at most 50 steps. In m^2 for rods of some decimetres: rounding.
    fn default() -> Self {
        Self { tolerance: 1e-14, max_iterations: 50 }
    }
}

impl Newton {
    /// Coordinates near `start` that close the linkage at `input`, by Newton's method.
    ///
    /// Law: `phi(q_k) + phi_q (q_(k+1) - q_k) = 0` (eq 2.19, which lacks the first term), the step halved while it does
    /// not reduce the violation; the number of steps is bounded. Fails with the violation that is left, or with the
    /// pivot of a singular configuration. Which assembly mode it finds depends on `start`.
    /// Checked: against the closed form and the resultant.
    pub fn solve<L: ClosedLinkage<N, I>, const N: usize, const I: usize>(
        &self,
        linkage: &L,
        start: [f64; N],
        input: &[f64; I],
    ) -> Result<Solution<N>> {
        self.check(&start, input)?;
        let (mut q, (mut phi, mut jacobian)) = (start, linearised(linkage, &start, input));
        for iterations in 0..=self.max_iterations {
            let residual = largest(&phi);
            if residual <= self.tolerance {
                return Ok(Solution { q, residual, iterations });
            }
            if iterations == self.max_iterations {
                break;
            }
            let step = solve(jacobian, phi).map_err(|pivot| singular(linkage.name(), &q, pivot))?;
            q = damped(linkage, &q, &step, input, residual);
            (phi, jacobian) = linearised(linkage, &q, input);
        }
        let (iterations, residual, tolerance) = (self.max_iterations, largest(&phi), self.tolerance);
        Err(LinkageError::NotConverged { linkage: linkage.name().to_owned(), iterations, residual, tolerance }.into())
    }

    fn check(&self, start: &[f64], input: &[f64]) -> vpm_core::Result<()> {
        for (name, numbers) in [("start", start), ("input", input)] {
            if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
                return Err(Error::NonFinite { path: format!("{name}[{index}]"), value: numbers[index] });
            }
        }
        if self.tolerance.is_nan() || self.tolerance <= 0.0 {
            let (setting, condition) = ("the tolerance of Newton's method", "be positive".to_owned());
            let repair = "give the largest violation that a closed linkage may have";
            return Err(Error::Setting { setting, condition, value: self.tolerance, repair });
        }
        Ok(())
    }
}

/// Damped Newton step `q - step`, halved until the violation is smaller, ten times at most.
fn damped<L: ClosedLinkage<N, I>, const N: usize, const I: usize>(
    linkage: &L,
    q: &[f64; N],
    step: &[f64; N],
    input: &[f64; I],
    residual: f64,
) -> [f64; N] {
    let moved = |share: f64| std::array::from_fn(|k| q[k] - share * step[k]);
    let better = |candidate: &[f64; N]| largest(&linkage.constraints(candidate, input)) < residual;
    (0..10).map(|halvings| moved(0.5_f64.powi(halvings))).find(better).unwrap_or_else(|| moved(1.0))
}

fn largest<const N: usize>(numbers: &[f64; N]) -> f64 {
    // A number that is not one counts as infinitely far away.
    numbers.iter().fold(0.0, |most, number| if number.abs() <= most { most } else { number.abs() })
}
