//! What acts on a machine beside its joints and lines: contacts with planes and bushings between frames; and load cells.

use crate::bushing::{Bushing, BushingWrenches};
use crate::contact::{Contact, ContactFriction, Plane};
use crate::data::{Data, FrameSlot};
use crate::dynamics::{add_wrench, in_axes, take_off};
use crate::error::{ConnectionError, Error, Result};
use crate::model::{Model, Place};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist, Vector3, Wrench};

/// Contacts, bushings and load cells in their places.
#[derive(Clone, Debug)]
pub struct Connections<S> {
    pub(crate) contacts: Vec<PlacedContact<S>>,
    pub(crate) bushings: Vec<PlacedBushing<S>>,
    /// Numbers of the joints whose reactions are read.
    pub(crate) cells: Vec<usize>,
    /// A motion of each frame, for the reactions and the inertial measurement units.
    pub(super) extra: Vec<Twist<S>>,
}

impl<S> Default for Connections<S> {
    fn default() -> Self {
        Self { contacts: Vec::new(), bushings: Vec::new(), cells: Vec::new(), extra: Vec::new() }
    }
}

/// A contact in its place.
#[derive(Clone, Debug)]
pub(crate) struct PlacedContact<S> {
    /// Number of the frame that the point is fixed to.
    pub(crate) frame: usize,
    /// The point in that frame, m.
    pub(crate) point: Vector3<S>,
    pub(crate) plane: Plane<S>,
    pub(crate) law: Contact<S>,
}

/// A bushing in its place.
#[derive(Clone, Debug)]
pub(crate) struct PlacedBushing<S> {
    pub(crate) a: End<S>,
    pub(crate) b: End<S>,
    pub(crate) law: Bushing<S>,
}

/// A frame of a bushing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End<S> {
    /// Number of the frame that it is fixed to.
    pub(crate) frame: usize,
    /// Its pose in that frame.
    pub(crate) pose: Pose<S>,
}

/// Place, velocity and force of a contact's point, in world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch<S> {
    pub(crate) place: Vector3<S>,
    pub(crate) velocity: Vector3<S>,
    pub(crate) force: Vector3<S>,
}

impl<S: Scalar> Connections<S> {
    /// Connections on the attachments of `model`: one for each contact, then two for each bushing.
    pub(crate) fn new(
        model: &Model<S>,
        contacts: Vec<(&str, Plane<S>, Contact<S>)>,
        bushings: Vec<(&str, Bushing<S>)>,
        cells: Vec<usize>,
    ) -> Result<Self> {
        let (points, ends) = model.attachments().split_at(contacts.len());
        let contact = |((name, plane, law), place): ((&str, Plane<S>, Contact<S>), &Place)| {
            if place.frame == 0 {
                return Err(Error::from(ConnectionError::OnWorld { contact: name.to_owned() }));
            }
            let point = Vector3::from_f64(place.pose.translation.to_array());
            Ok(PlacedContact { frame: place.frame, point, plane, law })
        };
        let bushing = |((name, law), ends): ((&str, Bushing<S>), &[Place])| {
            let [a, b] = [0, 1].map(|k| End { frame: ends[k].frame, pose: Pose::from_f64(ends[k].pose) });
            if a.frame == b.frame {
                return Err(Error::from(ConnectionError::OnePiece { bushing: name.to_owned() }));
            }
            Ok(PlacedBushing { a, b, law })
        };
        let contacts = contacts.into_iter().zip(points).map(contact).collect::<Result<_>>()?;
        let bushings = bushings.into_iter().zip(ends.chunks_exact(2)).map(bushing).collect::<Result<_>>()?;
        let extra = vec![Twist::zero(); if cells.is_empty() && model.imus().is_empty() { 0 } else { model.n_frames() }];
        Ok(Self { contacts, bushings, cells, extra })
    }

    /// Whether a machine has no connections: neither contacts nor bushings.
    #[inline]
    pub(crate) fn is_free(&self) -> bool {
        self.contacts.is_empty() && self.bushings.is_empty()
    }

    /// Adds the loads of the connections, contacts and bushings, to `loads` on the coordinates. It follows
    /// [`crate::dynamics::frames`] and the poses. The resistance of friction laws is that of `resistance`.
    pub(crate) fn add_loads(
        &self,
        model: &Model<S>,
        data: &Data<S>,
        resistance: impl Fn(&ContactFriction<S>, S, S) -> S,
        loads: &mut [S],
    ) {
        self.for_each_wrench(data, resistance, |frame, wrench| add_wrench(model, data, frame, wrench, loads));
    }

    /// Hands out the wrench of the connections on each frame, about its origin and in its axes.
    #[inline]
    pub(crate) fn for_each_wrench(
        &self,
        data: &Data<S>,
        resistance: impl Fn(&ContactFriction<S>, S, S) -> S,
        mut visit: impl FnMut(usize, Wrench<S>),
    ) {
        let frames = &data.composite.frames;
        for contact in &self.contacts {
            let slot = &frames[contact.frame];
            if let Some(touch) = contact.touch(slot, &resistance) {
                visit(contact.frame, contact.wrench(slot, &touch));
            }
        }
        for PlacedBushing { a, b, law } in &self.bushings {
            let BushingWrenches { on_a, on_b } = wrenches(frames, (a, b), law);
            for (end, wrench) in [(a, on_a), (b, on_b)] {
                if end.frame != 0 {
                    visit(end.frame, end.pose.wrench(wrench));
                }
            }
        }
    }

