//! Forward dynamics of trees of joints and beams with a cost linear in their number of parts: no mass matrix.
//!
//! The articulated-body algorithm with the segments of beams for joints of several coordinates. A segment is felt at its begin as an
//! articulated inertia with *pending* coordinates: those that act in the segment before it too, as the strain at a node of two elements
//! does, wait there until all that they act in lies behind; all others are eliminated in their segment, like a joint in its body.

mod segment;

use super::aba::{accelerate_body, free_joint, hand_on, move_body, push_body};
use crate::data::{AbaSlot, Data, SegmentSlot};
use crate::model::{Elastic, Model, Node};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist, Vector3, Wrench};
use segment::{accelerate, attach, begin, eliminate, load, release, share};

/// How far into a step stiffness and damping are taken implicitly.
#[derive(Clone, Copy, Debug)]
pub struct Shift<'a, S> {
    /// Time g in s: the coordinates change by g times the rates, the rates by g times the accelerations asked for.
    pub reach: S,
    /// Damping of each joint besides, N m s/rad or N s/m; with none given, none.
    pub resistances: &'a [S],
}

/// Articulated forward dynamics: accelerations of all coordinates under efforts `tau`, `M a + bias = tau`. `tau` holds
/// what springs and dampers do at coordinates `q` and rates `v`, those of the beams included.
///
/// Law: articulated bodies (Featherstone 2008, table 7.1) with several coordinates per joint (section 7.2, there for joints alone); between
/// neighbouring segments block elimination from the tip inward. Checked: against the mass matrix of composite bodies, for all levels;
/// free motion conserves energy.
pub fn articulated<'d, S: Scalar>(model: &Model<S>, data: &'d mut Data<S>, q: &[S], v: &[S], tau: &[S]) -> &'d [S] {
    sweep(model, data, (q, v), tau, None)
}

/// As [`articulated`], but the accelerations of an implicit step: `(M + g (D + R) + g^2 K) a + bias = tau`, in the same sweep.
///
/// K and D are stiffness and damping of the beams, R the diagonal of the resistances. With `tau` less `K (q + g v) + D v` this is one stage
/// of a method that takes elasticity and those resistances implicitly over the time g.
pub fn shifted<'d, S: Scalar>(
    model: &Model<S>,
    data: &'d mut Data<S>,
    (q, v): (&[S], &[S]),
    tau: &[S],
    shift: Shift<'_, S>,
) -> &'d [S] {
    sweep(model, data, (q, v), tau, Some(shift))
}

/// Accelerations per unit of the efforts `tau`, at the state and with the inertias of the last [`articulated`] or [`shifted`].
///
/// Law: the recursion is linear in the efforts, so the inertias that it left serve again, without velocities and gravity (Featherstone 2008,
/// section 7.3). Costs a part of a recursion. Checked: against the mass matrix of composite bodies, for all levels.
pub fn response<'d, S: Scalar>(model: &Model<S>, data: &'d mut Data<S>, tau: &[S]) -> &'d [S] {
    debug_assert!(model.is_segmented() && tau.len() == model.n_coordinates());
    push(model, data, tau);
    accelerations(model, data, Twist::zero(), false);
    &data.acceleration
}

fn sweep<'d, S: Scalar>(
    model: &Model<S>,
    data: &'d mut Data<S>,
    (q, v): (&[S], &[S]),
    tau: &[S],
    shift: Option<Shift<'_, S>>,
) -> &'d [S] {
    let n = model.n_coordinates();
    debug_assert!(model.is_segmented() && q.len() == n && v.len() == n && tau.len() == n);
    outward(model, data, q, v);
    inward(model, data, tau, shift);
    accelerations(model, data, Twist::new(Vector3::zero(), -model.gravity()), true);
    &data.acceleration
}

