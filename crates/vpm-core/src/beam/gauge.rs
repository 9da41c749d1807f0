//! The strain at one place of a beam.

use crate::scalar::Scalar;

/// The strain at one place of the axis as a linear map of the coordinates, made by `Beam::gauge`.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    /// Coordinate, component, and strain per unit of the coordinate.
    pub(super) entries: Vec<(usize, usize, f64)>,
}

impl Gauge {
    /// The strain screw (kappa_x, kappa_y, twist, shear_x, shear_y, extension) at coordinates `q`; allocates nothing.
    pub fn strain<S: Scalar>(&self, q: &[S]) -> [S; 6] {
        let mut strain = [S::zero(); 6];
        for &(coordinate, component, entry) in &self.entries {
            strain[component] += q[coordinate] * entry;
        }
        strain
    }

    /// Adds to `row` what each coordinate contributes to the sum of the components of the strain screw, each times its weight.
    pub fn add_weighted(&self, weights: [f64; 6], row: &mut [f64]) {
        for &(coordinate, component, entry) in &self.entries {
            row[coordinate] += weights[component] * entry;
        }
    }
}
