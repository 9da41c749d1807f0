//! Dynamics of trees with elastic beams, lines that weigh something and rotors that several joints turn, by composite bodies.
//!
//! `M(q) a + bias(q, v) + K q + D v = tau`, K and D constant. A beam is a joint of many coordinates whose mass is spread over its
//! stations: virtual work over the stations gives its own block of M, what reaches the root goes on inward as the inertia, the
//! wrench and the coupling wrenches of one composite body (Featherstone 2008, section 6.2, for rigid bodies; Shabana 2013, "Dynamics of
//! Multibody Systems", section 5.5, for the inertia coupling of a deformable body).

use super::energy::{Energy, of_rotors};
use super::frames::{Stations, frames, lines, outward, poses};
use super::slices;
use crate::data::{Composite, Data, FrameSlot, LineSlot};
use crate::model::{Elastic, Link, Model, Node, Shaft, Wire};
use crate::scalar::Scalar;
use crate::spatial::{Pose, SpatialInertia, Vector3, Wrench};

/// Mass matrix and bias of a flexible tree at coordinates `q` and rates `v`, left in `data`.
///
/// Across joints that do not couple the entries of M are zero.
/// Law: `M = sum J^T m J`, `bias = sum J^T (m A + V x* m V)` over bodies, stations and lines, A with gravity taken off.
/// Checked: against `crba`, `rnea` and `aba` on rigid trees, Lagrange's equations of the energy on flexible ones, a leg with closed
/// loops on lines.
pub fn terms<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) {
    outward(model, data, (q, v), Stations::Summed);
    let Data { composite, mass_matrix, .. } = data;
    mass_matrix.fill(S::zero());
    composite.bias.fill(S::zero());
    weigh_frames(model, &mut composite.frames, Stations::Summed);
    for node in model.order().iter().rev() {
        match node {
            Node::Body(number, beyond) => body(&model.links()[*number], *number, beyond, composite, mass_matrix),
            Node::Beam(number, beyond) => beam((&model.beams()[*number], *number), beyond, v, composite, mass_matrix),
        }
    }
    if !model.lines().is_empty() {
        poses(model, data);
        lines(model, data);
        massive_lines(model, data);
    }
    add_rotors(model, &mut data.mass_matrix);
    mirror(&mut data.mass_matrix, model.n_coordinates());
}

/// Adds rotors that several joints turn, `J r r^T`, to the lower triangle of a flexible tree.
///
/// Source: the kinetic energy `J (r . v)^2 / 2` of a shaft whose speed is a constant linear form of the rates, so that nothing comes to the
/// bias. Checked: against Lagrange's equations of a wrist worked out by hand.
fn add_rotors<S: Scalar>(model: &Model<S>, mass: &mut [S]) {
    let (n, blocks) = (model.n_coordinates(), model.blocks());
    for Shaft { ratios, inertia } in model.shafts() {
        let Some(inertia) = *inertia else { continue };
        for (k, one) in ratios.iter().enumerate() {
            for other in ratios[..=k].iter().filter(|other| blocks[other.joint] == blocks[one.joint]) {
                *entry(mass, n, one.joint, other.joint) += inertia * one.ratio * other.ratio;
            }
        }
    }
}

/// Wrench on each frame of a flexible tree that its own inertia needs in the motion of [`super::frames()`].
pub(super) fn weigh_frames<S: Scalar>(model: &Model<S>, frames: &mut [FrameSlot<S>], stations: Stations) {
    for (frame, (slot, products)) in frames.iter_mut().zip(model.products()).enumerate().skip(1) {
        if stations == Stations::Summed && model.is_summed(frame) {
            continue;
        }
        slot.wrench = slot.inertia.apply(slot.acceleration);
        if products.own() {
            slot.wrench += slot.velocity.cross_wrench(slot.inertia.apply(slot.velocity));
        }
    }
}

/// Joint of a flexible tree: its entries of the mass matrix, and all it carries one frame further in.
fn body<S: Scalar>(link: &Link<S>, number: usize, beyond: &[usize], data: &mut Composite<S>, mass: &mut [S]) {
    let Composite { frames, columns, bias, .. } = data;
    let n = bias.len();
    let FrameSlot { across, inertia, wrench, .. } = frames[number + 1];
    let own = inertia.apply(link.kind.unit());
    bias[number] = link.kind.effort(&wrench);
    mass[number * n + number] = link.kind.effort(&own) + link.rotor;
    for &other in beyond {
        *entry(mass, n, number, other) = link.kind.effort(&columns[other]);
    }
    if link.parent != 0 {
        carry(&mut frames[link.parent], &across, &inertia, &wrench);
        columns[number] = across.wrench(own);
        for &other in beyond {
            columns[other] = across.wrench(columns[other]);
        }
    }
}

