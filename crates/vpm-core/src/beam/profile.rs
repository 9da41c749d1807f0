//! Sections along the axis of a beam.

use super::entry::BeamEntry;
use super::quadrature::{Station, composite};
use super::{Section, Shape};
use crate::error::Result;
use crate::scalar::Scalar;
use crate::spatial::{SpatialInertia, Symmetric3, Vector3};

/// Points of a Gauss rule beyond those of the shape functions where sizes change along the axis: stiffness goes with their fourth power.
const TAPER: usize = 3;

/// Stiffness and inertia per length as functions of the arc length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Profile<'a, S> {
    entry: &'a BeamEntry<S>,
}

impl<'a, S: Scalar> Profile<'a, S> {
    /// The sections of a beam whose entry has been checked.
    pub fn new(entry: &'a BeamEntry<S>) -> Self {
        Self { entry }
    }

    /// Length of the beam in m.
    pub fn length(&self) -> f64 {
        self.entry.length
    }

    /// Points of a Gauss rule beyond those of the shape functions.
    pub fn extra(&self) -> usize {
        if self.entry.sections.len() > 1 { TAPER } else { 0 }
    }

    /// Whether there is one section for the whole beam.
    pub fn is_uniform(&self) -> bool {
        self.entry.sections.len() == 1
    }

    /// Arc lengths between which the section changes smoothly and shape functions with these `breaks` are smooth, ascending.
    pub fn breaks(&self, breaks: &[f64]) -> Vec<f64> {
        let sections = &self.entry.sections;
        let inside = sections.iter().map(|entry| entry.at).filter(|&at| at > 0.0 && at < self.length());
        let mut all: Vec<f64> = breaks.iter().copied().chain(inside).collect();
        all.sort_by(f64::total_cmp);
        all.dedup_by(|b, a| *b - *a < 1e-12 * self.length());
        all
    }

    /// A Gauss rule of `count` points, and more for tapered beams, on every smooth piece.
    pub fn rule(&self, count: usize, breaks: &[f64]) -> Vec<Station> {
        composite(count + self.extra(), &self.breaks(breaks))
    }

    /// The section at `mu`.
    pub fn at(&self, mu: f64) -> Result<Section<S>> {
        Section::new(self.shape(mu), self.entry.material)
    }

    fn shape(&self, mu: f64) -> Shape<S> {
        let sections = &self.entry.sections;
        let next = sections.iter().position(|entry| entry.at > mu);
        match next {
            None => sections[sections.len() - 1].shape,
            Some(0) => sections[0].shape,
            Some(next) => {
                let (before, after) = (&sections[next - 1], &sections[next]);
                let part = (mu - before.at) / (after.at - before.at);
                before.shape.between(&after.shape, part).unwrap_or(before.shape)
            }
        }
    }

    /// A slice of the beam of that length, in section axes, its centre in the origin.
    pub fn slice(&self, mu: f64, length: f64) -> Result<SpatialInertia<S>> {
        let [x, y, z, mass, ..] = self.at(mu)?.inertia.map(|density| density * length);
        let zero = S::zero();
        Ok(SpatialInertia::new(mass, Vector3::zero(), Symmetric3::from_array([x, y, z, zero, zero, zero])))
    }
}