    /// Takes the wrenches of connections off those of the frames, for reactions. The resistance of friction laws is
    /// that of `resistance`.
    pub(super) fn take_off(&self, data: &mut Data<S>, resistance: impl Fn(&ContactFriction<S>, S, S) -> S) {
        for contact in &self.contacts {
            let slot = &data.composite.frames[contact.frame];
            let wrench = contact.touch(slot, &resistance).map(|touch| contact.wrench(slot, &touch));
            if let Some(wrench) = wrench {
                take_off(data, contact.frame, wrench);
            }
        }
        for PlacedBushing { a, b, law } in &self.bushings {
            let BushingWrenches { on_a, on_b } = wrenches(&data.composite.frames, (a, b), law);
            for (end, wrench) in [(a, on_a), (b, on_b)] {
                take_off(data, end.frame, end.pose.wrench(wrench));
            }
        }
    }

    /// Potential energy of connections, J, after the poses of the frames.
    pub(crate) fn potential(&self, data: &Data<S>) -> S {
        let frames = &data.composite.frames;
        let contact = |contact: &PlacedContact<S>| {
            let place = frames[contact.frame].pose.point(contact.point);
            contact.law.normal.potential(contact.plane.depth(place))
        };
        let bushing = |bushing: &PlacedBushing<S>| bushing.law.potential(&relative(frames, &bushing.a, &bushing.b).0);
        self.contacts.iter().map(contact).sum::<S>() + self.bushings.iter().map(bushing).sum::<S>()
    }

    /// Observes the contacts among the connections: depth, normal force and force of each.
    pub(crate) fn observe_contacts(&self, data: &Data<S>, outputs: &mut [S]) {
        for (channels, contact) in outputs.chunks_exact_mut(5).zip(&self.contacts) {
            let slot = &data.composite.frames[contact.frame];
            let depth = contact.plane.depth(slot.pose.point(contact.point));
            let force = match contact.touch(slot, ContactFriction::resistance) {
                Some(touch) => touch.force,
                None => Vector3::zero(),
            };
            channels[0] = depth;
            channels[1] = force.dot(contact.plane.normal());
            channels[2..].copy_from_slice(&force.to_array());
        }
    }

    /// Observes the bushings among the connections: the wrench of each on A.
    pub(crate) fn observe_bushings(&self, data: &Data<S>, outputs: &mut [S]) {
        for (channels, PlacedBushing { a, b, law }) in outputs.chunks_exact_mut(6).zip(&self.bushings) {
            let on_a = wrenches(&data.composite.frames, (a, b), law).on_a;
            channels[..3].copy_from_slice(&on_a.angular.to_array());
            channels[3..].copy_from_slice(&on_a.linear.to_array());
        }
    }
}

impl<S: Scalar> PlacedContact<S> {
    /// Touch of a contact: its point, motion and force; none where it is known to be open.
    #[inline]
    pub(crate) fn touch(
        &self,
        slot: &FrameSlot<S>,
        resistance: impl Fn(&ContactFriction<S>, S, S) -> S,
    ) -> Option<Touch<S>> {
        let FrameSlot { pose, velocity, .. } = slot;
        let place = pose.point(self.point);
        if self.plane.depth(place).known_less(S::zero()) == Some(true) {
            return None;
        }
        let velocity = pose.rotation * (velocity.linear + velocity.angular.cross(self.point));
        let force = self.law.force_with(&self.plane, place, velocity, resistance);
        Some(Touch { place, velocity, force })
    }
}

impl<S: Scalar> PlacedContact<S> {
    /// Time, s, in which a contact closes at its present speed; infinite if it is closed or opens.
    pub(crate) fn time_to_close(&self, frames: &[FrameSlot<S>]) -> f64 {
        let FrameSlot { pose, velocity, .. } = &frames[self.frame];
        let depth = self.plane.depth(pose.point(self.point)).inspect();
        let speed = pose.rotation * (velocity.linear + velocity.angular.cross(self.point));
        let closing = -speed.dot(self.plane.normal()).inspect();
        if depth < 0.0 && closing > 0.0 { -depth / closing } else { f64::INFINITY }
    }

    /// Wrench of a contact force on the frame, about its origin and in its axes.
    #[inline]
    fn wrench(&self, slot: &FrameSlot<S>, touch: &Touch<S>) -> Wrench<S> {
        let force = slot.pose.rotation.transpose_mul(touch.force);
        Wrench::new(self.point.cross(force), force)
    }
}

/// Relative pose `X_BA` of a bushing, and motion of A against B at A's origin, in A's axes.
#[inline]
fn relative<S: Scalar>(frames: &[FrameSlot<S>], a: &End<S>, b: &End<S>) -> (Pose<S>, Twist<S>) {
    let in_world = |end: &End<S>| {
        let slot = &frames[end.frame];
        (slot.pose * end.pose, end.pose.inverse_twist(slot.velocity))
    };
    let ((pose_a, motion_a), (pose_b, motion_b)) = (in_world(a), in_world(b));
    let pose = pose_b.inverse() * pose_a;
    (pose, motion_a - pose.inverse_twist(motion_b))
}

#[inline]
fn wrenches<S: Scalar>(frames: &[FrameSlot<S>], (a, b): (&End<S>, &End<S>), law: &Bushing<S>) -> BushingWrenches<S> {
    let (pose, motion) = relative(frames, a, b);
    law.wrenches(&pose, motion)
}

/// Wrench of a connection in joint-aligned axes, transformed into the axes of the body.
pub(super) fn into_body<S: Scalar>(model: &Model<S>, joint: usize, wrench: Wrench<S>) -> Wrench<S> {
    let alignment = model.frames()[joint].joint.alignment();
    in_axes(&Pose::from_f64(Pose::new(alignment.transpose(), Vector3::zero())), wrench)
}
