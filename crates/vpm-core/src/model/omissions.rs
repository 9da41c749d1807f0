//! Terms of the equations of motion that a machine leaves out, part by part.

use serde::Deserialize;

use super::{Elastic, Link, Node, Wire};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist};

/// Terms that the equations of motion leave out, by the numbers of the parts.
///
/// With `V_k = J_k^T (m A_k + V_k x* m V_k)` what the products of rates of one body need, A_k the acceleration that they alone give it, the
/// velocity terms are the sum of all V_k: each can go by itself. Source: the sum over bodies of virtual work, D'Imperio 2016, section 2.4.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Omissions {
    /// Bodies, with all that is welded to them, that no products of rates load.
    pub velocity_of_bodies: Vec<usize>,
    /// Beams, likewise.
    pub velocity_of_beams: Vec<usize>,
    /// Joints with no entries of the mass matrix between the coordinates inward of them and theirs with those beyond.
    pub coupling: Vec<usize>,
    /// Beams without terms of second order in their deflection.
    pub second_order: Vec<usize>,
}

/// Which products of rates count at a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Products {
    /// All, there and in what it hangs on.
    Kept,
    /// None, neither there nor in anything beyond.
    Dropped,
    /// Anything else.
    Mixed(Mixed),
}

/// A frame at the border between parts with and without products of rates, or on the way to one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mixed {
    /// Whether they count there.
    pub(crate) own: bool,
    /// Whether they count in what it hangs on.
    carrier: bool,
    /// Whether the acceleration by products of rates is asked for there.
    tracked: bool,
    /// Whether velocities are asked for there.
    pub(crate) moves: bool,
}

impl Mixed {
    /// Acceleration step across a joint with omissions, from products of rates over this joint alone. It is at zero
    /// coordinate accelerations.
    ///
    /// Law: with the acceleration by products of rates `D = X^-1 D_P + across`, a frame that counts them has D beside all else, one that
    /// does not has nothing of it; so the step from what it hangs on is `own D - X^-1 (carrier D_P)`. `drifts` holds D of all frames
    /// that are tracked.
    #[inline]
    pub(crate) fn step<S: Scalar>(
        self,
        pose: &Pose<S>,
        across: Twist<S>,
        drifts: &mut [Twist<S>],
        (parent, frame): (usize, usize),
    ) -> Twist<S> {
        let Self { own, carrier, tracked, .. } = self;
        if own == carrier && !tracked {
            return if own { across } else { Twist::zero() };
        }
        let carried = pose.inverse_twist(drifts[parent]);
        if tracked {
            drifts[frame] = carried + across;
        }
        match (own, carrier) {
            (true, true) => across,
            (true, false) => carried + across,
            (false, true) => -carried,
            (false, false) => Twist::zero(),
        }
    }
}

impl Products {
    /// Whether omissions leave the acceleration by products of rates over a joint or along a beam.
    #[inline]
    pub(crate) fn accelerates(self) -> bool {
        match self {
            Self::Kept => true,
            Self::Dropped => false,
            Self::Mixed(Mixed { own, tracked, .. }) => own || tracked,
        }
    }

    /// Whether omissions leave the products of rates at the frame itself.
    #[inline]
    pub(crate) fn own(self) -> bool {
        match self {
            Self::Kept => true,
            Self::Dropped => false,
            Self::Mixed(mixed) => mixed.own,
        }
    }
}

/// The tree as far as it is known when its products are sorted.
pub(super) struct Tree<'a, S> {
    pub(super) links: &'a [Link<S>],
    pub(super) beams: &'a [Elastic<S>],
    pub(super) lines: &'a [Wire<S>],
    pub(super) order: &'a [Node],
    pub(super) n_frames: usize,
}

impl<S: Scalar> Tree<'_, S> {
    /// Frames of each node for omissions, and the frame that it hangs on.
    fn nodes(&self) -> impl DoubleEndedIterator<Item = (std::ops::Range<usize>, usize)> {
        self.order.iter().map(|node| match node {
            Node::Body(number, _) => (number + 1..number + 2, self.links[*number].parent),
            Node::Beam(number, _) => {
                let Elastic { beam, root, frame, .. } = &self.beams[*number];
                let first = frame.unwrap_or(0);
                (first..first + beam.stations(), root.frame)
            }
        })
    }

    /// Products of rates that omissions leave at each frame; those of lines count unless all are left out.
    pub(super) fn products(&self, omissions: &Omissions, all: bool) -> Vec<Products> {
        if all {
            return vec![Products::Dropped; self.n_frames];
        }
        let mut own = vec![true; self.n_frames];
        for &body in &omissions.velocity_of_bodies {
            own[body + 1] = false;
        }
        for &beam in &omissions.velocity_of_beams {
            let Elastic { beam, frame, .. } = &self.beams[beam];
            if let Some(first) = *frame {
                own[first..first + beam.stations()].fill(false);
            }
        }
        // What moves the ends of a line that weighs something is asked for there, however little the frames themselves count.
        let mut tracked = vec![false; self.n_frames];
        for wire in self.lines.iter().filter(|wire| wire.is_massive()) {
            for end in [wire.from.frame, wire.to.frame] {
                tracked[end] |= !own[end];
            }
        }
        let mut moves = tracked.clone();
        let mut products = vec![Products::Kept; self.n_frames];
        for (frames, parent) in self.nodes().rev() {
            for frame in frames {
                // Nothing moves the world, so that it is like whatever hangs on it.
                let carrier = if parent == 0 { own[frame] } else { own[parent] };
                let (tracks, runs) = (tracked[frame], moves[frame] || own[frame]);
                tracked[parent] |= parent != 0 && (tracks || carrier != own[frame]);
                moves[parent] |= parent != 0 && (runs || carrier != own[frame]);
                products[frame] = match (own[frame], carrier) {
                    (true, true) if !tracks => Products::Kept,
                    (false, false) if !runs => Products::Dropped,
                    (own, carrier) => Products::Mixed(Mixed { own, carrier, tracked: tracks, moves: runs }),
                };
            }
        }
        products
    }

    /// Block of the mass matrix, after omissions, that each coordinate is in.
    pub(super) fn blocks(&self, omissions: &Omissions) -> Vec<usize> {
        let coordinates = self.links.len() + self.beams.iter().map(|elastic| elastic.beam.len()).sum::<usize>();
        let (mut of_frames, mut of_coordinates) = (vec![0; self.n_frames], vec![0; coordinates]);
        for (node, (frames, parent)) in self.order.iter().zip(self.nodes()) {
            let own = match node {
                Node::Body(number, _) if omissions.coupling.contains(number) => number + 1,
                _ => of_frames[parent],
            };
            of_frames[frames].fill(own);
            match node {
                Node::Body(number, _) => of_coordinates[*number] = own,
                Node::Beam(number, _) => {
                    let Elastic { beam, coordinate, .. } = &self.beams[*number];
                    of_coordinates[*coordinate..*coordinate + beam.len()].fill(own);
                }
            }
        }
        of_coordinates
    }
}
