//! Where the bodies are and how they move.

use crate::data::{Data, KinematicsSlot};
use crate::model::Model;
use crate::scalar::Scalar;

/// Kinematics: poses `X_WB` and twists `V_WB` of all bodies, read with [`Data::pose`] and [`Data::twist`].
///
/// Law: X_WB = X_WP X_PB(q), V_B = X_PB^-1 V_P + S v (Featherstone 2008, section 5.3). Works in the frames of the
/// description, not in the aligned frames of the recursions, so that energies from here are an independent witness.
pub fn kinematics<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) {
    debug_assert!(q.len() == model.n_joints() && v.len() == model.n_joints());
    let slots = &mut data.kinematics;
    for (k, ((frame, &q), &v)) in model.frames().iter().zip(q).zip(v).enumerate() {
        let parent = slots[frame.parent];
        let across = frame.joint.pose(q);
        let twist = across.inverse_twist(parent.twist) + frame.joint.motion() * v;
        slots[k + 1] = KinematicsSlot { pose: parent.pose * across, twist };
    }
}
