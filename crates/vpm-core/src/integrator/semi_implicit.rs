//! Semi-implicit (symplectic) Euler.

use super::lu::Lu;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// First order, one evaluation a step: rates first, coordinates with the new rates; constant stiffness and damping implicitly.
///
/// Law: `v+ = v + h a(q, v)`, `q+ = q + h v+`, other states by the explicit Euler rule, but for those that
/// follow the path of coordinates, [`Ode::along_path`]. Where [`Ode::elasticity`] tells of constant
/// stiffness K and damping D, `M a = f - K q - D v`, the rates follow from `(M + h D + h^2 K) v+ = M v + h (f - K q)` instead, so
/// that the vibrations they cause limit no step: they are damped where the step does not resolve them.
/// Source: Hairer, Lubich & Wanner 2006, "Geometric Numerical Integration", equation I.1.9; for the implicit stiffness Baraff &
/// Witkin 1998, "Large steps in cloth simulation", equation 6. Checked: order 1; no drift of the energy of an oscillator; stable
/// far beyond the explicit limit on an elastic chain.
#[derive(Clone, Debug)]
pub struct SemiImplicit<S> {
    rate: Vec<S>,
    /// `[-M^-1 K, -M^-1 D]`, one row per coordinate.
    elastic: Vec<S>,
    lu: Lu<S>,
}

impl<S: Scalar> SemiImplicit<S> {
    /// Buffers of semi-implicit Euler for systems of `dim` states.
    pub fn new(dim: usize) -> Self {
        // There are coordinates for half of the states at most.
        let most = dim / 2;
        Self { rate: vec![S::zero(); dim], elastic: vec![S::zero(); 2 * most * most], lu: Lu::new(most) }
    }

    /// Moves `x` on by a semi-implicit Euler step (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        let n = ode.coordinates();
        ode.rhs(x, &mut self.rate);
        if ode.elasticity(x, &mut self.elastic[..2 * n * n]) {
            self.relax(&x[n..2 * n], step);
        }
        let add = |states: &mut [S], rates: &[S]| {
            states.iter_mut().zip(rates).for_each(|(state, &rate)| *state += rate * step);
        };
        add(&mut x[n..2 * n], &self.rate[n..2 * n]);
        ode.along_path(x, step, &mut self.rate);
        add(&mut x[2 * n..], &self.rate[2 * n..]);
        let (coordinates, others) = x.split_at_mut(n);
        for (coordinate, &rate) in coordinates.iter_mut().zip(&*others) {
            *coordinate += rate * step;
        }
    }

    /// Puts the mean acceleration over the step with implicit elasticity in the place of the one at its start.
    ///
    /// Law: with `[A B] = [-M^-1 K, -M^-1 D]` and the acceleration a at the start, `(1 - h B - h^2 A) a+ = a + h A v`.
    fn relax(&mut self, v: &[S], step: f64) {
        let n = v.len();
        self.lu.resize(n);
        let acceleration = &mut self.rate[n..2 * n];
        for (i, row) in self.elastic[..2 * n * n].chunks_exact(2 * n).enumerate() {
            let (stiff, damped) = row.split_at(n);
            let change: S = stiff.iter().zip(v).map(|(&entry, &v)| entry * v).sum();
            acceleration[i] += change * step;
            let matrix = &mut self.lu.matrix()[i * n..(i + 1) * n];
            for ((entry, &stiff), &damped) in matrix.iter_mut().zip(stiff).zip(damped) {
                *entry = -(stiff * step + damped) * step;
            }
            matrix[i] = matrix[i] + 1.0;
        }
        self.lu.factorise();
        self.lu.solve(acceleration);
    }
}
