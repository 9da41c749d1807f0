//! One flexible beam, at any level, over the number type of its parameters.

use nalgebra::DMatrix;

use super::damping::damping;
use super::deflection::{DeflectionAxis, modal};
use super::eigen::{self, Modes};
use super::entry::{BeamEntry, Component, Level};
use super::fields::{Field, Fields, Interpolated, basis};
use super::lumped::LumpedAxis;
use super::motion::Sections;
use super::profile::Profile;
use super::strain::{PlaneAxis, SpaceAxis};
use crate::error::Result;
use crate::scalar::Scalar;
use crate::spatial::SpatialInertia;

/// Stations of a smooth strain beam beyond the coefficients of a component.
const STRAIN_STATIONS: usize = 4;
/// Stations on each element.
const ELEMENT_STATIONS: usize = 3;

/// A straight beam along z of its root frame: a map from elastic coordinates to sections, inertia at sections, and constant
/// matrices of stiffness and damping.
///
/// By virtual work `M = sum J^T m J` over the stations, and likewise for the velocity terms and gravity: the same sums at every level,
/// which differ in the map alone. The numbers of the map are constants, everything that depends on the parameters is in `S`.
#[derive(Clone, Debug)]
pub struct Beam<S> {
    axis: Axis,
    map: Map,
    inertia: Vec<SpatialInertia<S>>,
    marks: Vec<usize>,
    stiffness: Vec<S>,
    damping: Vec<S>,
}

/// The map from coordinates to sections.
#[derive(Clone, Debug)]
enum Axis {
    Plane(PlaneAxis),
    Space(SpaceAxis),
    Deflection(DeflectionAxis),
    Lumped(LumpedAxis),
}

/// The map from coordinates to strains.
#[derive(Clone, Debug)]
enum Map {
    Fields(Fields),
    Springs(LumpedAxis),
}

/// The strain at one place of the axis as a linear map of the coordinates, made by [`Beam::gauge`].
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    entries: Vec<(usize, usize, f64)>,
}

impl Gauge {
    /// The strain screw (kappa_x, kappa_y, twist, shear_x, shear_y, extension) at coordinates `q`; allocates nothing.
    pub fn strain<S: Scalar>(&self, q: &[S]) -> [S; 6] {
        let mut strain = [S::zero(); 6];
        for &(coordinate, component, entry) in &self.entries {
            strain[component] += q[coordinate] * entry;
        }
        strain
    }
}

/// A section that carries inertia, something else, or both.
#[derive(Clone, Copy, Debug)]
struct Place {
    at: f64,
    /// Length of beam whose inertia is lumped there.
    weight: f64,
}

impl<S: Scalar> Beam<S> {
    /// The beam of an entry with additional stations at the arc lengths `marks` (m). Checked: as by [`BeamEntry::check`], marks on the beam.
    pub fn new(entry: &BeamEntry<S>, marks: &[f64]) -> Result<Self> {
        entry.check()?;
        for &mark in marks {
            entry.check_place("at", mark)?;
        }
        let profile = Profile::new(entry);
        match entry.level {
            Level::Rigid => Self::segmented(entry, &profile, (&[], 1), marks),
            Level::Lumped(n) => Self::segmented(entry, &profile, (&entry.deforms, n), marks),
            _ => Self::smooth(entry, &profile, marks),
        }
    }

