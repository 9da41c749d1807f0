//! The classical Runge-Kutta method.

use crate::ode::Ode;
use crate::scalar::Scalar;

/// Fourth order, four evaluations a step, explicit: cheap and exact where nothing is stiff.
///
/// Law: `x+ = x + h/6 (k1 + 2 k2 + 2 k3 + k4)`.
/// Source: Hairer, Nørsett & Wanner 1993, "Solving Ordinary Differential Equations I", table II.1.2. Checked: order 4.
/// Stable for `h |lambda| < 2.78` on the negative real axis.
#[derive(Clone, Debug)]
pub struct Rk4<S> {
    stage: Vec<S>,
    rate: Vec<S>,
    sum: Vec<S>,
}

impl<S: Scalar> Rk4<S> {
    /// Buffers of RK4 for systems of `dim` states.
    pub fn new(dim: usize) -> Self {
        let zero = vec![S::zero(); dim];
        Self { stage: zero.clone(), rate: zero.clone(), sum: zero }
    }

    /// Moves `x` on by an RK4 step (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        // (weight of the stage in the result, distance from x to the next stage), both in units of h.
        const TABLEAU: [(f64, f64); 4] = [(1.0 / 6.0, 0.5), (1.0 / 3.0, 0.5), (1.0 / 3.0, 1.0), (1.0 / 6.0, 0.0)];
        self.stage.copy_from_slice(x);
        self.sum.copy_from_slice(x);
        for (weight, next) in TABLEAU {
            ode.rhs(&self.stage, &mut self.rate);
            for (((stage, sum), &rate), &start) in self.stage.iter_mut().zip(&mut self.sum).zip(&self.rate).zip(&*x) {
                *sum += rate * (weight * step);
                *stage = start + rate * (next * step);
            }
        }
        x.copy_from_slice(&self.sum);
    }
}
