//! Reaction wrenches: what the joints of a machine carry.

use super::flexible::weigh_frames;
use super::frames::{Stations, bare_lines, frames, poses};
use crate::data::{Data, LineSlot, PointSlot};
use crate::model::{Elastic, Model, Node, Wire};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist, Vector3, Wrench};

/// A motion of all coordinates: positions, rates and accelerations.
pub(crate) type Motion<'a, S> = [&'a [S]; 3];

/// Reactions: wrench on every frame that its inertia and all that it carries need, left in its `wrench`. It is in the
/// frame's own axes and about its origin. Forces that act on them (N, along each line, and wrenches on frames added by
/// `applied`) are taken off.
///
/// Law: `F_B = m A_B + V_B x* m V_B - applied + sum of X_BC F_C` over what B carries (Featherstone 2008, table 5.1, with external forces);
/// the parts of a line are carried by its ends. Checked: against `rnea` along the axes, weights at rest, and the rates of momenta.
pub(crate) fn reactions<S: Scalar>(
    model: &Model<S>,
    data: &mut Data<S>,
    motion: Motion<'_, S>,
    extra: &mut [Twist<S>],
    tensions: &[S],
    applied: impl FnOnce(&mut Data<S>),
) {
    accelerated(model, data, motion, extra);
    poses(model, data);
    bare_lines(model, data);
    weigh_frames(model, &mut data.composite.frames, Stations::Each);
    for (number, wire) in model.lines().iter().enumerate() {
        let tension = tensions.get(number).copied().unwrap_or(S::zero());
        line(wire, number, data, (tension, model.keeps_velocity_terms()));
    }
    applied(data);
    inward(model, data);
}

/// Motion of every frame as by [`frames`], with the accelerations of the coordinates, as reactions need it.
pub(crate) fn accelerated<S: Scalar>(
    model: &Model<S>,
    data: &mut Data<S>,
    [q, v, a]: Motion<'_, S>,
    extra: &mut [Twist<S>],
) {
    frames(model, data, q, v);
    accelerate(model, data, a, extra);
}

/// Takes a wrench that acts on a frame, about its origin and in its axes, off its reaction.
pub(crate) fn take_off<S: Scalar>(data: &mut Data<S>, frame: usize, wrench: Wrench<S>) {
    if frame != 0 {
        let slot = &mut data.composite.frames[frame];
        slot.wrench = slot.wrench - wrench;
    }
}

/// Adds the accelerations of the coordinates to those of all frames, for reactions.
fn accelerate<S: Scalar>(model: &Model<S>, data: &mut Data<S>, a: &[S], extra: &mut [Twist<S>]) {
    let composite = &mut data.composite;
    extra[0] = Twist::zero();
    for node in model.order() {
        match node {
            Node::Body(number, _) => {
                let link = &model.links()[*number];
                let mut own = composite.frames[number + 1].across.inverse_twist(extra[link.parent]);
                link.kind.add_rate(&mut own, a[*number]);
                extra[number + 1] = own;
            }
            Node::Beam(number, _) => {
                let Elastic { beam, root, coordinate, frame, .. } = &model.beams()[*number];
                let Some(first) = *frame else { continue };
                let (len, a) = (beam.len(), &a[*coordinate..]);
                for station in 0..beam.stations() {
                    let columns = &composite.sections[*number].columns[station * len..(station + 1) * len];
                    let carried = composite.frames[first + station].across.inverse_twist(extra[root.frame]);
                    extra[first + station] =
                        columns.iter().zip(a).fold(carried, |sum, (&column, &rate)| sum + column * rate);
                }
            }
        }
    }
    for (slot, &extra) in composite.frames.iter_mut().zip(&*extra).skip(1) {
        slot.acceleration += extra;
    }
}

/// Loads the frames of a line's ends with what its parts need and its force takes, for reactions.
///
/// As in the equations of motion: a part moves with `J = J_end + c J_u`, so that its own end carries it along the line and both do across.
fn line<S: Scalar>(wire: &Wire<S>, number: usize, data: &mut Data<S>, (tension, keeps): (S, bool)) {
    let LineSlot { length, direction: u, from, to, .. } = &data.composite.lines[number];
    let shrink = length.recip();
    let turn = |v: Vector3<S>| (v - *u * u.dot(v)) * shrink;
    let (rate, change) = (to.velocity - from.velocity, to.acceleration - from.acceleration);
    let (stretch, spin) = (u.dot(rate), turn(rate));
    let swing = turn(change);
    let swing = if keeps { swing - spin * (stretch * shrink * 2.0) - *u * spin.dot(spin) } else { swing };
    // What the beginning and the end have to give, in world axes.
    let mut needed = [*u * tension, -(*u * tension)];
    for (part, point, sign, own) in [(&wire.barrel, from, 1.0, 0), (&wire.rod, to, -1.0, 1)] {
        let Some(part) = part else { continue };
        let center = part.center * sign;
        let inertia = (point.acceleration + swing * center) * part.mass;
        let across = turn(inertia * center + swing * part.inertia);
        needed[own] += inertia;
        needed[0] -= across;
        needed[1] += across;
    }
    let places = [from, to].map(|PointSlot { place, .. }| *place);
    for ((end, place), needed) in [&wire.from, &wire.to].into_iter().zip(places).zip(needed) {
        if end.frame == 0 {
            continue;
        }
        let slot = &mut data.composite.frames[end.frame];
        let about_origin = Wrench::new((place - slot.pose.translation).cross(needed), needed);
        slot.wrench += in_axes(&slot.pose, about_origin);
    }
}

/// Wrench of a reaction about the origin of a frame from world axes into its own.
pub(crate) fn in_axes<S: Scalar>(pose: &Pose<S>, wrench: Wrench<S>) -> Wrench<S> {
    Wrench::new(pose.rotation.transpose_mul(wrench.angular), pose.rotation.transpose_mul(wrench.linear))
}

/// Reactions inward: hands on to each frame what it carries.
fn inward<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    let frames = &mut data.composite.frames;
    let mut hand = |parent: usize, own: usize| {
        if parent != 0 {
            let moved = frames[own].across.wrench(frames[own].wrench);
            frames[parent].wrench += moved;
        }
    };
    for node in model.order().iter().rev() {
        match node {
            Node::Body(number, _) => hand(model.links()[*number].parent, number + 1),
            Node::Beam(number, _) => {
                let Elastic { beam, root, frame, .. } = &model.beams()[*number];
                let first = frame.unwrap_or(0);
                (first..first + beam.stations()).for_each(|station| hand(root.frame, station));
            }
        }
    }
}
