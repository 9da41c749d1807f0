//! A value with `N` directional derivatives, over any scalar (so that duals nest).

use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use super::{Scalar, Search};

/// `value + gradient . (e1 .. eN)` with `ei ej = 0`: a number and its derivatives with respect to `N` variables.
#[derive(Clone, Copy, Debug)]
pub struct Dual<S, const N: usize> {
    /// The number itself.
    pub value: S,
    /// Its derivative with respect to each of the `N` variables.
    pub gradient: [S; N],
}

/// Lifts `values` to dual constants and makes those at `variables` variables: lane `k` for `variables[k]`.
///
/// The caller sees to it that there are at most `N` variables, all of them indices into `values`; others are left out.
pub fn seed<S: Scalar, const N: usize>(values: &[S], variables: &[usize]) -> Vec<Dual<S, N>> {
    debug_assert!(variables.len() <= N);
    let mut lifted: Vec<_> = values.iter().map(|&value| Dual::constant(value)).collect();
    for (lane, &index) in variables.iter().enumerate() {
        if let Some(gradient) = lifted.get_mut(index).and_then(|number| number.gradient.get_mut(lane)) {
            *gradient = S::one();
        }
    }
    lifted
}

impl<S: Scalar, const N: usize> Dual<S, N> {
    /// Dual number that does not depend on the variables.
    #[inline]
    pub fn constant(value: S) -> Self {
        Self { value, gradient: [S::zero(); N] }
    }

    /// Dual variable number `lane` itself, at `value`. A lane of `N` or more gives a constant.
    #[inline]
    pub fn variable(value: S, lane: usize) -> Self {
        let mut number = Self::constant(value);
        if let Some(gradient) = number.gradient.get_mut(lane) {
            *gradient = S::one();
        }
        number
    }

    /// Dual f(x) from its value and slope at x: `f + f' dx`.
    #[inline]
    fn chain(self, value: S, slope: S) -> Self {
        Self { value, gradient: self.gradient.map(|part| part * slope) }
    }

    /// Combines two gradients of dual numbers lane by lane.
    #[inline]
    fn zip(self, other: Self, value: S, combine: impl Fn(S, S) -> S) -> Self {
        let mut gradient = self.gradient;
        for (left, right) in gradient.iter_mut().zip(&other.gradient) {
            *left = combine(*left, *right);
        }
        Self { value, gradient }
    }

    /// Dual product (a b)' = a' b + b' a.
    #[inline]
    fn product(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        self.zip(other, a * b, |left, right| left * b + right * a)
    }

    /// Dual quotient (a/b)' = (a' - (a/b) b') / b, with one division for all lanes.
    #[inline]
    fn quotient(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        let inverse = other.value.recip();
        self.zip(other, quotient, |left, right| (left - quotient * right) * inverse)
    }
}

