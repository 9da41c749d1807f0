//! The six lower pairs.

use super::Screw;

/// Two bodies in contact over a surface: the six lower pairs, and none of the freedoms for a fixed joint.
///
/// In the joint frame, whose z axis is the pair's axis. Source: Table 2.1 of the thesis. Checked: the twists that a
/// pair allows span exactly the displacements and rotations of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LowerPair {
    /// No relative motion.
    Fixed,
    /// Turns about z: (theta3) in rad.
    Revolute,
    /// Slides along z: (d3) in m.
    Prismatic,
    /// Turns about z and slides `pitch` (m/rad) along it: (theta3), with d3 = pitch theta3.
    Helical {
        /// Translation in m per rad.
        pitch: f64,
    },
    /// Slides along and turns about z: (d3, theta3).
    Cylindrical,
    /// Turns about the origin: (theta1, theta2, theta3), in turn about x, the moved y, the moved z.
    ///
    /// These coordinates are singular at theta2 = +-90 deg; the pair is not.
    Spherical,
    /// Slides along x and y and turns about z: (d1, d2, theta3).
    Planar,
}

impl LowerPair {
    /// Number of coordinates of a lower pair.
    pub fn freedoms(self) -> usize {
        self.screws().len()
    }

    /// Unit screws of a lower pair's coordinates in the joint frame, in order; each moves those after it.
    pub fn screws(self) -> Vec<Screw> {
        const X: usize = 0;
        const Y: usize = 1;
        const Z: usize = 2;
        match self {
            Self::Fixed => vec![],
            Self::Revolute => vec![Screw::about(Z, 0.0)],
            Self::Prismatic => vec![Screw::along(Z)],
            Self::Helical { pitch } => vec![Screw::about(Z, pitch)],
            Self::Cylindrical => vec![Screw::along(Z), Screw::about(Z, 0.0)],
            Self::Spherical => vec![Screw::about(X, 0.0), Screw::about(Y, 0.0), Screw::about(Z, 0.0)],
            Self::Planar => vec![Screw::along(X), Screw::along(Y), Screw::about(Z, 0.0)],
        }
    }
}
