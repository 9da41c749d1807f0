//! Slices of beams that bend in one plane, all at once: what they are to the root of their beam and to its coordinates.
//!
//! Axes: across, the axis of bending, along, with the beam's root for origin. In them a slice at r has the acceleration
//! `a + A x r + w x (w x r) + 2 w x dr/dt + d^2r/dt^2`, with A the angular acceleration of the root and w its angular velocity. All terms
//! but the last two are those of a rigid body with the slices where they are. Its inertia goes to what carries the beam before that is
//! weighed. Source: Shabana 2013, "Dynamics of Multibody Systems", sections 5.3 to 5.5 (inertia and quadratic velocity vector of a
//! floating frame). Checked: against the sum station by station, Lagrange's equations, and articulated bodies.

use super::flexible::entry;
use crate::beam::{Slices, Sums};
use crate::data::{Composite, FrameSlot};
use crate::model::Elastic;
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist, Vector3, Wrench};

/// Turning rate of the root of a beam with slices about the axis of bending. It follows from the velocity of what
/// carries it.
pub(super) fn turn<S: Scalar>(slices: &Slices<S>, velocity: Twist<S>) -> S {
    velocity.angular.dot(Vector3::from_f64(slices.frame.rotation.columns[1].to_array()))
}

/// Adds the slices to the inertia of what carries their beam.
pub(super) fn hand_on<S: Scalar>(slices: &Slices<S>, sums: &Sums<S>, carrier: &mut FrameSlot<S>) {
    carrier.inertia += Pose::from_f64(slices.frame).inertia(slices.inertia(sums));
}

/// Adds what the slices of a beam do to its coordinates, and what of their wrench on its root is not that of a rigid body.
pub(super) fn add<S: Scalar>(
    (elastic, slices): (&Elastic<S>, &Slices<S>),
    number: usize,
    v: &[S],
    data: &mut Composite<S>,
    mass: &mut [S],
) {
    let Composite { frames, sums, columns, bias, .. } = data;
    let (n, len, first, sums) = (bias.len(), elastic.beam.len(), elastic.coordinate, &sums[number]);
    let frame = Pose::<S>::from_f64(slices.frame);
    let FrameSlot { velocity, acceleration, .. } = frames[elastic.root.frame];
    let motion = (frame.inverse_twist(velocity), frame.inverse_twist(acceleration));
    let wrench = weigh((slices, sums), motion, &v[first..], |i, coupling, effort| {
        bias[first + i] += effort;
        columns[first + i] += frame.wrench(coupling);
        for j in 0..=i {
            *entry(mass, n, first + i, first + j) += sums.block[i * len + j] + slices.block[i * len + j];
        }
    });
    if elastic.root.frame != 0 {
        frames[elastic.root.frame].wrench += frame.wrench(wrench);
    }
}

/// Tells `own` of each coordinate the wrench on the root per unit of its acceleration and what the slices do to it at a root of that
/// velocity and acceleration, and returns what of their wrench on the root is not that of a rigid body; all in the axes of the slices.
///
/// Law: `bias_i = p_i . a + l_i A + sum m J_i . r' - w_z^2 s_xx - w_x^2 s_zz + w_x w_z s_xz`. There `p_i = sum m J_i`,
/// `l_i = sum m r x J_i`, and a is the acceleration of the root's point. What turns about the axis of bending is in r'; s are the sums
/// of [`crate::beam::Sums`] for roots that move in space.
#[inline]
pub(super) fn weigh<S: Scalar>(
    (slices, sums): (&Slices<S>, &Sums<S>),
    (velocity, acceleration): (Twist<S>, Twist<S>),
    v: &[S],
    mut own: impl FnMut(usize, Wrench<S>, S),
) -> Wrench<S> {
    let zero = S::zero();
    let [x, y, z] = velocity.angular.to_array();
    let point = (acceleration.linear + velocity.angular.cross(velocity.linear)).to_array();
    // Rates of the momentum and of the moments of second order, for roots that move in space.
    let (mut slide, mut spread, mut spin) = ([zero; 2], [zero; 3], zero);
    for (i, (column, &turning)) in sums.columns.iter().zip(&slices.turning).enumerate() {
        let [across, along] = column.momentum;
        let angular = column.angular + turning;
        let mut effort = across * point[0] + along * point[2] + angular * acceleration.angular.y + column.effort;
        if slices.spatial {
            let [xx, zz, xz] = column.spread;
            effort += x * z * xz - z * z * xx - x * x * zz;
            let rate = v[i];
            (slide[0], slide[1]) = (slide[0] + across * rate, slide[1] + along * rate);
            (0..3).for_each(|k| spread[k] += column.spread[k] * rate);
            spin += angular * rate;
        }
        own(i, Wrench::new(Vector3::new(zero, angular, zero), Vector3::new(across, zero, along)), effort);
    }
    // The rigid body's share has `w x (w x r)` already, which r' has too about the axis of bending.
    let square = y * y;
    let [[h_x, h_z], [across, along]] = [sums.first, sums.force];
    let mut force = Vector3::new(across + h_x * square, zero, along + h_z * square);
    let mut moment = Vector3::new(zero, sums.moment, zero);
    if slices.spatial {
        let [xx, zz, xz] = spread;
        force.y = (z * slide[0] - x * slide[1]) * 2.0;
        moment.x = x * zz * 2.0 - z * (xz + spin);
        moment.z = z * xx * 2.0 - x * (xz - spin);
    }
    Wrench::new(moment, force)
}
