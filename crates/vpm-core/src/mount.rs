//! What a part of a machine is fixed to.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::spatial::{Matrix3, Pose, Vector3};

/// How far `R R^T` may be from the identity.
const ROTATION_TOLERANCE: f64 = 1e-6;

/// What carries a part: the frame that its own place is given in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mount {
    /// The world.
    #[default]
    World,
    /// The frame of the body of that number.
    Body(usize),
    /// The frame of a section of a beam. It has z along the tangent of the axis.
    Section {
        /// Number of the beam.
        beam: usize,
        /// Arc length from the root, m.
        at: f64,
    },
}

/// A frame to watch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Name, unique in the model.
    pub name: String,
    /// What it is fixed to.
    pub on: Mount,
    /// Its origin in the mount's frame, m.
    pub translation: [f64; 3],
    /// Its axes in the mount's frame, row by row.
    pub rotation: [f64; 9],
}

/// A strain gauge along a beam, at one point of a section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gauge {
    /// Name, unique in the model.
    pub name: String,
    /// Number of the beam.
    pub beam: usize,
    /// Arc length from the root, m.
    pub at: f64,
    /// First coordinate of the point in the section, m.
    pub x: f64,
    /// Second coordinate of the point in the section, m.
    pub y: f64,
}

/// The pose of a part in its mount's frame, after a check that the numbers are finite and the rotation is one.
pub(crate) fn placed(name: &str, translation: [f64; 3], rotation: [f64; 9]) -> Result<Pose<f64>> {
    check_finite(name, "translation", &translation)?;
    check_finite(name, "rotation", &rotation)?;
    let matrix = Matrix3::<f64>::from_rows_f64(rotation);
    let product = matrix.mul_transpose(matrix) - Matrix3::identity();
    let entries = product.columns.iter().flat_map(|column| column.to_array());
    let defect = entries.fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
    let determinant = matrix.determinant();
    if defect > ROTATION_TOLERANCE || determinant < 0.0 {
        return Err(Error::Rotation { joint: name.to_owned(), defect, determinant });
    }
    Ok(Pose::new(matrix, Vector3::from_f64(translation)))
}

/// Checks that all numbers of a mount are finite.
pub(crate) fn check_finite(name: &str, group: &str, numbers: &[f64]) -> Result<()> {
    match numbers.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((index, &value)) => Err(Error::NonFinite { path: format!("{name}.{group}[{index}]"), value }),
        None => Ok(()),
    }
}
