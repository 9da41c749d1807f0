//! A number that does not tell how it compares: laws work out both ways and select, as a number does that records its operations.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use vpm_core::Scalar;
use vpm_core::scalar::Search;

/// A plain number whose comparisons are not known before both ways are worked out, and whose value no law may ask for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Both(pub f64);

impl Scalar for Both {
    fn re(&self) -> f64 {
        panic!("something was decided by the value of {self:?}")
    }
    fn inspect(&self) -> f64 {
        self.0
    }
    fn known_less(self, _: Self) -> Option<bool> {
        None
    }
    fn select_less(self, other: Self, yes: Self, no: Self) -> Self {
        if self.0 < other.0 { yes } else { no }
    }
    fn is_finite(self) -> bool {
        self.0.is_finite()
    }
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    fn exp(self) -> Self {
        Self(self.0.exp())
    }
    fn exp_m1(self) -> Self {
        Self(self.0.exp_m1())
    }
    fn ln(self) -> Self {
        Self(self.0.ln())
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = self.0.sin_cos();
        (Self(sine), Self(cosine))
    }
    fn tanh(self) -> Self {
        Self(self.0.tanh())
    }
    fn atan(self) -> Self {
        Self(self.0.atan())
    }
    fn powi(self, exponent: i32) -> Self {
        Self(self.0.powi(exponent))
    }
    fn search(search: &'static Search, arguments: impl Iterator<Item = Self>) -> Self {
        Self(search.value(arguments.map(|argument| argument.0)))
    }
}

impl From<f64> for Both {
    fn from(value: f64) -> Self {
        Self(value)
    }
}

impl Sum for Both {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        Self(numbers.map(|number| number.0).sum())
    }
}

impl Neg for Both {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

macro_rules! operators {
    ($($operator:ident::$method:ident, $assign:ident::$in_place:ident => $symbol:tt),*) => {$(
        impl $operator for Both {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(self.0 $symbol other.0)
            }
        }
        impl $operator<f64> for Both {
            type Output = Self;
            fn $method(self, other: f64) -> Self {
                Self(self.0 $symbol other)
            }
        }
        impl $assign for Both {
            fn $in_place(&mut self, other: Self) {
                self.0 = self.0 $symbol other.0;
            }
        }
    )*};
}

operators!(
    Add::add, AddAssign::add_assign => +,
    Sub::sub, SubAssign::sub_assign => -,
    Mul::mul, MulAssign::mul_assign => *,
    Div::div, DivAssign::div_assign => /
);
