//! Effects that change the tree itself instead of acting on a joint.

use serde::Deserialize;

use crate::beam::{BeamEntry, Component};
use crate::effect::Domain;
use crate::error::Result;
use crate::model::Parts;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Vector3};

/// An effect on what a machine is made of, over the number type `P` as the laws of joints.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum TreeEffect<P> {
    /// Inertia that turns with a joint's own rate, beside what it may have: it adds to that joint's entry of the mass matrix alone.
    RotorInertia {
        /// Number of the joint.
        joint: usize,
        /// As the joint feels it, kg or kg m^2.
        inertia: P,
    },
    /// Gravity that does not point where it should: turned about the first axis, then about the second.
    GravityTilt {
        /// Unit vectors in the world frame.
        axes: [[f64; 3]; 2],
        /// Angle about the first axis, rad.
        first: P,
        /// Angle about the second axis, rad.
        second: P,
    },
    /// Damping per stiffness beside what a beam has.
    StructuralDamping {
        /// Number of the beam.
        beam: usize,
        /// In s.
        time: P,
    },
    /// Bending stiffness of a beam, by what its tip shows, in the place of Young's modulus.
    ///
    /// Law: `E I = stiffness length/3` with I of the section at the root, for its first component of bending: a force F across the tip
    /// deflects a uniform beam by `F length^2/stiffness`, as a rigid one on a torsion spring at its root (Euler-Bernoulli cantilever).
    LinkFlexibility {
        /// Number of the beam.
        beam: usize,
        /// Moment at the root per angle of the line from root to tip, N m/rad.
        stiffness: P,
        /// Damping per stiffness, s.
        time: P,
    },
}

impl<P> TreeEffect<P> {
    /// The same effect over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> TreeEffect<T> {
        match self {
            Self::RotorInertia { joint, inertia } => TreeEffect::RotorInertia { joint: *joint, inertia: f(inertia) },
            Self::GravityTilt { axes, first, second } => {
                TreeEffect::GravityTilt { axes: *axes, first: f(first), second: f(second) }
            }
            Self::StructuralDamping { beam, time } => TreeEffect::StructuralDamping { beam: *beam, time: f(time) },
            Self::LinkFlexibility { beam, stiffness, time } => {
                TreeEffect::LinkFlexibility { beam: *beam, stiffness: f(stiffness), time: f(time) }
            }
        }
    }

    /// Parameters of a tree effect and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        match self {
            Self::RotorInertia { inertia, .. } => vec![(inertia, Domain::NonNegative)],
            Self::GravityTilt { first, second, .. } => vec![(first, Domain::Any), (second, Domain::Any)],
            Self::StructuralDamping { time, .. } => vec![(time, Domain::NonNegative)],
            Self::LinkFlexibility { stiffness, time, .. } => {
                vec![(stiffness, Domain::Positive), (time, Domain::NonNegative)]
            }
        }
    }

    /// The joint or beam at which the effect acts, as its kind and number; none for gravity.
    pub(super) fn site(&self) -> Option<(&'static str, usize)> {
        match self {
            Self::RotorInertia { joint, .. } => Some(("joint", *joint)),
            Self::GravityTilt { .. } => None,
            Self::StructuralDamping { beam, .. } | Self::LinkFlexibility { beam, .. } => Some(("beam", *beam)),
        }
    }
}

impl<S: Scalar> TreeEffect<S> {
    /// Applies a tree effect: changes the parts of a machine. The joint or beam must exist.
    pub(super) fn apply(&self, parts: &mut Parts<S>) -> Result<()> {
        match *self {
            Self::RotorInertia { joint, inertia } => {
                let rotor = &mut parts.bodies[joint].rotor_inertia;
                *rotor = Some(rotor.map_or(inertia, |own| own + inertia));
            }
            Self::GravityTilt { axes: [one, other], first, second } => {
                let turn = |axis, angle| Matrix3::rotation(Vector3::from_f64(axis), angle);
                parts.gravity = (turn(other, second) * (turn(one, first) * Vector3::from(parts.gravity))).to_array();
            }
            Self::StructuralDamping { beam, time } => add_damping(&mut parts.beams[beam], time),
            Self::LinkFlexibility { beam, stiffness, time } => {
                let entry = &mut parts.beams[beam];
                if let (Some(root), Some(material)) = (entry.sections.first(), &mut entry.material) {
                    let properties = root.shape.properties(material.poisson)?;
                    let bends = |component: &&Component| matches!(component, Component::BendingX | Component::BendingY);
                    let about_x = !matches!(entry.deforms.iter().find(bends), Some(Component::BendingY));
                    let moment = if about_x { properties.moment_x } else { properties.moment_y };
                    material.young = stiffness * (entry.length / 3.0) / moment;
                }
                add_damping(entry, time);
            }
        }
        Ok(())
    }
}

fn add_damping<S: Scalar>(beam: &mut BeamEntry<S>, time: S) {
    let own = &mut beam.damping.stiffness;
    *own = Some(own.map_or(time, |own| own + time));
}
