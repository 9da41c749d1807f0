//! Mechanical energy.

use super::kinematics;
use crate::data::Data;
use crate::model::Model;
use crate::scalar::Scalar;

/// Mechanical energy of a state, in J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy<S> {
    /// 1/2 sum V . M V.
    pub kinetic: S,
    /// -sum m g . c, zero with all centres of mass in the world origin.
    pub potential: S,
}

/// Kinetic and potential energy in J at coordinates `q` and rates `v`.
///
/// Checked: Lagrange's equations of these energies give the efforts of `rnea`; free motion conserves their sum.
pub fn energy<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) -> Energy<S> {
    kinematics(model, data, q, v);
    let gravity = model.gravity();
    let mut total = Energy { kinetic: of_rotors(model, v), potential: S::zero() };
    for (frame, slot) in model.frames().iter().zip(data.kinematics.iter().skip(1)) {
        let body = frame.inertia;
        let first_moment_in_world = slot.pose.rotation * body.first_moment + slot.pose.translation * body.mass;
        total.kinetic += body.kinetic_energy(slot.twist);
        total.potential -= gravity.dot(first_moment_in_world);
    }
    total
}

/// Kinetic energy of the drives' rotors, whose speed is the joint's or that of the shaft of a transmission.
pub(super) fn of_rotors<S: Scalar>(model: &Model<S>, v: &[S]) -> S {
    let on_joints: S = model.links().iter().zip(v).map(|(link, &v)| link.rotor * v * v * 0.5).sum();
    let shafts = model.shafts().iter().filter_map(|shaft| shaft.inertia.map(|inertia| (shaft, inertia)));
    let on_shafts = shafts.map(|(shaft, inertia)| {
        let speed: S = shaft.ratios.iter().map(|entry| entry.ratio * v[entry.joint]).sum();
        inertia * speed * speed * 0.5
    });
    on_joints + on_shafts.sum::<S>()
}
