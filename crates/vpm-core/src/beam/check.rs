//! Whether a beam can exist as it is described.

use super::entry::{BeamEntry, Component, Level};
use super::reduced::Reduced;
use super::rest::STRAIGHT;
use super::{Section, Shape, not_negative, positive};
use crate::error::{Error, Result};
use crate::scalar::Scalar;

impl Level {
    /// Range to check for a level's number: name, bounds, and the sentence that names them.
    fn range(self) -> Option<(usize, usize, usize, &'static str)> {
        match self {
            Self::Rigid => None,
            Self::Lumped(n) => Some((n, 1, 200, "lie between 1 and 200 for rigid segments")),
            Self::Modal(k) => Some((k, 1, 8, "lie between 1 and 8 for modes of a component")),
            Self::Bezier(n) => Some((n, 2, 12, "lie between 2 and 12 for the degree of a Bezier centreline")),
            Self::Deflection(n) => Some((n, 2, 12, "lie between 2 and 12 for the degree of the deflection")),
            Self::Hermite(n) => Some((n, 1, 100, "lie between 1 and 100 for cubic elements")),
            Self::Strain(n) => Some((n, 1, 12, "lie between 1 and 12 for Legendre coefficients of strain")),
            Self::Elements(n) => Some((n, 1, 100, "lie between 1 and 100 for elements of linear strain")),
            Self::Reduced(n) => Some((n, 1, 64, "lie between 1 and 64 for modes of a reduced solid")),
        }
    }
}

impl<S: Scalar> BeamEntry<S> {
    /// Checks whether the beam can exist as described. It needs positive length and sections, a level in its range, at
    /// least one component, places on the axis, and damping that takes energy out.
    pub fn check(&self) -> Result<()> {
        positive(&format!("{}.length", self.name), self.length)?;
        match &self.reduced {
            Some(reduced) => self.check_reduced(reduced)?,
            None => {
                self.check_level()?;
                self.check_sections()?;
                self.check_rest()?;
            }
        }
        self.check_damping()
    }

    fn check_reduced(&self, reduced: &Reduced) -> Result<()> {
        reduced.check(&self.name)?;
        let (stiffness, mass) = self.factors();
        positive(&format!("{}.stiffness_factor", self.name), stiffness)?;
        positive(&format!("{}.mass_factor", self.name), mass)?;
        let (modes, interfaces) = (reduced.solid().squares.len(), reduced.solid().interfaces.len());
        if self.length != interfaces as f64 {
            return Err(self.domain("length", "be the number of interfaces beside that at the root", self.length));
        }
        match self.level {
            Level::Rigid => Ok(()),
            Level::Reduced(n) if (1..=modes).contains(&n) => Ok(()),
            Level::Reduced(n) => {
                Err(self.domain("level", "lie between 1 and the number of modes of the reduced solid", n as f64))
            }
            _ => Err(self.domain("level", "be rigid or reduced for a reduced solid", 0.0)),
        }
    }

    /// Error of the check of one number of this beam, called `{name}.{what}`.
    pub(super) fn domain(&self, what: &str, condition: &'static str, value: f64) -> Error {
        Error::Domain { path: format!("{}.{what}", self.name), condition, value }
    }

    /// Checks whether a place along the axis lies on the beam.
    pub(super) fn check_place(&self, what: &str, at: f64) -> Result<()> {
        // Places that a length was computed for may miss the tip by rounding.
        if at >= 0.0 && at <= self.length * (1.0 + 1e-12) {
            let between = self.reduced.is_some() && at.fract() != 0.0;
            return if between { Err(self.domain(what, "be the number of an interface", at)) } else { Ok(()) };
        }
        Err(self.domain(what, "lie between 0 and the length of the beam", at))
    }

