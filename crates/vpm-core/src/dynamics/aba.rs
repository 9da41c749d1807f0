//! Forward dynamics by the articulated body algorithm.

use crate::data::{AbaSlot, Data};
use crate::joint::JointKind;
use crate::model::{Link, Model, Products};
use crate::scalar::Scalar;
use crate::spatial::{ArticulatedInertia, Symmetric3, Twist, Vector3, Wrench};

/// A joint counts as moving no inertia below this fraction of the inertia of its body in other directions.
const SINGULAR: f64 = 1e-12;

/// ABA: joint accelerations (m/s^2 or rad/s^2) that efforts `tau` give at `q` and `v`.
///
/// Law: outward V and bias forces, inward the articulated inertia that each joint feels, outward the accelerations
/// (Featherstone 2008, table 7.1). Gravity is an upward acceleration of the world. In a configuration in which a joint
/// moves no inertia the result is not finite. Checked: against `rnea` and `crba`, and textbook pendulums.
pub fn aba<'d, S: Scalar>(model: &Model<S>, data: &'d mut Data<S>, q: &[S], v: &[S], tau: &[S]) -> &'d [S] {
    debug_assert!(q.len() == model.n_joints() && v.len() == model.n_joints() && tau.len() == model.n_joints());
    velocities(model, data, q, v);
    inertias(model, data, tau);
    accelerations(model, data);
    &data.acceleration
}

/// Joint that moves no inertia in the ABA at coordinates `q`, and its articulated inertia; if there is one.
pub(super) fn singular_joint<S: Scalar>(
    model: &Model<S>,
    data: &mut Data<S>,
    q: &[S],
    rest: &[S],
) -> Option<(usize, f64)> {
    velocities(model, data, q, rest);
    inertias(model, data, rest);
    // Outermost first: a singular joint spoils the inertias that the joints before it feel.
    let slots = model.links().iter().zip(data.aba.iter().skip(1)).enumerate().rev();
    slots.into_iter().find_map(|(number, (link, slot))| {
        let inertia = (link.kind.effort(&slot.unit_wrench) + link.rotor).inspect();
        let size = |block: Symmetric3<S>| (block.xx + block.yy + block.zz).inspect();
        let scale = match link.kind {
            JointKind::Prismatic => size(slot.inertia.linear),
            JointKind::Revolute => size(slot.inertia.angular),
            JointKind::Helical { pitch } => size(slot.inertia.angular) + pitch * pitch * size(slot.inertia.linear),
        };
        (inertia.is_nan() || inertia <= SINGULAR * scale).then_some((number, inertia))
    })
}

fn velocities<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) {
    let Data { aba: slots, drifts, .. } = data;
    slots[0].velocity = Twist::zero();
    for (k, ((link, &q), &v)) in model.links().iter().zip(q).zip(v).enumerate() {
        let (before, rest) = slots.split_at_mut(k + 1);
        move_body(&mut rest[0], link, &before[link.parent].velocity, (q, v), (model.products()[k + 1], k + 1, drifts));
    }
}

/// ABA outward over one joint: pose, V, bias acceleration and bias force of the body numbered `frame`. Its carrier
/// moves with `carrier`.
#[inline]
pub(super) fn move_body<S: Scalar>(
    slot: &mut AbaSlot<S>,
    link: &Link<S>,
    carrier: &Twist<S>,
    (q, v): (S, S),
    (products, frame, drifts): (Products, usize, &mut [Twist<S>]),
) {
    slot.pose = link.pose(q);
    slot.inertia = link.inertia.into();
    // All that this algorithm asks of velocities are their products.
    (slot.bias_acceleration, slot.bias_wrench) = (Twist::zero(), Wrench::zero());
    let moves = match products {
        Products::Kept => true,
        Products::Dropped => return,
        Products::Mixed(mixed) => mixed.moves,
    };
    if moves {
        slot.velocity = slot.pose.inverse_twist(*carrier);
        link.kind.add_rate(&mut slot.velocity, v);
        slot.bias_acceleration = link.kind.rate_cross(&slot.velocity, v);
    }
    if let Products::Mixed(mixed) = products {
        slot.bias_acceleration = mixed.step(&slot.pose, slot.bias_acceleration, drifts, (link.parent, frame));
    }
    if products.own() {
        slot.bias_wrench = slot.velocity.cross_wrench(link.inertia.apply(slot.velocity));
    }
}

