//! From the entry of a beam to its map, its stations and its constant matrices.

use std::ops::Range;

use super::Basis;
use super::damping::damping;
use super::deflection::{DeflectionAxis, LinearAxis, modal};
use super::entry::{BeamEntry, Component, Level};
use super::fields::{Field, Fields, Interpolated, basis};
use super::flexible::{Axis, Beam, Map};
use super::lumped::LumpedAxis;
use super::profile::Profile;
use super::reduced::{Fields as ReducedFields, Reduced, ReducedAxis};
use super::segment::{Segment, damps_locally};
use super::strain::Rule;
use crate::error::Result;
use crate::scalar::Scalar;
use crate::spatial::{SpatialInertia, Vector3};

/// Stations of a smooth strain beam beyond the coefficients of a component.
const STRAIN_STATIONS: usize = 4;
/// Stations on each element.
const ELEMENT_STATIONS: usize = 3;

/// What holds where the terms of second order are left out.
const LINEAR: &str = "be straight and untwisted where the deflection is linear in the coordinates (second_order)";

/// Up to which order in the deflection the map is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    First,
    Second,
}

/// Whether a constructed beam integrates poses from the strain, exact at any deflection. Elsewhere they are right to
/// second order.
fn integrated(level: Level) -> bool {
    matches!(level, Level::Strain(_) | Level::Elements(_) | Level::Bezier(_))
}

/// A section that carries inertia, something else, or both.
#[derive(Clone, Copy, Debug)]
struct Place {
    at: f64,
    /// Length of beam whose inertia is lumped there.
    weight: f64,
}

impl Place {
    fn is_heavy(&self) -> bool {
        self.weight != 0.0
    }
}

impl<S: Scalar> Beam<S> {
    /// Constructs the beam of an entry with additional stations at the arc lengths `marks` (m). Checked: as by
    /// [`BeamEntry::check`], marks on the beam.
    pub fn new(entry: &BeamEntry<S>, marks: &[f64]) -> Result<Self> {
        Self::of_order(entry, marks, Order::Second)
    }

    /// Constructs a beam as [`Beam::new`], but with a deflection that is linear in the coordinates. Rigid beams have no
    /// deflection, and the hinges of lumped ones no terms of second order apart from the others: those are as they are.
    pub fn first_order(entry: &BeamEntry<S>, marks: &[f64]) -> Result<Self> {
        Self::of_order(entry, marks, Order::First)
    }

    fn of_order(entry: &BeamEntry<S>, marks: &[f64], order: Order) -> Result<Self> {
        entry.check()?;
        for &mark in marks {
            entry.check_place("at", mark)?;
        }
        let profile = Profile::new(entry);
        if let Some(reduced) = &entry.reduced {
            return Self::reduced(entry, reduced, marks, order);
        }
        if order == Order::First && integrated(entry.level) && !profile.rest().is_straight() {
            return Err(entry.domain("rest", LINEAR, entry.rest[0].at));
        }
        match entry.level {
            Level::Rigid => Self::segmented(entry, &profile, (&[], 1), marks),
            Level::Lumped(n) => Self::segmented(entry, &profile, (&entry.deforms, n), marks),
            _ => Self::smooth(entry, &profile, marks, order),
        }
    }

