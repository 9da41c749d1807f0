//! One segment of a beam on its way through an articulated tree.

use super::super::slices;
use crate::beam::{Beam, Segment, Slices};
use crate::data::{AbaSlot, SegmentSlot};
use crate::scalar::Scalar;
use crate::spatial::{ArticulatedInertia, Pose, SpatialInertia, Twist, Wrench};

/// Moves the stations of a segment, sums up what its own inertia does at its begin, and tells how its end moves.
///
/// Law: virtual work, `U = sum X m J`, `m = sum J^T m J`, `b = sum J^T (m c + V x* m V)` over the stations, `c = V x J c' + J' c'` their
/// acceleration by rates relative to the begin (Featherstone 2008, sections 5.3 and 6.2).
pub(super) fn begin<S: Scalar>(
    segment: &Segment,
    slot: &mut SegmentSlot<S>,
    stations: &mut [AbaSlot<S>],
    (inertias, slices): (&[SpatialInertia<S>], Option<&Slices<S>>),
    keeps: bool,
) -> Twist<S> {
    let (mut composite, mut total) = match slices {
        Some(slices) => sum_up(segment, slot, slices),
        None => {
            let SegmentSlot { sections, coordinates, rates, columns, matrix, efforts, .. } = slot;
            segment.motion(coordinates, rates, sections, keeps);
            columns.fill(Wrench::zero());
            matrix.fill(S::zero());
            efforts.fill(S::zero());
            (SpatialInertia::zero(), Wrench::zero())
        }
    };
    let SegmentSlot { sections, columns, matrix, efforts, .. } = slot;
    let (mut velocity, mut drift) = (slot.velocity, Twist::zero());
    let n = segment.len();
    for (number, section) in sections.at.iter().enumerate() {
        if slices.is_some_and(|slices| slices.has(number)) {
            continue;
        }
        if keeps {
            velocity = section.pose.inverse_twist(slot.velocity) + section.twist;
            drift = velocity.cross(section.twist) + section.acceleration;
        }
        let (Some(station), Some(inertia)) = (stations.get_mut(number), inertias.get(number)) else { continue };
        (station.velocity, station.bias_acceleration) = (velocity, drift);
        (station.inertia, station.bias_wrench) = (ArticulatedInertia::default(), Wrench::zero());
        let mut load = Wrench::zero();
        if keeps {
            load = inertia.apply(drift) + velocity.cross_wrench(inertia.apply(velocity));
        }
        composite += section.pose.inertia(*inertia);
        total += section.pose.wrench(load);
        let jacobian = &sections.columns[number * n..(number + 1) * n];
        add((columns, matrix, efforts), (&section.pose, jacobian), load, |column| inertia.apply(column));
    }
    (slot.inertia, slot.wrench, slot.drift) = (composite.into(), total, drift);
    velocity
}

/// The inertia of the slices of a segment and the wrench on them where its begin does not accelerate; what is felt of the coordinates goes
/// to the slot.
fn sum_up<S: Scalar>(
    segment: &Segment,
    slot: &mut SegmentSlot<S>,
    slices: &Slices<S>,
) -> (SpatialInertia<S>, Wrench<S>) {
    let SegmentSlot { sections, sums, coordinates, rates, columns, matrix, efforts, velocity, .. } = slot;
    segment.gather((coordinates, rates), slices::turn(slices, *velocity), (slices, sums), sections);
    let frame = Pose::<S>::from_f64(slices.frame);
    let (inertia, own) = (slices.inertia(sums), frame.inverse_twist(*velocity));
    let extra = slices::weigh((slices, sums), (own, Twist::zero()), rates, |i, coupling, effort| {
        (columns[i], efforts[i]) = (frame.wrench(coupling), effort);
    });
    for (entry, (&sum, &constant)) in matrix.iter_mut().zip(sums.block.iter().zip(&slices.block)) {
        *entry = sum + constant;
    }
    (frame.inertia(inertia), frame.wrench(own.cross_wrench(inertia.apply(own)) + extra))
}

