//! The strain at one place of a beam.

use crate::scalar::Scalar;

/// The strain at one place of the axis as a linear map of the coordinates, made by `Beam::gauge`.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    /// Coordinate, component, and strain per unit of the coordinate.
    pub(super) entries: Vec<(usize, usize, f64)>,
}

impl Gauge {
    /// Gauge reading: the strain screw at coordinates `q`; allocates nothing. It is (kappa_x, kappa_y, twist, shear_x,
    /// shear_y, extension).
    pub fn strain<S: Scalar>(&self, q: &[S]) -> [S; 6] {
        let mut strain = [S::zero(); 6];
        for &(coordinate, component, entry) in &self.entries {
            strain[component] += q[coordinate] * entry;
        }
        strain
    }

    /// Adds to `row` each coordinate's contribution to a gauge: strain components times their weights.
    pub fn add_weighted(&self, weights: [f64; 6], row: &mut [f64]) {
        for &(coordinate, component, entry) in &self.entries {
            row[coordinate] += weights[component] * entry;
        }
    }
}
