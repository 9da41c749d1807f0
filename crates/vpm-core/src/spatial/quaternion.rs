//! Orientations as unit quaternions.

use super::{Matrix3, Vector3};
use crate::scalar::Scalar;

/// A unit quaternion `(w, v)`, the rotation by `2 atan2(|v|, w)` about v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion<S> {
    /// Cosine of half the angle.
    pub real: S,
    /// Axis times the sine of half the angle.
    pub vector: Vector3<S>,
}

impl<S: Scalar> Quaternion<S> {
    /// Identity quaternion: no rotation.
    #[inline]
    pub fn identity() -> Self {
        Self { real: S::one(), vector: Vector3::zero() }
    }

    /// Quaternion of the rotation `Rx(a) Ry(b) Rz(c)` by three angles (rad).
    pub fn from_angles(angles: [S; 3]) -> Self {
        let [x, y, z] = angles.map(|angle| (angle * 0.5).sin_cos());
        let zero = S::zero();
        let about =
            |(sine, cosine): (S, S), axis: fn(S, S) -> Vector3<S>| Self { real: cosine, vector: axis(sine, zero) };
        let x = about(x, |sine, zero| Vector3::new(sine, zero, zero));
        let y = about(y, |sine, zero| Vector3::new(zero, sine, zero));
        let z = about(z, |sine, zero| Vector3::new(zero, zero, sine));
        x.then(y).then(z)
    }

    /// Quaternion product: this rotation, then the other one in the axes that this one has turned.
    #[inline]
    #[must_use]
    pub fn then(self, other: Self) -> Self {
        let (p, q) = (self.vector, other.vector);
        Self { real: self.real * other.real - p.dot(q), vector: q * self.real + p * other.real + p.cross(q) }
    }

    /// Normalised quaternion, without what rounding has added to the length.
    #[inline]
    #[must_use]
    pub fn normalised(self) -> Self {
        let length = (self.real * self.real + self.vector.dot(self.vector)).sqrt();
        Self { real: self.real / length, vector: self.vector * length.recip() }
    }

    /// Rotation matrix of the quaternion.
    ///
    /// Law: `R = 1 + 2 w [v]x + 2 [v]x^2` (Rodrigues, by half the angle).
    #[inline]
    pub fn rotation(self) -> Matrix3<S> {
        let (w, v) = (self.real, self.vector);
        let column = |unit: Vector3<S>| {
            let across = v.cross(unit);
            unit + (across * w + v.cross(across)) * S::from_f64(2.0)
        };
        let [x, y, z] = Matrix3::identity().columns;
        Matrix3::from_columns(column(x), column(y), column(z))
    }

    /// Four numbers of the quaternion, w first.
    #[inline]
    pub fn to_array(self) -> [S; 4] {
        let [x, y, z] = self.vector.to_array();
        [self.real, x, y, z]
    }
}
