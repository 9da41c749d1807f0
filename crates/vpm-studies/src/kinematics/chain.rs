//! Serial chains of lower pairs: where the last body is.

use super::{DenavitHartenberg, LowerPair, Screw};
use vpm_core::scalar::Scalar;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};

/// A chain of bodies from the world to a tool, each carried by the one before through a lower pair.
///
/// Coordinate `k` belongs to screw `k`: a pair of several freedoms has several, in the order of [`LowerPair::screws`].
#[derive(Clone, Debug, PartialEq)]
pub struct SerialChain {
    steps: Vec<Step>,
    tool: Pose<f64>,
}

/// A screw, and the frame it is written in, as seen from the frame that the screw before it moved.
#[derive(Clone, Debug, PartialEq)]
struct Step {
    frame: Pose<f64>,
    screw: Screw,
}

/// How a body moves: its pose, and velocity and acceleration of its origin, all in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<S> {
    /// `X_WB`.
    pub pose: Pose<S>,
    /// Angular velocity (rad/s) and velocity of the origin (m/s).
    pub velocity: Twist<S>,
    /// Angular acceleration (rad/s^2) and acceleration of the origin (m/s^2).
    pub acceleration: Twist<S>,
}

impl SerialChain {
    /// A chain of joints, each by its frame in the body before it and its pair, and the tool's frame in the last body.
    pub fn new(joints: &[(Pose<f64>, LowerPair)], tool: Pose<f64>) -> Self {
        let (mut steps, mut pending) = (Vec::new(), Pose::identity());
        for &(frame, pair) in joints {
            pending = pending * frame;
            for screw in pair.screws() {
                steps.push(Step { frame: pending, screw });
                pending = Pose::identity();
            }
        }
        Self { steps, tool: pending * tool }
    }

    /// A chain by the parameters of Denavit and Hartenberg, the base frame's z axis along the first joint.
    pub fn from_denavit_hartenberg(links: &[DenavitHartenberg]) -> Self {
        let mut frame = Pose::identity();
        let mut joints = Vec::with_capacity(links.len());
        for link in links {
            joints.push((frame, link.pair));
            frame = link.pose();
        }
        Self::new(&joints, frame)
    }

    /// Number of coordinates of a serial chain.
    pub fn n_coordinates(&self) -> usize {
        self.steps.len()
    }

    /// Pose of the tool of a serial chain at coordinates `q` (rad or m). Source: eq 2.17.
    pub fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        debug_assert!(q.len() == self.n_coordinates());
        self.walk(|k| q[k], |_, _, _| ())
    }

    /// Tool pose of a serial chain and, in `frames`, those of the frames that coordinates move. Each is before its own
    /// motion.
    ///
    /// For a chain by Denavit and Hartenberg, frame k is `A_0k` of eq 2.17, since its z axis is that of joint k + 1.
    pub fn frames<S: Scalar>(&self, q: &[S], frames: &mut [Pose<S>]) -> Pose<S> {
        debug_assert!(q.len() == self.n_coordinates() && frames.len() == q.len());
        self.walk(|k| q[k], |k, frame, _| frames[k] = *frame)
    }

    /// Goes along the chain with `coordinate(k)`, shows each frame and its screw, in world axes at the world's origin,
    /// ends at the tool.
    pub(super) fn walk<S: Scalar>(
        &self,
        coordinate: impl Fn(usize) -> S,
        mut visit: impl FnMut(usize, &Pose<S>, Twist<S>),
    ) -> Pose<S> {
        let mut pose = Pose::identity();
        for (k, step) in self.steps.iter().enumerate() {
            pose = pose * constant(&step.frame);
            visit(k, &pose, pose.twist(step.screw.twist()));
            pose = pose * step.screw.displacement(coordinate(k));
        }
        pose * constant(&self.tool)
    }
}

/// Pose in a chain without derivatives, over another number type.
fn constant<S: Scalar>(pose: &Pose<f64>) -> Pose<S> {
    let [x, y, z] = pose.rotation.columns.map(|column| Vector3::from_f64(column.to_array()));
    Pose::new(Matrix3::from_columns(x, y, z), Vector3::from_f64(pose.translation.to_array()))
}
