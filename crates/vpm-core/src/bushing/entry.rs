//! A bushing of a machine: which two frames it connects.

use nalgebra::{Matrix6, SymmetricEigen};
use serde::Deserialize;

use super::Bushing;
use crate::effect::Domain;
use crate::error::{ConnectionError, Result};
use crate::mount::{Marker, Mount};
use crate::scalar::Scalar;

/// How far entries on both sides of the diagonal may differ, as a share of the largest entry.
const SYMMETRY: f64 = 1e-9;
/// How far below zero an eigenvalue of the scaled matrix may be: rounded entries of a matrix that is just semidefinite.
const SLACK: f64 = 1e-9;
/// Names of the six directions.
const DIRECTIONS: [&str; 6] = ["rx", "ry", "rz", "x", "y", "z"];

/// An elastic connection of two frames of a machine, over any parameter type. Entries that are missing are zero.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BushingEntry<P> {
    /// Name, unique in the model.
    pub name: String,
    /// Frame A.
    pub a: BushingEnd,
    /// Frame B.
    pub b: BushingEnd,
    /// Stiffness K by rows.
    pub stiffness: [[Option<P>; 6]; 6],
    /// Damping C by rows.
    pub damping: [[Option<P>; 6]; 6],
    /// Preload `w_0`.
    pub preload: [Option<P>; 6],
}

/// A frame that a bushing is fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BushingEnd {
    /// What it is fixed to.
    pub on: Mount,
    /// Its origin in the mount's frame, m.
    pub translation: [f64; 3],
    /// Its axes in the mount's frame, row by row.
    pub rotation: [f64; 9],
}

impl<P> BushingEntry<P> {
    /// Law of a bushing's entry over another number type, zero where there is no parameter.
    pub fn law<S: Scalar>(&self, f: &mut impl FnMut(&P) -> S) -> Bushing<S> {
        let mut number = |entry: &Option<P>| entry.as_ref().map_or(S::zero(), &mut *f);
        Bushing {
            stiffness: self.stiffness.each_ref().map(|row| row.each_ref().map(&mut number)),
            damping: self.damping.each_ref().map(|row| row.each_ref().map(&mut number)),
            preload: self.preload.each_ref().map(number),
        }
    }

    /// Parameters of a bushing's entry and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let of = |place: usize| if place.is_multiple_of(7) { Domain::NonNegative } else { Domain::Any };
        let matrices = [&self.stiffness, &self.damping].into_iter();
        let entries = matrices.flat_map(|matrix| matrix.as_flattened().iter().enumerate());
        let matrices = entries.filter_map(|(place, entry)| entry.as_ref().map(|entry| (entry, of(place))));
        matrices.chain(self.preload.iter().flatten().map(|entry| (entry, Domain::Any))).collect()
    }

    /// Frames of a bushing's entry, A first, as frames to keep track of.
    pub fn markers(&self) -> [Marker; 2] {
        [("a", self.a), ("b", self.b)].map(|(end, frame)| {
            let BushingEnd { on, translation, rotation } = frame;
            Marker { name: format!("{}.{end}", self.name), on, translation, rotation }
        })
    }
}

impl BushingEntry<usize> {
    /// Checks a bushing's entry with the parameters `theta`, beyond the domain of each. It needs a symmetric stiffness,
    /// and neither matrix gives energy away.
    pub fn check(&self, theta: &[f64]) -> Result<()> {
        let law: Bushing<f64> = self.law(&mut |&index| theta[index]);
        let largest = law.stiffness.as_flattened().iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        let pairs = (0..36).map(|place| (place / 6, place % 6)).filter(|(row, column)| row < column);
        for (row, column) in pairs {
            let (above, below) = (law.stiffness[row][column], law.stiffness[column][row]);
            if (above - below).abs() > SYMMETRY * largest {
                let (bushing, row, column) = (self.name.clone(), DIRECTIONS[row], DIRECTIONS[column]);
                return Err(ConnectionError::NotSymmetric { bushing, row, column, above, below }.into());
            }
        }
        for (matrix, entries) in [("stiffness", &law.stiffness), ("damping", &law.damping)] {
            let eigenvalue = smallest(entries);
            if eigenvalue < -SLACK {
                return Err(ConnectionError::NotPositive { bushing: self.name.clone(), matrix, eigenvalue }.into());
            }
        }
        Ok(())
    }
}

/// Smallest eigenvalue of the symmetric part of a bushing's entry, scaled to a diagonal of 1. So angles and ways count
/// alike.
///
/// A direction without an own entry must not be coupled to any other: the smallest eigenvalue is then minus infinity.
fn smallest(matrix: &[[f64; 6]; 6]) -> f64 {
    let symmetric = Matrix6::from_fn(|i, j| 0.5 * (matrix[i][j] + matrix[j][i]));
    let coupled = |i: usize| (0..6).any(|j| j != i && symmetric[(i, j)] != 0.0);
    if (0..6).any(|i| symmetric[(i, i)] <= 0.0 && coupled(i)) {
        return f64::NEG_INFINITY;
    }
    let scale = |i: usize| if symmetric[(i, i)] > 0.0 { symmetric[(i, i)].sqrt().recip() } else { 0.0 };
    let scaled = Matrix6::from_fn(|i, j| symmetric[(i, j)] * scale(i) * scale(j));
    SymmetricEigen::new(scaled).eigenvalues.min()
}
