//! Sections along the axis of a beam.

use super::entry::{BeamEntry, SectionEntry};
use super::quadrature::{Station, composite};
use super::rest::Rest;
use super::{Material, Section, Shape};
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
    /// Profile of the sections of a beam whose entry has been checked.
    pub fn new(entry: &'a BeamEntry<S>) -> Self {
        Self { entry }
    }

    /// Length in m of the beam with this profile.
    pub fn length(&self) -> f64 {
        self.entry.length
    }

    /// Points of a Gauss rule that the profile needs beyond those of the shape functions.
    pub fn extra(&self) -> usize {
        if self.entry.sections.len() > 1 { TAPER } else { 0 }
    }

    /// Whether the profile has one section for the whole beam.
    pub fn is_uniform(&self) -> bool {
        self.entry.sections.len() == 1
    }

    /// Breaks of the profile and the shape functions' `breaks`, ascending: all is smooth between them.
    pub fn breaks(&self, breaks: &[f64]) -> Vec<f64> {
        let (sections, rest) = (&self.entry.sections, &self.entry.rest);
        let places = sections.iter().map(|entry| entry.at).chain(rest.iter().map(|entry| entry.at));
        let inside = places.filter(|&at| at > 0.0 && at < self.length());
        let mut all: Vec<f64> = breaks.iter().copied().chain(inside).collect();
        all.sort_by(f64::total_cmp);
        all.dedup_by(|b, a| *b - *a < 1e-12 * self.length());
        all
    }

    /// Gauss rule for the profile on every smooth piece: `count` points, and more for tapered beams.
    pub fn rule(&self, count: usize, breaks: &[f64]) -> Vec<Station> {
        composite(count + self.extra(), &self.breaks(breaks))
    }

    /// Section of the profile at `mu`.
    pub fn at(&self, mu: f64) -> Result<Section<S>> {
        let sections = &self.entry.sections;
        let own = |entry: &SectionEntry<S>| Section::of(&entry.shape, self.material(entry));
        match sections.iter().position(|entry| entry.at > mu) {
            None => own(&sections[sections.len() - 1]),
            Some(0) => own(&sections[0]),
            Some(next) => {
                let (before, after) = (&sections[next - 1], &sections[next]);
                let part = (mu - before.at) / (after.at - before.at);
                let shape = before.shape.between(&after.shape, part);
                let materials = self.material(before).zip(self.material(after));
                let material = materials.map(|(here, there)| self.mixed(here, there, part));
                Section::of(shape.as_ref().unwrap_or(&before.shape), material.as_ref())
            }
        }
    }

    fn material<'b>(&'b self, entry: &'b SectionEntry<S>) -> Option<&'b Material<S>> {
        entry.material.as_ref().or(self.entry.material.as_ref())
    }

    /// Material of the profile in between; where no section has its own, that of the beam as it is.
    fn mixed(&self, here: &Material<S>, there: &Material<S>, part: f64) -> Material<S> {
        let alike = self.entry.sections.iter().all(|entry| entry.material.is_none());
        if alike { *here } else { here.between(there, part) }
    }

    /// Whether the profile may have its centre of mass beside the axis.
    pub fn is_eccentric(&self) -> bool {
        self.entry.sections.iter().any(|entry| matches!(entry.shape, Shape::Layers(_)))
    }

    /// Shape at rest of a beam's profile.
    pub fn rest(&self) -> Rest {
        Rest::new(&self.entry.rest)
    }

    /// Slice of the beam's profile of that length, in section axes, its centre in the origin.
    pub fn slice(&self, mu: f64, length: f64) -> Result<SpatialInertia<S>> {
        let Section { inertia, center, .. } = self.at(mu)?;
        let ([x, y, z, mass, ..], zero) = (inertia.map(|density| density * length), S::zero());
        let center = center.map_or_else(Vector3::zero, |[x, y]| Vector3::new(x, y, zero));
        Ok(SpatialInertia::new(mass, center, Symmetric3::from_array([x, y, z, zero, zero, zero])))
    }
}