impl<S: Scalar, const N: usize> Scalar for Dual<S, N> {
    #[inline]
    fn re(&self) -> f64 {
        self.value.re()
    }
    #[inline]
    fn inspect(&self) -> f64 {
        self.value.inspect()
    }
    #[inline]
    fn known_less(self, other: Self) -> Option<bool> {
        self.value.known_less(other.value)
    }
    #[inline]
    fn select_less(self, other: Self, yes: Self, no: Self) -> Self {
        let pick = |yes, no| self.value.select_less(other.value, yes, no);
        yes.zip(no, pick(yes.value, no.value), pick)
    }
    #[inline]
    fn frozen(self) -> Self {
        Self::constant(self.value)
    }
    #[inline]
    fn is_first_order() -> bool {
        S::plain(&[]).is_some()
    }
    #[inline]
    fn is_constant(&self) -> bool {
        self.value.is_constant() && self.gradient.iter().all(|part| part.re() == 0.0 && part.is_constant())
    }
    #[inline]
    fn add_derivatives(&mut self, other: &Self, slope: f64) {
        if let (Some(own), Some(other)) = (S::plain_mut(&mut self.gradient), S::plain(&other.gradient)) {
            own.iter_mut().zip(other).for_each(|(own, other)| *own += slope * other);
        }
    }
    #[inline]
    fn is_finite(self) -> bool {
        self.value.is_finite() && self.gradient.iter().all(|part| part.is_finite())
    }
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, root.recip() * 0.5)
    }
    #[inline]
    fn exp(self) -> Self {
        let power = self.value.exp();
        self.chain(power, power)
    }
    #[inline]
    fn exp_m1(self) -> Self {
        let less_one = self.value.exp_m1();
        self.chain(less_one, less_one + 1.0)
    }
    #[inline]
    fn ln(self) -> Self {
        self.chain(self.value.ln(), self.value.recip())
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = self.value.sin_cos();
        (self.chain(sine, cosine), self.chain(cosine, -sine))
    }
    #[inline]
    fn tanh(self) -> Self {
        let tanh = self.value.tanh();
        self.chain(tanh, S::one() - tanh * tanh)
    }
    #[inline]
    fn atan(self) -> Self {
        self.chain(self.value.atan(), (self.value * self.value + 1.0).recip())
    }
    #[inline]
    fn powi(self, exponent: i32) -> Self {
        if exponent == 0 {
            return Self::one();
        }
        let slope = self.value.powi(exponent - 1) * f64::from(exponent);
        self.chain(self.value.powi(exponent), slope)
    }
    #[inline]
    fn search(search: &'static Search, arguments: impl Iterator<Item = Self>) -> Self {
        Self::constant(S::search(search, arguments.map(|argument| argument.value)))
    }
}

impl<S: Scalar, const N: usize> Default for Dual<S, N> {
    #[inline]
    fn default() -> Self {
        Self::constant(S::zero())
    }
}

impl<S: Scalar, const N: usize> From<f64> for Dual<S, N> {
    #[inline]
    fn from(value: f64) -> Self {
        Self::constant(S::from(value))
    }
}

impl<S: Scalar, const N: usize> PartialEq for Dual<S, N> {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.re() == other.re()
    }
}

impl<S: Scalar, const N: usize> PartialOrd for Dual<S, N> {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.re().partial_cmp(&other.re())
    }
}

impl<S: Scalar, const N: usize> Sum for Dual<S, N> {
    #[inline]
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::zero(), |total, number| total + number)
    }
}

impl<S: Scalar, const N: usize> Neg for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { value: -self.value, gradient: self.gradient.map(|part| -part) }
    }
}

impl<S: Scalar, const N: usize> Add for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.zip(other, self.value + other.value, |left, right| left + right)
    }
}

impl<S: Scalar, const N: usize> Sub for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.zip(other, self.value - other.value, |left, right| left - right)
    }
}

impl<S: Scalar, const N: usize> Mul for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.product(other)
    }
}

impl<S: Scalar, const N: usize> Div for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        self.quotient(other)
    }
}

impl<S: Scalar, const N: usize> Add<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, ..self }
    }
}

impl<S: Scalar, const N: usize> Sub<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn sub(self, other: f64) -> Self {
        Self { value: self.value - other, ..self }
    }
}

impl<S: Scalar, const N: usize> Mul<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, gradient: self.gradient.map(|part| part * factor) }
    }
}

impl<S: Scalar, const N: usize> Div<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn div(self, divisor: f64) -> Self {
        Self { value: self.value / divisor, gradient: self.gradient.map(|part| part / divisor) }
    }
}

macro_rules! assign_from_operator {
    ($($operator:ident :: $method:ident => $symbol:tt),*) => {$(
        impl<S: Scalar, const N: usize> $operator for Dual<S, N> {
            #[inline]
            fn $method(&mut self, other: Self) {
                *self = *self $symbol other;
            }
        }
    )*};
}

assign_from_operator!(
    AddAssign::add_assign => +,
    SubAssign::sub_assign => -,
    MulAssign::mul_assign => *,
    DivAssign::div_assign => /
);
