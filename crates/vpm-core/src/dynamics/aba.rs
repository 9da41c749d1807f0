//! Forward dynamics by the articulated body algorithm.

use crate::data::Data;
use crate::joint::JointKind;
use crate::model::{Model, Products};
use crate::scalar::Scalar;
use crate::spatial::{ArticulatedInertia, Symmetric3, Twist, Vector3, Wrench};

/// A joint counts as moving no inertia below this fraction of the inertia of its body in other directions.
const SINGULAR: f64 = 1e-12;

/// Joint accelerations (m/s^2 or rad/s^2) that efforts `tau` give at coordinates `q` and rates `v`.
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

/// The joint that moves no inertia, and its articulated inertia, at coordinates `q`; if there is one.
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
        let (parent, slot) = (&before[link.parent], &mut rest[0]);
        slot.pose = link.pose(q);
        slot.inertia = link.inertia.into();
        // All that this algorithm asks of velocities are their products.
        (slot.bias_acceleration, slot.bias_wrench) = (Twist::zero(), Wrench::zero());
        let products = model.products()[k + 1];
        let moves = match products {
            Products::Kept => true,
            Products::Dropped => continue,
            Products::Mixed(mixed) => mixed.moves,
        };
        if moves {
            slot.velocity = slot.pose.inverse_twist(parent.velocity);
            link.kind.add_rate(&mut slot.velocity, v);
            slot.bias_acceleration = link.kind.rate_cross(&slot.velocity, v);
        }
        if let Products::Mixed(mixed) = products {
            slot.bias_acceleration = mixed.step(&slot.pose, slot.bias_acceleration, drifts, (link.parent, k + 1));
        }
        if products.own() {
            slot.bias_wrench = slot.velocity.cross_wrench(link.inertia.apply(slot.velocity));
        }
    }
}

fn inertias<S: Scalar>(model: &Model<S>, data: &mut Data<S>, tau: &[S]) {
    let slots = &mut data.aba;
    for (k, (link, &tau)) in model.links().iter().zip(tau).enumerate().rev() {
        let (before, rest) = slots.split_at_mut(k + 1);
        let slot = &mut rest[0];
        slot.unit_wrench = unit_wrench(link.kind, &slot.inertia);
        slot.inverse = (link.kind.effort(&slot.unit_wrench) + link.rotor).recip();
        slot.effort = tau - link.kind.effort(&slot.bias_wrench);
        if link.parent != 0 {
            // What the parent feels when this joint is free: I^a = I^A - U U^T / D, p^a = p^A + I^a c + U u / D.
            let felt = slot.inertia.deflated(slot.unit_wrench, slot.inverse);
            let bias =
                slot.bias_wrench + felt.apply(slot.bias_acceleration) + slot.unit_wrench * (slot.effort * slot.inverse);
            let parent = &mut before[link.parent];
            parent.inertia += slot.pose.articulated_inertia(felt);
            parent.bias_wrench += slot.pose.wrench(bias);
        }
    }
}

fn accelerations<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    let slots = &mut data.aba;
    slots[0].acceleration = Twist::new(Vector3::zero(), -model.gravity());
    for (k, (link, result)) in model.links().iter().zip(&mut data.acceleration).enumerate() {
        let (before, rest) = slots.split_at_mut(k + 1);
        let (parent, slot) = (&before[link.parent], &mut rest[0]);
        slot.acceleration = slot.pose.inverse_twist(parent.acceleration) + slot.bias_acceleration;
        *result = (slot.effort - slot.acceleration.power(slot.unit_wrench)) * slot.inverse;
        link.kind.add_rate(&mut slot.acceleration, *result);
    }
}

/// U = I^A S for a joint axis along z: one column of the 6 x 6 inertia, or a sum of two.
#[inline]
fn unit_wrench<S: Scalar>(kind: JointKind, inertia: &ArticulatedInertia<S>) -> Wrench<S> {
    match kind {
        JointKind::Prismatic => sliding(inertia),
        JointKind::Revolute => turning(inertia),
        JointKind::Helical { pitch } => screwing(inertia, pitch),
    }
}

/// Out of the way of the other two, which are in almost every machine.
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