/// Beam of a flexible tree: its block of the mass matrix, and all it carries to what its root sits on. The block is of
/// its slices together and else station by station.
fn beam<S: Scalar>(
    (elastic, number): (&Elastic<S>, usize),
    beyond: &[(usize, usize)],
    v: &[S],
    data: &mut Composite<S>,
    mass: &mut [S],
) {
    let Elastic { beam, root, coordinate, frame, heavy, slices, .. } = elastic;
    let (len, first, frame) = (beam.len(), *coordinate, frame.unwrap_or(0));
    data.columns[first..first + len].fill(Wrench::zero());
    if let Some(slices) = slices {
        slices::add((elastic, slices), number, v, data, mass);
    }
    let Composite { frames, sections, columns, bias, .. } = data;
    let n = bias.len();
    let jacobian = |station: usize| &sections[number].columns[station * len..(station + 1) * len];
    for station in 0..beam.stations() {
        if !heavy[station] || slices.as_ref().is_some_and(|slices| slices.has(station)) {
            continue;
        }
        let FrameSlot { across, inertia, wrench, .. } = frames[frame + station];
        for (i, column) in jacobian(station).iter().enumerate() {
            let momentum = inertia.apply(*column);
            bias[first + i] += column.power(wrench);
            columns[first + i] += across.wrench(momentum);
            let row = &mut mass[(first + i) * n + first..];
            for (entry, other) in row.iter_mut().zip(&jacobian(station)[..=i]) {
                *entry += other.power(momentum);
            }
        }
        if root.frame != 0 {
            carry(&mut frames[root.frame], &across, &inertia, &wrench);
        }
    }
    for &(other, station) in beyond {
        for (i, column) in jacobian(station).iter().enumerate() {
            *entry(mass, n, first + i, other) = column.power(columns[other]);
        }
        columns[other] = frames[frame + station].across.wrench(columns[other]);
    }
}

/// Hands an inertia and the wrench on it to the frame of a flexible tree that carries them.
fn carry<S: Scalar>(parent: &mut FrameSlot<S>, across: &Pose<S>, inertia: &SpatialInertia<S>, wrench: &Wrench<S>) {
    parent.inertia += across.inertia(*inertia);
    parent.wrench += across.wrench(*wrench);
}

/// Entry of two coordinates in the lower triangle of a flexible tree's mass matrix.
pub(super) fn entry<S>(mass: &mut [S], n: usize, i: usize, j: usize) -> &mut S {
    &mut mass[i.max(j) * n + i.min(j)]
}

/// Adds lines with mass to a flexible tree: needles between their points.
///
/// Law: with u the unit vector of the line and J_u its derivative by the coordinates, a centre at distance c from the beginning has
/// `J = J_from + c J_u`, one at distance c from the end `J = J_to - c J_u`; `M += m J^T J + I J_u^T J_u`,
/// `bias += m J^T a + I J_u^T u''` at zero coordinate accelerations. Source: D'Imperio 2016, eqs 2.85 to 2.95, in space.
fn massive_lines<S: Scalar>(model: &Model<S>, data: &mut Data<S>) {
    let Data { composite: Composite { lines, bias, .. }, mass_matrix: mass, .. } = data;
    let (n, keeps, blocks) = (bias.len(), model.keeps_velocity_terms(), model.blocks());
    let couples = model.couples();
    for (Wire { barrel, rod, .. }, slot) in model.lines().iter().zip(lines) {
        if barrel.is_none() && rod.is_none() {
            continue;
        }
        let LineSlot { length, direction: u, from, to, turns } = slot;
        let shrink = length.recip();
        let turn = |v: Vector3<S>| (v - *u * u.dot(v)) * shrink;
        let (rate, change) = (to.velocity - from.velocity, to.acceleration - from.acceleration);
        let (stretch, spin) = (u.dot(rate), turn(rate));
        // u'' from d^2/dt^2 (s u), s the length.
        let swing = turn(change);
        let swing = if keeps { swing - spin * (stretch * shrink * 2.0) - *u * spin.dot(spin) } else { swing };
        for (turned, (&to, &from)) in turns.iter_mut().zip(to.columns.iter().zip(&from.columns)) {
            *turned = turn(to - from);
        }
        for (part, point, sign) in [(barrel, &*from, 1.0), (rod, &*to, -1.0)] {
            let Some(part) = part else { continue };
            let center = part.center * sign;
            let acceleration = (point.acceleration + swing * center) * part.mass;
            for (i, (&turning, &column)) in turns.iter().zip(&point.columns).enumerate() {
                let moving = column + turning * center;
                bias[i] += moving.dot(acceleration) + turning.dot(swing) * part.inertia;
                let others = turns.iter().zip(&point.columns).zip(blocks);
                for (entry, ((&other, &column), &block)) in mass[i * n..=i * n + i].iter_mut().zip(others) {
                    if !couples && block != blocks[i] {
                        continue;
                    }
                    let along = moving.dot(column + other * center) * part.mass;
                    *entry += along + turning.dot(other) * part.inertia;
                }
            }
        }
    }
}

/// Copies the lower triangle of a flexible tree's mass matrix to the upper one.
fn mirror<S: Copy>(matrix: &mut [S], n: usize) {
    for i in 0..n {
        for j in 0..i {
            matrix[j * n + i] = matrix[i * n + j];
        }
    }
}

