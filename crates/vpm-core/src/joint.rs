//! Joints between a body and its parent, one coordinate each.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Twist, Vector3, Wrench};

/// How far the length of an axis may be from 1 before it counts as a mistake instead of rounding.
const AXIS_TOLERANCE: f64 = 1e-3;
/// How far `R R^T` may be from the identity.
const ROTATION_TOLERANCE: f64 = 1e-6;

/// Which lower pair the joint is. Every kind moves along or about one axis: the z axis of its own aligned frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointKind {
    /// Slides along the axis; coordinate in m, effort in N.
    Prismatic,
    /// Turns about the axis; coordinate in rad, effort in N m.
    Revolute,
}

/// A joint: what moves, and where its frame sits in the parent body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Name, unique in the model.
    pub name: String,
    /// Which motion it allows.
    pub kind: JointKind,
    /// Direction of the motion in the joint frame, a unit vector.
    pub axis: [f64; 3],
    /// Origin of the joint frame in the parent's frame, in m.
    pub translation: [f64; 3],
    /// Axes of the joint frame in the parent's frame, row by row.
    pub rotation: [f64; 9],
}

impl JointKind {
    /// Moves `twist` along the joint's z axis by `rate`: V + S rate.
    #[inline]
    pub(crate) fn add_rate<S: Scalar>(self, twist: &mut Twist<S>, rate: S) {
        match self {
            Self::Prismatic => twist.linear.z += rate,
            Self::Revolute => twist.angular.z += rate,
        }
    }

    /// The part of a wrench that the joint's effort has to carry: S . F.
    #[inline]
    pub(crate) fn effort<S: Scalar>(self, wrench: &Wrench<S>) -> S {
        match self {
            Self::Prismatic => wrench.linear.z,
            Self::Revolute => wrench.angular.z,
        }
    }

    /// V x (S rate): the acceleration that a body moving with `V` gives to its joint motion, for an axis along z.
    #[inline]
    pub(crate) fn rate_cross<S: Scalar>(self, v: &Twist<S>, rate: S) -> Twist<S> {
        let turn = |w: Vector3<S>| Vector3::new(w.y * rate, -(w.x * rate), S::zero());
        match self {
            Self::Prismatic => Twist::new(Vector3::zero(), turn(v.angular)),
            Self::Revolute => Twist::new(turn(v.angular), turn(v.linear)),
        }
    }
}

impl Joint {
    /// The joint with an exact unit axis, or what is wrong with its geometry.
    pub fn checked(&self) -> Result<Self> {
        self.check_finite()?;
        let [x, y, z] = self.axis;
        let length = x.hypot(y).hypot(z);
        if (length - 1.0).abs() > AXIS_TOLERANCE {
            return Err(Error::Axis { joint: self.name.clone(), axis: self.axis, length });
        }
        self.check_rotation()?;
        Ok(Self { axis: self.axis.map(|component| component / length), ..self.clone() })
    }

    fn check_finite(&self) -> Result<()> {
        let groups: [(&str, &[f64]); 3] =
            [("axis", &self.axis), ("translation", &self.translation), ("rotation", &self.rotation)];
        for (group, numbers) in groups {
            for (index, &value) in numbers.iter().enumerate() {
                if !value.is_finite() {
                    return Err(Error::NonFinite { path: format!("{}.{group}[{index}]", self.name), value });
                }
            }
        }
        Ok(())
    }

    fn check_rotation(&self) -> Result<()> {
        let rotation = Matrix3::<f64>::from_rows_f64(self.rotation);
        let product = rotation.mul_transpose(rotation) - Matrix3::identity();
        let entries = product.columns.iter().flat_map(|column| column.to_array());
        let defect = entries.fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
        let determinant = rotation.determinant();
        if defect > ROTATION_TOLERANCE || determinant < 0.0 {
            return Err(Error::Rotation { joint: self.name.clone(), defect, determinant });
        }
        Ok(())
    }

    /// The pose of the joint frame in the parent's frame, at coordinate zero.
    pub fn frame<S: Scalar>(&self) -> Pose<S> {
        Pose::new(Matrix3::from_rows_f64(self.rotation), Vector3::from_f64(self.translation))
    }

    /// The pose `X_PB` of the body in its parent's frame at coordinate `q` (m or rad).
    ///
    /// Source: Featherstone 2008, section 4.4. Checked: its derivative along `q` is [`Joint::motion`].
    pub fn pose<S: Scalar>(&self, q: S) -> Pose<S> {
        let axis = Vector3::from_f64(self.axis);
        let moved = match self.kind {
            JointKind::Prismatic => Pose::new(Matrix3::identity(), axis * q),
            JointKind::Revolute => Pose::new(Matrix3::rotation(axis, q), Vector3::zero()),
        };
        self.frame() * moved
    }

    /// The twist of the body relative to its parent per unit rate, in the body's frame (1/s per unit of rate).
    pub fn motion<S: Scalar>(&self) -> Twist<S> {
        let axis = Vector3::from_f64(self.axis);
        match self.kind {
            JointKind::Prismatic => Twist::new(Vector3::zero(), axis),
            JointKind::Revolute => Twist::new(axis, Vector3::zero()),
        }
    }

    /// Axes of a frame in the body's frame whose z axis is the joint axis.
    ///
    /// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited", listing 3. Exact for coordinate axes.
    pub(crate) fn alignment(&self) -> Matrix3<f64> {
        let [x, y, z] = self.axis;
        let sign = 1.0_f64.copysign(z);
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        Matrix3::from_columns(
            Vector3::new(1.0 + sign * x * x * a, sign * b, -sign * x),
            Vector3::new(b, sign + y * y * a, -y),
            Vector3::new(x, y, z),
        )
    }
}