    /// A beam whose strain or deflection is interpolated.
    fn smooth(entry: &BeamEntry<S>, profile: &Profile<S>, marks: &[f64]) -> Result<Self> {
        let field = |&component| Ok(Field { component, basis: basis(entry.level, component, entry.length)? });
        let mut list = entry.deforms.iter().map(field).collect::<Result<Vec<_>>>()?;
        let (interpolated, points) = match entry.level {
            Level::Strain(n) => (Interpolated::Strain, n + STRAIN_STATIONS),
            Level::Elements(_) => (Interpolated::Strain, ELEMENT_STATIONS),
            Level::Hermite(_) => (Interpolated::Deflection, ELEMENT_STATIONS),
            Level::Modal(count) => {
                list = modal(profile, list, count)?;
                (Interpolated::Deflection, 2 * count + STRAIN_STATIONS)
            }
            _ => (Interpolated::Deflection, list.iter().map(|field| field.basis.points()).max().unwrap_or(1)),
        };
        let fields = Fields::new(interpolated, list);
        let rule = profile.rule(points, &fields.breaks());
        let (places, marks) = merged(rule.iter().map(|at| Place { at: at.place, weight: at.weight }).collect(), marks);
        let at: Vec<f64> = places.iter().map(|place| place.at).collect();
        let axis = match interpolated {
            Interpolated::Deflection => Axis::Deflection(DeflectionAxis::new(&fields, &at)),
            Interpolated::Strain => {
                PlaneAxis::new(&fields, &at).map_or_else(|| Axis::Space(SpaceAxis::new(&fields, &at)), Axis::Plane)
            }
        };
        let inertia = places.iter().map(|place| profile.slice(place.at, place.weight)).collect::<Result<_>>()?;
        let stiffness = fields.stiffness(profile)?;
        let groups = groups(|component| {
            (0..fields.len()).filter(|&k| fields.components[k] == component as usize).collect::<Vec<_>>()
        });
        let beam = Self { axis, map: Map::Fields(fields), inertia, marks, stiffness, damping: Vec::new() };
        beam.damped(entry, &groups)
    }

    /// A beam of rigid segments, or a rigid one.
    fn segmented(
        entry: &BeamEntry<S>,
        profile: &Profile<S>,
        (components, segments): (&[Component], usize),
        marks: &[f64],
    ) -> Result<Self> {
        let middles = LumpedAxis::middles(components, segments, entry.length);
        let (places, marks) = merged(middles.iter().map(|&at| Place { at, weight: 1.0 }).collect(), marks);
        let at: Vec<f64> = places.iter().map(|place| place.at).collect();
        let axis = LumpedAxis::new(components, segments, entry.length, &at);
        let whole = |place: &Place| match place.weight {
            0.0 => Ok(SpatialInertia::zero()),
            _ => LumpedAxis::segment(profile, place.at, segments),
        };
        let inertia = places.iter().map(whole).collect::<Result<_>>()?;
        let (stiffness, each) = (axis.stiffness(profile)?, components.len());
        let groups =
            groups(|component| (0..axis.len()).filter(|&k| components[k % each] == component).collect::<Vec<_>>());
        let map = Map::Springs(axis.clone());
        let beam = Self { axis: Axis::Lumped(axis), map, inertia, marks, stiffness, damping: Vec::new() };
        beam.damped(entry, &groups)
    }

    fn damped(mut self, entry: &BeamEntry<S>, groups: &[Vec<usize>]) -> Result<Self> {
        self.damping = damping(entry, &self.stiffness, || self.mass(), groups)?;
        Ok(self)
    }

    /// How many elastic coordinates there are.
    pub fn len(&self) -> usize {
        match &self.map {
            Map::Fields(fields) => fields.len(),
            Map::Springs(axis) => axis.len(),
        }
    }

    /// Whether there are none: the beam is rigid.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many sections there are along the axis, root to tip: those with inertia and those that carry something.
    pub fn stations(&self) -> usize {
        self.inertia.len()
    }

    /// The station of mark `i`.
    pub fn mark(&self, i: usize) -> usize {
        self.marks[i]
    }

    /// The inertia lumped at a station, in section axes; zero where a section only carries something.
    pub fn inertia(&self, station: usize) -> SpatialInertia<S> {
        self.inertia[station]
    }

    /// Buffers for [`Beam::motion`], of any number type that the beam's can be lifted to.
    pub fn sections(&self) -> Sections<S> {
        let scratch = match &self.axis {
            Axis::Plane(axis) => axis.scratch(),
            Axis::Deflection(axis) => axis.scratch(),
            Axis::Space(_) | Axis::Lumped(_) => 0,
        };
        Sections::new(self.stations(), self.len(), scratch)
    }

