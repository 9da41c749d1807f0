//! Beams of rigid segments with springs between them, and rigid beams.

use super::entry::Component;
use super::motion::Sections;
use super::profile::Profile;
use super::quadrature::composite;
use super::rest::{Rest, lift};
use crate::error::Result;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, SpatialInertia, Twist, Vector3};

/// Gauss points on a segment and on the region of a spring.
const POINTS: usize = 4;

/// Rigid segments of equal length along the axis, each hinged to the one before, the first to the root.
///
/// The coordinates are those of the hinges, root first; in a hinge the components follow one another as listed, like joints with
/// nothing between. The spring of a hinge stands for the elasticity from the middle of one segment to the middle of the next,
/// `1 / k = int dmu / K`; that of the hinge at the clamp for the half segment beyond it. The outer half of the last segment is rigid.
#[derive(Clone, Debug)]
pub(super) struct LumpedAxis {
    components: Vec<Component>,
    segments: usize,
    length: f64,
    /// What lies between a section and the one before it.
    steps: Vec<Step>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    /// Along the rigid axis.
    Shift(Pose<f64>),
    /// Through the hinge with that number.
    Hinge(usize),
    /// A section.
    Section,
}

impl LumpedAxis {
    /// Lumped axis of `segments` with hinges of these components; with none of them it is rigid.
    pub fn new(components: &[Component], (segments, length): (usize, f64), places: &[f64], rest: &Rest) -> Self {
        let mut axis = Self { components: components.to_vec(), segments, length, steps: Vec::new() };
        let (mut here, mut next) = (0.0, 0);
        for &place in places {
            // A section at a hinge belongs to the segment before it, at the clamp to the first one.
            while next < segments && (axis.hinge(next) < place || next == 0) {
                axis.shift(&mut here, axis.hinge(next), rest);
                if !components.is_empty() {
                    axis.steps.push(Step::Hinge(next));
                }
                next += 1;
            }
            axis.shift(&mut here, place, rest);
            axis.steps.push(Step::Section);
        }
        axis
    }

    fn shift(&mut self, here: &mut f64, to: f64, rest: &Rest) {
        if to > *here {
            self.steps.push(Step::Shift(rest.across(*here, to)));
            *here = to;
        }
    }

    /// Place of a hinge on a lumped beam.
    fn hinge(&self, number: usize) -> f64 {
        self.length * number as f64 / self.segments as f64
    }

    /// Number of coordinates of a lumped beam.
    pub fn len(&self) -> usize {
        self.components.len() * self.segments
    }

    /// Middles of a lumped beam's segments: the places of their inertia.
    pub fn middles(components: &[Component], segments: usize, length: f64) -> Vec<f64> {
        let segments = if components.is_empty() { 1 } else { segments };
        (0..segments).map(|k| length * (k as f64 + 0.5) / segments as f64).collect()
    }

    /// Inertia of a whole segment of a lumped beam, in the axes of the section in its middle.
    pub fn segment<S: Scalar>(profile: &Profile<S>, middle: f64, segments: usize) -> Result<SpatialInertia<S>> {
        let (half, rest) = (0.5 * profile.length() / segments as f64, profile.rest());
        let mut inertia = SpatialInertia::zero();
        for at in composite(POINTS, &pieces(profile, middle - half, middle + half)) {
            inertia += lift(&rest.across(middle, at.place)).inertia(profile.slice(at.place, at.weight)?);
        }
        Ok(inertia)
    }

    /// Region of a lumped beam's spring: from one segment's middle to the next, or from the clamp.
    fn region(&self, hinge: usize) -> [f64; 2] {
        let (at, half) = (self.hinge(hinge), 0.5 * self.length / self.segments as f64);
        [(at - half).max(0.0), at + half]
    }

