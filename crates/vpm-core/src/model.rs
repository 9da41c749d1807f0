//! The immutable description of a rigid tree, in numbers.

use crate::body::{Body, PointMass, check_physical};
use crate::error::{Error, Result};
use crate::joint::{Joint, JointKind};
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, SpatialInertia, Vector3};

/// A tree of rigid bodies. Joint `k` carries body `k`; every parent comes before its children.
///
/// The recursive algorithms work in *aligned* frames: body frames turned once, at build, so that z is the joint
/// axis. A joint motion is then one component of a 6-vector instead of a product with six.
#[derive(Clone, Debug)]
pub struct Model<S> {
    gravity: [f64; 3],
    links: Vec<Link<S>>,
    frames: Vec<BodyFrame<S>>,
}

/// What the recursions need of one body, in aligned frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link<S> {
    /// Slot of the parent: 0 is the world, k + 1 is body k.
    pub(crate) parent: usize,
    pub(crate) kind: JointKind,
    /// Pose in the parent's aligned frame at coordinate zero.
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    pub(crate) inertia: SpatialInertia<S>,
}

/// What a user sees of one body: its own frame, as described.
#[derive(Clone, Debug)]
pub(crate) struct BodyFrame<S> {
    pub(crate) name: String,
    pub(crate) parent: Option<usize>,
    pub(crate) joint: Joint,
    pub(crate) inertia: SpatialInertia<S>,
}

impl<S: Scalar> Model<S> {
    /// Builds the tree from its bodies, parents first, with point masses (payloads) on them and `gravity` in m/s^2 in
    /// the world frame.
    ///
    /// A point mass may be negative (a correction to a mass taken too large) as long as what the body then has is
    /// physical.
    pub fn new(gravity: [f64; 3], bodies: &[Body<S>], point_masses: &[PointMass<S>]) -> Result<Self> {
        check_gravity(gravity)?;
        let mut inertias = bodies.iter().map(own_inertia).collect::<Result<Vec<_>>>()?;
        attach(&mut inertias, bodies, point_masses)?;
        let mut model = Self { gravity, links: Vec::new(), frames: Vec::new() };
        for (body, inertia) in bodies.iter().zip(inertias) {
            model.push(body, inertia)?;
        }
        Ok(model)
    }

    fn push(&mut self, body: &Body<S>, inertia: SpatialInertia<S>) -> Result<()> {
        let joint = body.joint.checked()?;
        let parent_alignment = match body.parent {
            None => Matrix3::identity(),
            Some(parent) => match self.frames.get(parent) {
                Some(frame) => frame.joint.alignment(),
                None => {
                    let index = self.frames.len();
                    return Err(Error::Parent { body: body.name.clone(), index, parent });
                }
            },
        };
        self.links.push(Link::new(&joint, body.parent, parent_alignment, inertia));
        self.frames.push(BodyFrame { name: body.name.clone(), parent: body.parent, joint, inertia });
        Ok(())
    }

    /// Number of joints, bodies and coordinates.
    #[inline]
    pub fn n_joints(&self) -> usize {
        self.links.len()
    }

    /// Gravity in m/s^2, in the world frame.
    #[inline]
    pub fn gravity(&self) -> [f64; 3] {
        self.gravity
    }

    /// Name of body `k`, if there is one.
    pub fn body_name(&self, k: usize) -> Option<&str> {
        self.frames.get(k).map(|frame| frame.name.as_str())
    }

    /// Joint `k`, if there is one.
    pub fn joint(&self, k: usize) -> Option<&Joint> {
        self.frames.get(k).map(|frame| &frame.joint)
    }

    /// Spatial inertia of body `k` with its point masses, in the body's frame, if there is one.
    pub fn inertia(&self, k: usize) -> Option<SpatialInertia<S>> {
        self.frames.get(k).map(|frame| frame.inertia)
    }

    /// The links, parents first.
    #[inline]
    pub(crate) fn links(&self) -> &[Link<S>] {
        &self.links
    }

    /// The bodies in their own frames, parents first.
    #[inline]
    pub(crate) fn frames(&self) -> &[BodyFrame<S>] {
        &self.frames
    }
}

