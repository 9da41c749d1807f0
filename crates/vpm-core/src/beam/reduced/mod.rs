//! Solids of finite elements, reduced to a few modes: a link of any shape, small deflections, right to second order in them.
//!
//! The place of a material point is `x + Phi(x) q + 1/2 q^T Gamma(x) q` in the link's root frame, which the inner interface holds. All that
//! inertia asks of the solid is the Gram matrix of the functions `1`, `x`, `Phi` and `Gamma` under its density. Point masses with the
//! same Gram matrix have the same kinetic energy, gravity and momentum in every motion: the solid is replaced by some of them, at most
//! `3 n + 4`, and they are the stations of a [`Beam`](super::Beam). No integral of the shapes is left out.
//!
//! Sources: Craig & Bampton 1968, "Coupling of substructures for dynamic analyses", AIAA J. 6(7), for the modes; Shabana 2013, "Dynamics of
//! Multibody Systems", chapter 5, for the floating frame and its integrals; Wallrapp 1994, "Standardization of flexible body modeling in
//! multibody system codes", Mech. Struct. Mach. 22(3), for the stiffening by loads, which is the work of `Gamma`.

mod axis;

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{dimension, positive};
use crate::error::{Error, Result};

pub(super) use axis::{Fields, ReducedAxis};

/// A reduced solid; copies share its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduced(Arc<Solid>);

/// The numbers of a reduced solid, slowest mode first.
///
/// Modes have unit modal mass. What is quadratic in them has an entry for each pair `i <= j`, at `j (j + 1) / 2 + i`, so that the first
/// modes alone are a prefix; it may be empty for none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Solid {
    /// Squared angular frequency of each mode of the solid held at its root, 1/s^2.
    pub squares: Vec<f64>,
    /// Point masses with the inertia of the solid, kg.
    pub masses: Vec<f64>,
    /// Their fields.
    pub points: Vec<Field<3>>,
    /// Fields of the interfaces but that at the root: rotation vector, then place.
    pub interfaces: Vec<Field<6>>,
}

/// How a point or a frame moves with the modes: place at rest, first and second derivatives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "[f64; D]: Serialize + for<'a> Deserialize<'a>")]
pub struct Field<const D: usize> {
    /// At rest.
    pub rest: [f64; D],
    /// Per unit of each mode.
    pub shapes: Vec<[f64; D]>,
    /// Second derivative by each pair of modes.
    pub curved: Vec<[f64; D]>,
}

impl Reduced {
    /// Reduced solid made of these numbers.
    pub fn new(solid: Solid) -> Self {
        Self(Arc::new(solid))
    }

    /// The numbers of the reduced solid.
    pub fn solid(&self) -> &Solid {
        &self.0
    }

    /// Checks whether the numbers of a reduced solid fit together. Lengths agree, numbers are finite, masses and
    /// stiffness positive.
    pub(super) fn check(&self, name: &str) -> Result<()> {
        let Solid { squares, masses, points, interfaces } = self.solid();
        dimension(&format!("{name}.reduced.points"), masses.len(), points.len(), "mass")?;
        for (what, numbers) in [("masses", masses), ("squares", squares)] {
            for (place, &number) in numbers.iter().enumerate() {
                positive(&format!("{name}.reduced.{what}.{place}"), number)?;
            }
        }
        for (place, point) in points.iter().enumerate() {
            point.check(&format!("{name}.reduced.points.{place}"), squares.len())?;
        }
        for (place, interface) in interfaces.iter().enumerate() {
            interface.check(&format!("{name}.reduced.interfaces.{place}"), squares.len())?;
        }
        Ok(())
    }

    /// Interface of a reduced solid at a place: none for the root, which is at 0.
    pub(super) fn interface(&self, at: f64) -> Option<&Field<6>> {
        self.solid().interfaces.iter().zip(1_u32..).find(|(_, number)| f64::from(*number) == at).map(|(field, _)| field)
    }

    /// Largest kinetic energy (J) of a reduced solid. Each point moves with its distance from the root times the
    /// frequency of the fastest mode.
    pub(crate) fn largest_energy(&self) -> f64 {
        let Solid { squares, masses, points, .. } = self.solid();
        let reach = |field: &Field<3>| field.rest.iter().map(|x| x * x).sum::<f64>();
        let moment: f64 = masses.iter().zip(points).map(|(mass, point)| mass * reach(point)).sum();
        0.5 * squares.iter().copied().fold(0.0, f64::max) * moment
    }
}

impl<const D: usize> Field<D> {
    fn check(&self, path: &str, modes: usize) -> Result<()> {
        dimension(&format!("{path}.shapes"), modes, self.shapes.len(), "mode")?;
        let pairs = if self.curved.is_empty() { 0 } else { modes * (modes + 1) / 2 };
        dimension(&format!("{path}.curved"), pairs, self.curved.len(), "pair of modes")?;
        let mut all = self.shapes.iter().chain(&self.curved).chain([&self.rest]).flatten();
        all.find(|number| !number.is_finite())
            .map_or(Ok(()), |&value| Err(Error::NonFinite { path: path.to_owned(), value }))
    }
}

impl Serialize for Reduced {
    fn serialize<T: Serializer>(&self, serializer: T) -> std::result::Result<T::Ok, T::Error> {
        self.solid().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Reduced {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        Solid::deserialize(deserializer).map(Self::new)
    }
}