    /// Spring constants of a lumped beam, as a diagonal matrix, row by row.
    pub fn stiffness<S: Scalar>(&self, profile: &Profile<S>) -> Result<Vec<S>> {
        let n = self.len();
        let mut stiffness = vec![S::zero(); n * n];
        for hinge in 0..if self.components.is_empty() { 0 } else { self.segments } {
            let [begin, end] = self.region(hinge);
            let mut compliance = [S::zero(); 6];
            for at in composite(POINTS, &pieces(profile, begin, end)) {
                for (sum, modulus) in compliance.iter_mut().zip(profile.at(at.place)?.stiffness) {
                    *sum += modulus.recip() * at.weight;
                }
            }
            for (place, &component) in self.components.iter().enumerate() {
                let k = hinge * self.components.len() + place;
                stiffness[k * n + k] = compliance[component as usize].recip();
            }
        }
        Ok(stiffness)
    }

    /// Strain of a lumped beam at `mu` per unit of each coordinate. It is that of the hinge whose spring stands for the
    /// place, spread evenly over it.
    pub fn strain_row(&self, mu: f64) -> Vec<(usize, Component, f64)> {
        let size = self.length / self.segments as f64;
        let hinge = ((mu / size + 0.5) as usize).min(self.segments - 1);
        let [begin, end] = self.region(hinge);
        let first = hinge * self.components.len();
        self.components.iter().enumerate().map(|(k, &part)| (first + k, part, 1.0 / (end - begin))).collect()
    }

    /// Motion of a lumped beam: poses, twists, columns and accelerations of all sections.
    pub fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>) {
        let (n, mut station) = (self.len(), 0);
        let mut moving = out.begin(station, n);
        for step in &self.steps {
            match *step {
                Step::Shift(across) => {
                    let across = lift(&across);
                    moving.advance(&across, Twist::zero(), Twist::zero());
                    carry(&across, &mut out.columns[station * n..(station + 1) * n]);
                }
                Step::Hinge(number) => {
                    for (place, &component) in self.components.iter().enumerate() {
                        let k = number * self.components.len() + place;
                        let axis = axis(component);
                        let across = component.joint(q[k]);
                        moving.advance(&across, axis * v[k], Twist::zero());
                        let columns = &mut out.columns[station * n..(station + 1) * n];
                        carry(&across, &mut columns[..k]);
                        columns[k] = axis;
                    }
                }
                Step::Section => {
                    out.at[station] = moving;
                    station += 1;
                    if station < out.at.len() {
                        moving = out.begin(station, n);
                    }
                }
            }
        }
    }
}

/// Ends of the smooth pieces of a lumped beam between two places.
fn pieces<S: Scalar>(profile: &Profile<S>, begin: f64, end: f64) -> Vec<f64> {
    let inside = profile.breaks(&[0.0, profile.length()]).into_iter().filter(|&at| at > begin && at < end);
    std::iter::once(begin).chain(inside).chain([end]).collect()
}

fn carry<S: Scalar>(across: &Pose<S>, columns: &mut [Twist<S>]) {
    for column in columns {
        *column = across.inverse_twist(*column);
    }
}

/// Motion of a lumped beam's hinge per unit rate.
fn axis<S: Scalar>(component: Component) -> Twist<S> {
    let unit = |k: usize| Vector3::from_f64([0, 1, 2].map(|at| if at == k { 1.0 } else { 0.0 }));
    match component as usize {
        turn @ 0..3 => Twist::new(unit(turn), Vector3::zero()),
        slide => Twist::new(Vector3::zero(), unit(slide - 3)),
    }
}

impl Component {
    /// Pose across a lumped beam's hinge at coordinate `q` (rad or m).
    fn joint<S: Scalar>(self, q: S) -> Pose<S> {
        let motion = axis::<S>(self);
        match self {
            Self::BendingX | Self::BendingY | Self::Torsion => {
                Pose::new(Matrix3::rotation(motion.angular, q), Vector3::zero())
            }
            _ => Pose::new(Matrix3::identity(), motion.linear * q),
        }
    }
}
