//! Steps of controlled error.

use super::rosenbrock::Rosenbrock;
use crate::error::{Error, Result};
use crate::ode::Ode;
use crate::scalar::Scalar;

/// How exact each step has to be.
#[derive(Clone, Debug, PartialEq)]
pub struct StepControl {
    /// Error of a step relative to each state.
    pub relative: f64,
    /// Error of a step that counts as none, for each state in its unit.
    pub absolute: Vec<f64>,
    /// Most steps, accepted and refused, of one [`Adaptive::advance`].
    pub most_steps: usize,
}

/// What one [`Adaptive::advance`] has taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// Steps that were taken.
    pub accepted: usize,
    /// Steps that were too long.
    pub refused: usize,
}

/// The Rosenbrock method of order 4 with steps as long as their error allows.
///
/// Law: the error of a step is the difference e to the embedded solution of order 3; with the weights
/// `w = absolute + relative max(|x|, |x+|)` a step is taken where `E = sqrt(mean (e/w)^2) <= 1`, and the next is
/// `min(max(0.9 E^(-1/4), 1/5), 5)` times as long, not longer after a refused one.
/// Source: Hairer & Wanner 1996, "Solving Ordinary Differential Equations II", sections IV.7 and IV.8, equations 8.19 to 8.21.
/// The work is not bounded by the time but by the number of steps: not for control loops. Checked: tolerances are positive, their
/// number is that of the states; that the end is reached within the steps; the error follows the tolerance.
#[derive(Clone, Debug)]
pub struct Adaptive<S> {
    method: Rosenbrock<S>,
    next: Vec<S>,
    control: StepControl,
    proposed: Option<f64>,
}

impl<S: Scalar> Adaptive<S> {
    /// Buffers for systems of as many states as `control` has absolute tolerances.
    pub fn new(control: StepControl) -> Result<Self> {
        for &value in control.absolute.iter().chain([&control.relative]) {
            if value.is_nan() || value <= 0.0 {
                let (setting, condition) = ("a tolerance of the step control", "be positive".to_owned());
                let repair = "use 1e-6 and a millionth of the size of each state, for example";
                return Err(Error::Setting { setting, condition, value, repair });
            }
        }
        let dim = control.absolute.len();
        Ok(Self { method: Rosenbrock::new(dim), next: vec![S::zero(); dim], control, proposed: None })
    }

    /// Moves `x` on by `duration` (s), from a first step that the last call proposed or, at first, a thousandth of the duration.
    pub fn advance(&mut self, ode: &mut impl Ode<S>, x: &mut [S], duration: f64) -> Result<Steps> {
        if x.len() != self.next.len() {
            let (what, each) = ("the state under step control".to_owned(), "absolute tolerance".to_owned());
            return Err(Error::Dimension { what, expected: self.next.len(), found: x.len(), each });
        }
        let (mut gone, mut steps, mut longest) = (0.0, Steps::default(), 5.0);
        let mut step = self.proposed.unwrap_or(1e-3 * duration);
        while gone < duration {
            if steps.accepted + steps.refused >= self.control.most_steps {
                return Err(Error::Steps { most: self.control.most_steps, reached: gone, duration });
            }
            let left = duration - gone;
            let taken = if step < left { step } else { left };
            let error = self.attempt(ode, x, taken);
            let factor = (0.9 * error.powf(-0.25)).clamp(0.2, longest);
            if error <= 1.0 {
                x.copy_from_slice(&self.next);
                gone = if step < left { gone + taken } else { duration };
                // A step that the end cut short says nothing against the longer one.
                step = if step < left { taken * factor } else { step.max(taken * factor) };
                (steps.accepted, longest) = (steps.accepted + 1, 5.0);
            } else {
                step = taken * if error.is_finite() { factor } else { 0.2 };
                (steps.refused, longest) = (steps.refused + 1, 1.0);
            }
        }
        self.proposed = Some(step);
        Ok(steps)
    }

    /// Computes a step into `next`; its error in tolerances, infinite where the step has no number.
    fn attempt(&mut self, ode: &mut impl Ode<S>, x: &[S], step: f64) -> f64 {
        self.method.attempt(ode, x, step);
        self.next.copy_from_slice(x);
        self.method.accept(&mut self.next);
        let mut sum = 0.0;
        let pairs = x.iter().zip(&self.next).zip(self.method.last_increment()).zip(&self.control.absolute);
        for (((before, after), error), absolute) in pairs {
            let weight = absolute + self.control.relative * before.re().abs().max(after.re().abs());
            sum += (error.re() / weight).powi(2);
        }
        let error = (sum / x.len().max(1) as f64).sqrt();
        if error.is_nan() { f64::INFINITY } else { error.max(1e-12) }
    }
}
