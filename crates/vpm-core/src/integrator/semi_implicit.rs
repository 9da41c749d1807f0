//! Semi-implicit (symplectic) Euler.

use crate::ode::Ode;
use crate::scalar::Scalar;

/// First order, one evaluation a step: rates first, coordinates with the new rates.
///
/// Law: `v+ = v + h a(q, v)`, `q+ = q + h v+`, other states by the explicit Euler rule.
/// Source: Hairer, Lubich & Wanner 2006, "Geometric Numerical Integration", equation I.1.9. Checked: order 1; no drift of the energy
/// of an oscillator.
#[derive(Clone, Debug)]
pub struct SemiImplicit<S> {
    rate: Vec<S>,
}

impl<S: Scalar> SemiImplicit<S> {
    /// Buffers for systems of `dim` states.
    pub fn new(dim: usize) -> Self {
        Self { rate: vec![S::zero(); dim] }
    }

    /// Moves `x` on by `step` (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        ode.rhs(x, &mut self.rate);
        let (coordinates, others) = x.split_at_mut(ode.coordinates());
        for (state, &rate) in others.iter_mut().zip(&self.rate[coordinates.len()..]) {
            *state += rate * step;
        }
        for (coordinate, &rate) in coordinates.iter_mut().zip(&*others) {
            *coordinate += rate * step;
        }
    }
}