    /// Constructs a beam whose strain or deflection is interpolated.
    fn smooth(entry: &BeamEntry<S>, profile: &Profile<S>, marks: &[f64], order: Order) -> Result<Self> {
        let field = |&component| Ok(Field { component, basis: basis(entry.level, component, entry.length)? });
        let mut list = entry.deforms.iter().map(field).collect::<Result<Vec<_>>>()?;
        let most = |count: fn(&Basis) -> usize| list.iter().map(|field| count(&field.basis)).max().unwrap_or(1);
        let (interpolated, points) = match entry.level {
            Level::Strain(n) => (Interpolated::Strain, n + STRAIN_STATIONS),
            Level::Bezier(_) => (Interpolated::Deflection, most(Basis::len) + STRAIN_STATIONS),
            Level::Elements(_) => (Interpolated::Strain, ELEMENT_STATIONS),
            Level::Hermite(_) => (Interpolated::Deflection, ELEMENT_STATIONS),
            Level::Modal(count) => {
                list = modal(profile, list, count)?;
                (Interpolated::Deflection, 2 * count + STRAIN_STATIONS)
            }
            _ => (Interpolated::Deflection, most(Basis::points)),
        };
        let fields = Fields::new(interpolated, list);
        let rule = profile.rule(points, &fields.breaks());
        let (places, marks) = merged(rule.iter().map(|at| Place { at: at.place, weight: at.weight }).collect(), marks);
        let at: Vec<f64> = places.iter().map(|place| place.at).collect();
        let axis = match order {
            Order::First => Axis::Linear(LinearAxis::new(&fields, &at)),
            Order::Second if !integrated(entry.level) => Axis::Deflection(DeflectionAxis::new(&fields, &at)),
            Order::Second => {
                let elements = matches!(entry.level, Level::Elements(_));
                let rule = if elements { Rule::Elements } else { Rule::Sections };
                Axis::integrated(&fields, &at, &profile.rest(), rule)
            }
        };
        let inertia = places.iter().map(|place| profile.slice(place.at, place.weight)).collect::<Result<_>>()?;
        let stiffness = fields.stiffness(profile)?;
        let groups = groups(profile, |component| {
            (0..fields.len()).filter(|&k| fields.components[k] == component as usize).collect::<Vec<_>>()
        });
        let segments = match entry.level {
            Level::Elements(n) if order == Order::Second && damps_locally(entry) => {
                Segment::elements(&entry.deforms, (entry.length, n), &at, &profile.rest())?
            }
            _ => Segment::whole(&axis, fields.len(), at.len()),
        };
        let heavy = places.iter().map(Place::is_heavy).collect();
        let (map, damping, couplings) = (Map::Fields(fields), Vec::new(), Vec::new());
        let beam = Self {
            eccentric: profile.is_eccentric(),
            axis,
            map,
            inertia,
            heavy,
            marks,
            stiffness,
            damping,
            damped: false,
            couplings,
            segments,
        };
        beam.damped(entry, &groups)
    }

    /// Constructs a beam of rigid segments, or a rigid one.
    fn segmented(
        entry: &BeamEntry<S>,
        profile: &Profile<S>,
        (components, segments): (&[Component], usize),
        marks: &[f64],
    ) -> Result<Self> {
        let middles = LumpedAxis::middles(components, segments, entry.length);
        let (places, marks) = merged(middles.iter().map(|&at| Place { at, weight: 1.0 }).collect(), marks);
        let at: Vec<f64> = places.iter().map(|place| place.at).collect();
        let axis = LumpedAxis::new(components, (segments, entry.length), &at, &profile.rest());
        let whole = |place: &Place| match place.weight {
            0.0 => Ok(SpatialInertia::zero()),
            _ => LumpedAxis::segment(profile, place.at, segments),
        };
        let inertia = places.iter().map(whole).collect::<Result<_>>()?;
        let (stiffness, each) = (axis.stiffness(profile)?, components.len());
        let groups = groups(profile, |component| {
            (0..axis.len()).filter(|&k| components[k % each] == component).collect::<Vec<_>>()
        });
        let (map, coordinates) = (Map::Springs(axis.clone()), axis.len());
        let heavy = places.iter().map(Place::is_heavy).collect();
        let axis = Axis::Lumped(axis);
        let segments = if !components.is_empty() && damps_locally(entry) {
            Segment::hinged(components, (entry.length, segments), &at, &profile.rest())
        } else {
            Segment::whole(&axis, coordinates, at.len())
        };
        let (damping, couplings) = (Vec::new(), Vec::new());
        let beam = Self {
            eccentric: profile.is_eccentric(),
            axis,
            map,
            inertia,
            heavy,
            marks,
            stiffness,
            damping,
            damped: false,
            couplings,
            segments,
        };
        beam.damped(entry, &groups)
    }

