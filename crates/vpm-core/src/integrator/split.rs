//! One stage of a method that takes what is stiff implicitly and all else explicitly.

use super::lu::Lu;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// The two states of a stage, and what its rates need.
#[derive(Clone, Debug)]
pub(super) struct Split<S> {
    /// Where the stage has come to, for all that is explicit.
    pub(super) explicit: Vec<S>,
    /// Where it will be without its own rates, for all that is implicit.
    pub(super) implicit: Vec<S>,
    /// `[-M^-1 K, -M^-1 D]`, one row per coordinate, of systems that solve nothing by themselves.
    elastic: Vec<S>,
    lu: Lu<S>,
}

impl<S: Scalar> Split<S> {
    /// Buffers of a split stage for systems of `dim` states.
    pub(super) fn new(dim: usize) -> Self {
        // There are coordinates for half of the states at most.
        let most = dim / 2;
        let [explicit, implicit] = [0; 2].map(|_| vec![S::zero(); dim]);
        Self { explicit, implicit, elastic: vec![S::zero(); 2 * most * most], lu: Lu::new(most) }
    }

    /// Rates that a split stage adds for `reach` (s) to its implicit state, see [`Ode::additive_rates`].
    #[inline]
    pub(super) fn rates(&mut self, ode: &mut impl Ode<S>, reach: f64, rates: &mut [S]) {
        if !ode.additive_rates(&self.explicit, &self.implicit, reach, rates) {
            self.relax(ode, reach, rates);
        }
    }

    /// Relaxes explicit rates of a split stage by the system's elasticity, taken implicitly.
    ///
    /// Law: with `[A, B] = [-M^-1 K, -M^-1 D]` and r the reach, `(1 - r B - r^2 A) a = a_E + A (q_I + r v_I - q_E) + B (v_I - v_E)`.
    fn relax(&mut self, ode: &mut impl Ode<S>, reach: f64, rates: &mut [S]) {
        let n = ode.coordinates();
        if n == 0 || !ode.elasticity(&self.explicit, &mut self.elastic[..2 * n * n]) {
            return;
        }
        self.lu.resize(n);
        let ([q_e, v_e], [q_i, v_i]) = (halves(&self.explicit, n), halves(&self.implicit, n));
        let (coordinates, rates) = rates[..2 * n].split_at_mut(n);
        for (i, row) in self.elastic[..2 * n * n].chunks_exact(2 * n).enumerate() {
            let (stiff, damped) = row.split_at(n);
            let matrix = &mut self.lu.matrix()[i * n..(i + 1) * n];
            for (j, (entry, (&stiff, &damped))) in matrix.iter_mut().zip(stiff.iter().zip(damped)).enumerate() {
                rates[i] += stiff * (q_i[j] + v_i[j] * reach - q_e[j]) + damped * (v_i[j] - v_e[j]);
                *entry = -(stiff * reach + damped) * reach;
            }
            matrix[i] = matrix[i] + 1.0;
        }
        self.lu.factorise();
        self.lu.solve(rates);
        for ((coordinate, &rate), &acceleration) in coordinates.iter_mut().zip(v_i).zip(&*rates) {
            *coordinate = rate + acceleration * reach;
        }
    }
}

/// Coordinates and their rates in a split stage.
fn halves<S>(x: &[S], n: usize) -> [&[S]; 2] {
    [&x[..n], &x[n..2 * n]]
}
