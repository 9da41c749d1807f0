//! Inverse dynamics by the recursive Newton-Euler algorithm.

use crate::data::Data;
use crate::model::{Model, Products};
use crate::scalar::Scalar;
use crate::spatial::{Twist, Vector3};

/// RNEA: joint efforts tau (N or N m) that give accelerations `a` at coordinates `q` and rates `v`.
///
/// Law: outward V_B, A_B and F_B = M_B A_B + V_B x* M_B V_B; inward tau = S . F_B, F_P += F_B
/// (Featherstone 2008, table 5.1). Gravity is an upward acceleration of the world.
/// Checked: against Lagrange's equations and against `aba` and `crba`.
pub fn rnea<'d, S: Scalar>(model: &Model<S>, data: &'d mut Data<S>, q: &[S], v: &[S], a: &[S]) -> &'d [S] {
    debug_assert!(q.len() == model.n_joints() && v.len() == model.n_joints() && a.len() == model.n_joints());
    outward(model, data, q, v, a);
    inward(model, data, a);
    &data.effort
}

fn outward<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S], a: &[S]) {
    let Data { rnea: slots, drifts, .. } = data;
    slots[0].velocity = Twist::zero();
    slots[0].acceleration = Twist::new(Vector3::zero(), -model.gravity());
    for (k, (((link, &q), &v), &a)) in model.links().iter().zip(q).zip(v).zip(a).enumerate() {
        let (before, rest) = slots.split_at_mut(k + 1);
        let (parent, slot) = (&before[link.parent], &mut rest[0]);
        slot.pose = link.pose(q);
        let products = model.products()[k + 1];
        slot.acceleration = slot.pose.inverse_twist(parent.acceleration);
        if products != Products::Dropped {
            slot.velocity = slot.pose.inverse_twist(parent.velocity);
            link.kind.add_rate(&mut slot.velocity, v);
            let across = link.kind.rate_cross(&slot.velocity, v);
            slot.acceleration += match products {
                Products::Mixed(mixed) => mixed.step(&slot.pose, across, drifts, (link.parent, k + 1)),
                Products::Kept | Products::Dropped => across,
            };
        }
        link.kind.add_rate(&mut slot.acceleration, a);
        slot.wrench = link.inertia.apply(slot.acceleration);
        if products.own() {
            slot.wrench += slot.velocity.cross_wrench(link.inertia.apply(slot.velocity));
        }
    }
}

fn inward<S: Scalar>(model: &Model<S>, data: &mut Data<S>, a: &[S]) {
    let slots = &mut data.rnea;
    for (k, ((link, effort), &a)) in model.links().iter().zip(&mut data.effort).zip(a).enumerate().rev() {
        let (before, rest) = slots.split_at_mut(k + 1);
        let slot = &rest[0];
        *effort = link.kind.effort(&slot.wrench) + link.rotor * a;
        if link.parent != 0 {
            before[link.parent].wrench += slot.pose.wrench(slot.wrench);
        }
    }
}
