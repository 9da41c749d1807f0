//! Joints between a body and its parent, one coordinate each.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::mount::{check_finite, placed};
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Twist, Vector3, Wrench};

/// How far the length of an axis may be from 1 before it counts as a mistake instead of rounding.
const AXIS_TOLERANCE: f64 = 1e-3;

/// Which lower pair the joint is. Every kind moves along or about one axis: the z axis of its own aligned frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum JointKind {
    /// Slides along the axis; coordinate in m, effort in N.
    Prismatic,
    /// Turns about the axis; coordinate in rad, effort in N m.
    Revolute,
    /// Turns about the axis and moves along it, as a screw in its nut; coordinate in rad, effort in N m.
    Helical {
        /// Advance per angle, m/rad.
        pitch: f64,
    },
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
            Self::Helical { pitch } => {
                twist.angular.z += rate;
                twist.linear.z += rate * pitch;
            }
        }
    }

    /// The part of a wrench that the joint's effort has to carry: S . F.
    #[inline]
    pub(crate) fn effort<S: Scalar>(self, wrench: &Wrench<S>) -> S {
        match self {
            Self::Prismatic => wrench.linear.z,
            Self::Revolute => wrench.angular.z,
            Self::Helical { pitch } => wrench.angular.z + wrench.linear.z * pitch,
        }
    }

    /// V x (S rate): the acceleration that a body moving with `V` gives to its joint motion, for an axis along z.
    #[inline]
    pub(crate) fn rate_cross<S: Scalar>(self, v: &Twist<S>, rate: S) -> Twist<S> {
        let turn = |w: Vector3<S>| Vector3::new(w.y * rate, -(w.x * rate), S::zero());
        match self {
            Self::Prismatic => Twist::new(Vector3::zero(), turn(v.angular)),
            Self::Revolute => Twist::new(turn(v.angular), turn(v.linear)),
            Self::Helical { pitch } => screw_cross(v, rate, pitch),
        }
    }

    /// The part of a twist that belongs to the joint's own coordinate, S per unit rate, for an axis along z.
    #[inline]
    pub(crate) fn unit<S: Scalar>(self) -> Twist<S> {
        let mut unit = Twist::zero();
        self.add_rate(&mut unit, S::one());
        unit
    }
}

/// `V x (S rate)` of a screw along z; out of the way of the other two kinds, which are in almost every machine.
#[cold]
fn screw_cross<S: Scalar>(v: &Twist<S>, rate: S, pitch: f64) -> Twist<S> {
    let turn = |w: Vector3<S>| Vector3::new(w.y * rate, -(w.x * rate), S::zero());
    Twist::new(turn(v.angular), turn(v.linear + v.angular * S::from_f64(pitch)))
}

impl Joint {
    /// The joint with an exact unit axis, or what is wrong with its geometry.
    pub fn checked(&self) -> Result<Self> {
        check_finite(&self.name, "axis", &self.axis)?;
        if let JointKind::Helical { pitch } = self.kind {
            check_finite(&self.name, "pitch", &[pitch])?;
        }
        let [x, y, z] = self.axis;
        let length = x.hypot(y).hypot(z);
        if (length - 1.0).abs() > AXIS_TOLERANCE {
            return Err(Error::Axis { joint: self.name.clone(), axis: self.axis, length });
        }
        placed(&self.name, self.translation, self.rotation)?;
        Ok(Self { axis: self.axis.map(|component| component / length), ..self.clone() })
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
            JointKind::Helical { pitch } => Pose::new(Matrix3::rotation(axis, q), axis * (q * pitch)),
        };
        self.frame() * moved
    }

    /// The twist of the body relative to its parent per unit rate, in the body's frame (1/s per unit of rate).
    pub fn motion<S: Scalar>(&self) -> Twist<S> {
        let axis = Vector3::from_f64(self.axis);
        match self.kind {
            JointKind::Prismatic => Twist::new(Vector3::zero(), axis),
            JointKind::Revolute => Twist::new(axis, Vector3::zero()),
            JointKind::Helical { pitch } => Twist::new(axis, axis * S::from_f64(pitch)),
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
