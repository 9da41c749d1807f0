//! About which axes the parts of a machine can turn.

use super::{Elastic, Link, Node};
use crate::joint::JointKind;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Vector3};

/// Sine of the angle up to which two axes are one: rounding, which the sum of a machine's own rotations has too.
const PARALLEL: f64 = 1e-14;

/// How a frame can turn in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Turning {
    Not,
    /// About this axis of the frame alone.
    About(Vector3<f64>),
    Anyhow,
}

impl Turning {
    /// Turning axes seen in axes with that rotation.
    fn seen(self, rotation: Matrix3<f64>) -> Self {
        match self {
            Self::About(axis) => Self::About(rotation.transpose_mul(axis)),
            other => other,
        }
    }

    /// Of a frame that turns about `axis` in one which turns like this.
    fn with(self, axis: Vector3<f64>) -> Self {
        match self {
            Self::Not => Self::About(axis),
            Self::About(own) if is_parallel(own, axis) => self,
            _ => Self::Anyhow,
        }
    }
}

fn is_parallel(a: Vector3<f64>, b: Vector3<f64>) -> bool {
    let off = a.cross(b);
    off.dot(off) <= PARALLEL * PARALLEL
}

/// For each beam whether its root may turn about other axes than the one about which it bends.
pub(super) fn turning_in_space<S: Scalar>(
    order: &[Node],
    links: &[Link<S>],
    beams: &[Elastic<S>],
    frames: usize,
) -> Vec<bool> {
    let (mut turnings, mut spatial) = (vec![Turning::Not; frames], vec![true; beams.len()]);
    for node in order {
        match node {
            Node::Body(number, _) => {
                let Link { parent, kind, rotation, .. } = &links[*number];
                let carried = turnings[*parent].seen(*rotation);
                turnings[number + 1] = match kind {
                    JointKind::Prismatic => carried,
                    _ => carried.with(Vector3::new(0.0, 0.0, 1.0)),
                };
            }
            Node::Beam(number, _) => {
                let Elastic { beam, root, frame, .. } = &beams[*number];
                let carried = turnings[root.frame].seen(root.pose.rotation);
                let turning = beam.bending_axis().map_or(Turning::Anyhow, |axis| carried.with(axis));
                spatial[*number] = turning == Turning::Anyhow;
                let first = frame.unwrap_or(0);
                turnings[first..first + beam.stations()].fill(turning);
            }
        }
    }
    spatial
}