/// Adds forces on lines to `loads` of a flexible tree: `J^T F`, after [`terms`] or [`super::observe`].
pub(crate) fn add_line_forces<S: Scalar>(data: &Data<S>, forces: &[S], loads: &mut [S]) {
    for (line, &force) in forces.iter().enumerate() {
        data.line_load(line, force, loads);
    }
}

/// Subtracts stiffness and damping of a flexible tree's beams from `loads`: `K q + D v`.
pub(crate) fn subtract_elastic<S: Scalar>(model: &Model<S>, q: &[S], v: &[S], loads: &mut [S]) {
    for Elastic { beam, coordinate, .. } in model.beams() {
        let len = beam.len();
        let own = *coordinate..coordinate + len;
        let (q, v) = (&q[own.clone()], &v[own.clone()]);
        for (row, load) in loads[own].iter_mut().enumerate() {
            let filled = beam.couplings(row);
            let entries = row * len + filled.start..row * len + filled.end;
            let (stiffness, damping) = (&beam.stiffness()[entries.clone()], &beam.damping()[entries]);
            *load -= product(stiffness, &q[filled.clone()]) + product(damping, &v[filled]);
        }
    }
}

/// Adds `reach D + reach^2 K` of a flexible tree's beams to the mass matrix. A step does that which takes their
/// elasticity implicitly.
pub(crate) fn stiffen<S: Scalar>(model: &Model<S>, reach: S, mass: &mut [S]) {
    let n = model.n_coordinates();
    for Elastic { beam, coordinate, .. } in model.beams() {
        let len = beam.len();
        let rows = beam.stiffness().chunks_exact(len.max(1)).zip(beam.damping().chunks_exact(len.max(1)));
        for (row, (stiffness, damping)) in (*coordinate..).zip(rows) {
            let entries = &mut mass[row * n + coordinate..][..len];
            for (entry, (&stiffness, &damping)) in entries.iter_mut().zip(stiffness.iter().zip(damping)) {
                *entry += (stiffness * reach + damping) * reach;
            }
        }
    }
}

/// Kinetic and potential energy of a flexible tree in J, at `q` and `v`. The potential is that in gravity and in the
/// beams.
///
/// Checked: free motion conserves their sum.
pub fn energy<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], v: &[S]) -> Energy<S> {
    frames(model, data, q, v);
    poses(model, data);
    lines(model, data);
    let gravity = model.gravity();
    let mut total = Energy { kinetic: of_rotors(model, v), potential: S::zero() };
    for FrameSlot { pose, velocity, inertia, .. } in data.composite.frames.iter().skip(1) {
        total.kinetic += inertia.kinetic_energy(*velocity);
        total.potential -= gravity.dot(pose.rotation * inertia.first_moment + pose.translation * inertia.mass);
    }
    for (Wire { barrel, rod, .. }, LineSlot { length, direction: u, from, to, .. }) in
        model.lines().iter().zip(&data.composite.lines)
    {
        let rate = to.velocity - from.velocity;
        let spin = (rate - *u * u.dot(rate)) * length.recip();
        for (part, point, sign) in [(barrel, from, 1.0), (rod, to, -1.0)] {
            let Some(part) = part else { continue };
            let center = part.center * sign;
            let velocity = point.velocity + spin * center;
            total.kinetic += (velocity.dot(velocity) * part.mass + spin.dot(spin) * part.inertia) * 0.5;
            total.potential -= gravity.dot(point.place + *u * center) * part.mass;
        }
    }
    for Elastic { beam, coordinate, .. } in model.beams() {
        let q = &q[*coordinate..coordinate + beam.len()];
        let rows = beam.stiffness().chunks_exact(q.len().max(1));
        total.potential += rows.zip(q).map(|(row, &own)| own * product(row, q)).sum::<S>() * 0.5;
    }
    total
}

fn product<S: Scalar>(row: &[S], x: &[S]) -> S {
    row.iter().zip(x).map(|(&entry, &x)| entry * x).sum()
}

/// Accelerations of a flexible tree under `tau`, after [`terms`] at the same `q` and `v`. The factors of M stay in
/// `data`.
pub fn solve<'d, S: Scalar>(model: &Model<S>, data: &'d mut Data<S>, q: &[S], v: &[S], tau: &[S]) -> &'d [S] {
    data.factorise();
    let Data { composite: Composite { bias, factors, .. }, acceleration, .. } = data;
    for ((entry, &tau), &bias) in acceleration.iter_mut().zip(tau).zip(&*bias) {
        *entry = tau - bias;
    }
    subtract_elastic(model, q, v, acceleration);
    factors.solve(acceleration);
    acceleration
}

/// Efforts of a flexible tree for accelerations `a`: `M a + bias + K q + D v`, after [`terms`] there.
pub fn required<S: Scalar>(model: &Model<S>, data: &Data<S>, (q, v): (&[S], &[S]), a: &[S], efforts: &mut [S]) {
    let n = model.n_coordinates();
    efforts.fill(S::zero());
    subtract_elastic(model, q, v, efforts);
    let rows = data.mass_matrix.chunks_exact(n.max(1)).zip(&data.composite.bias);
    for (effort, (row, &bias)) in efforts.iter_mut().zip(rows) {
        *effort = product(row, a) + bias - *effort;
    }
}
