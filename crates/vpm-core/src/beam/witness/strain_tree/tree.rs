//! Flexible links in a tree.

use super::beam::StrainBeam;
use crate::error::{Error, Result};
use crate::joint::Joint;
use crate::spatial::{Pose, SpatialInertia};

/// A joint, a rigid hub, a beam on it, and a rigid body at the tip of the beam; any of the four may be missing.
#[derive(Clone, Debug)]
pub struct FlexibleLink {
    /// Number of the link at whose tip this one hangs; none for the world.
    pub parent: Option<usize>,
    /// The joint; without one the link is welded on.
    pub joint: Option<Joint>,
    /// Inertia of the hub in the joint's frame.
    pub hub: SpatialInertia<f64>,
    /// The root of the beam in the joint's frame, and the beam along its z.
    pub beam: Option<(Pose<f64>, StrainBeam)>,
    /// Inertia of the body at the tip, in the frame of the tip's section.
    pub tip: SpatialInertia<f64>,
}

impl FlexibleLink {
    /// Root of a flexible tree: a link of nothing, welded to the world.
    pub fn welded() -> Self {
        Self { parent: None, joint: None, hub: SpatialInertia::zero(), beam: None, tip: SpatialInertia::zero() }
    }
}

/// A tree of flexible links in space. The coordinates of a link are that of its joint, then those of its beam.
#[derive(Clone, Debug)]
pub struct FlexibleTree {
    pub(super) links: Vec<FlexibleLink>,
    /// First coordinate of each link, and the number of all.
    pub(super) offsets: Vec<usize>,
    /// The coordinates that move each link, ascending, its own included.
    pub(super) support: Vec<Vec<usize>>,
    pub(super) gravity: [f64; 3],
    stiffness: Vec<f64>,
    damping: Vec<f64>,
}

impl FlexibleTree {
    /// A tree of `links`, parents first, under `gravity` (m/s^2).
    pub fn new(mut links: Vec<FlexibleLink>, gravity: [f64; 3]) -> Result<Self> {
        if let Some(value) = gravity.into_iter().find(|component| !component.is_finite()) {
            return Err(Error::NonFinite { path: "gravity".to_owned(), value });
        }
        let (mut offsets, mut support) = (vec![0], Vec::<Vec<usize>>::new());
        for (index, link) in links.iter_mut().enumerate() {
            if let Some(joint) = &mut link.joint {
                *joint = joint.checked()?;
            }
            let mut moved = match link.parent {
                None => Vec::new(),
                Some(parent) => match support.get(parent) {
                    Some(before) => before.clone(),
                    None => return Err(Error::Parent { body: format!("link {index}"), index, parent }),
                },
            };
            let own = usize::from(link.joint.is_some()) + link.beam.as_ref().map_or(0, |(_, beam)| beam.len());
            let first = offsets[index];
            moved.extend(first..first + own);
            offsets.push(first + own);
            support.push(moved);
        }
        let n = offsets[links.len()];
        let zero = vec![0.0; n * n];
        let mut tree = Self { links, offsets, support, gravity, stiffness: zero.clone(), damping: zero };
        tree.fill_elasticity();
        Ok(tree)
    }

    fn fill_elasticity(&mut self) {
        let n = self.len();
        for (k, link) in self.links.iter().enumerate() {
            let Some((_, beam)) = &link.beam else { continue };
            let (first, size) = (self.offsets[k + 1] - beam.len(), beam.len());
            for (place, entry) in beam.stiffness().into_iter().enumerate() {
                let at = (first + place / size) * n + first + place % size;
                self.stiffness[at] = entry;
                self.damping[at] = entry * beam.damping();
            }
        }
    }

    /// Number of coordinates of the flexible tree.
    pub fn len(&self) -> usize {
        self.offsets[self.links.len()]
    }

    /// Whether the flexible tree has no coordinates.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Place of the joint coordinate of link `link` in the tree, if it has a joint.
    pub fn joint_coordinate(&self, link: usize) -> Option<usize> {
        self.links.get(link)?.joint.as_ref().map(|_| self.offsets[link])
    }

    /// Elastic stiffness of the flexible tree, row by row.
    pub fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// Kelvin-Voigt damping of the flexible tree, row by row.
    pub fn damping(&self) -> &[f64] {
        &self.damping
    }
}
