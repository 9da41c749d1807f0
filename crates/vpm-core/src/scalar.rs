//! The number type of all physics: `f64` for values, [`Dual`] for values with exact derivatives, [`Twins`] for two runs at once.
//!
//! Every law is written once, over `S: Scalar`. With `S = f64` it compiles to plain floating point; with
//! `S = Dual<f64, N>` the same source gives the value and `N` directional derivatives, exact to rounding; with
//! `S = Dual<Dual<f64, M>, N>` it gives derivatives of derivatives (an implicit integrator needs the state Jacobian of
//! a system that already carries parameter sensitivities).
//!
//! Source: forward accumulation, Griewank & Walther 2008, "Evaluating Derivatives", chapter 3.
//!
//! Why an own dual number: `num-dual` keeps the gradient behind an `Option` (a branch in every operation, which stops
//! the compiler from using vector instructions), and writes tanh as sinh/cosh, which is inf/inf as soon as a joint runs 710
//! times faster than the transition velocity of its friction law. It serves as the witness in the tests instead.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

pub use crate::scalar::choice::Choice;
pub use crate::scalar::dual::{Dual, seed};
pub use crate::scalar::search::{ARGUMENTS, Search};
pub use crate::scalar::twins::Twins;

mod choice;
mod dual;
mod search;
mod twins;

