//! Two plain numbers that go through the same operations.
#![allow(unsafe_code)]

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use super::{Scalar, Search};

/// Two numbers side by side, as the lanes of a vector: two runs of one machine in the time of one.
///
/// Each lane is bitwise what it would be alone. Where a choice has to be one for both, it is that of the first.
#[derive(Clone, Copy, Debug, Default)]
#[repr(transparent)]
pub struct Twins([f64; 2]);

impl Twins {
    #[inline]
    fn each(self, function: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(function))
    }

    #[inline]
    fn with(self, other: Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        let ([a, b], [c, d]) = (self.0, other.0);
        Self([combine(a, c), combine(b, d)])
    }
}

impl Scalar for Twins {
    const LANES: usize = 2;
    #[inline]
    fn side_by_side(first: f64, second: f64) -> Self {
        Self([first, second])
    }
    #[inline]
    fn lane(&self, lane: usize) -> f64 {
        self.0[lane]
    }
    #[inline]
    fn re(&self) -> f64 {
        self.0[0]
    }
    #[inline]
    fn values(numbers: &[Self]) -> Option<&[f64]> {
        // SAFETY: a number is two `f64` and nothing else (`repr(transparent)` on an array), so that twice as many of these stand in
        // the same memory, which the result borrows as the argument does.
        Some(unsafe { std::slice::from_raw_parts(numbers.as_ptr().cast(), 2 * numbers.len()) })
    }
    #[inline]
    fn values_mut(numbers: &mut [Self]) -> Option<&mut [f64]> {
        // SAFETY: as above; the borrow is as exclusive as that of the argument, and any two `f64` are a number.
        Some(unsafe { std::slice::from_raw_parts_mut(numbers.as_mut_ptr().cast(), 2 * numbers.len()) })
    }
    #[inline]
    fn known_less(self, other: Self) -> Option<bool> {
        let ([a, b], [c, d]) = (self.0, other.0);
        let less = a < c;
        (less == (b < d)).then_some(less)
    }
    #[inline]
    fn select_less(self, other: Self, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|lane| if self.0[lane] < other.0[lane] { yes.0[lane] } else { no.0[lane] }))
    }
    #[inline]
    fn is_constant(&self) -> bool {
        self.0[0].to_bits() == self.0[1].to_bits()
    }
    #[inline]
    fn is_within(self, most: f64) -> bool {
        self.0.iter().all(|value| value.abs() <= most)
    }
    #[inline]
    fn is_finite(self) -> bool {
        self.0.iter().all(|value| value.is_finite())
    }
    #[inline]
    fn sqrt(self) -> Self {
        self.each(f64::sqrt)
    }
    #[inline]
    fn exp(self) -> Self {
        self.each(f64::exp)
    }
    #[inline]
    fn exp_m1(self) -> Self {
        self.each(f64::exp_m1)
    }
    #[inline]
    fn ln(self) -> Self {
        self.each(f64::ln)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let [(sine, cosine), (other_sine, other_cosine)] = self.0.map(f64::sin_cos);
        (Self([sine, other_sine]), Self([cosine, other_cosine]))
    }
    #[inline]
    fn tanh(self) -> Self {
        self.each(f64::tanh)
    }
    #[inline]
    fn atan(self) -> Self {
        self.each(f64::atan)
    }
    #[inline]
    fn powi(self, exponent: i32) -> Self {
        self.each(|value| value.powi(exponent))
    }
    fn search(search: &'static Search, arguments: impl Iterator<Item = Self>) -> Self {
        let arguments: Vec<Self> = arguments.collect();
        Self(std::array::from_fn(|lane| search.value(arguments.iter().map(|argument| argument.0[lane]))))
    }
}

impl From<f64> for Twins {
    #[inline]
    fn from(value: f64) -> Self {
        Self([value; 2])
    }
}

impl Sum for Twins {
    #[inline]
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::default(), |total, number| total + number)
    }
}

impl Neg for Twins {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.each(|value| -value)
    }
}

macro_rules! operator {
    ($($operator:ident :: $method:ident, $assign:ident :: $assigned:ident => $symbol:tt),*) => {$(
        impl $operator for Twins {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                self.with(other, |a, b| a $symbol b)
            }
        }
        impl $operator<f64> for Twins {
            type Output = Self;
            #[inline]
            fn $method(self, other: f64) -> Self {
                self.each(|value| value $symbol other)
            }
        }
        impl $assign for Twins {
            #[inline]
            fn $assigned(&mut self, other: Self) {
                *self = *self $symbol other;
            }
        }
    )*};
}

operator!(
    Add::add, AddAssign::add_assign => +,
    Sub::sub, SubAssign::sub_assign => -,
    Mul::mul, MulAssign::mul_assign => *,
    Div::div, DivAssign::div_assign => /
);
