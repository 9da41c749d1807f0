//! What a method of fixed steps damps because it does not resolve it.
//!
//! For analysis beside a run: this allocates.

use nalgebra::{Complex, DMatrix};

use super::stability::eigenvalues;
use super::{Integrator, Method};
use crate::error::Result;
use crate::ode::Ode;

/// Damping ratio below which a mode counts as lightly damped: it rings for more than a period and a half.
pub const LIGHT: f64 = 0.1;
/// Share of its amplitude that a mode may lose to the method unsaid.
pub const LOST: f64 = 0.1;
/// Largest product of angular frequency and step that is looked at, and how finely.
const REACH: f64 = 10.0;
const GRID: f64 = 0.05;

/// A lightly damped mode that the method damps besides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damped {
    /// Its frequency in Hz.
    pub frequency: f64,
    /// Its own damping ratio.
    pub ratio: f64,
    /// The time that counts in s: that of the run, or in which the mode falls to 1/e by itself if that is shorter.
    pub time: f64,
    /// Share of its amplitude that the method leaves of it in that time.
    pub left: f64,
}

/// What a method resolves over a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolution {
    /// Frequency in Hz above which an undamped vibration loses more than [`LOST`]; infinite if there is none.
    pub limit: f64,
    /// The lightly damped modes that lose more than that, slowest first.
    pub damped: Vec<Damped>,
}

/// How a method steps through a linear system.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// The method.
    pub method: Method,
    /// Its step in s.
    pub step: f64,
    /// Time of the run in s.
    pub duration: f64,
    /// Whether [`Method::SemiImplicit`] takes the stiffness implicitly.
    pub implicit: bool,
}

impl Resolution {
    /// Of the linear system `x' = A x`, A (`jacobian`) row by row, in states of these natural `sizes`.
    ///
    /// Law: a mode `e^(s t)` is a damped oscillator. The method itself makes one step of it; the eigenvalue g of what that does to its
    /// state leaves `(|g| e^(-h Re s))^(t/h)` of its amplitude over a time t, beside its own damping. Forces that a method takes
    /// explicitly and others that it takes implicitly are not told apart.
    /// Steps of controlled error resolve what they meet; guarded ones are those of the Rosenbrock method.
    /// Checked: closed forms of the stability functions, runs of a spring.
    pub fn new(jacobian: &[f64], sizes: &[f64], steps: Steps) -> Result<Self> {
        let none = Self { limit: f64::INFINITY, damped: Vec::new() };
        let steps = match steps.method {
            Method::Adaptive { .. } => return Ok(none),
            Method::Guarded => Steps { method: Method::Rosenbrock, ..steps },
            _ => steps,
        };
        if jacobian.iter().any(|entry| !entry.is_finite()) {
            return Ok(none);
        }
        let n = sizes.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| jacobian[i * n + j] * sizes[j] / sizes[i]);
        let damped = eigenvalues(scaled)?.into_iter().filter(|value| value.im > 0.0).map(|value| steps.damped(value));
        let mut damped: Vec<_> = damped.filter(|mode| mode.ratio < LIGHT && mode.left < 1.0 - LOST).collect();
        damped.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        Ok(Self { limit: steps.limit(), damped })
    }
}

impl Steps {
    fn damped(&self, value: Complex<f64>) -> Damped {
        let (size, ratio) = (value.norm(), -value.re / value.norm());
        let own = if ratio > 0.0 { (ratio * size).recip() } else { f64::INFINITY };
        let time = self.duration.min(own);
        let factor = self.growth(size * self.step, ratio) * (-value.re * self.step).exp();
        Damped { frequency: value.im / std::f64::consts::TAU, ratio, time, left: factor.powf(time / self.step) }
    }

    /// Frequency in Hz above which the method takes more than the share from an undamped vibration.
    fn limit(&self) -> f64 {
        let lost = |reach: f64| self.growth(reach, 0.0).powf(self.duration / self.step) < 1.0 - LOST;
        let first = (1..=(REACH / GRID) as u32).map(|k| f64::from(k) * GRID).find(|&reach| lost(reach));
        let Some(mut high) = first else { return f64::INFINITY };
        let mut low = high - GRID;
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if lost(middle) { high = middle } else { low = middle }
        }
        high / (std::f64::consts::TAU * self.step)
    }

    /// By how much one step of `reach` radians makes an oscillator of that damping ratio grow.
    fn growth(&self, reach: f64, ratio: f64) -> f64 {
        let mut oscillator = Oscillator { ratio, implicit: self.implicit };
        let mut integrator = Integrator::new(self.method, 2);
        let columns = [[1.0, 0.0], [0.0, 1.0]].map(|mut x| {
            integrator.step(&mut oscillator, &mut x, reach);
            x
        });
        let [[a, c], [b, d]] = columns;
        let (half, product) = (0.5 * (a + d), a * d - b * c);
        let square = half * half - product;
        if square < 0.0 { product.sqrt() } else { half.abs() + square.sqrt() }
    }
}

/// `q'' + 2 ratio q' + q = 0`.
struct Oscillator {
    ratio: f64,
    implicit: bool,
}

impl Ode<f64> for Oscillator {
    fn dim(&self) -> usize {
        2
    }

    fn coordinates(&self) -> usize {
        1
    }

    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt.copy_from_slice(&[x[1], -x[0] - 2.0 * self.ratio * x[1]]);
    }

    fn jacobian(&mut self, _: &[f64], jacobian: &mut [f64]) {
        jacobian.copy_from_slice(&[0.0, 1.0, -1.0, -2.0 * self.ratio]);
    }

    fn elasticity(&mut self, _: &[f64], block: &mut [f64]) -> bool {
        block.copy_from_slice(&[-1.0, -2.0 * self.ratio]);
        self.implicit
    }
}
