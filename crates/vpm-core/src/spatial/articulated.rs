//! Inertia of a body as felt through the joints beyond it.

use std::ops::{Add, AddAssign};

use super::{Matrix3, SpatialInertia, Symmetric3, Twist, Wrench};
use crate::scalar::Scalar;

/// A symmetric 6 x 6 inertia `[J H; H^T M]`: `F = [J w + H v; H^T w + M v]` (Featherstone 2008, section 7.1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArticulatedInertia<S> {
    /// J: moment per angular acceleration, kg m^2.
    pub angular: Symmetric3<S>,
    /// H: moment per linear acceleration, kg m.
    pub coupling: Matrix3<S>,
    /// M: force per linear acceleration, kg. Differs from m 1 because free joints hide part of the mass.
    pub linear: Symmetric3<S>,
}

impl<S: Scalar> ArticulatedInertia<S> {
    /// Force for an acceleration of an articulated inertia.
    #[inline]
    pub fn apply(&self, a: Twist<S>) -> Wrench<S> {
        Wrench::new(
            self.angular * a.angular + self.coupling * a.linear,
            self.linear * a.linear + self.coupling.transpose_mul(a.angular),
        )
    }

    /// Articulated inertia `M - U U^T / d` when the joint that feels `U` per unit acceleration is free.
    #[inline]
    pub fn deflated(self, u: Wrench<S>, inverse: S) -> Self {
        let scaled = u * inverse;
        let (n, f, p, q) = (u.angular, u.linear, scaled.angular, scaled.linear);
        let j = self.angular;
        let m = self.linear;
        let [hx, hy, hz] = self.coupling.columns;
        Self {
            angular: Symmetric3 {
                xx: j.xx - n.x * p.x,
                yy: j.yy - n.y * p.y,
                zz: j.zz - n.z * p.z,
                xy: j.xy - n.x * p.y,
                xz: j.xz - n.x * p.z,
                yz: j.yz - n.y * p.z,
            },
            coupling: Matrix3::from_columns(hx - n * q.x, hy - n * q.y, hz - n * q.z),
            linear: Symmetric3 {
                xx: m.xx - f.x * q.x,
                yy: m.yy - f.y * q.y,
                zz: m.zz - f.z * q.z,
                xy: m.xy - f.x * q.y,
                xz: m.xz - f.x * q.z,
                yz: m.yz - f.y * q.z,
            },
        }
    }
}

impl<S: Scalar> From<SpatialInertia<S>> for ArticulatedInertia<S> {
    #[inline]
    fn from(body: SpatialInertia<S>) -> Self {
        Self {
            angular: body.rotational,
            coupling: Matrix3::skew(body.first_moment),
            linear: Symmetric3::diagonal(body.mass),
        }
    }
}

impl<S: Scalar> Add for ArticulatedInertia<S> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            angular: self.angular + other.angular,
            coupling: self.coupling + other.coupling,
            linear: self.linear + other.linear,
        }
    }
}

impl<S: Scalar> AddAssign for ArticulatedInertia<S> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
