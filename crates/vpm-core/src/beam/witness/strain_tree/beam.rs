//! One beam in strain coordinates.

use crate::beam::fields::{self, Fields, Interpolated};
use crate::beam::quadrature::gauss;
use crate::beam::rest::Rest;
use crate::beam::strain::{Crossing, SpaceAxis};
use crate::beam::{Basis, Component, Section, not_negative};
use crate::error::{Error, Result};
use crate::scalar::Scalar;
use crate::spatial::{SpatialInertia, Symmetric3, Twist, Vector3};

/// A strain that the beam may have, with its shape functions. Strains that are not listed are rigid.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Which component.
    pub strain: Component,
    /// Its shape functions.
    pub basis: Basis,
}

/// A straight beam along z of its root frame.
#[derive(Clone, Debug)]
pub struct StrainBeam {
    fields: Fields,
    section: Section,
    damping: f64,
    length: f64,
    axis: SpaceAxis,
    /// Inertia of the beam that is lumped at the end of each piece by the Gauss rule over the beam.
    inertia: Vec<SpatialInertia<f64>>,
}

impl StrainBeam {
    /// A beam of that section with those strains, Kelvin-Voigt `damping` (s), integrated over `stations` Gauss stations.
    ///
    /// Checked: at least one field, one length, smooth bases, 2 to 60 stations.
    pub fn new(section: Section, fields: Vec<Field>, damping: f64, stations: usize) -> Result<Self> {
        not_negative("beam.damping", damping)?;
        let length = fields.first().map_or(0.0, |field| field.basis.length());
        let alike = fields.iter().all(|field| field.basis.length() == length && field.basis.breaks().len() == 2);
        if length == 0.0 || !alike || !(2..=60).contains(&stations) {
            let condition = "lie between 2 and 60, for one or more smooth strain fields of the same length".to_owned();
            let repair = "give every field a Legendre, Bernstein or monomial basis of the beam's length";
            let value = stations as f64;
            return Err(Error::Setting { setting: "the stations of a strain beam", condition, value, repair });
        }
        let list =
            fields.into_iter().map(|Field { strain, basis }| fields::Field { component: strain, basis }).collect();
        let fields = Fields::new(Interpolated::Strain, list);
        let rule = gauss(stations, 0.0, length);
        let places: Vec<f64> = rule.iter().map(|at| at.place).chain([length]).collect();
        let inertia = rule.iter().map(|at| at.weight).chain([0.0]).map(|weight| slice(&section, weight)).collect();
        Ok(Self { axis: SpaceAxis::new(&fields, &places, &Rest::default()), fields, section, damping, length, inertia })
    }

    /// How many coordinates the beam has.
    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// Whether the strain beam has no coordinates.
    pub fn is_empty(&self) -> bool {
        self.fields.components.is_empty()
    }

    /// Number of pieces of the strain beam.
    pub(super) fn pieces(&self) -> usize {
        self.axis.pieces()
    }

    /// Inertia at the end of a piece of the strain beam.
    pub(super) fn inertia(&self, piece: usize) -> SpatialInertia<f64> {
        self.inertia[piece]
    }

    /// Kelvin-Voigt damping of the strain beam in s.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Elastic stiffness of the strain beam, `int Phi^T K Phi`, row by row; different strains do not couple.
    pub fn stiffness(&self) -> Vec<f64> {
        let (n, components) = (self.len(), &self.fields.components);
        let mut stiffness = vec![0.0; n * n];
        for at in gauss(self.fields.points() + 1, 0.0, self.length) {
            let row = self.fields.strain_row(at.place);
            for i in 0..n {
                for j in (0..n).filter(|&j| components[i] == components[j]) {
                    stiffness[i * n + j] += at.weight * self.section.stiffness[components[i]] * row[i] * row[j];
                }
            }
        }
        stiffness
    }

    /// Strain of the strain beam at `mu` (m) for coordinates `c`, in the order of [`Component`]. The strain of the
    /// surface at distance z from the neutral axis is z times the curvature.
    pub fn strain(&self, mu: f64, c: &[f64]) -> [f64; 6] {
        let mut strain = [0.0; 6];
        for ((value, &component), c) in self.fields.strain_row(mu).iter().zip(&self.fields.components).zip(c) {
            strain[component] += value * c;
        }
        strain
    }

    /// Crosses a piece of the strain beam with coordinates `c` and rates `rates`.
    pub(super) fn cross<S: Scalar>(&self, piece: usize, c: &[S], rates: &[S]) -> Crossing<S> {
        self.axis.cross(piece, c, rates)
    }

    /// Twist of the end of a strain beam's piece relative to its begin, per unit rate of coordinate `k`.
    pub(super) fn column<S: Scalar>(&self, piece: usize, crossing: &Crossing<S>, k: usize) -> Twist<S> {
        self.axis.column(piece, crossing, k).unwrap_or_else(Twist::zero)
    }
}

/// Inertia of a strain beam's slice of that length, its centre in the origin.
fn slice(section: &Section, length: f64) -> SpatialInertia<f64> {
    let [x, y, z, mass, ..] = section.inertia.map(|density| density * length);
    SpatialInertia::new(mass, Vector3::zero(), Symmetric3::from_array([x, y, z, 0.0, 0.0, 0.0]))
}
