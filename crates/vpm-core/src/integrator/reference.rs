//! An adaptive reference solution, for checks of the fixed-step methods; with the cargo feature `reference`.

use std::cell::RefCell;

use diffsol::{DenseMatrix, MatrixCommon, NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod};

use crate::error::{Error, Result};
use crate::ode::Ode;

/// How exact a reference solution has to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Error of a step relative to each state.
    pub relative: f64,
    /// Error of a step that counts as none whatever the size of the state, in the units of the states.
    pub absolute: f64,
}

/// An ordinary differential equation with the Jacobian of the last state asked for.
struct Shared<'a, O> {
    ode: &'a mut O,
    state: Vec<f64>,
    jacobian: Vec<f64>,
}

impl<O: Ode<f64>> Shared<'_, O> {
    /// Product `df/dx v` at x for the reference solver.
    fn product(&mut self, x: &[f64], v: &[f64], out: &mut [f64]) {
        if self.state != x {
            self.state.clear();
            self.state.extend_from_slice(x);
            self.ode.jacobian(x, &mut self.jacobian);
        }
        for (out, row) in out.iter_mut().zip(self.jacobian.chunks_exact(x.len().max(1))) {
            *out = row.iter().zip(v).map(|(&entry, &v)| entry * v).sum();
        }
    }
}

/// Reference solution of `ode` at `times` (s, ascending, after 0) from `start` at time 0, row by row.
///
/// Law: backward differentiation of variable order and step (the crate `diffsol`; Shampine & Reichelt 1997, "The MATLAB ODE suite",
/// SIAM J. Sci. Comput. 18(1)) with exact Jacobians. Checked: sizes, tolerances and times; that the solver arrives.
pub fn solve<O: Ode<f64>>(ode: &mut O, start: &[f64], times: &[f64], tolerance: Tolerance) -> Result<Vec<Vec<f64>>> {
    let dim = ode.dim();
    examine(dim, start, times, tolerance)?;
    if times.is_empty() || dim == 0 {
        return Ok(vec![Vec::new(); times.len()]);
    }
    let shared = RefCell::new(Shared { ode, state: Vec::new(), jacobian: vec![0.0; dim * dim] });
    let problem = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(tolerance.relative)
        .atol([tolerance.absolute])
        .rhs_implicit(
            |x, _, _, rate| shared.borrow_mut().ode.rhs(x, rate),
            |x, _, _, v, out| shared.borrow_mut().product(x, v, out),
        )
        .init(|_, _, state| state.copy_from_slice(start), dim)
        .build();
    let problem = problem.map_err(|error| lost(&error))?;
    let mut solver = problem.bdf::<NalgebraLU<f64>>().map_err(|error| lost(&error))?;
    let (states, _) = solver.solve_dense(times).map_err(|error| lost(&error))?;
    Ok((0..states.ncols()).map(|column| (0..dim).map(|row| states.get_index(row, column)).collect()).collect())
}

fn examine(dim: usize, start: &[f64], times: &[f64], tolerance: Tolerance) -> Result<()> {
    if start.len() != dim {
        let (what, each) = ("the start of a reference solution".to_owned(), "state".to_owned());
        return Err(Error::Dimension { what, expected: dim, found: start.len(), each });
    }
    for value in [tolerance.relative, tolerance.absolute] {
        if value.is_nan() || value <= 0.0 {
            let repair = "use 1e-8 for both, for example";
            let condition = "be positive".to_owned();
            return Err(Error::Setting { setting: "a tolerance of the reference solver", condition, value, repair });
        }
    }
    let mut before = 0.0;
    for &value in times {
        if !value.is_finite() || value <= before {
            let condition = format!("be finite and later than the one before, {before} s");
            let repair = "list the times in ascending order, without the start";
            return Err(Error::Setting { setting: "a time of a reference solution", condition, value, repair });
        }
        before = value;
    }
    Ok(())
}

fn lost(error: &diffsol::DiffsolError) -> Error {
    Error::ReferenceSolution { message: error.to_string() }
}