    /// Poses, twists, accelerations and Jacobian columns of all sections at coordinates `q` and rates `v`; allocates nothing.
    pub fn motion(&self, q: &[S], v: &[S], out: &mut Sections<S>) {
        debug_assert!(q.len() == self.len() && v.len() == self.len() && out.at.len() == self.stations());
        match &self.axis {
            Axis::Plane(axis) => axis.motion(q, v, out),
            Axis::Space(axis) => axis.motion(q, v, out),
            Axis::Deflection(axis) => axis.motion(q, v, out),
            Axis::Lumped(axis) => axis.motion(q, v, out),
        }
    }

    /// Elastic stiffness, row by row.
    pub fn stiffness(&self) -> &[S] {
        &self.stiffness
    }

    /// Damping, row by row.
    pub fn damping(&self) -> &[S] {
        &self.damping
    }

    /// The strain at `mu` (m), prepared: the map is made once, outside of hot paths.
    pub fn gauge(&self, mu: f64) -> Gauge {
        let mut entries: Vec<_> = match &self.map {
            Map::Fields(fields) => {
                let row = fields.strain_row(mu).into_iter().zip(&fields.components).enumerate();
                row.map(|(k, (entry, &component))| (k, component, entry)).collect()
            }
            Map::Springs(axis) => {
                axis.strain_row(mu).into_iter().map(|(k, component, entry)| (k, component as usize, entry)).collect()
            }
        };
        entries.retain(|&(.., entry)| entry != 0.0);
        Gauge { entries }
    }

    /// The strain screw (kappa_x, kappa_y, twist, shear_x, shear_y, extension) at `mu` (m); in a loop, use [`Beam::gauge`].
    pub fn strain(&self, mu: f64, q: &[S]) -> [S; 6] {
        self.gauge(mu).strain(q)
    }

    /// The largest slope of the axis against its direction at the root in rad, where the map is right to second order in it only; none
    /// where it is exact.
    pub fn slope(&self, q: &[S]) -> Option<S> {
        match &self.axis {
            Axis::Deflection(axis) => Some(axis.slope(q)),
            _ => None,
        }
    }

    /// The slope (rad) beyond which a beam with interpolated deflection is wrong by more than 1 % of its deflection, under the hardest of
    /// the usual loads: a force across the tip. The error goes with the square of the slope.
    pub const fn slope_limit() -> f64 {
        0.147
    }

    /// Mass matrix of the clamped beam at rest, row by row.
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

    /// Natural frequencies (rad/s) and modes of the clamped beam alone, from the values of the parameters.
    pub fn modes(&self) -> Result<Modes> {
        let values = |matrix: &[S]| DMatrix::from_row_iterator(self.len(), self.len(), matrix.iter().map(Scalar::re));
        eigen::modes(&values(&self.stiffness), &values(&self.mass()))
    }
}

/// Coordinates that couple in a straight beam at rest: each bending with the shear of its plane.
fn groups(of: impl Fn(Component) -> Vec<usize>) -> [Vec<usize>; 4] {
    let both = |bending, shear| [of(bending), of(shear)].concat();
    [
        both(Component::BendingX, Component::ShearY),
        both(Component::BendingY, Component::ShearX),
        of(Component::Torsion),
        of(Component::Extension),
    ]
}

/// Stations and marks, root to tip, and the place of each mark in the list.
fn merged(mut places: Vec<Place>, marks: &[f64]) -> (Vec<Place>, Vec<usize>) {
    for &at in marks {
        if !places.iter().any(|place| place.at == at) {
            places.push(Place { at, weight: 0.0 });
        }
    }
    places.sort_by(|a, b| a.at.total_cmp(&b.at));
    let marks = marks.iter().map(|&at| places.iter().position(|place| place.at == at).unwrap_or(0)).collect();
    (places, marks)
}
