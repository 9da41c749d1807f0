//! Where something sits, once all rigid connections are followed to the frame that moves.

use crate::spatial::Pose;

/// A place on a moving frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Number of the frame: 0 is the world, k + 1 is body k, then come the stations of the beams.
    pub(crate) frame: usize,
    /// The pose in that frame; for a body in its aligned frame.
    pub(crate) pose: Pose<f64>,
}

impl Place {
    /// Place in the world.
    pub(crate) fn world() -> Self {
        Self { frame: 0, pose: Pose::identity() }
    }

    /// A place beyond this one.
    pub(crate) fn beyond(self, pose: Pose<f64>) -> Self {
        Self { frame: self.frame, pose: self.pose * pose }
    }
}