/// A real number, possibly carrying derivatives.
///
/// Laws choose by [`Scalar::if_less`] and its kin, never by `if` on [`Scalar::re`]: a number may stand for the operation that
/// makes it, and a choice has to hold for every value that comes along. So there is no `<` and no `==` between such numbers.
/// Steps whose number depends on values stand in a [`Search`].
pub trait Scalar:
    Copy
    + Debug
    + Default
    + Send
    + Sync
    + 'static
    + From<f64>
    + Sum
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The value without any derivative. Where it decides what a law computes, ask by [`Scalar::if_less`] instead.
    fn re(&self) -> f64;
    /// Value of a scalar for a check that can only complain: nothing else may depend on it.
    #[inline]
    fn inspect(&self) -> f64 {
        self.re()
    }
    /// Whether a scalar is less than `other`, if that is known already.
    #[inline]
    fn known_less(self, other: Self) -> Option<bool> {
        Some(self.re() < other.re())
    }
    /// Scalar `yes` where the number is less than `other`, else `no`, with their derivatives. Both are worked out:
    /// prefer [`Scalar::if_less`].
    #[inline]
    fn select_less(self, other: Self, yes: Self, no: Self) -> Self {
        if self.re() < other.re() { yes } else { no }
    }
    /// Whether a scalar's value and all derivatives are finite.
    fn is_finite(self) -> bool;
    /// Square root of a scalar; its derivative is infinite at zero.
    fn sqrt(self) -> Self;
    /// Exponential e^x of a scalar.
    fn exp(self) -> Self;
    /// Exponential e^x - 1 of a scalar, accurate near zero.
    fn exp_m1(self) -> Self;
    /// Natural logarithm of a scalar.
    fn ln(self) -> Self;
    /// Sine and cosine of a scalar together (argument in rad).
    fn sin_cos(self) -> (Self, Self);
    /// Hyperbolic tangent of a scalar, finite for every finite argument.
    fn tanh(self) -> Self;
    /// Arc tangent of a scalar in rad.
    fn atan(self) -> Self;
    /// Power x^n of a scalar for an integer exponent.
    fn powi(self, exponent: i32) -> Self;
    /// What a search in plain numbers finds with the values of these arguments: a constant, whatever they carry.
    #[inline]
    fn search(search: &'static Search, arguments: impl Iterator<Item = Self>) -> Self {
        Self::from_f64(search.value(arguments.map(|argument| argument.re())))
    }

    /// Scalar without the derivatives of the outermost kind: what a chord takes for a constant.
    #[inline]
    #[must_use]
    fn frozen(self) -> Self {
        self
    }
    /// Scalars themselves, where they are plain values.
    #[inline]
    fn plain(_numbers: &[Self]) -> Option<&[f64]> {
        None
    }
    /// As [`Scalar::plain`], to be written.
    #[inline]
    fn plain_mut(_numbers: &mut [Self]) -> Option<&mut [f64]> {
        None
    }

    /// Values of scalars that carry no derivative, those of each number together; none for others.
    #[inline]
    fn values(numbers: &[Self]) -> Option<&[f64]> {
        Self::plain(numbers)
    }
    /// As [`Scalar::values`], to be written.
    #[inline]
    fn values_mut(numbers: &mut [Self]) -> Option<&mut [f64]> {
        Self::plain_mut(numbers)
    }

    /// How many runs a scalar belongs to, side by side.
    const LANES: usize = 1;
    /// Scalar of two runs, where there are as many lanes; else that of the first.
    #[inline]
    fn side_by_side(first: f64, _second: f64) -> Self {
        Self::from_f64(first)
    }
    /// Value of a scalar in one of its lanes.
    #[inline]
    fn lane(&self, _lane: usize) -> f64 {
        self.re()
    }
    /// Whether scalars can carry derivatives.
    #[inline]
    fn has_derivatives() -> bool {
        Self::values(&[]).is_none()
    }
    /// Whether the magnitude of a scalar's value is at most this.
    #[inline]
    fn is_within(self, most: f64) -> bool {
        self.re().abs() <= most
    }
    /// Whether scalars are plain values with their first derivatives along some directions.
    #[inline]
    fn is_first_order() -> bool {
        false
    }
    /// Whether a scalar carries no derivative that is not zero.
    #[inline]
    fn is_constant(&self) -> bool {
        true
    }
    /// Adds `slope` times the derivatives of `other` to the scalar's own. Numbers that are not of first order stay as
    /// they are.
    #[inline]
    fn add_derivatives(&mut self, _other: &Self, _slope: f64) {}

    /// Constant scalar: all derivatives zero.
    #[inline]
    fn from_f64(value: f64) -> Self {
        Self::from(value)
    }
    /// Scalar 0.
    #[inline]
    fn zero() -> Self {
        Self::from(0.0)
    }
    /// Scalar 1.
    #[inline]
    fn one() -> Self {
        Self::from(1.0)
    }
    /// Sine of a scalar (argument in rad).
    #[inline]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// Cosine of a scalar (argument in rad).
    #[inline]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    /// Reciprocal 1/x of a scalar.
    #[inline]
    fn recip(self) -> Self {
        Self::one() / self
    }
    /// What `yes` gives where the number is less than `other`, else what `no` gives. A number that is not comparable (NaN)
    /// gives `no`.
    #[inline]
    fn if_less<T: Choice<Self>>(self, other: Self, yes: impl FnOnce() -> T, no: impl FnOnce() -> T) -> T {
        match self.known_less(other) {
            Some(true) => yes(),
            Some(false) => no(),
            None => T::choose(&|yes, no| self.select_less(other, yes, no), yes(), no()),
        }
    }
    /// As [`Scalar::if_less`] against zero.
    #[inline]
    fn if_negative<T: Choice<Self>>(self, yes: impl FnOnce() -> T, no: impl FnOnce() -> T) -> T {
        self.if_less(Self::zero(), yes, no)
    }
    /// What `yes` gives where the number is above zero, else what `no` gives.
    #[inline]
    fn if_positive<T: Choice<Self>>(self, yes: impl FnOnce() -> T, no: impl FnOnce() -> T) -> T {
        Self::zero().if_less(self, yes, no)
    }
    /// Absolute value of a scalar, |x|; at zero the derivative is that of +x.
    #[inline]
    fn abs(self) -> Self {
        self.if_negative(|| -self, || self)
    }
    /// Larger of two scalars, with its derivatives; the first if they are equal.
    #[inline]
    fn max(self, other: Self) -> Self {
        self.if_less(other, || other, || self)
    }
    /// Smaller of two scalars, with its derivatives; the first if they are equal.
    #[inline]
    fn min(self, other: Self) -> Self {
        other.if_less(self, || other, || self)
    }
}

impl Scalar for f64 {
    #[inline]
    fn plain(numbers: &[Self]) -> Option<&[f64]> {
        Some(numbers)
    }
    #[inline]
    fn plain_mut(numbers: &mut [Self]) -> Option<&mut [f64]> {
        Some(numbers)
    }
    #[inline]
    fn re(&self) -> f64 {
        *self
    }
    #[inline]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline]
    fn exp(self) -> Self {
        f64::exp(self)
    }
    #[inline]
    fn exp_m1(self) -> Self {
        f64::exp_m1(self)
    }
    #[inline]
    fn ln(self) -> Self {
        f64::ln(self)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
    #[inline]
    fn tanh(self) -> Self {
        f64::tanh(self)
    }
    #[inline]
    fn atan(self) -> Self {
        f64::atan(self)
    }
    #[inline]
    fn powi(self, exponent: i32) -> Self {
        f64::powi(self, exponent)
    }
    #[inline]
    fn sin(self) -> Self {
        f64::sin(self)
    }
    #[inline]
    fn cos(self) -> Self {
        f64::cos(self)
    }
}
