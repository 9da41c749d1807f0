//! Mass matrix by the composite rigid body algorithm.

use crate::data::Data;
use crate::joint::JointKind;
use crate::model::Model;
use crate::scalar::Scalar;
use crate::spatial::{SpatialInertia, Vector3, Wrench};

/// CRBA: mass matrix M(q), n x n, column by column (symmetric, so the order does not matter to the reader).
///
/// Law: M_ij = S_i . F with F the wrench on composite body j, at joint i, for a unit acceleration of joint j
/// (Featherstone 2008, table 6.2). Entries of joints on different branches are zero.
/// Checked: positive definite; M a + h = tau against `rnea` and `aba`.
pub fn crba<'d, S: Scalar>(model: &Model<S>, data: &'d mut Data<S>, q: &[S]) -> &'d [S] {
    debug_assert!(q.len() == model.n_joints());
    composites(model, data, q);
    columns(model, data);
    &data.mass_matrix
}

/// CRBA composites: gathers in each slot the inertia of the body and of all it carries.
fn composites<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S]) {
    let slots = &mut data.crba;
    for ((link, &q), slot) in model.links().iter().zip(q).zip(slots.iter_mut().skip(1)) {
        slot.pose = link.pose(q);
        slot.composite = link.inertia;
    }
    for (k, link) in model.links().iter().enumerate().rev() {
        if link.parent != 0 {
            let (before, rest) = slots.split_at_mut(k + 1);
            before[link.parent].composite += rest[0].pose.inertia(rest[0].composite);
        }
    }
}

/// CRBA columns: carries the wrench of each unit acceleration to the root and reads it at every joint.
fn columns<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    let (links, slots, n) = (model.links(), &data.crba, model.n_joints());
    let matrix = &mut data.mass_matrix;
    for (j, link) in links.iter().enumerate() {
        let mut wrench = unit_wrench(link.kind, &slots[j + 1].composite);
        matrix[j * n + j] = link.kind.effort(&wrench) + link.rotor;
        let mut slot = j + 1;
        while links[slot - 1].parent != 0 {
            wrench = slots[slot].pose.wrench(wrench);
            slot = links[slot - 1].parent;
            let entry = links[slot - 1].kind.effort(&wrench);
            matrix[j * n + slot - 1] = entry;
            matrix[(slot - 1) * n + j] = entry;
        }
    }
}

/// M S in the CRBA for a joint axis along z: one column of the 6 x 6 inertia, or a sum of two.
#[inline]
fn unit_wrench<S: Scalar>(kind: JointKind, body: &SpatialInertia<S>) -> Wrench<S> {
    match kind {
        JointKind::Prismatic => sliding(body),
        JointKind::Revolute => turning(body),
        JointKind::Helical { pitch } => turning(body) + sliding(body) * S::from_f64(pitch),
    }
}

#[inline]
fn sliding<S: Scalar>(body: &SpatialInertia<S>) -> Wrench<S> {
    let (h, zero) = (body.first_moment, S::zero());
    Wrench::new(Vector3::new(h.y, -h.x, zero), Vector3::new(zero, zero, body.mass))
}

#[inline]
fn turning<S: Scalar>(body: &SpatialInertia<S>) -> Wrench<S> {
    let (h, inertia) = (body.first_moment, body.rotational);
    Wrench::new(Vector3::new(inertia.xz, inertia.yz, inertia.zz), Vector3::new(-h.y, h.x, S::zero()))
}
