//! One flexible beam, at any level, over the number type of its parameters.

use std::ops::Range;

use nalgebra::DMatrix;

use super::deflection::{DeflectionAxis, LinearAxis};
use super::eigen::{self, Modes};
use super::fields::Fields;
use super::gauge::Gauge;
use super::lumped::LumpedAxis;
use super::motion::Sections;
use super::reduced::ReducedAxis;
use super::rest::Rest;
use super::segment::Segment;
use super::strain::{PlaneAxis, Rule, Slices, SpaceAxis, Sums};
use crate::error::Result;
use crate::scalar::Scalar;
use crate::spatial::{Pose, SpatialInertia, Vector3};

/// A beam that leaves its root along z, or a reduced solid: a map from elastic coordinates to sections, inertia at sections, and constant
/// matrices of stiffness and damping.
///
/// By virtual work `M = sum J^T m J` over the stations, and likewise for the velocity terms and gravity: the same sums at every level,
/// which differ in the map alone. The numbers of the map are constants, everything that depends on the parameters is in `S`.
#[derive(Clone, Debug)]
pub struct Beam<S> {
    pub(super) axis: Axis,
    /// Whether the centre of mass of a section may lie beside the axis.
    pub(super) eccentric: bool,
    pub(super) map: Map,
    pub(super) inertia: Vec<SpatialInertia<S>>,
    /// Whether inertia is lumped at a station, or it only carries something.
    pub(super) heavy: Vec<bool>,
    pub(super) marks: Vec<usize>,
    pub(super) stiffness: Vec<S>,
    pub(super) damping: Vec<S>,
    /// Whether it is described with any damping.
    pub(super) damped: bool,
    /// In each row of stiffness and damping, where there may be entries.
    pub(super) couplings: Vec<Range<usize>>,
    pub(super) segments: Vec<Segment>,
}

/// The map from coordinates to sections.
#[derive(Clone, Debug)]
pub(super) enum Axis {
    Plane(PlaneAxis),
    Space(SpaceAxis),
    Deflection(DeflectionAxis),
    Linear(LinearAxis),
    Lumped(LumpedAxis),
    Reduced(ReducedAxis),
}

/// The map from coordinates to strains.
#[derive(Clone, Debug)]
pub(super) enum Map {
    Fields(Fields),
    Springs(LumpedAxis),
    /// None: that many modes, whose strains nobody knows.
    Modes(usize),
}

impl Axis {
    /// Exact strain map of a flexible beam: in a plane if it bends in one and is straight at rest, else in space.
    pub(super) fn integrated(fields: &Fields, places: &[f64], rest: &Rest, rule: Rule) -> Self {
        let plane = if rest.is_straight() { PlaneAxis::new(fields, places, rule) } else { None };
        plane.map_or_else(|| Self::Space(SpaceAxis::new(fields, places, rest)), Self::Plane)
    }

    /// Numbers of partial sums that a flexible beam's motion needs.
    pub(super) fn scratch(&self) -> usize {
        match self {
            Self::Plane(axis) => axis.scratch(),
            Self::Deflection(axis) => axis.scratch(),
            Self::Linear(_) | Self::Space(_) | Self::Lumped(_) | Self::Reduced(_) => 0,
        }
    }

    /// Motion of a flexible beam's sections: poses, twists and columns, and accelerations if asked for.
    #[inline]
    pub(super) fn sweep<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>, accelerates: bool) {
        match self {
            Self::Plane(axis) => axis.motion(q, v, out),
            Self::Space(axis) => axis.motion(q, v, out, accelerates),
            Self::Deflection(axis) => axis.motion(q, v, out, accelerates),
            Self::Linear(axis) => axis.motion(q, v, out, accelerates),
            Self::Lumped(axis) => axis.motion(q, v, out),
            Self::Reduced(axis) => axis.motion(q, v, out, accelerates),
        }
    }
}

impl<S: Scalar> Beam<S> {
    /// Number of elastic coordinates of a flexible beam.
    pub fn len(&self) -> usize {
        match &self.map {
            Map::Fields(fields) => fields.len(),
            Map::Springs(axis) => axis.len(),
            Map::Modes(count) => *count,
        }
    }

    /// Whether a flexible beam has no elastic coordinates: it is rigid.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of sections along a flexible beam, root to tip. They have inertia or carry something.
    pub fn stations(&self) -> usize {
        self.inertia.len()
    }

    /// Station of mark `i` on a flexible beam.
    pub fn mark(&self, i: usize) -> usize {
        self.marks[i]
    }

    /// Inertia lumped at a flexible beam's station, in section axes; zero where it only carries something.
    pub fn inertia(&self, station: usize) -> SpatialInertia<S> {
        self.inertia[station]
    }

    /// Whether inertia is lumped at a flexible beam's station, of whatever size.
    pub(crate) fn is_heavy(&self, station: usize) -> bool {
        self.heavy[station]
    }

    /// Section buffers of a flexible beam for [`Beam::motion`], of any number type that lifts the beam's.
    pub fn sections(&self) -> Sections<S> {
        Sections::new(self.stations(), self.len(), self.axis.scratch())
    }

    /// Motion of a flexible beam's sections at coordinates `q` and rates `v`; allocates nothing. It has poses, twists,
    /// accelerations and Jacobian columns.
    pub fn motion(&self, q: &[S], v: &[S], out: &mut Sections<S>) {
        self.sweep(q, v, out, true);
    }

    /// Motion of a flexible beam as [`Beam::motion`], with accelerations only if asked for; else they mean nothing.
    pub(crate) fn sweep(&self, q: &[S], v: &[S], out: &mut Sections<S>, accelerates: bool) {
        debug_assert!(q.len() == self.len() && v.len() == self.len() && out.at.len() == self.stations());
        self.axis.sweep(q, v, out, accelerates);
    }

