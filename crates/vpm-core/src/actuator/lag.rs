//! The time an actuator takes to follow its command.

use serde::Deserialize;

use crate::scalar::Scalar;

/// First-order lag of an actuator: current, pressure or valve position that settles exponentially.
///
/// Law: `T dx/dt = w - x`, with T in s and the command w and the state x in the command's unit. For w constant over an interval h
/// the solution is `x(h) = w + (x0 - w) e^(-h/T)`, with the mean `w + (x0 - w) (T/h) (1 - e^(-h/T))`.
/// Source: the linear first-order system, Franklin, Powell & Emami-Naeini 2015, "Feedback Control of Dynamic Systems", section 3.1.
/// Checked: the time constant must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct Lag<P> {
    /// Time constant in s.
    pub time_constant: P,
}

impl<P> Lag<P> {
    /// The same lag over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Lag<T> {
        Lag { time_constant: f(&self.time_constant) }
    }
}

impl<S: Scalar> Lag<S> {
    /// Rate dx/dt of a lag at state `x` under command `w`.
    #[inline]
    pub fn rate(&self, x: S, w: S) -> S {
        (w - x) / self.time_constant
    }

    /// Lag over an interval `time_step` (s) with constant command `w`: state after it, and mean state. It starts from
    /// state `x`.
    #[inline]
    pub fn interval(&self, x: S, w: S, time_step: f64) -> (S, S) {
        let decay_less_one = (-(self.time_constant.recip() * time_step)).exp_m1();
        let gap = x - w;
        (x + gap * decay_less_one, w - gap * self.time_constant * decay_less_one / time_step)
    }
}
