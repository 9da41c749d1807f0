//! How thick a piston and its rod are.

use std::f64::consts::FRAC_PI_4;

use serde::Deserialize;

use super::{Chambers, NamedDomain};
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Size of a piston with a rod on one side: as diameters, or as data sheets of drives give it.
///
/// Law: `A = pi/4 bore^2` and `alpha A = pi/4 (bore^2 - rod^2)`. Checked: all are positive; the rod is thinner than the bore, the ratio
/// alpha at most 1 (a rod on both sides, or none).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, deny_unknown_fields, expecting = "a cylinder's size is {bore, rod} or {area, area_ratio}")]
pub enum PistonSize<P> {
    /// By diameters.
    Diameters {
        /// Of the piston, m.
        bore: P,
        /// Of the rod, m.
        rod: P,
    },
    /// By areas.
    Areas {
        /// A of the piston on the side without rod, m^2.
        area: P,
        /// alpha, share of it on the side of the rod.
        area_ratio: P,
    },
}

impl<P> PistonSize<P> {
    /// The same size over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> PistonSize<T> {
        match self {
            Self::Diameters { bore, rod } => PistonSize::Diameters { bore: f(bore), rod: f(rod) },
            Self::Areas { area, area_ratio } => PistonSize::Areas { area: f(area), area_ratio: f(area_ratio) },
        }
    }

    /// Parameters of a piston's size and where each is defined.
    pub fn domains(&self) -> Vec<NamedDomain<'_, P>> {
        match self {
            Self::Diameters { bore, rod } => {
                vec![("cylinder.bore", bore, Domain::Positive), ("cylinder.rod", rod, Domain::Positive)]
            }
            Self::Areas { area, area_ratio } => {
                vec![("cylinder.area", area, Domain::Positive), ("cylinder.area_ratio", area_ratio, Domain::Ratio)]
            }
        }
    }
}

impl<S: Scalar> PistonSize<S> {
    /// Areas in m^2 on which the pressures act, from the piston's size.
    #[inline]
    pub fn areas(&self) -> Chambers<S> {
        match *self {
            Self::Diameters { bore, rod } => {
                let full = bore * bore * FRAC_PI_4;
                Chambers { a: full, b: full - rod * rod * FRAC_PI_4 }
            }
            Self::Areas { area, area_ratio } => Chambers { a: area, b: area * area_ratio },
        }
    }
}
