//! Where all frames of a machine are and how they move.

use super::slices;
use crate::beam::Sections;
use crate::data::{Composite, Data, FrameSlot, LineSlot, PointSlot};
use crate::model::{Elastic, Model, Node, Place, Products, Wire};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist, Vector3};

/// Motion of every frame at coordinates `q`, rates `v` and zero coordinate accelerations, outward from the world.
///
/// Law: `V_F = X^-1 V_P + V_PF`, `A_F = X^-1 A_P + V_F x V_PF + dV_PF/dt` with V_PF the twist of F relative to P in the axes of F
/// (Featherstone 2008, section 5.3; a station of a beam is a joint of as many coordinates). Gravity is an upward acceleration of the
/// world. Where the model drops its velocity terms, `A_F = X^-1 A_P`; where it drops those of some parts, they go on from one joint to the next.
pub fn frames<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) {
    outward(model, data, (q, v), Stations::Each);
}

/// How the stations of beams are taken that are nothing but slices of a beam which bends in one plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stations {
    /// Each moves as a frame.
    Each,
    /// They have no frames, but sums that go to what carries the beam.
    Summed,
}

/// As [`frames`], with a say in how slices of beams are taken.
pub(crate) fn outward<S: Scalar>(model: &Model<S>, data: &mut Data<S>, (q, v): (&[S], &[S]), taken: Stations) {
    debug_assert!(q.len() == model.n_coordinates() && v.len() == model.n_coordinates());
    let Data { composite: Composite { frames, sections, sums, .. }, drifts, .. } = data;
    frames[0].acceleration = Twist::new(Vector3::zero(), -model.gravity());
    for node in model.order() {
        match node {
            Node::Body(number, _) => {
                let link = &model.links()[*number];
                // Only these two: a frame is large, and larger in dual numbers.
                let FrameSlot { velocity, acceleration, .. } = frames[link.parent];
                let slot = &mut frames[number + 1];
                slot.across = link.pose(q[*number]);
                slot.velocity = slot.across.inverse_twist(velocity);
                link.kind.add_rate(&mut slot.velocity, v[*number]);
                slot.acceleration = slot.across.inverse_twist(acceleration);
                let across = || link.kind.rate_cross(&slot.velocity, v[*number]);
                match model.products()[number + 1] {
                    Products::Kept => slot.acceleration += across(),
                    Products::Dropped => {}
                    Products::Mixed(mixed) => {
                        slot.acceleration += mixed.step(&slot.across, across(), drifts, (link.parent, number + 1));
                    }
                }
                slot.inertia = link.inertia;
            }
            Node::Beam(number, _) => {
                let Elastic { beam, root, coordinate, frame, inertias, slices, .. } = &model.beams()[*number];
                let (own, parent) = (*coordinate..coordinate + beam.len(), frames[root.frame]);
                let sections = &mut sections[*number];
                let (q, v) = (&q[own.clone()], &v[own]);
                let slices = slices.as_ref().filter(|_| taken == Stations::Summed);
                match slices {
                    Some(slices) => {
                        let sums = &mut sums[*number];
                        beam.gather((q, v), slices::turn(slices, parent.velocity), (slices, sums), sections);
                        if root.frame != 0 {
                            slices::hand_on(slices, sums, &mut frames[root.frame]);
                        }
                    }
                    None => beam.sweep(q, v, sections, model.accelerates(*number)),
                }
                let (begin, first) = (Pose::from_f64(root.pose), frame.unwrap_or(0));
                let stations = frames.iter_mut().enumerate().skip(first).zip(&sections.at).zip(inertias);
                for (((station, slot), section), inertia) in stations {
                    if slices.is_some_and(|slices| slices.has(station - first)) {
                        continue;
                    }
                    slot.across = begin * section.pose;
                    slot.velocity = slot.across.inverse_twist(parent.velocity) + section.twist;
                    slot.acceleration = slot.across.inverse_twist(parent.acceleration);
                    let across = || slot.velocity.cross(section.twist) + section.acceleration;
                    match model.products()[station] {
                        Products::Kept => slot.acceleration += across(),
                        Products::Dropped => {}
                        Products::Mixed(mixed) => {
                            slot.acceleration += mixed.step(&slot.across, across(), drifts, (root.frame, station));
                        }
                    }
                    slot.inertia = *inertia;
                }
            }
        }
    }
}

/// Frames of the bodies of a rigid tree: poses `X_WF` and velocities, all that forces on them need.
pub(crate) fn motion<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) {
    debug_assert!(model.is_recursive());
    let frames = &mut data.composite.frames;
    for (k, ((link, &q), &v)) in model.links().iter().zip(q).zip(v).enumerate() {
        let (before, rest) = frames.split_at_mut(k + 1);
        let (parent, slot) = (&before[link.parent], &mut rest[0]);
        slot.across = link.pose(q);
        slot.pose = parent.pose * slot.across;
        slot.velocity = slot.across.inverse_twist(parent.velocity);
        link.kind.add_rate(&mut slot.velocity, v);
    }
}

