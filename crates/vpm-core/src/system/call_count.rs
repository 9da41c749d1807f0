//! How often a step asks for rates and for matrices.

use std::ops::AddAssign;

use super::System;
use crate::ode::Ode;

/// A matrix that an integrator asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Matrix {
    /// Exact derivatives of the rates.
    Jacobian,
    /// What stands in their place in a linearly implicit step.
    Iteration,
    /// What constant stiffness and damping do.
    Elasticity,
}

impl Matrix {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Jacobian, Self::Iteration, Self::Elasticity];

    /// Name of the counted matrix call among the stages of a step.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Jacobian => "Jacobian",
            Self::Iteration => "iteration matrix",
            Self::Elasticity => "elasticity",
        }
    }
}

/// How often an integrator asked for rates, matrices and samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Calls {
    pub(crate) rates: u64,
    pub(crate) matrices: [u64; 3],
    pub(crate) samples: u64,
}

impl Calls {
    /// Call count of a stage: how often it was part of what a step needed.
    pub(crate) fn of(&self, stage: &str) -> f64 {
        let matrix = Matrix::ALL.into_iter().position(|kind| kind.name() == stage);
        let count = match (matrix, stage) {
            (Some(place), _) => self.matrices[place],
            (None, "sensors" | "sample") => self.samples,
            (None, "rates") => self.rates,
            // Each sample evaluates the rates once, beside those that the integrator asks for.
            (None, _) => self.rates + self.samples,
        };
        count as f64
    }
}

impl AddAssign for Calls {
    fn add_assign(&mut self, other: Self) {
        self.rates += other.rates;
        self.samples += other.samples;
        self.matrices.iter_mut().zip(other.matrices).for_each(|(count, more)| *count += more);
    }
}

/// A system that counts what it is asked for.
pub(crate) struct Counted<'a> {
    pub(crate) system: &'a mut System<f64>,
    pub(crate) calls: Calls,
}

impl Counted<'_> {
    fn matrix(&mut self, kind: Matrix) {
        self.calls.matrices[kind as usize] += 1;
    }

    /// Counts the call of a matrix with the rates at the same state.
    fn with_rates(&mut self, kind: Matrix) {
        self.matrix(kind);
        self.calls.rates += u64::from(!self.system.is_ready() && !self.system.has_rates_in(kind));
    }
}

impl Ode<f64> for Counted<'_> {
    fn dim(&self) -> usize {
        self.system.dim()
    }

    fn coordinates(&self) -> usize {
        self.system.coordinates()
    }

    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        self.calls.rates += 1;
        self.system.rhs(x, dxdt);
    }

    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        self.matrix(Matrix::Jacobian);
        self.system.jacobian(x, jacobian);
    }

    fn iteration_matrix(&mut self, x: &[f64], matrix: &mut [f64]) {
        self.matrix(Matrix::Iteration);
        self.system.iteration_matrix(x, matrix);
    }

    fn linearise(&mut self, x: &[f64], jacobian: &mut [f64], rates: &mut [f64]) {
        self.with_rates(Matrix::Jacobian);
        self.system.linearise(x, jacobian, rates);
    }

    fn prepare(&mut self, x: &[f64], matrix: &mut [f64], rates: &mut [f64]) {
        self.with_rates(Matrix::Iteration);
        self.system.prepare(x, matrix, rates);
    }

    /// Counts additive rates as one call of the rates.
    fn additive_rates(&mut self, explicit: &[f64], implicit: &[f64], reach: f64, rates: &mut [f64]) -> bool {
        self.calls.rates += u64::from(reach != 0.0 || !self.system.is_ready());
        self.system.additive_rates(explicit, implicit, reach, rates)
    }

    fn elasticity(&mut self, x: &[f64], block: &mut [f64]) -> bool {
        let any = self.system.elasticity(x, block);
        if any {
            self.matrix(Matrix::Elasticity);
        }
        any
    }

    fn along_path(&mut self, x: &[f64], step: f64, rates: &mut [f64]) {
        self.system.along_path(x, step, rates);
    }

    fn arrive(&mut self, x: &mut [f64], step: Option<f64>) {
        self.system.arrive(x, step);
    }

    fn scales(&self, scales: &mut [f64]) {
        self.system.scales(scales);
    }
}
