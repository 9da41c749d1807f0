//! A method of two steps for machines whose stiff forces are linear: one evaluation of the dynamics a step.

use nalgebra::Complex;

use super::split::Split;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// How much of the implicit part stands at the ends of two steps rather than in the middle: what is far too stiff for the step then
/// falls to a third with each, and no other share lets it fall faster.
const SHARE: f64 = 0.125;

/// Second order in fixed steps with one evaluation, A-stable for what a system takes implicitly in [`Ode::additive_rates`], explicit in
/// all else. The mean rates of the step before are all that it remembers.
///
/// Law: `k = F(x + h/2 k', x - h c/2 k' + h (1 + c)/2 k)`, `x+ = x + h k`, with k' the k of the step before, F as in [`Ode::additive_rates`]
/// and c = 1/8: extrapolated to the middle of the step for what is explicit (Adams-Bashforth), for the implicit part the mean
/// `9/16 x+ + 3/8 x + 1/16 x-` (modified Crank-Nicolson). A vibration of `w` that is implicit loses the share `c (w h)^4 / 4` of its amplitude
/// in a step and is slower by the share `(1/12 + c/2) (w h)^2`; that of a spring that is explicit grows by `(1 - c) (w h)^4 / 8`.
/// Where `x` is not where the last step ended, or the step has another length, k' is `F(x, x + h (1 + c)/2 k')`, which keeps the order.
/// Small corrections, as of an observer, are no such jump: each moves the state of both steps.
/// Source: Ascher, Ruuth & Wetton 1995, "Implicit-explicit methods for time-dependent partial differential equations", SIAM J. Numer.
/// Anal. 32(3), section 2.2 (MCNAB). Checked: order 2 against other integrators, the roots of its characteristic polynomial, the energy
/// of a machine without friction, steps far above the explicit limit, jumps of commands.
#[derive(Clone, Debug)]
pub struct CrankNicolson<S> {
    split: Split<S>,
    /// k' of the last step, where that ended, and its length in s; 0 before the first.
    before: Vec<S>,
    end: Vec<S>,
    length: f64,
    rates: Vec<S>,
}

impl<S: Scalar> CrankNicolson<S> {
    /// Buffers of the Crank-Nicolson method for systems of `dim` states.
    pub fn new(dim: usize) -> Self {
        let [before, end, rates] = [0; 3].map(|_| vec![S::zero(); dim]);
        Self { split: Split::new(dim), before, end, length: 0.0, rates }
    }

    /// Moves `x` on by a Crank-Nicolson step (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        let reach = 0.5 * (1.0 + SHARE) * step;
        if !self.goes_on(x, step) {
            self.begin(ode, x, reach);
        }
        let states = self.split.explicit.iter_mut().zip(&mut self.split.implicit);
        for ((explicit, implicit), (&x, &before)) in states.zip(x.iter().zip(&self.before)) {
            *explicit = x + before * (0.5 * step);
            *implicit = x - before * (0.5 * SHARE * step);
        }
        self.split.rates(ode, reach, &mut self.rates);
        x.iter_mut().zip(&self.rates).for_each(|(state, &rate)| *state += rate * step);
        std::mem::swap(&mut self.before, &mut self.rates);
        self.end.copy_from_slice(x);
        self.length = step;
    }

    /// Whether a Crank-Nicolson step goes on where the last one ended, derivatives included.
    fn goes_on(&self, x: &[S], step: f64) -> bool {
        let same = |(&a, &b): (&S, &S)| a.inspect().to_bits() == b.inspect().to_bits() && (a - b).is_constant();
        self.length.to_bits() == step.to_bits() && x.iter().zip(&self.end).all(same)
    }

    /// Begins the Crank-Nicolson method: finds rates in place of a step before.
    #[cold]
    fn begin(&mut self, ode: &mut impl Ode<S>, x: &[S], reach: f64) {
        ode.additive_rates(x, x, 0.0, &mut self.before);
        self.split.explicit.copy_from_slice(x);
        self.split.implicit.copy_from_slice(x);
        self.split.rates(ode, reach, &mut self.before);
    }

    /// Notes for Crank-Nicolson that a step of that length (s) has led from `start` to `x`.
    pub(super) fn follow(&mut self, start: &[S], x: &[S], step: f64) {
        for (before, (&start, &x)) in self.before.iter_mut().zip(start.iter().zip(x)) {
            *before = (x - start) / step;
        }
        self.end.copy_from_slice(x);
        self.length = step;
    }

    /// Notes for Crank-Nicolson that a state counts anew from `value`.
    pub(super) fn recount(&mut self, state: usize, value: S) {
        self.end[state] = value;
    }

    /// Notes for Crank-Nicolson that a small correction has moved the leading states to `x`.
    pub(super) fn correct(&mut self, x: &[S]) {
        self.end[..x.len()].copy_from_slice(x);
    }

    /// Forgets the last Crank-Nicolson step.
    pub(super) fn reset(&mut self) {
        self.length = 0.0;
    }
}

/// Growth of the implicit mode `e^(s t)`, z = h s, in a Crank-Nicolson step. It is the larger root of the
/// characteristic polynomial `(1 - (1 + c)/2 z) r^2 - (1 + (1/2 - c) z) r - c/2 z`.
pub(super) fn growth(z: Complex<f64>) -> Complex<f64> {
    let square = -z * (0.5 * (1.0 + SHARE)) + 1.0;
    let (half, last) = ((z * (0.5 - SHARE) + 1.0) * 0.5, z * (0.5 * SHARE));
    let root = (half * half + square * last).sqrt();
    [half + root, half - root]
        .map(|r| r / square)
        .into_iter()
        .fold(Complex::default(), |most, r| if r.norm() > most.norm() { r } else { most })
}
