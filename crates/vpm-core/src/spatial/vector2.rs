//! Two numbers along the axes of one plane frame.

use std::ops::{Add, Mul, Neg, Sub};

use crate::scalar::Scalar;

/// A vector in a plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector2<S> {
    /// Along the first axis.
    pub x: S,
    /// Along the second axis.
    pub y: S,
}

impl<S: Scalar> Vector2<S> {
    /// Plane vector from its components.
    #[inline]
    pub fn new(x: S, y: S) -> Self {
        Self { x, y }
    }

    /// The zero vector.
    #[inline]
    pub fn zero() -> Self {
        Self::new(S::zero(), S::zero())
    }

    /// Plane vector from two constants.
    #[inline]
    pub fn from_f64([x, y]: [f64; 2]) -> Self {
        Self::new(S::from_f64(x), S::from_f64(y))
    }

    /// Components of the plane vector as an array.
    #[inline]
    pub fn to_array(self) -> [S; 2] {
        [self.x, self.y]
    }

    /// Scalar product of two plane vectors.
    #[inline]
    pub fn dot(self, other: Self) -> S {
        self.x * other.x + self.y * other.y
    }

    /// Cross product of two plane vectors: its component normal to the plane.
    #[inline]
    pub fn cross(self, other: Self) -> S {
        self.x * other.y - self.y * other.x
    }

    /// Plane vector turned by +90 deg: the velocity of a point per unit angular velocity.
    #[inline]
    pub fn perpendicular(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// Plane vector turned by the angle with this sine and cosine.
    #[inline]
    pub fn rotated(self, (sine, cosine): (S, S)) -> Self {
        Self::new(cosine * self.x - sine * self.y, sine * self.x + cosine * self.y)
    }

    /// Its length; the derivative of a zero vector's length is infinite.
    #[inline]
    pub fn length(self) -> S {
        self.dot(self).sqrt()
    }
}

impl Vector2<f64> {
    /// Angle of the plane vector from the first axis in rad.
    pub fn argument(self) -> f64 {
        self.y.atan2(self.x)
    }
}

impl<S: Scalar> Add for Vector2<S> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl<S: Scalar> Sub for Vector2<S> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl<S: Scalar> Neg for Vector2<S> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y)
    }
}

impl<S: Scalar> Mul<S> for Vector2<S> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: S) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}
