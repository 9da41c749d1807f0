//! Straight connections between two points of a machine: linear actuators, with or without masses of their own.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::mount::{Mount, check_finite};
use crate::scalar::Scalar;

/// A line between two points. A force on it pushes them apart.
///
/// Its parts are needles on the line: they have no inertia about it, and their spin about it is left out. Source: D'Imperio 2016,
/// "Modelling and simulation techniques for advanced robotic systems", eqs 2.85 to 2.95, in space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line<P> {
    /// Name, unique in the model.
    pub name: String,
    /// Where it begins.
    pub from: LineEnd,
    /// Where it ends.
    pub to: LineEnd,
    /// The mass that stays at the distance of its centre from the beginning.
    pub barrel: Option<LinePart<P>>,
    /// The mass that stays at the distance of its centre from the end.
    pub rod: Option<LinePart<P>>,
}

/// A point of attachment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineEnd {
    /// What the point is fixed to.
    pub on: Mount,
    /// Its coordinates in the mount's frame, m.
    pub point: [f64; 3],
}

/// Barrel or rod.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinePart<P> {
    /// Mass in kg.
    pub mass: P,
    /// Distance of the centre of mass from the own point of attachment, toward the other one, m.
    pub center: P,
    /// Inertia about the centre of mass, across the line, kg m^2.
    pub inertia: P,
}

impl<P> LinePart<P> {
    /// The same part over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> LinePart<T> {
        LinePart { mass: f(&self.mass), center: f(&self.center), inertia: f(&self.inertia) }
    }
}

impl<P> Line<P> {
    /// The same line over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Line<T> {
        Line {
            name: self.name.clone(),
            from: self.from,
            to: self.to,
            barrel: self.barrel.as_ref().map(|part| part.map(f)),
            rod: self.rod.as_ref().map(|part| part.map(f)),
        }
    }
}

impl<S: Scalar> Line<S> {
    /// Whether the numbers are finite and the masses not negative.
    pub fn check(&self) -> Result<()> {
        check_finite(&self.name, "from.point", &self.from.point)?;
        check_finite(&self.name, "to.point", &self.to.point)?;
        for (which, part) in [("barrel", &self.barrel), ("rod", &self.rod)] {
            let Some(LinePart { mass, center, inertia }) = part else { continue };
            for (quantity, number, signed) in
                [("mass", mass, false), ("center", center, true), ("inertia", inertia, false)]
            {
                let (path, value) = (format!("{}.{which}.{quantity}", self.name), number.inspect());
                if !number.is_finite() {
                    return Err(Error::NonFinite { path, value });
                }
                if value < 0.0 && !signed {
                    return Err(Error::Domain { path, condition: "be zero or positive", value });
                }
            }
        }
        Ok(())
    }
}
