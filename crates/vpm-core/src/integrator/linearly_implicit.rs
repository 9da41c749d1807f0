//! A Rosenbrock method: implicit stability for two linear solves a step.

use std::ops::Mul;

use super::Length;
use super::stage::Stage;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// The diagonal coefficient: 1 - 1/sqrt(2), the root of `g^2 - 2 g + 1/2` with the smaller error constant.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// Second order and L-stable: stiff friction and springs are damped out instead of blowing up, in bounded work (one Jacobian, one
/// factorisation, two right-hand sides and solves a step, no iteration).
///
/// Law (ROS2): `(1 - g h A) k1 = f(x)`, `(1 - g h A) k2 = f(x + h k1) - 2 k1`, `x+ = x + 3/2 h k1 + 1/2 h k2`.
/// The order is 2 whatever A is, the stability is that of A = df/dx; [`Ode::iteration_matrix`] chooses A.
/// Source: Verwer, Spee, Blom & Hundsdorfer 1999, "A second-order Rosenbrock method applied to photochemical dispersion problems",
/// SIAM J. Sci. Comput. 20(4), equation 3.3; theory in Hairer & Wanner 1996, "Solving Ordinary Differential Equations II",
/// section IV.7. Checked: order 2; a stiff decay is damped at steps far beyond its time constant.
#[derive(Clone, Debug)]
pub struct LinearlyImplicit<S, L = f64> {
    left: Stage<S, L>,
    first: Vec<S>,
    second: Vec<S>,
    stage: Vec<S>,
}

impl<S: Scalar + Mul<L, Output = S>, L: Length> LinearlyImplicit<S, L> {
    /// Buffers of the linearly implicit method for systems of `dim` states.
    pub fn new(dim: usize) -> Self {
        let zero = vec![S::zero(); dim];
        Self { left: Stage::new(dim), first: zero.clone(), second: zero.clone(), stage: zero }
    }

    /// Moves `x` on by a linearly implicit step (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: L) {
        ode.prepare(x, self.left.matrix(), &mut self.first);
        self.left.factorise(ode.coordinates(), step * GAMMA);
        self.left.solve(ode, &mut self.first);
        for ((stage, &start), &rate) in self.stage.iter_mut().zip(&*x).zip(&self.first) {
            *stage = start + rate * step;
        }
        ode.rhs(&self.stage, &mut self.second);
        for (second, &first) in self.second.iter_mut().zip(&self.first) {
            *second -= first * 2.0;
        }
        self.left.solve(ode, &mut self.second);
        for ((state, &first), &second) in x.iter_mut().zip(&self.first).zip(&self.second) {
            *state += first * (step * 1.5) + second * (step * 0.5);
        }
    }

    /// Largest elimination factor in the last linearly implicit step: where it is large, the step is not exact. That
    /// happens in numbers that do not tell how they compare, so that rows stay where they are.
    pub(crate) fn largest_factor(&self) -> S {
        self.left.largest_factor()
    }
}