    /// Constructs the first modes of a reduced solid: its point masses, then the interfaces that carry something.
    fn reduced(entry: &BeamEntry<S>, reduced: &Reduced, marks: &[f64], order: Order) -> Result<Self> {
        let n = if let Level::Reduced(n) = entry.level { n } else { 0 };
        let (solid, quadratic) = (reduced.solid(), order == Order::Second);
        let points: Vec<_> = solid.points.iter().map(|point| ReducedFields::new(point, n, quadratic)).collect();
        let frame = |&at: &f64| {
            let root = ReducedFields::still([0.0; 6], n);
            reduced.interface(at).map_or(root, |field| ReducedFields::new(field, n, quadratic))
        };
        let masses = points.len();
        let axis = ReducedAxis::new(n, points, marks.iter().map(frame).collect());
        let (stiffer, heavier) = entry.factors();
        let point = |&mass: &f64| SpatialInertia::point_mass(heavier * mass, Vector3::zero());
        let carried = marks.iter().map(|_| SpatialInertia::zero());
        let inertia: Vec<_> = solid.masses.iter().map(point).chain(carried).collect();
        let mut stiffness = vec![S::zero(); n * n];
        for (place, &square) in solid.squares[..n].iter().enumerate() {
            stiffness[place * n + place] = stiffer * square;
        }
        let heavy = (0..inertia.len()).map(|station| station < masses).collect();
        let marks = (masses..inertia.len()).collect();
        let axis = Axis::Reduced(axis);
        let segments = Segment::whole(&axis, n, inertia.len());
        let (map, damping, couplings) = (Map::Modes(n), Vec::new(), Vec::new());
        let beam = Self {
            axis,
            map,
            inertia,
            heavy,
            eccentric: false,
            marks,
            stiffness,
            damping,
            damped: false,
            couplings,
            segments,
        };
        let alone: Vec<Vec<usize>> = (0..n).map(|mode| vec![mode]).collect();
        beam.damped(entry, &alone)
    }

    fn damped(mut self, entry: &BeamEntry<S>, groups: &[Vec<usize>]) -> Result<Self> {
        self.damping = damping(entry, &self.stiffness, || self.mass(), groups)?;
        let law = &entry.damping;
        self.damped = law.stiffness.is_some() || law.mass.is_some() || !law.ratios.is_empty();
        let n = self.len();
        self.couplings = match damps_locally(entry) {
            true => self.stiffness.chunks_exact(n.max(1)).map(filled).collect(),
            false => vec![0..n; n],
        };
        Ok(self)
    }
}

/// Range of a constructed matrix row from the first entry that is not zero to behind the last one.
fn filled<S: Scalar>(row: &[S]) -> Range<usize> {
    // Moduli are positive, so that only shapes which do not overlap give zeros.
    let filled = |entry: &S| entry.inspect() != 0.0;
    let first = row.iter().position(filled).unwrap_or(0);
    first..row.iter().rposition(filled).map_or(first, |last| last + 1)
}

/// Groups of coordinates that couple at rest in a constructed beam. In a straight beam with its mass on the axis each
/// bending couples with the shear of its plane, else all do.
fn groups<S: Scalar>(profile: &Profile<S>, of: impl Fn(Component) -> Vec<usize>) -> Vec<Vec<usize>> {
    if profile.is_eccentric() || !profile.rest().is_straight() {
        let mut all: Vec<usize> = Component::ALL.into_iter().flat_map(of).collect();
        all.sort_unstable();
        return vec![all];
    }
    let both = |bending, shear| [of(bending), of(shear)].concat();
    vec![
        both(Component::BendingX, Component::ShearY),
        both(Component::BendingY, Component::ShearX),
        of(Component::Torsion),
        of(Component::Extension),
    ]
}

/// Stations and marks of a constructed beam, root to tip, and the place of each mark in the list.
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
