//! Natural modes: the generalised symmetric eigenproblem.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::dimension;
use crate::error::{Error, Result};

/// Natural modes of `M q'' + K q = 0`, slowest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// Natural angular frequencies in rad/s; a negative number `-s` stands for growth with `e^(s t)`.
    pub frequencies: Vec<f64>,
    /// Mode shapes in the coordinates, one per column, scaled to modal mass 1.
    pub shapes: DMatrix<f64>,
}

/// Eigenmodes of `K a = omega^2 M a`.
///
/// Law: with `M = L L^T` the problem becomes that of the symmetric `L^-1 K L^-T` (Golub & Van Loan 2013, "Matrix Computations",
/// algorithm 8.7.1). Checked: both matrices of one size, K finite, M positive definite. Of K the symmetric part counts.
pub fn modes(stiffness: &DMatrix<f64>, mass: &DMatrix<f64>) -> Result<Modes> {
    dimension("the rows of the stiffness matrix", mass.nrows(), stiffness.nrows(), "row of the mass matrix")?;
    dimension("the columns of the stiffness matrix", mass.ncols(), stiffness.ncols(), "column of the mass matrix")?;
    if let Some(&value) = stiffness.iter().find(|entry| !entry.is_finite()) {
        return Err(Error::NonFinite { path: "beam.stiffness".to_owned(), value });
    }
    if mass.is_empty() {
        return Ok(Modes { frequencies: Vec::new(), shapes: DMatrix::zeros(0, 0) });
    }
    let lower = factor(mass)?.l();
    let half = solve_lower(&lower, stiffness.clone());
    let both = solve_lower(&lower, half.transpose());
    let symmetric = (&both + both.transpose()) * 0.5;
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(symmetric);
    let mut order: Vec<usize> = (0..eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigenvalues[a].total_cmp(&eigenvalues[b]));
    let frequencies = order.iter().map(|&k| eigenvalues[k].abs().sqrt().copysign(eigenvalues[k])).collect();
    let mut shapes = eigenvectors.select_columns(&order);
    lower.tr_solve_lower_triangular_mut(&mut shapes);
    Ok(Modes { frequencies, shapes })
}

/// Solves `K q = f` for a symmetric positive definite K of an eigenproblem.
pub fn solve(stiffness: &DMatrix<f64>, load: &DVector<f64>) -> Result<DVector<f64>> {
    Ok(factor(stiffness)?.solve(load))
}

fn factor(matrix: &DMatrix<f64>) -> Result<Cholesky<f64, nalgebra::Dyn>> {
    let smallest = matrix.diagonal().iter().copied().fold(f64::INFINITY, f64::min);
    Cholesky::new(matrix.clone()).ok_or(Error::Setting {
        setting: "the smallest diagonal entry of the beam's matrix",
        condition: "come from independent shape functions that all carry mass and stiffness".to_owned(),
        value: smallest,
        repair: "use fewer shape functions",
    })
}

fn solve_lower(lower: &DMatrix<f64>, mut right: DMatrix<f64>) -> DMatrix<f64> {
    lower.solve_lower_triangular_mut(&mut right);
    right
}