/// Poses `X_WF` of every frame after [`frames`].
pub(crate) fn poses<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    let frames = &mut data.composite.frames;
    for node in model.order() {
        let (parent, own) = match node {
            Node::Body(number, _) => (model.links()[*number].parent, number + 1..number + 2),
            Node::Beam(number, _) => {
                let elastic = &model.beams()[*number];
                let first = elastic.frame.unwrap_or(0);
                (elastic.root.frame, first..first + elastic.beam.stations())
            }
        };
        let parent = frames[parent].pose;
        for slot in &mut frames[own] {
            slot.pose = parent * slot.across;
        }
    }
}

/// Geometry and motion of every line between frames, after [`poses`].
pub(crate) fn lines<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    bare_lines(model, data);
    let Composite { frames, sections, lines, .. } = &mut data.composite;
    for (Wire { from, to, .. }, slot) in model.lines().iter().zip(lines) {
        for (place, point) in [(from, &mut slot.from), (to, &mut slot.to)] {
            let PointSlot { place: at, columns, .. } = point;
            columns.fill(Vector3::zero());
            for_each_column(model, frames, sections, place.frame, |coordinate, column| {
                columns[coordinate] = column.linear + column.angular.cross(*at);
            });
        }
    }
}

/// Angle and speed of every transmission shaft at coordinates `q` and rates `v`, after the frames. Its levers stand
/// since the data were made.
#[inline]
pub(crate) fn shafts<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) {
    for (shaft, slot) in model.shafts().iter().zip(&mut data.composite.lines[model.lines().len()..]) {
        let of = |numbers: &[S]| shaft.ratios.iter().map(|entry| entry.ratio * numbers[entry.joint]).sum();
        slot.length = of(q);
        slot.to.velocity = Vector3::new(of(v), S::zero(), S::zero());
    }
}

/// Lines between frames as [`lines`], but without the velocities per unit rate of the coordinates.
pub(super) fn bare_lines<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    let Data { composite: Composite { frames, lines, .. }, drifts, .. } = data;
    for (Wire { from, to, .. }, slot) in model.lines().iter().zip(lines) {
        let LineSlot { length, direction, from: begin, to: end, .. } = slot;
        for (place, point) in [(from, &mut *begin), (to, &mut *end)] {
            let FrameSlot { pose, .. } = &frames[place.frame];
            let (at, speed, change) = at_place(model, frames, drifts, place);
            point.place = pose.point(at);
            point.velocity = pose.rotation * speed;
            point.acceleration = pose.rotation * change;
        }
        let across = end.place - begin.place;
        *length = across.dot(across).sqrt();
        *direction = across * length.recip();
    }
}

/// A point fixed to a frame: where it is and how it moves, in the axes of the frame.
fn at_place<S: Scalar>(
    model: &Model<S>,
    frames: &[FrameSlot<S>],
    drifts: &[Twist<S>],
    place: &Place,
) -> (Vector3<S>, Vector3<S>, Vector3<S>) {
    let at = Vector3::from_f64(place.pose.translation.to_array());
    let FrameSlot { velocity, acceleration, .. } = &frames[place.frame];
    let speed = velocity.linear + velocity.angular.cross(at);
    let mut change = acceleration.linear + acceleration.angular.cross(at);
    if model.keeps_velocity_terms() {
        // The conventional acceleration of a point from the spatial one (Featherstone 2008, section 2.11).
        change += velocity.angular.cross(speed);
        // Points keep their products of rates, whatever the frames do.
        if !model.products()[place.frame].own() {
            let Twist { angular, linear } = drifts[place.frame];
            change += linear + angular.cross(at);
        }
    }
    (at, speed, change)
}

/// Specific force and angular velocity of a frame fixed to another one, in its own axes.
///
/// Law: an accelerometer shows the acceleration of its place less that of gravity, a gyroscope the angular velocity (Titterton
/// and Weston 2004, "Strapdown Inertial Navigation Technology", section 3.2). Checked: against the second derivative of the pose.
pub(crate) fn specific_force<S: Scalar>(model: &Model<S>, data: &Data<S>, place: &Place) -> [Vector3<S>; 2] {
    let frames = &data.composite.frames;
    let (_, _, change) = at_place(model, frames, &data.drifts, place);
    let turned = Pose::from_f64(place.pose).rotation;
    [change, frames[place.frame].velocity.angular].map(|vector| turned.transpose_mul(vector))
}

/// Hands out, for every coordinate that moves a frame, the twist per unit rate in the axes and at the origin of the world.
pub(crate) fn for_each_column<S: Scalar>(
    model: &Model<S>,
    frames: &[FrameSlot<S>],
    sections: &[Sections<S>],
    mut frame: usize,
    mut visit: impl FnMut(usize, Twist<S>),
) {
    while frame != 0 {
        let pose = frames[frame].pose;
        match model.links().get(frame - 1) {
            Some(link) => {
                visit(frame - 1, pose.twist(link.kind.unit()));
                frame = link.parent;
            }
            None => {
                let Some((number, station)) = model.station(frame) else { return };
                let Elastic { beam, root, coordinate, .. } = &model.beams()[number];
                let columns = &sections[number].columns[station * beam.len()..(station + 1) * beam.len()];
                for (k, column) in columns.iter().enumerate() {
                    visit(coordinate + k, pose.twist(*column));
                }
                frame = root.frame;
            }
        }
    }
}
