//! What closes a loop of a machine: two frames that stay together as in a joint.

use serde::Deserialize;

use crate::bushing::BushingEnd;
use crate::mount::Marker;

/// The joint that two frames stay together in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Closure {
    /// The origins coincide.
    Spherical,
    /// The origins coincide, and so do the z axes of the joint.
    Revolute,
    /// The frames coincide.
    Rigid,
}

/// A closed loop of a machine: frames A and B, each fixed to something, and the joint between them.
///
/// Law: `p_B - p_A = 0` in world axes, then `a_A . b_B = 0` for pairs of unit axes, one of A and one of B. Source: primitive
/// constraints, Haug 1989, "Computer Aided Kinematics and Dynamics of Mechanical Systems", sections 9.4.1 and 9.4.2.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopEntry {
    /// Name, unique in the model.
    pub name: String,
    /// The joint.
    pub joint: Closure,
    /// Frame A.
    pub a: BushingEnd,
    /// Frame B.
    pub b: BushingEnd,
    /// Axes of the joint in A and in B, row by row.
    #[serde(default = "upright")]
    pub axes: [f64; 9],
}

fn upright() -> [f64; 9] {
    [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
}

impl Closure {
    /// Axes in a closure, one of A and one of B, that stay perpendicular.
    pub fn perpendicular(self) -> &'static [(usize, usize)] {
        match self {
            Self::Spherical => &[],
            Self::Revolute => &[(2, 0), (2, 1)],
            Self::Rigid => &[(2, 0), (2, 1), (0, 1)],
        }
    }

    /// Number of a closure's equations.
    pub fn equations(self) -> usize {
        3 + self.perpendicular().len()
    }
}

impl LoopEntry {
    /// Frames of a closure, A first, as frames to keep track of.
    pub fn markers(&self) -> [Marker; 2] {
        [("a", self.a), ("b", self.b)].map(|(end, frame)| {
            let BushingEnd { on, translation, rotation } = frame;
            Marker { name: format!("{}.{end}", self.name), on, translation, rotation }
        })
    }
}
