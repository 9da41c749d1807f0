//! Where one frame is in another.

use std::ops::Mul;

use super::{ArticulatedInertia, Matrix3, SpatialInertia, Symmetric3, Twist, Vector3, Wrench};
use crate::scalar::Scalar;

/// The pose `X_AB` of a frame B in a frame A: `p_A = R_AB p_B + t_AB`. Names cancel: `X_WB = X_WA * X_AB`.
///
/// Everything a pose carries from B to A (twist, wrench, inertia) is moved to A's origin and turned into A's axes
/// (Featherstone 2008, section 2.8).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose<S> {
    /// `R_AB`, whose columns are the axes of B in A.
    pub rotation: Matrix3<S>,
    /// `t_AB`, the origin of B in A, in m.
    pub translation: Vector3<S>,
}

impl<S: Scalar> Pose<S> {
    /// Pose from its parts; `rotation` must be orthonormal and right-handed.
    #[inline]
    pub fn new(rotation: Matrix3<S>, translation: Vector3<S>) -> Self {
        Self { rotation, translation }
    }

    /// Identity pose: B on top of A.
    #[inline]
    pub fn identity() -> Self {
        Self::new(Matrix3::identity(), Vector3::zero())
    }

    /// A constant pose.
    #[inline]
    pub fn from_f64(pose: Pose<f64>) -> Self {
        let columns = pose.rotation.columns.map(|column| Vector3::from_f64(column.to_array()));
        Self::new(Matrix3 { columns }, Vector3::from_f64(pose.translation.to_array()))
    }

    /// Inverse pose `X_BA` from `X_AB`.
    #[inline]
    pub fn inverse(self) -> Self {
        Self::new(self.rotation.transpose(), -self.rotation.transpose_mul(self.translation))
    }

    /// Point `p_A` from `p_B` by a pose, in m.
    #[inline]
    pub fn point(&self, p: Vector3<S>) -> Vector3<S> {
        self.rotation * p + self.translation
    }

    /// Twist `V_A` from `V_B` by a pose.
    #[inline]
    pub fn twist(&self, v: Twist<S>) -> Twist<S> {
        let angular = self.rotation * v.angular;
        Twist::new(angular, self.rotation * v.linear + self.translation.cross(angular))
    }

    /// Twist `V_B` from `V_A` by the inverse pose.
    #[inline]
    pub fn inverse_twist(&self, v: Twist<S>) -> Twist<S> {
        let at_b = v.linear - self.translation.cross(v.angular);
        Twist::new(self.rotation.transpose_mul(v.angular), self.rotation.transpose_mul(at_b))
    }

    /// Wrench `F_A` from `F_B` by a pose.
    #[inline]
    pub fn wrench(&self, f: Wrench<S>) -> Wrench<S> {
        let linear = self.rotation * f.linear;
        Wrench::new(self.rotation * f.angular + self.translation.cross(linear), linear)
    }

    /// Wrench `F_B` from `F_A` by the inverse pose.
    #[inline]
    pub fn inverse_wrench(&self, f: Wrench<S>) -> Wrench<S> {
        let at_b = f.angular - self.translation.cross(f.linear);
        Wrench::new(self.rotation.transpose_mul(at_b), self.rotation.transpose_mul(f.linear))
    }

    /// Inertia `M_A` from `M_B` by a pose (Featherstone 2008, section 2.13, in the ten parameters).
    ///
    /// With first moment h turned into A: `I_A = R I_B R^T - [t]x[h]x - [h]x[t]x - m [t]x^2`, `h_A = h + m t`.
    #[inline]
    pub fn inertia(&self, body: SpatialInertia<S>) -> SpatialInertia<S> {
        let turned = self.rotation * body.first_moment;
        let shifted = turned + self.translation * body.mass;
        // -[t]x[h]x - [h]x[t]x - m [t]x^2 is one symmetric product of t with the mean of the two first moments.
        let mean = (turned + shifted) * S::from_f64(0.5);
        SpatialInertia {
            mass: body.mass,
            first_moment: shifted,
            rotational: body.rotational.rotated(self.rotation) + Symmetric3::cross_product(self.translation, mean),
        }
    }

    /// Articulated inertia `M_A` from `M_B` by a pose (Featherstone 2008, section 7.1).
    ///
    /// With J, H, M turned into A: `M_A = M`, `H_A = H + [t]x M`, `J_A = J - H_A [t]x + [t]x H^T`.
    #[inline]
    pub fn articulated_inertia(&self, body: ArticulatedInertia<S>) -> ArticulatedInertia<S> {
        let linear = body.linear.rotated(self.rotation);
        let coupling = (self.rotation * body.coupling).mul_transpose(self.rotation);
        let [x, y, z] = linear.full().columns;
        let t = self.translation;
        let moved = coupling + Matrix3::from_columns(t.cross(x), t.cross(y), t.cross(z));
        let angular = body.angular.rotated(self.rotation) + shift(t, moved, coupling);
        ArticulatedInertia { angular, coupling: moved, linear }
    }
}

/// Symmetric `[t]x H^T - G [t]x` for a pose's shift, where G - H is `[t]x` times a symmetric matrix.
#[inline]
fn shift<S: Scalar>(t: Vector3<S>, g: Matrix3<S>, h: Matrix3<S>) -> Symmetric3<S> {
    // Row i of -G [t]x is t x (row i of G).
    let [gx, gy, gz] = g.transpose().columns;
    let (rx, ry, rz) = (t.cross(gx), t.cross(gy), t.cross(gz));
    // Column j of [t]x H^T is t x (row j of H).
    let [hx, hy, hz] = h.transpose().columns;
    let (cx, cy, cz) = (t.cross(hx), t.cross(hy), t.cross(hz));
    Symmetric3 { xx: rx.x + cx.x, yy: ry.y + cy.y, zz: rz.z + cz.z, xy: rx.y + cy.x, xz: rx.z + cz.x, yz: ry.z + cz.y }
}

impl<S: Scalar> Mul for Pose<S> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self::new(self.rotation * other.rotation, self.point(other.translation))
    }
}
