//! Unit screws: lines with a pitch, about and along which bodies move.

use vpm_core::scalar::Scalar;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};
use vpm_core::{Error, Result};

/// How far the length of a direction may be from 1 before it counts as a mistake instead of rounding.
const UNIT_TOLERANCE: f64 = 1e-9;

/// A unit screw: the line through `point` along `direction`, with a pitch.
///
/// Law: `$ = (s; s_o x s + lambda s)` in `[angular; linear]`, with s_o the position of any point of the line; a
/// prismatic one is `(0; s)`. Source: eqs 2.26 to 2.28. Checked: its displacement, differentiated, is its twist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screw {
    direction: [f64; 3],
    point: [f64; 3],
    pitch: Pitch,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Pitch {
    /// Translation in m per rad.
    Finite(f64),
    /// Translation alone.
    Infinite,
}

impl Screw {
    /// Screw that turns about the line through `point` (m) along the unit vector `direction`; coordinate in rad.
    pub fn revolute(direction: [f64; 3], point: [f64; 3]) -> Result<Self> {
        Self::helical(direction, point, 0.0)
    }

    /// Screw that slides along the unit vector `direction`; coordinate in m.
    pub fn prismatic(direction: [f64; 3]) -> Result<Self> {
        Self { direction, point: [0.0; 3], pitch: Pitch::Infinite }.checked()
    }

    /// Screw that turns about a line and slides `pitch` (m/rad) along it; coordinate in rad.
    pub fn helical(direction: [f64; 3], point: [f64; 3], pitch: f64) -> Result<Self> {
        Self { direction, point, pitch: Pitch::Finite(pitch) }.checked()
    }

    /// Screw about coordinate axis `axis` (0, 1, 2 for x, y, z) through the origin, with a pitch in m/rad.
    pub(crate) fn about(axis: usize, pitch: f64) -> Self {
        Self { direction: coordinate_axis(axis), point: [0.0; 3], pitch: Pitch::Finite(pitch) }
    }

    /// Screw that slides along coordinate axis `axis` (0, 1, 2 for x, y, z).
    pub(crate) fn along(axis: usize) -> Self {
        Self { direction: coordinate_axis(axis), point: [0.0; 3], pitch: Pitch::Infinite }
    }

    fn checked(self) -> Result<Self> {
        let pitch = match self.pitch {
            Pitch::Finite(pitch) => pitch,
            Pitch::Infinite => 0.0,
        };
        for (path, numbers) in [("direction", &self.direction[..]), ("point", &self.point[..]), ("pitch", &[pitch][..])]
        {
            if let Some(&value) = numbers.iter().find(|number| !number.is_finite()) {
                return Err(Error::NonFinite { path: format!("screw.{path}"), value });
            }
        }
        let [x, y, z] = self.direction;
        let length = x.hypot(y).hypot(z);
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            let (setting, repair) = ("the length of a screw's direction", "divide the direction by its length");
            let condition = format!("be 1 within {UNIT_TOLERANCE:e}");
            return Err(Error::Setting { setting, condition, value: length, repair });
        }
        Ok(self)
    }

    /// Twist of a screw per unit rate of its coordinate.
    pub fn twist<S: Scalar>(&self) -> Twist<S> {
        let direction = Vector3::from_f64(self.direction);
        match self.pitch {
            Pitch::Infinite => Twist::new(Vector3::zero(), direction),
            Pitch::Finite(pitch) => {
                let moment = Vector3::from_f64(self.point).cross(direction);
                Twist::new(direction, moment + direction * S::from_f64(pitch))
            }
        }
    }

    /// The displacement by the coordinate `q` (rad, or m for a prismatic screw): the exponential of `$ q`.
    pub fn displacement<S: Scalar>(&self, q: S) -> Pose<S> {
        let direction = Vector3::from_f64(self.direction);
        match self.pitch {
            Pitch::Infinite => Pose::new(Matrix3::identity(), direction * q),
            Pitch::Finite(pitch) => {
                let (rotation, point) = (Matrix3::rotation(direction, q), Vector3::from_f64(self.point));
                Pose::new(rotation, point - rotation * point + direction * (q * pitch))
            }
        }
    }
}

fn coordinate_axis(axis: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 })
}