/// Adds the inertia of one section of a segment to what is felt of the coordinates.
#[inline]
fn add<S: Scalar>(
    (columns, matrix, efforts): (&mut [Wrench<S>], &mut [S], &mut [S]),
    (pose, jacobian): (&Pose<S>, &[Twist<S>]),
    load: Wrench<S>,
    momentum: impl Fn(Twist<S>) -> Wrench<S>,
) {
    let n = jacobian.len();
    for (i, &column) in jacobian.iter().enumerate() {
        let momentum = momentum(column);
        columns[i] += pose.wrench(momentum);
        efforts[i] += column.power(load);
        for (entry, other) in matrix[i * n..].iter_mut().zip(&jacobian[..=i]) {
            *entry += other.power(momentum);
        }
    }
}

/// Attaches to a segment what a section carries: articulated inertia and wrench. `drift` is the acceleration by rates
/// alone.
pub(super) fn attach<S: Scalar>(
    slot: &mut SegmentSlot<S>,
    section: usize,
    (inertia, wrench): (&ArticulatedInertia<S>, Wrench<S>),
    drift: Twist<S>,
) {
    let SegmentSlot { sections, columns, matrix, efforts, .. } = slot;
    let (n, pose) = (columns.len(), &sections.at[section].pose);
    let jacobian = &sections.columns[section * n..(section + 1) * n];
    let load = wrench + inertia.apply(drift);
    add((columns, matrix, efforts), (pose, jacobian), load, |column| inertia.apply(column));
    slot.inertia += pose.articulated_inertia(*inertia);
    slot.wrench += pose.wrench(load);
}

/// Adds a wrench on a segment's section alone.
pub(super) fn load<S: Scalar>(slot: &mut SegmentSlot<S>, section: usize, wrench: Wrench<S>) {
    let SegmentSlot { sections, efforts, .. } = slot;
    let n = efforts.len();
    let jacobian = &sections.columns[section * n..(section + 1) * n];
    efforts.iter_mut().zip(jacobian).for_each(|(effort, &column)| *effort += column.power(wrench));
    slot.wrench += sections.at[section].pose.wrench(wrench);
}

/// Adds what the pending coordinates of the next segment, the first `shared` ones there and the last ones here, do by themselves.
pub(super) fn share<S: Scalar>(slot: &mut SegmentSlot<S>, next: &SegmentSlot<S>, shared: usize) {
    let SegmentSlot { sections, columns, matrix, efforts, drift, .. } = slot;
    let (n, width) = (columns.len(), next.columns.len());
    let (first, end) = (n - shared, sections.at.len() - 1);
    let (pose, jacobian) = (&sections.at[end].pose, &sections.columns[end * n..]);
    for (k, &column) in next.columns[..shared].iter().enumerate() {
        let own = first + k;
        columns[own] += pose.wrench(column);
        efforts[own] += drift.power(column) + next.efforts[k];
        for (other, turned) in jacobian.iter().enumerate() {
            let power = turned.power(column);
            let both = if other == own { power * 2.0 } else { power };
            matrix[own.max(other) * n + own.min(other)] += both;
        }
        for (l, &entry) in next.matrix[k * width..=k * width + k].iter().enumerate() {
            matrix[own * n + first + l] += entry;
        }
    }
}

