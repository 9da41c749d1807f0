//! The fields that a beam's coordinates interpolate: one component of strain or deflection each.

use super::entry::Component;
use super::profile::Profile;
use super::{Basis, Level};
use crate::error::Result;
use crate::scalar::Scalar;

/// Which fields the shape functions interpolate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolated {
    /// The strain itself.
    Strain,
    /// The deflection, of which the strain is a derivative: the second for bending, the first for the others.
    Deflection,
}

/// A component and its shape functions.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    /// Which component.
    pub component: Component,
    /// Its shape functions.
    pub basis: Basis,
}

/// All fields of a beam; their coordinates follow one another.
#[derive(Clone, Debug)]
pub(super) struct Fields {
    /// What they interpolate.
    pub interpolated: Interpolated,
    /// One per component.
    pub list: Vec<Field>,
    /// The component of each coordinate.
    pub components: Vec<usize>,
}

impl Fields {
    /// The fields of a level with shape functions.
    pub fn new(interpolated: Interpolated, list: Vec<Field>) -> Self {
        let repeat = |field: &Field| std::iter::repeat_n(field.component as usize, field.basis.len());
        let components = list.iter().flat_map(repeat).collect();
        Self { interpolated, list, components }
    }

    /// Number of coordinates that the fields interpolate.
    pub fn len(&self) -> usize {
        self.components.len()
    }

    /// Breaks of the fields: arc lengths between which all shape functions are smooth.
    pub fn breaks(&self) -> Vec<f64> {
        self.list.first().map_or_else(Vec::new, |field| field.basis.breaks())
    }

    /// Points that a Gauss rule needs on each piece to integrate products of two fields exactly.
    pub fn points(&self) -> usize {
        self.list.iter().map(|field| field.basis.points()).max().unwrap_or(1)
    }

    /// Row of the fields at `mu`: all shape functions, differentiated `order(component)` times.
    pub fn row(&self, mu: f64, order: impl Fn(Component) -> usize) -> Vec<f64> {
        self.list.iter().flat_map(|field| field.basis.evaluate(mu, order(field.component))).collect()
    }

    /// Strain fields at `mu` per unit of each coordinate, each in its own component.
    ///
    /// Law: `e = (theta_x', theta_y', theta_z', ...)`, with `theta_x = -v_y'`, `theta_y = v_x'` for the deflection by bending.
    pub fn strain_row(&self, mu: f64) -> Vec<f64> {
        if self.interpolated == Interpolated::Strain {
            return self.row(mu, |_| 0);
        }
        let mut row = self.row(mu, |component| if component.bends() { 2 } else { 1 });
        for (entry, &component) in row.iter_mut().zip(&self.components) {
            if component == Component::BendingX as usize {
                *entry = -*entry;
            }
        }
        row
    }

    /// Elastic stiffness of the fields, `int Phi^T K Phi`, row by row; different components do not couple.
    pub fn stiffness<S: Scalar>(&self, profile: &Profile<S>) -> Result<Vec<S>> {
        let n = self.len();
        let mut stiffness = vec![S::zero(); n * n];
        let coupled = self.coupled(profile);
        for at in profile.rule(self.points(), &self.breaks()) {
            let (row, section) = (self.strain_row(at.place), profile.at(at.place)?);
            for i in 0..n {
                let modulus = section.stiffness[self.components[i]] * (at.weight * row[i]);
                for j in (0..n).filter(|&j| coupled[i * n + j]) {
                    stiffness[i * n + j] += modulus * row[j];
                }
            }
        }
        Ok(stiffness)
    }

    /// Coordinates that couple by stiffness of the fields: those of one component.
    ///
    /// In a uniform beam with a single field those whose strains are orthogonal do not: between them stands nothing but rounding.
    fn coupled<S: Scalar>(&self, profile: &Profile<S>) -> Vec<bool> {
        const ROUNDING: f64 = 1e-14;
        let n = self.len();
        let mut products = vec![0.0; n * n];
        for at in profile.rule(self.points(), &self.breaks()) {
            let row = self.strain_row(at.place);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                products[i * n + j] += at.weight * row[i] * row[j];
            }
        }
        let orthogonal = |i: usize, j: usize| {
            let (product, own) = (products[i * n + j], products[i * n + i] * products[j * n + j]);
            profile.is_uniform() && self.list.len() == 1 && product * product <= ROUNDING * ROUNDING * own
        };
        let pairs = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        pairs.map(|(i, j)| self.components[i] == self.components[j] && !orthogonal(i, j)).collect()
    }
}

impl Component {
    /// Whether a field's component is a curvature.
    pub(super) fn bends(self) -> bool {
        matches!(self, Self::BendingX | Self::BendingY)
    }
}

/// Basis of a component's field at a level that is neither rigid, lumped nor modal.
///
/// Deflections by bending are clamped in value and slope, the others in value; shear has a deflection of its own, so that the
/// rotation of the section is a field of its own. Strains need no clamp: the root stands where it stands.
pub(super) fn basis(level: Level, component: Component, length: f64) -> Result<Basis> {
    match (level, component.bends()) {
        (Level::Hermite(n), true) => Basis::hermite(length, n),
        (Level::Hermite(n), false) => Basis::linear(length, n, 1),
        (Level::Strain(n), _) => Basis::legendre(length, n),
        (Level::Elements(n), _) => Basis::linear(length, n, 0),
        (Level::Bezier(n) | Level::Deflection(n), true) => Basis::bernstein(length, n, 2),
        (Level::Bezier(n) | Level::Deflection(n), false) => Basis::bernstein(length, n, 1),
        (Level::Modal(k), true) => Basis::bernstein(length, k + 8, 2),
        (Level::Modal(k), false) => Basis::bernstein(length, k + 8, 1),
        (Level::Rigid | Level::Lumped(_) | Level::Reduced(_), _) => Basis::linear(length, 1, 1),
    }
}
