//! Spatial motion vectors.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use super::{Vector3, Wrench};
use crate::scalar::Scalar;

/// A motion `[angular; linear]`: the velocity of a body (rad/s, m/s), a unit joint motion, or a spatial acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist<S> {
    /// Angular velocity in rad/s.
    pub angular: Vector3<S>,
    /// Velocity in m/s of the body point at the frame origin.
    pub linear: Vector3<S>,
}

impl<S: Scalar> Twist<S> {
    /// Twist from its parts.
    #[inline]
    pub fn new(angular: Vector3<S>, linear: Vector3<S>) -> Self {
        Self { angular, linear }
    }

    /// Zero twist: no motion.
    #[inline]
    pub fn zero() -> Self {
        Self::new(Vector3::zero(), Vector3::zero())
    }

    /// Power in W of a wrench on this twist, both at the same origin and in the same axes.
    #[inline]
    pub fn power(self, wrench: Wrench<S>) -> S {
        self.angular.dot(wrench.angular) + self.linear.dot(wrench.linear)
    }

    /// Cross product of twists `V x U`: rate of a motion `U` fixed in a body that moves with `V`. (Featherstone 2008,
    /// section 2.9.)
    #[inline]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.angular.cross(other.angular),
            self.angular.cross(other.linear) + self.linear.cross(other.angular),
        )
    }

    /// Cross product of twist and wrench `V x* F`: rate of a wrench `F` fixed in a body that moves with `V`.
    /// (Featherstone 2008, section 2.9.)
    #[inline]
    pub fn cross_wrench(self, wrench: Wrench<S>) -> Wrench<S> {
        Wrench::new(
            self.angular.cross(wrench.angular) + self.linear.cross(wrench.linear),
            self.angular.cross(wrench.linear),
        )
    }
}

impl<S: Scalar> Add for Twist<S> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.angular + other.angular, self.linear + other.linear)
    }
}

impl<S: Scalar> Sub for Twist<S> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.angular - other.angular, self.linear - other.linear)
    }
}

impl<S: Scalar> Neg for Twist<S> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.angular, -self.linear)
    }
}

impl<S: Scalar> Mul<S> for Twist<S> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: S) -> Self {
        Self::new(self.angular * factor, self.linear * factor)
    }
}

impl<S: Scalar> AddAssign for Twist<S> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
