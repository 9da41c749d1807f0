//! Parts of a beam that a few of its coordinates bend.

use std::ops::Range;

use nalgebra::DMatrix;

use super::Basis;
use super::entry::{BeamEntry, Component};
use super::fields::{Field, Fields, Interpolated};
use super::flexible::Axis;
use super::lumped::LumpedAxis;
use super::motion::Sections;
use super::rest::Rest;
use super::strain::{Rule, Slices, Sums};
use crate::error::Result;
use crate::scalar::Scalar;
use crate::spatial::{Pose, SpatialInertia};

/// A part of a beam whose sections move, relative to where it begins, by some of the beam's coordinates alone.
///
/// A beam of elements has one for each element, in which the strains at its two nodes act, one of segments with hinges one for each hinge. A
/// beam whose coordinates act everywhere is one segment, as is one whose damping couples coordinates far apart.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    axis: Axis,
    /// Coordinates of the beam that act in it; those that act in the segment before it too come first.
    pub(crate) coordinates: Vec<usize>,
    /// How many act in the segment before it too: they are the last ones there.
    pub(crate) shared: usize,
    /// Stations of the beam on it, which are its first sections; if another segment follows, its last section is where that begins.
    pub(crate) stations: Range<usize>,
    sections: usize,
}

/// What lies between two places of a beam.
struct Cut {
    begin: f64,
    size: f64,
    stations: Range<usize>,
    /// Arc lengths of its sections from its begin.
    places: Vec<f64>,
}

impl Segment {
    /// The whole beam as its one segment, for coordinates that act everywhere.
    pub(super) fn whole(axis: &Axis, coordinates: usize, stations: usize) -> Vec<Self> {
        let coordinates = (0..coordinates).collect();
        vec![Self { axis: axis.clone(), coordinates, shared: 0, stations: 0..stations, sections: stations }]
    }

    /// Segments of a beam of linear strains with stations at `places`, as exact as the whole when deflected.
    pub(super) fn elements(
        deforms: &[Component],
        (length, count): (f64, usize),
        places: &[f64],
        rest: &Rest,
    ) -> Result<Vec<Self>> {
        let each = deforms.len();
        let segment = |(number, cut): (usize, Cut)| {
            // The functions of the first node, component by component, then those of the second.
            let fields = Fields::new(Interpolated::Strain, nodal(deforms, cut.size)?);
            let axis = Axis::integrated(&fields, &cut.places, &rest.from(cut.begin), Rule::Elements);
            let at = |node: usize| (0..each).map(move |component| component * (count + 1) + node);
            let coordinates = at(number).chain(at(number + 1)).collect();
            let shared = if number == 0 { 0 } else { each };
            Ok(Self { axis, coordinates, shared, stations: cut.stations, sections: cut.places.len() })
        };
        cuts(length, count, places).into_iter().enumerate().map(segment).collect()
    }

    /// The rigid segments of a lumped beam with stations at `places`, each with the hinge at its begin.
    pub(super) fn hinged(
        components: &[Component],
        (length, count): (f64, usize),
        places: &[f64],
        rest: &Rest,
    ) -> Vec<Self> {
        let each = components.len();
        let segment = |(number, cut): (usize, Cut)| Self {
            axis: Axis::Lumped(LumpedAxis::new(components, (1, cut.size), &cut.places, &rest.from(cut.begin))),
            coordinates: (number * each..(number + 1) * each).collect(),
            shared: 0,
            stations: cut.stations,
            sections: cut.places.len(),
        };
        cuts(length, count, places).into_iter().enumerate().map(segment).collect()
    }

    /// Number of coordinates that act in a segment.
    pub(crate) fn len(&self) -> usize {
        self.coordinates.len()
    }

    /// Buffers for [`Segment::motion`].
    pub(crate) fn buffers<S: Scalar>(&self) -> Sections<S> {
        Sections::new(self.sections, self.len(), self.axis.scratch())
    }

    /// Motion of a segment's sections relative to its begin: poses, twists, columns, accelerations if asked for.
    #[inline]
    pub(crate) fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>, accelerates: bool) {
        self.axis.sweep(q, v, out, accelerates);
    }

    /// The slices of this segment, seen from where it begins; none unless it bends in one plane.
    ///
    /// They are the stations that `is_slice` names, of a beam with these `inertias`.
    pub(super) fn slices<S: Scalar>(
        &self,
        inertias: &[SpatialInertia<S>],
        is_slice: impl Fn(usize) -> bool,
        spatial: bool,
    ) -> Option<Slices<S>> {
        let Axis::Plane(axis) = &self.axis else { return None };
        let Range { start, end } = self.stations;
        let mut own = inertias[start..end].to_vec();
        own.resize(self.sections, SpatialInertia::zero());
        let is_own = |section: usize| start + section < end && is_slice(start + section);
        Some(axis.slices(&own, is_own, (&Pose::identity(), spatial)))
    }

    /// As [`Segment::motion`], but of slices only sums, for a begin that turns with `turn` about the axis of bending.
    #[inline]
    pub(crate) fn gather<S: Scalar>(
        &self,
        motion: (&[S], &[S]),
        turn: S,
        sums: (&Slices<S>, &mut Sums<S>),
        out: &mut Sections<S>,
    ) {
        if let Axis::Plane(axis) = &self.axis {
            axis.gather(motion, turn, sums, out);
        }
    }
}

/// Whether damping couples coordinates of segments no further than the beam's stiffness does.
pub(super) fn damps_locally<S: Scalar>(entry: &BeamEntry<S>) -> bool {
    entry.damping.mass.is_none() && entry.damping.ratios.is_empty()
}

/// Cuts an axis into segments of equal length, with the sections of each.
fn cuts(length: f64, count: usize, places: &[f64]) -> Vec<Cut> {
    let node = |number: usize| length * number as f64 / count as f64;
    let mut first = 0;
    let cut = |number: usize| {
        let ([begin, end], last) = ([node(number), node(number + 1)], number + 1 == count);
        let own = places[first..].iter().take_while(|&&place| last || place <= end).count();
        let stations = first..first + own;
        let mut local: Vec<f64> = places[stations.clone()].iter().map(|place| place - begin).collect();
        // A section at a node belongs to the part before it, of which it is the end.
        if !last && places[stations.clone()].last() != Some(&end) {
            local.push(end - begin);
        }
        first += own;
        Cut { begin, size: end - begin, stations, places: local }
    };
    (0..count).map(cut).collect()
}

/// Linear functions of both nodes of a segment: all components at the first node, then at the second.
fn nodal(deforms: &[Component], size: f64) -> Result<Vec<Field>> {
    let both = Basis::linear(size, 1, 0)?;
    if let [component] = *deforms {
        return Ok(vec![Field { component, basis: both }]);
    }
    let field = |node: usize, component: Component| {
        let column = DMatrix::from_fn(2, 1, |row, _| if row == node { 1.0 } else { 0.0 });
        Ok(Field { component, basis: Basis::combination(both.clone(), column)? })
    };
    let places = [0, 1].into_iter().flat_map(|node| deforms.iter().map(move |&component| (node, component)));
    places.map(|(node, component)| field(node, component)).collect()
}
