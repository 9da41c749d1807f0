//! A beam element between two nodes with absolute coordinates, as a check of the other beams at large deflection.
//!
//! A node has a position and four Euler parameters in the world. Six deformation measures tell how the element is deformed, whatever
//! its rigid motion: elongation, twist, and the angles of both nodes against the line between them in two planes. They are
//! approximate: an element that bends by the angle `phi` errs by `phi^2`, so that many short elements are exact.
//!
//! Sources: D'Imperio 2016, "Modelling and simulation techniques for advanced robotic systems", equations 3.1 to 3.6, where three
//! entries of the rotation matrix 3.2 are misprinted; Jonker & Meijaard 2013, "A geometrically non-linear formulation of a
//! three-dimensional beam element for solving large deflection multibody system problems", Int. J. Non-Linear Mechanics 53, for the
//! stiffness that belongs to the measures.

mod chain;

pub use chain::{NodeLoad, TwoNodeChain};

use crate::beam::{Section, positive};
use crate::error::Result;
use crate::scalar::{Dual, Scalar};
use crate::spatial::{Matrix3, Vector3};

/// Coordinates of a node: position, Euler parameters.
pub const NODE: usize = 7;
/// Coordinates of an element: those of its node at the root side, then those of the other.
pub const ELEMENT: usize = 2 * NODE;

/// An element along z of its nodes, of length `length` while undeformed.
#[derive(Clone, Debug)]
pub struct TwoNode {
    length: f64,
    /// Stiffness of the six measures; symmetric.
    stiffness: [[f64; 6]; 6],
}

/// Rotation matrix of a node's Euler parameters (the first one the scalar) of length 1.
///
/// Law: equation 3.2, with `2 (l1 l2 + l0 l3)`, `2 (l1 l3 - l0 l2)` and `2 (l2 l3 + l0 l1)` below the diagonal.
pub fn rotation<S: Scalar>([a, b, c, d]: [S; 4]) -> Matrix3<S> {
    let double = |left: S, right: S| (left + right) * 2.0;
    let [aa, bb, cc, dd] = [a * a, b * b, c * c, d * d];
    Matrix3::from_columns(
        Vector3::new(aa + bb - cc - dd, double(b * c, a * d), double(b * d, -(a * c))),
        Vector3::new(double(b * c, -(a * d)), aa - bb + cc - dd, double(c * d, a * b)),
        Vector3::new(double(b * d, a * c), double(c * d, -(a * b)), aa - bb - cc + dd),
    )
}

impl TwoNode {
    /// Two-node element of that section and length (m), whose shear follows from bending (Timoshenko).
    ///
    /// Law: `EA / l` for the elongation, `GJ / l^3` for the twist, `EJ / (l^3 (1 + f)) [4 + f, f - 2; f - 2, 4 + f]` for both pairs of
    /// bending measures, `f = 12 EJ / (aGA l^2)`.
    pub fn new(section: &Section, length: f64) -> Result<Self> {
        positive("element.length", length)?;
        let [bend_x, bend_y, twist, shear_x, shear_y, stretch] = section.stiffness;
        let mut stiffness = [[0.0; 6]; 6];
        stiffness[0][0] = stretch / length;
        stiffness[1][1] = twist / length.powi(3);
        for (first, bend, shear) in [(2, bend_x, shear_y), (4, bend_y, shear_x)] {
            let slender = 12.0 * bend / (shear * length * length);
            let unit = bend / (length.powi(3) * (1.0 + slender));
            for (i, j, factor) in [(0, 0, 4.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 4.0)] {
                stiffness[first + i][first + j] = unit * (factor + slender);
            }
        }
        Ok(Self { length, stiffness })
    }

    /// Length of an undeformed two-node element, in m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The six deformation measures in m: elongation, twist, bending about x at both nodes, bending about y at both nodes.
    ///
    /// Law: equation 3.6 with the axes x, y, z of the source renamed z, x, y. Checked: a rigid motion leaves them zero.
    pub fn deformation<S: Scalar>(&self, x: &[S; ELEMENT]) -> [S; 6] {
        let [p, q] = [0, NODE].map(|first| rotation([3, 4, 5, 6].map(|k| x[first + k])).columns);
        let line = Vector3::new(x[7] - x[0], x[8] - x[1], x[9] - x[2]);
        let distance = line.dot(line).sqrt();
        let along = |axis: Vector3<S>| line.dot(axis) / distance * self.length;
        let twist = (p[1].dot(q[0]) - p[0].dot(q[1])) * (0.5 * self.length);
        [distance - self.length, twist, -along(p[1]), along(q[1]), along(p[0]), -along(q[0])]
    }

    /// Elastic energy of a two-node element in J.
    pub fn energy<S: Scalar>(&self, x: &[S; ELEMENT]) -> S {
        let measures = self.deformation(x);
        let mut energy = S::zero();
        for (row, &left) in self.stiffness.iter().zip(&measures) {
            for (&entry, &right) in row.iter().zip(&measures) {
                if entry != 0.0 {
                    energy += left * right * (0.5 * entry);
                }
            }
        }
        energy
    }

    /// Forces that hold a two-node element in this shape: the exact derivative of the energy.
    pub fn forces<S: Scalar>(&self, x: &[S; ELEMENT]) -> [S; ELEMENT] {
        self.energy(&std::array::from_fn(|k| Dual::variable(x[k], k))).gradient
    }
}