    fn check_level(&self) -> Result<()> {
        if let Level::Reduced(n) = self.level {
            return Err(self.domain("level", "be another one for a link without a reduced solid", n as f64));
        }
        let Some((size, least, most, condition)) = self.level.range() else { return Ok(()) };
        if !(least..=most).contains(&size) {
            return Err(self.domain("level", condition, size as f64));
        }
        if self.deforms.is_empty() {
            return Err(self.domain("deforms", "name at least one component unless the level is rigid", 0.0));
        }
        let twice = self.deforms.iter().enumerate().find(|(place, part)| self.deforms[..*place].contains(part));
        twice.map_or(Ok(()), |(place, _)| Err(self.domain("deforms", "name every component once", place as f64)))
    }

    fn check_sections(&self) -> Result<()> {
        if self.sections.is_empty() {
            return Err(self.domain("sections", "hold at least one section", 0.0));
        }
        let several = self.sections.len() > 1;
        for (place, entry) in self.sections.iter().enumerate() {
            let what = if several { format!("section.{place}") } else { "section".to_owned() };
            self.check_place(&format!("{what}.at"), entry.at)?;
            let material = entry.material.as_ref().or(self.material.as_ref());
            Section::of(&entry.shape, material).map_err(|error| self.named(error, &what))?;
            self.check_shear(&entry.shape, &what)?;
            let Some(before) = place.checked_sub(1).map(|before| &self.sections[before]) else { continue };
            if entry.at <= before.at {
                return Err(self.domain(&format!("{what}.at"), "lie beyond the section before it", entry.at));
            }
            if before.shape.between(&entry.shape, 0.5).is_none() {
                let condition = "have the same kind of shape as the section before it, with as many layers";
                return Err(self.domain(&format!("{what}.shape"), condition, place as f64));
            }
        }
        Ok(())
    }

    /// Checks whether a section given by its moduli has those that its beam shears with.
    fn check_shear(&self, shape: &Shape<S>, what: &str) -> Result<()> {
        let Shape::Stiffness(moduli) = shape else { return Ok(()) };
        let shears = [("shear_x", Component::ShearX, moduli.shear_x), ("shear_y", Component::ShearY, moduli.shear_y)];
        for (name, component, modulus) in shears {
            if modulus.is_none() && self.deforms.contains(&component) {
                let condition = "be given for a beam that deforms in it";
                return Err(self.domain(&format!("{what}.{name}"), condition, 0.0));
            }
        }
        Ok(())
    }

    fn check_rest(&self) -> Result<()> {
        let Some(first) = self.rest.first() else { return Ok(()) };
        if matches!(self.level, Level::Modal(_) | Level::Deflection(_) | Level::Hermite(_)) {
            return Err(self.domain("rest", STRAIGHT, first.at));
        }
        for (place, entry) in self.rest.iter().enumerate() {
            self.check_place(&format!("rest.{place}.at"), entry.at)?;
            for curvature in entry.curvature {
                if !curvature.is_finite() {
                    return Err(Error::NonFinite { path: format!("{}.rest.{place}", self.name), value: curvature });
                }
            }
            if place > 0 && entry.at <= self.rest[place - 1].at {
                return Err(self.domain(&format!("rest.{place}.at"), "lie beyond the place before it", entry.at));
            }
        }
        Ok(())
    }

    /// Names beam and section before a parameter in an error of the check.
    fn named(&self, error: Error, section: &str) -> Error {
        let full = |path: String| match (path.strip_prefix("section."), path.strip_prefix("material.")) {
            (Some(size), _) => format!("{}.{section}.{size}", self.name),
            (_, Some(parameter)) => format!("{}.{parameter}", self.name),
            _ => format!("{}.{path}", self.name),
        };
        match error {
            Error::Domain { path, condition, value } => Error::Domain { path: full(path), condition, value },
            Error::NonFinite { path, value } => Error::NonFinite { path: full(path), value },
            other => other,
        }
    }

    fn check_damping(&self) -> Result<()> {
        let damping = &self.damping;
        for (what, value) in [("stiffness", damping.stiffness), ("mass", damping.mass)] {
            value.map_or(Ok(S::zero()), |value| not_negative(&format!("{}.damping.{what}", self.name), value))?;
        }
        for (place, &ratio) in damping.ratios.iter().enumerate() {
            not_negative(&format!("{}.damping.ratios.{place}", self.name), ratio)?;
        }
        Ok(())
    }
}