/// Articulated tree outward: velocities and what they need, and each segment's own inertia.
fn outward<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) {
    let Data { aba: frames, segments, drifts, .. } = data;
    for node in model.order() {
        match node {
            Node::Body(number, _) => {
                let link = &model.links()[*number];
                let (frame, carrier) = (number + 1, frames[link.parent].velocity);
                let products = (model.products()[frame], frame, &mut drifts[..]);
                move_body(&mut frames[frame], link, &carrier, (q[*number], v[*number]), products);
            }
            Node::Beam(number, _) => {
                let elastic = &model.beams()[*number];
                let own = elastic.coordinate..elastic.coordinate + elastic.beam.len();
                let carrier = frames[elastic.root.frame].velocity;
                let stations = &mut frames[elastic.frame.unwrap_or(0)..];
                let keeps = model.keeps_velocity_terms();
                along(elastic, &mut segments[*number], stations, (&q[own.clone()], &v[own]), (carrier, keeps));
            }
        }
    }
}

/// Articulated tree outward along a beam, whose stations are the first of `stations`.
fn along<S: Scalar>(
    elastic: &Elastic<S>,
    slots: &mut [SegmentSlot<S>],
    stations: &mut [AbaSlot<S>],
    (q, v): (&[S], &[S]),
    (carrier, keeps): (Twist<S>, bool),
) {
    let mut velocity = Pose::from_f64(elastic.root.pose).inverse_twist(carrier);
    for (number, (segment, slot)) in elastic.beam.segments().iter().zip(slots).enumerate() {
        for (place, &coordinate) in segment.coordinates.iter().enumerate() {
            (slot.coordinates[place], slot.rates[place]) = (q[coordinate], v[coordinate]);
        }
        slot.velocity = velocity;
        let own = segment.stations.clone();
        let heavy = (&elastic.inertias[own.clone()], elastic.segment_slices.get(number));
        velocity = begin(segment, slot, &mut stations[own], heavy, keeps);
    }
}

/// Articulated inertias, eliminating coordinates from the tips to the root.
fn inward<S: Scalar>(model: &Model<S>, data: &mut Data<S>, tau: &[S], shift: Option<Shift<'_, S>>) {
    let Data { aba: frames, segments, .. } = data;
    for node in model.order().iter().rev() {
        match node {
            Node::Body(number, _) => {
                let link = &model.links()[*number];
                let damped = shift.and_then(|shift| Some(*shift.resistances.get(*number)? * shift.reach));
                let rotor = damped.map_or(link.rotor, |damped| link.rotor + damped);
                free_joint(&mut frames[number + 1], link.kind, rotor, tau[*number]);
                if let (true, Ok([slot, carrier])) =
                    (link.parent != 0, frames.get_disjoint_mut([number + 1, link.parent]))
                {
                    hand_on(slot, carrier);
                }
            }
            Node::Beam(number, _) => {
                let (elastic, slots) = (&model.beams()[*number], &mut segments[*number]);
                gather(model, elastic, slots, frames, (tau, shift.map(|shift| shift.reach)));
                if elastic.root.frame != 0 {
                    let (root, carrier) = (Pose::from_f64(elastic.root.pose), &mut frames[elastic.root.frame]);
                    carrier.inertia += root.articulated_inertia(slots[0].inertia);
                    carrier.bias_wrench += root.wrench(slots[0].wrench);
                }
            }
        }
    }
}

/// Articulated tree inward along a beam.
fn gather<S: Scalar>(
    model: &Model<S>,
    elastic: &Elastic<S>,
    slots: &mut [SegmentSlot<S>],
    frames: &[AbaSlot<S>],
    (tau, reach): (&[S], Option<S>),
) {
    let tau = &tau[elastic.coordinate..];
    let segments = elastic.beam.segments();
    for (number, segment) in segments.iter().enumerate().rev() {
        let (before, after) = slots.split_at_mut(number + 1);
        let slot = &mut before[number];
        for (section, station) in segment.stations.clone().enumerate() {
            let frame = elastic.frame.unwrap_or(0) + station;
            if model.is_carrier(frame) {
                let AbaSlot { inertia, bias_wrench, bias_acceleration, .. } = &frames[frame];
                attach(slot, section, (inertia, *bias_wrench), *bias_acceleration);
            }
        }
        if let (Some(next), Some(beyond)) = (after.first(), segments.get(number + 1)) {
            let (end, drift) = (slot.sections.at.len() - 1, slot.drift);
            attach(slot, end, (&next.inertia, next.wrench), drift);
            share(slot, next, beyond.shared);
        }
        eliminate(&elastic.beam, segment, slot, tau, reach);
    }
}

