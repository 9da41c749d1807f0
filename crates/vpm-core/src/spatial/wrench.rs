//! Spatial force vectors.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use super::Vector3;
use crate::scalar::Scalar;

/// A force `[angular; linear]`: a moment about the frame origin (N m) and a force (N), or a momentum (N m s, N s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench<S> {
    /// Moment about the frame origin in N m.
    pub angular: Vector3<S>,
    /// Force in N.
    pub linear: Vector3<S>,
}

impl<S: Scalar> Wrench<S> {
    /// Wrench from its parts.
    #[inline]
    pub fn new(angular: Vector3<S>, linear: Vector3<S>) -> Self {
        Self { angular, linear }
    }

    /// Zero wrench: no force.
    #[inline]
    pub fn zero() -> Self {
        Self::new(Vector3::zero(), Vector3::zero())
    }
}

impl<S: Scalar> Add for Wrench<S> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.angular + other.angular, self.linear + other.linear)
    }
}

impl<S: Scalar> Sub for Wrench<S> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.angular - other.angular, self.linear - other.linear)
    }
}

impl<S: Scalar> Neg for Wrench<S> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.angular, -self.linear)
    }
}

impl<S: Scalar> Mul<S> for Wrench<S> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: S) -> Self {
        Self::new(self.angular * factor, self.linear * factor)
    }
}

impl<S: Scalar> AddAssign for Wrench<S> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