impl<S: Scalar> Link<S> {
    fn new(joint: &Joint, parent: Option<usize>, parent_alignment: Matrix3<f64>, inertia: SpatialInertia<S>) -> Self {
        let alignment = joint.alignment();
        let frame: Pose<f64> = joint.frame();
        let to_aligned = Pose::new(lift(alignment).transpose(), Vector3::zero());
        Self {
            parent: parent.map_or(0, |index| index + 1),
            kind: joint.kind,
            rotation: parent_alignment.transpose() * frame.rotation * alignment,
            translation: parent_alignment.transpose_mul(frame.translation),
            inertia: to_aligned.inertia(inertia),
        }
    }

    /// The pose `X_PB` of the body in its parent at coordinate `q`, both in aligned frames.
    #[inline]
    pub(crate) fn pose(&self, q: S) -> Pose<S> {
        let [x, y, z] = self.rotation.columns;
        match self.kind {
            JointKind::Prismatic => {
                Pose::new(lift(self.rotation), Vector3::from_f64(self.translation.to_array()) + scaled(z, q))
            }
            JointKind::Revolute => {
                let (sine, cosine) = q.sin_cos();
                let rotation = Matrix3::from_columns(
                    scaled(x, cosine) + scaled(y, sine),
                    scaled(y, cosine) - scaled(x, sine),
                    Vector3::from_f64(z.to_array()),
                );
                Pose::new(rotation, Vector3::from_f64(self.translation.to_array()))
            }
        }
    }
}

/// A constant vector times a number: cheaper than a product of two numbers that carry derivatives.
#[inline]
fn scaled<S: Scalar>(v: Vector3<f64>, factor: S) -> Vector3<S> {
    Vector3::new(factor * v.x, factor * v.y, factor * v.z)
}

#[inline]
fn lift<S: Scalar>(matrix: Matrix3<f64>) -> Matrix3<S> {
    Matrix3 { columns: matrix.columns.map(|column| Vector3::from_f64(column.to_array())) }
}

fn check_gravity(gravity: [f64; 3]) -> Result<()> {
    for (axis, value) in ["x", "y", "z"].into_iter().zip(gravity) {
        if !value.is_finite() {
            return Err(Error::NonFinite { path: format!("gravity.{axis}"), value });
        }
    }
    Ok(())
}

fn own_inertia<S: Scalar>(body: &Body<S>) -> Result<SpatialInertia<S>> {
    body.check()?;
    Ok(body.spatial_inertia())
}

/// Adds the point masses and checks that what each body then has is physical.
fn attach<S: Scalar>(
    inertias: &mut [SpatialInertia<S>],
    bodies: &[Body<S>],
    point_masses: &[PointMass<S>],
) -> Result<()> {
    for (payload, point) in point_masses.iter().enumerate() {
        let Some((inertia, body)) = inertias.get_mut(point.body).zip(bodies.get(point.body)) else {
            return Err(Error::PayloadBody { payload, body: point.body, bodies: bodies.len() });
        };
        check_point_mass(&body.name, point)?;
        *inertia += SpatialInertia::point_mass(point.mass, Vector3::from(point.position));
    }
    let loaded = |k: &usize| point_masses.iter().any(|point| point.body == *k);
    for (k, (inertia, body)) in inertias.iter().zip(bodies).enumerate() {
        if loaded(&k) {
            let total = inertia.value();
            let [xx, yy, zz, ..] = total.rotational.to_array();
            check_physical(&body.name, total.mass, total.central(), 1e-12 * (xx + yy + zz))?;
        }
    }
    Ok(())
}

fn check_point_mass<S: Scalar>(body: &str, point: &PointMass<S>) -> Result<()> {
    let [x, y, z] = point.position;
    for (parameter, number) in [("mass", point.mass), ("x", x), ("y", y), ("z", z)] {
        if !number.is_finite() {
            return Err(Error::NonFinite { path: format!("{body}.payload.{parameter}"), value: number.re() });
        }
    }
    Ok(())
}
