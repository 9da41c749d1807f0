//! The linear system of an implicit stage.

use std::ops::Mul;

use super::Length;
use super::lu::{Lu, take};
use crate::ode::Ode;
use crate::scalar::Scalar;

/// `1 - r A` of an implicit step, with the coordinates eliminated: they follow their rates.
///
/// Law: with `A = [0, 1, 0; B, C]`, the coordinates first, `(1 - r A) [k; w] = [a; b]` is `(1 - r C - r^2 B') w = b + r B a` and
/// `k = a + r v`, where v are the leading entries of w and B' is B below v, zero elsewhere. So a system of n coordinates and m states
/// costs the factors of m - n rows, an eighth of the work where there is nothing but coordinates and rates.
/// Numbers with first derivatives take the factors of the values alone: of `(1 - r A) k = b` these are `k' = (1 - r A)^-1 (b' + r A' k)`.
/// Source: elimination by blocks, Golub & Van Loan 2013, "Matrix Computations", section 3.2.9. Checked: against the whole system.
#[derive(Clone, Debug)]
pub(super) struct Stage<S, L = f64> {
    /// A, row by row.
    matrix: Vec<S>,
    /// -r B, column by column, its rows in the order of the factors.
    coupling: Vec<S>,
    lu: Lu<S>,
    /// What derivatives missing in A make of a solution.
    missing: Vec<S>,
    /// The derivatives of a right-hand side, where they are solved for apart.
    derivatives: Vec<S>,
    /// The same of the values, where numbers carry first derivatives.
    values: Option<Box<Stage<f64>>>,
    coordinates: usize,
    dim: usize,
    reach: L,
}

impl<S: Scalar + Mul<L, Output = S>, L: Length> Stage<S, L> {
    /// Buffers of an implicit stage for systems of `dim` states.
    pub(super) fn new(dim: usize) -> Self {
        let (square, line) = (vec![S::zero(); dim * dim], vec![S::zero(); dim]);
        Self {
            matrix: square.clone(),
            coupling: square,
            lu: Lu::new(dim),
            missing: line.clone(),
            derivatives: line,
            values: S::is_first_order().then(|| Box::new(Stage::new(dim))),
            coordinates: 0,
            dim,
            reach: L::default(),
        }
    }

    /// Matrix A of an implicit stage, to be written row by row before it is factorised; it stays there.
    pub(super) fn matrix(&mut self) -> &mut [S] {
        &mut self.matrix
    }

    /// Factorises `1 - reach A` of an implicit stage, where that many coordinates lead the state.
    pub(super) fn factorise(&mut self, coordinates: usize, reach: L) {
        (self.coordinates, self.reach) = (coordinates, reach);
        if let Some(values) = &mut self.values {
            values.matrix.iter_mut().zip(&self.matrix).for_each(|(value, entry)| *value = entry.re());
            return values.factorise(coordinates, (S::one() * reach).re());
        }
        let left = self.dim - coordinates;
        if self.lu.dim() != left {
            self.lu.resize(left);
        }
        for_size!(left, N => self.eliminate::<N>());
    }

    /// Eliminates the coordinates from an implicit stage and factorises the rest; of N rows, or any if N is 0.
    fn eliminate<const N: usize>(&mut self) {
        let (n, reach) = (self.coordinates, self.reach);
        let left = if N == 0 { self.dim - n } else { N };
        let (dim, given) = (n + left, &self.matrix[n * (n + left)..]);
        let matrix = &mut self.lu.matrix()[..left * left];
        let square = reach * reach;
        for (k, row) in matrix.chunks_exact_mut(left.max(1)).enumerate() {
            let given = &given[k * dim..(k + 1) * dim];
            scale::<S, L, N>(row, &given[n..], -reach);
            row[k] = row[k] + 1.0;
            for (target, &entry) in row.iter_mut().zip(&given[..n]) {
                *target -= entry * square;
            }
        }
        self.lu.factorise_of::<N>();
        for column in 0..n {
            let coupling = &mut self.coupling[column * left..(column + 1) * left];
            for (coupling, &row) in coupling.iter_mut().zip(self.lu.order()) {
                *coupling = given[row * dim + column] * -reach;
            }
        }
    }

    /// Largest elimination factor of an implicit stage, see [`Lu::largest_factor`].
    pub(super) fn largest_factor(&self) -> S {
        match &self.values {
            Some(values) => S::from_f64(values.largest_factor()),
            None => self.lu.largest_factor(),
        }
    }