/// The wrenches that efforts cause, from the tips to the root, with the articulated inertias as they are.
fn push<S: Scalar>(model: &Model<S>, data: &mut Data<S>, tau: &[S]) {
    let Data { aba: frames, segments, .. } = data;
    frames.iter_mut().for_each(|frame| frame.bias_wrench = Wrench::zero());
    for node in model.order().iter().rev() {
        let (carrier, wrench) = match node {
            Node::Body(number, _) => {
                let link = &model.links()[*number];
                (link.parent, push_body(&mut frames[number + 1], link.kind, tau[*number]))
            }
            Node::Beam(number, _) => {
                let (elastic, slots) = (&model.beams()[*number], &mut segments[*number]);
                push_along(model, elastic, slots, frames, &tau[elastic.coordinate..]);
                (elastic.root.frame, Pose::from_f64(elastic.root.pose).wrench(slots[0].wrench))
            }
        };
        frames[carrier].bias_wrench += wrench;
    }
}

/// Articulated tree inward along a beam for other efforts.
fn push_along<S: Scalar>(
    model: &Model<S>,
    elastic: &Elastic<S>,
    slots: &mut [SegmentSlot<S>],
    frames: &[AbaSlot<S>],
    tau: &[S],
) {
    let segments = elastic.beam.segments();
    for (number, segment) in segments.iter().enumerate().rev() {
        let (before, after) = slots.split_at_mut(number + 1);
        let slot = &mut before[number];
        slot.wrench = Wrench::zero();
        slot.efforts.fill(S::zero());
        for (section, station) in segment.stations.clone().enumerate() {
            let frame = elastic.frame.unwrap_or(0) + station;
            if model.is_carrier(frame) {
                load(slot, section, frames[frame].bias_wrench);
            }
        }
        if let (Some(next), Some(beyond)) = (after.first(), segments.get(number + 1)) {
            load(slot, slot.sections.at.len() - 1, next.wrench);
            let first = slot.efforts.len() - beyond.shared;
            slot.efforts[first..].iter_mut().zip(&next.efforts).for_each(|(own, &pending)| *own += pending);
        }
        release(segment, slot, tau);
    }
}

/// Articulated tree outward: accelerations from a `world` that has its own to the tips. Those by rates alone come where
/// asked for.
fn accelerations<S: Scalar>(model: &Model<S>, data: &mut Data<S>, world: Twist<S>, keeps: bool) {
    let Data { aba: frames, segments, acceleration: result, .. } = data;
    let of_rates = |drift: Twist<S>| if keeps { drift } else { Twist::zero() };
    frames[0].acceleration = world;
    for node in model.order() {
        match node {
            Node::Body(number, _) => {
                let link = &model.links()[*number];
                let (carrier, slot) = (frames[link.parent].acceleration, &mut frames[number + 1]);
                let drift = of_rates(slot.bias_acceleration);
                result[*number] = accelerate_body(slot, link.kind, &carrier, drift);
            }
            Node::Beam(number, _) => {
                let elastic = &model.beams()[*number];
                let carrier = frames[elastic.root.frame].acceleration;
                let mut base = Pose::from_f64(elastic.root.pose).inverse_twist(carrier);
                let slots = &mut segments[*number];
                for (number, segment) in elastic.beam.segments().iter().enumerate() {
                    let (before, rest) = slots.split_at_mut(number);
                    let slot = &mut rest[0];
                    slot.acceleration = base;
                    accelerate(segment, slot, before.last(), &mut result[elastic.coordinate..]);
                    for (section, station) in segment.stations.clone().enumerate() {
                        let frame = elastic.frame.unwrap_or(0) + station;
                        if model.is_carrier(frame) {
                            let drift = of_rates(frames[frame].bias_acceleration);
                            frames[frame].acceleration = slot.section(section, drift);
                        }
                    }
                    base = slot.section(slot.sections.at.len() - 1, of_rates(slot.drift));
                }
            }
        }
    }
}