/// Eliminates the coordinates of a segment that act in none before it, under the efforts `tau` on those of the beam.
///
/// Law: from `U . A + m c'' + b = tau`, `F - U tau' / m` with the efforts left over, as at a joint (Featherstone 2008, equations 7.23 to
/// 7.27), and likewise for the coordinates that stay; `m` with the beam's `g D + g^2 K` if a `reach` g is given.
pub(super) fn eliminate<S: Scalar>(
    beam: &Beam<S>,
    segment: &Segment,
    slot: &mut SegmentSlot<S>,
    tau: &[S],
    reach: Option<S>,
) {
    let n = segment.len();
    let SegmentSlot { inertia, wrench, columns, matrix, efforts, inverses, .. } = slot;
    for own in (segment.shared..n).rev() {
        let (above, row) = matrix.split_at_mut(own * n);
        if let Some(reach) = reach {
            stiffen(beam, segment, (own, &mut row[..=own]), reach);
        }
        let (column, inverse) = (columns[own], row[own].recip());
        let effort = tau[segment.coordinates[own]] - efforts[own];
        (efforts[own], inverses[own]) = (effort, inverse);
        let solved = effort * inverse;
        *inertia = inertia.deflated(column, inverse);
        *wrench += column * solved;
        for (other, &entry) in row[..own].iter().enumerate() {
            let share = entry * inverse;
            columns[other] = columns[other] - column * share;
            efforts[other] += entry * solved;
            for (left, &across) in above[other * n..].iter_mut().zip(&row[..=other]) {
                *left -= share * across;
            }
        }
    }
}

/// Releases a segment under other efforts `tau`, once [`eliminate`] has worked out the inertias. Wrench and efforts
/// remain.
pub(super) fn release<S: Scalar>(segment: &Segment, slot: &mut SegmentSlot<S>, tau: &[S]) {
    let n = segment.len();
    let SegmentSlot { wrench, columns, matrix, efforts, inverses, .. } = slot;
    for own in (segment.shared..n).rev() {
        let effort = tau[segment.coordinates[own]] - efforts[own];
        let solved = effort * inverses[own];
        efforts[own] = effort;
        *wrench += columns[own] * solved;
        efforts.iter_mut().zip(&matrix[own * n..own * n + own]).for_each(|(other, &entry)| *other += entry * solved);
    }
}

/// Adds `g D + g^2 K` to a segment's row of a coordinate.
fn stiffen<S: Scalar>(beam: &Beam<S>, segment: &Segment, (own, row): (usize, &mut [S]), reach: S) {
    let coordinate = segment.coordinates[own];
    let coupled = beam.couplings(coordinate);
    for (entry, other) in row.iter_mut().zip(&segment.coordinates) {
        if coupled.contains(other) {
            let at = coordinate * beam.len() + other;
            *entry += (beam.damping()[at] + beam.stiffness()[at] * reach) * reach;
        }
    }
}

/// Accelerations of the coordinates that were eliminated in a segment, from that of its begin and those of the segment before it.
pub(super) fn accelerate<S: Scalar>(
    segment: &Segment,
    slot: &mut SegmentSlot<S>,
    before: Option<&SegmentSlot<S>>,
    result: &mut [S],
) {
    let n = segment.len();
    let SegmentSlot { columns, matrix, efforts, inverses, acceleration, accelerations, .. } = slot;
    if let Some(before) = before {
        let last = before.accelerations.len() - segment.shared;
        accelerations[..segment.shared].copy_from_slice(&before.accelerations[last..]);
    }
    for own in segment.shared..n {
        let mut effort = efforts[own] - acceleration.power(columns[own]);
        for (&entry, &other) in matrix[own * n..own * n + own].iter().zip(&*accelerations) {
            effort -= entry * other;
        }
        accelerations[own] = effort * inverses[own];
        result[segment.coordinates[own]] = accelerations[own];
    }
}

impl<S: Scalar> SegmentSlot<S> {
    /// Acceleration A of a segment's section after [`accelerate`], where `drift` is that by rates alone.
    #[inline]
    pub(super) fn section(&self, number: usize, drift: Twist<S>) -> Twist<S> {
        let n = self.accelerations.len();
        let start = self.sections.at[number].pose.inverse_twist(self.acceleration) + drift;
        let columns = &self.sections.columns[number * n..(number + 1) * n];
        columns.iter().zip(&self.accelerations).fold(start, |sum, (&column, &own)| sum + column * own)
    }
}