    /// Motion of a flexible beam outside of its `slices`, for a root that turns with `turn` about the bending axis. Of
    /// the slices there are only sums. Else as [`Beam::motion`].
    pub(crate) fn gather(
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

    /// Axis about which a flexible beam bends, if it bends in one plane and does nothing else.
    pub(crate) fn bending_axis(&self) -> Option<Vector3<f64>> {
        match &self.axis {
            Axis::Plane(axis) => Some(axis.axis()),
            _ => None,
        }
    }

    /// Slices of a flexible beam that bends in one plane, on a root at `root`. The root moves in space or about the
    /// axis of bending alone.
    ///
    /// Where anything else can sit there are none: at the marks.
    pub(crate) fn slices(&self, root: &Pose<f64>, spatial: bool) -> Option<Slices<S>> {
        let Axis::Plane(axis) = &self.axis else { return None };
        Some(axis.slices(&self.inertia, |station| self.is_slice(station), (root, spatial)))
    }

    /// Slices of each segment of a flexible beam, seen from where the segment begins. There are none if one of them
    /// does not bend in one plane.
    pub(crate) fn segment_slices(&self, spatial: bool) -> Option<Vec<Slices<S>>> {
        let of = |segment: &Segment| segment.slices(&self.inertia, |station| self.is_slice(station), spatial);
        self.segments.iter().map(of).collect()
    }

    fn is_slice(&self, station: usize) -> bool {
        self.heavy[station] && !self.eccentric && !self.marks.contains(&station)
    }

    /// Segments of a flexible beam, root to tip: in each only some of its coordinates act.
    pub(crate) fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Range of columns that may hold entries in row `row` of a flexible beam's stiffness and damping.
    #[inline]
    pub(crate) fn couplings(&self, row: usize) -> Range<usize> {
        self.couplings[row].clone()
    }

    /// Elastic stiffness of a flexible beam, row by row.
    pub fn stiffness(&self) -> &[S] {
        &self.stiffness
    }

    /// Damping of a flexible beam, row by row.
    pub fn damping(&self) -> &[S] {
        &self.damping
    }

    /// Whether a flexible beam is described with any damping, of whatever size.
    pub(crate) fn is_damped(&self) -> bool {
        self.damped
    }

    /// Gauge of a flexible beam at `mu` (m): the strain map is made once, outside of hot paths.
    pub fn gauge(&self, mu: f64) -> Gauge {
        let mut entries: Vec<_> = match &self.map {
            Map::Fields(fields) => {
                let row = fields.strain_row(mu).into_iter().zip(&fields.components).enumerate();
                row.map(|(k, (entry, &component))| (k, component, entry)).collect()
            }
            Map::Springs(axis) => {
                axis.strain_row(mu).into_iter().map(|(k, component, entry)| (k, component as usize, entry)).collect()
            }
            Map::Modes(_) => Vec::new(),
        };
        entries.retain(|&(.., entry)| entry != 0.0);
        Gauge { entries }
    }

    /// Strain screw of a flexible beam at `mu` (m); in a loop, use [`Beam::gauge`]. It is (kappa_x, kappa_y, twist,
    /// shear_x, shear_y, extension).
    pub fn strain(&self, mu: f64, q: &[S]) -> [S; 6] {
        self.gauge(mu).strain(q)
    }

    /// Largest slope of a flexible beam in rad, where its map is right to first or second order only. It is that of the
    /// axis against its direction at the root; none where the map is exact.
    pub fn slope(&self, q: &[S]) -> Option<S> {
        match &self.axis {
            Axis::Deflection(axis) => Some(axis.slope(q)),
            Axis::Linear(axis) => Some(axis.slope(q)),
            Axis::Reduced(axis) => Some(axis.slope(q)),
            _ => None,
        }
    }

    /// Slope limit (rad) of a flexible beam, beyond which interpolated deflection is wrong by more than 1 %. That share
    /// of its deflection holds under the hardest of the usual loads: a force across the tip. The error goes with the
    /// square of the slope.
    pub const fn slope_limit() -> f64 {
        0.147
    }

    /// Place of the mark `i` of a flexible beam in the root frame at rest, for the place `at`.
    pub(crate) fn at_rest(&self, i: usize, at: f64) -> Pose<f64> {
        let place = match &self.axis {
            Axis::Reduced(axis) => axis.place(i),
            _ => Vector3::new(0.0, 0.0, at),
        };
        Pose { translation: place, ..Pose::identity() }
    }

    /// Mass matrix of the clamped flexible beam at rest, row by row.
    pub fn mass(&self) -> Vec<S> {
        let (n, mut sections) = (self.len(), self.sections());
        let (zero, mut mass) = (vec![S::zero(); n], vec![S::zero(); n * n]);
        self.motion(&zero, &zero, &mut sections);
        for (inertia, columns) in self.inertia.iter().zip(sections.columns.chunks_exact(n.max(1))) {
            for (i, column) in columns.iter().enumerate() {
                let momentum = inertia.apply(*column);
                for (j, other) in columns.iter().enumerate() {
                    mass[i * n + j] += other.power(momentum);
                }
            }
        }
        mass
    }

    /// Natural frequencies (rad/s) and modes of the clamped flexible beam alone, from its parameter values.
    pub fn modes(&self) -> Result<Modes> {
        let values = |matrix: &[S]| DMatrix::from_row_iterator(self.len(), self.len(), matrix.iter().map(Scalar::re));
        eigen::modes(&values(&self.stiffness), &values(&self.mass()))
    }
}
