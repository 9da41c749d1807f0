//! Links by the four parameters of Denavit and Hartenberg.

use super::LowerPair;
use vpm_core::spatial::{Matrix3, Pose, Vector3};

/// A link by its four parameters, and the joint before it.
///
/// Law: `A = T(z, theta) T(z, d) T(x, alpha) T(x, a)`, with the joint's coordinate added to theta (revolute) or d
/// (prismatic).
/// Source: eqs 2.14, 2.15 and 2.18; a point transforms as `p_0 = A_0n p_n` (2.16 corrected).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenavitHartenberg {
    /// Angle about the previous z from the old to the new x, in rad.
    pub theta: f64,
    /// Distance along the previous z to the common normal, in m.
    pub d: f64,
    /// Angle about the common normal from the old to the new z, in rad.
    pub alpha: f64,
    /// Length of the common normal, in m.
    pub a: f64,
    /// The pair about or along the previous z axis.
    pub pair: LowerPair,
}

impl DenavitHartenberg {
    /// Pose of a Denavit-Hartenberg link's frame in the previous one at coordinate zero.
    pub fn pose(&self) -> Pose<f64> {
        let about = |axis, angle| Matrix3::rotation(Vector3::from_f64(axis), angle);
        let (z, x) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let twist = Pose::new(about(z, self.theta), Vector3::from_f64([0.0, 0.0, self.d]));
        twist * Pose::new(about(x, self.alpha), Vector3::from_f64([self.a, 0.0, 0.0]))
    }
}
