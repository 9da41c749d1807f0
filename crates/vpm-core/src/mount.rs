//! Where a frame of the machine is fixed.

use serde::{Deserialize, Serialize};

/// What carries a frame: the world, a rigid body, or a section of a flexible beam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mount {
    /// Fixed in the world.
    #[default]
    World,
    /// Fixed to the body of that number.
    Body(usize),
    /// Fixed to a section of a beam, whose z is the tangent of the beam's axis.
    Section {
        /// Number of the beam.
        beam: usize,
        /// Arc length from the root in m.
        at: f64,
    },
}