    /// Solution x of an implicit stage `(1 - reach A) x = b` in the place of `b`. A is the last matrix of that system.
    pub(super) fn solve(&mut self, ode: &mut impl Ode<S>, b: &mut [S]) {
        if let Some(mut values) = self.values.take() {
            self.solve_by(&mut values, ode, b);
            self.values = Some(values);
            return;
        }
        if !ode.turns() {
            for_size!(self.lu.dim(), N => self.solve_of::<N>(b));
            return;
        }
        // Values first: derivatives need them, and take one solution then.
        let mut missing = std::mem::take(&mut self.missing);
        self.derivatives.copy_from_slice(b);
        b.iter_mut().for_each(|entry| *entry = entry.frozen());
        self.derivatives.iter_mut().zip(&*b).for_each(|(entry, &value)| *entry -= value);
        for_size!(self.lu.dim(), N => self.solve_of::<N>(b));
        ode.turned(b, &mut missing);
        for (missing, &own) in missing.iter_mut().zip(&self.derivatives) {
            *missing = *missing * self.reach + own;
        }
        for_size!(self.lu.dim(), N => self.solve_of::<N>(&mut missing));
        b.iter_mut().zip(&missing).for_each(|(entry, &missing)| *entry += missing);
        self.missing = missing;
    }

    /// Solution of an implicit stage for numbers with first derivatives, by the factors of the values.
    fn solve_by(&mut self, values: &mut Stage<f64>, ode: &mut impl Ode<S>, b: &mut [S]) {
        let (dim, n) = (self.dim, self.coordinates);
        let mut solution = std::mem::take(&mut values.missing);
        solution.iter_mut().zip(&*b).for_each(|(value, entry)| *value = entry.re());
        for_size!(values.lu.dim(), N => values.solve_of::<N>(&mut solution));
        let mut missing = std::mem::take(&mut self.missing);
        missing.fill(S::zero());
        for (entry, &value) in b.iter_mut().zip(&solution) {
            *entry = *entry - entry.re() + value;
        }
        if ode.turns() {
            ode.turned(b, &mut missing);
        }
        for (row, (missing, entry)) in missing.iter_mut().zip(&*b).enumerate() {
            *missing = *missing * self.reach + (*entry - entry.re());
            if row >= n {
                for (slope, &value) in self.matrix[row * dim..].iter().zip(&solution) {
                    missing.add_derivatives(slope, values.reach * value);
                }
            }
        }
        values.solve_numbers(&mut missing, &mut self.derivatives);
        for ((entry, &missing), &value) in b.iter_mut().zip(&missing).zip(&solution) {
            *entry = missing + value;
        }
        (self.missing, values.missing) = (missing, solution);
    }

    fn solve_of<const N: usize>(&mut self, b: &mut [S]) {
        let (coordinates, others) = b.split_at_mut(self.coordinates);
        let left = if N == 0 { others.len() } else { N };
        self.lu.solve_of::<N>(others, |others| {
            for (&coordinate, column) in coordinates.iter().zip(self.coupling.chunks_exact(left.max(1))) {
                take(others, column, coordinate);
            }
        });
        for (coordinate, &rate) in coordinates.iter_mut().zip(&*others) {
            *coordinate += rate * self.reach;
        }
    }
}

/// Writes `factor` times a row of an implicit stage; N is its length, or 0 for any.
#[inline(always)]
fn scale<S: Scalar + Mul<L, Output = S>, L: Length, const N: usize>(row: &mut [S], given: &[S], factor: L) {
    match (row.first_chunk_mut::<N>(), given.first_chunk::<N>()) {
        // All are read before one is written, so that the compiler takes several at a time.
        (Some(row), Some(given)) if N > 0 && S::plain(&[]).is_some() => *row = given.map(|entry| entry * factor),
        _ => row.iter_mut().zip(given).for_each(|(target, &entry)| *target = entry * factor),
    }
}

impl Stage<f64> {
    /// As [`Stage::solve`], of numbers of another kind, in room for as many of these as there are states.
    fn solve_numbers<T: Scalar>(&self, b: &mut [T], room: &mut [T]) {
        let (coordinates, others) = b.split_at_mut(self.coordinates);
        let left = others.len();
        self.lu.solve_numbers(others, &mut room[..left], |others| {
            for (&coordinate, column) in coordinates.iter().zip(self.coupling.chunks_exact(left.max(1))) {
                take(others, column, coordinate);
            }
        });
        for (coordinate, &rate) in coordinates.iter_mut().zip(&*others) {
            *coordinate += rate * self.reach;
        }
    }
}