fn inertias<S: Scalar>(model: &Model<S>, data: &mut Data<S>, tau: &[S]) {
    let slots = &mut data.aba;
    for (k, (link, &tau)) in model.links().iter().zip(tau).enumerate().rev() {
        let (before, rest) = slots.split_at_mut(k + 1);
        let slot = &mut rest[0];
        free_joint(slot, link.kind, link.rotor, tau);
        if link.parent != 0 {
            hand_on(slot, &mut before[link.parent]);
        }
    }
}

/// ABA inward at one joint: U, 1/D with an inertia `rotor`, and u. The rotor feels the joint's acceleration alone.
#[inline]
pub(super) fn free_joint<S: Scalar>(slot: &mut AbaSlot<S>, kind: JointKind, rotor: S, tau: S) {
    slot.unit_wrench = unit_wrench(kind, &slot.inertia);
    slot.inverse = (kind.effort(&slot.unit_wrench) + rotor).recip();
    slot.effort = tau - kind.effort(&slot.bias_wrench);
}

/// ABA from a free joint to its parent: I^a = I^A - U U^T / D, p^a = p^A + I^a c + U u / D.
#[inline]
pub(super) fn hand_on<S: Scalar>(slot: &AbaSlot<S>, parent: &mut AbaSlot<S>) {
    let felt = slot.inertia.deflated(slot.unit_wrench, slot.inverse);
    let bias = slot.bias_wrench + felt.apply(slot.bias_acceleration) + slot.unit_wrench * (slot.effort * slot.inverse);
    parent.inertia += slot.pose.articulated_inertia(felt);
    parent.bias_wrench += slot.pose.wrench(bias);
}

/// ABA to the parent of a free joint: effort `tau` and the wrench on the body, without inertias and rates.
#[inline]
pub(super) fn push_body<S: Scalar>(slot: &mut AbaSlot<S>, kind: JointKind, tau: S) -> Wrench<S> {
    slot.effort = tau - kind.effort(&slot.bias_wrench);
    slot.pose.wrench(slot.bias_wrench + slot.unit_wrench * (slot.effort * slot.inverse))
}

fn accelerations<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    let slots = &mut data.aba;
    slots[0].acceleration = Twist::new(Vector3::zero(), -model.gravity());
    for (k, (link, result)) in model.links().iter().zip(&mut data.acceleration).enumerate() {
        let (before, rest) = slots.split_at_mut(k + 1);
        let drift = rest[0].bias_acceleration;
        *result = accelerate_body(&mut rest[0], link.kind, &before[link.parent].acceleration, drift);
    }
}

/// ABA outward over one joint: its acceleration, and A of its body. Its carrier accelerates with `carrier`, where rates
/// alone add `drift`.
#[inline]
pub(super) fn accelerate_body<S: Scalar>(
    slot: &mut AbaSlot<S>,
    kind: JointKind,
    carrier: &Twist<S>,
    drift: Twist<S>,
) -> S {
    slot.acceleration = slot.pose.inverse_twist(*carrier) + drift;
    let result = (slot.effort - slot.acceleration.power(slot.unit_wrench)) * slot.inverse;
    kind.add_rate(&mut slot.acceleration, result);
    result
}

/// U = I^A S in the ABA for a joint axis along z: one column of the 6 x 6 inertia, or a sum of two.
#[inline]
fn unit_wrench<S: Scalar>(kind: JointKind, inertia: &ArticulatedInertia<S>) -> Wrench<S> {
    match kind {
        JointKind::Prismatic => sliding(inertia),
        JointKind::Revolute => turning(inertia),
        JointKind::Helical { pitch } => screwing(inertia, pitch),
    }
}

/// U of a screw joint in the ABA; out of the way of the other two, which are in almost every machine.
#[cold]
fn screwing<S: Scalar>(inertia: &ArticulatedInertia<S>, pitch: f64) -> Wrench<S> {
    turning(inertia) + sliding(inertia) * S::from_f64(pitch)
}

#[inline]
fn sliding<S: Scalar>(inertia: &ArticulatedInertia<S>) -> Wrench<S> {
    let m = inertia.linear;
    Wrench::new(inertia.coupling.columns[2], Vector3::new(m.xz, m.yz, m.zz))
}

#[inline]
fn turning<S: Scalar>(inertia: &ArticulatedInertia<S>) -> Wrench<S> {
    let [x, y, z] = inertia.coupling.columns;
    let j = inertia.angular;
    Wrench::new(Vector3::new(j.xz, j.yz, j.zz), Vector3::new(x.z, y.z, z.z))
}
