//! Small dense linear systems.

use std::ops::Mul;

use crate::scalar::Scalar;

/// Rows from which on a solution is written out. With 5 that costs 3 % of a step, with 11 it saves 12 %.
const WRITTEN_OUT: usize = 7;

/// LU factors of a small square matrix, in buffers that are allocated once.
///
/// Law: `P A = L D R` with ones on the diagonals of L and R and row exchanges for the largest pivot (Golub & Van Loan 2013, "Matrix
/// Computations", algorithm 3.4.1, U = D R). What solves is kept column by column, with the inverse of each pivot: columns are added as
/// they stand, without sums that wait for each other (algorithms 3.1.3 and 3.1.4 there), nor for the pivots.
/// A singular matrix gives infinite or undefined numbers, which the caller finds in its result.
#[derive(Clone, Debug)]
pub struct Lu<S> {
    dim: usize,
    /// The matrix, then U, row by row.
    factors: Vec<S>,
    /// L below and R above the diagonal, column by column, with the inverse of each pivot on it.
    columns: Vec<S>,
    order: Vec<usize>,
    scratch: Vec<S>,
}

impl<S: Scalar> Lu<S> {
    /// LU buffers for matrices of `dim` rows.
    pub fn new(dim: usize) -> Self {
        let (square, line) = (vec![S::zero(); dim * dim], vec![S::zero(); dim]);
        Self { dim, factors: square.clone(), columns: square, order: (0..dim).collect(), scratch: line }
    }

    /// Rows of the LU-factorised matrix.
    pub(super) fn dim(&self) -> usize {
        self.dim
    }

    /// Resizes the LU buffers to matrices of `dim` rows; allocates only where they were never that large.
    pub fn resize(&mut self, dim: usize) {
        self.dim = dim;
        self.factors.resize(dim * dim, S::zero());
        self.columns.resize(dim * dim, S::zero());
        self.order.resize(dim, 0);
        self.scratch.resize(dim, S::zero());
    }

    /// The matrix to factorise next, row by row, overwritten by [`Lu::factorise`].
    pub fn matrix(&mut self) -> &mut [S] {
        &mut self.factors
    }

    /// LU-factorises the matrix in place.
    pub fn factorise(&mut self) {
        for_size!(self.dim, N => self.factorise_of::<N>());
    }

    pub(super) fn factorise_of<const N: usize>(&mut self) {
        let n = if N == 0 { self.dim } else { N };
        let (factors, columns) = (&mut self.factors[..n * n], &mut self.columns[..n * n]);
        let order = &mut self.order[..n];
        order.iter_mut().enumerate().for_each(|(row, place)| *place = row);
        for column in 0..n {
            let best = largest(factors, column, n);
            if best != column {
                order.swap(column, best);
                let (upper, lower) = factors.split_at_mut(best * n);
                upper[column * n..(column + 1) * n].swap_with_slice(&mut lower[..n]);
                columns[..column * n].chunks_exact_mut(n).for_each(|factors| factors.swap(column, best));
            }
            let (above, below) = factors.split_at_mut((column + 1) * n);
            let pivots = &above[column * n..];
            let inverse = pivots[column].recip();
            columns[column * n + column] = inverse;
            for (k, row) in below.chunks_exact_mut(n).enumerate() {
                let factor = row[column] * inverse;
                columns[column * n + column + 1 + k] = factor;
                reduce::<S, N>(row, pivots, factor, column);
                row[column] = S::zero();
            }
            for (k, &pivot) in pivots.iter().enumerate().skip(column + 1) {
                columns[k * n + column] = pivot * inverse;
            }
        }
    }

    /// Largest entry of L below its diagonal in the LU factors: at most one with row exchanges.
    pub(super) fn largest_factor(&self) -> S {
        let columns = self.columns.chunks_exact(self.dim.max(1)).enumerate();
        columns
            .flat_map(|(column, entries)| &entries[column + 1..])
            .fold(S::zero(), |largest, factor| largest.max(factor.abs()))
    }

    /// Order in which the LU factors take the rows of the matrix.
    pub(super) fn order(&self) -> &[usize] {
        &self.order
    }

    /// Replaces `b` by the solution x of `A x = b` from the LU factors.
    pub fn solve(&mut self, b: &mut [S]) {
        for_size!(self.dim, N => self.solve_of::<N>(b, |_| ()));
    }

    /// Solves as [`Lu::solve`] after `change`, which sees the entries of `b` in the order of the factors.
    ///
    /// N is the number of rows, or 0 for any number.
    #[inline]
    pub(super) fn solve_of<const N: usize>(&mut self, b: &mut [S], change: impl FnOnce(&mut [S])) {
        let Self { columns, order, scratch, .. } = self;
        let mut few = [S::zero(); N];
        let (n, known) = if N == 0 { (self.dim, &mut scratch[..]) } else { (N, &mut few[..]) };
        let (columns, b) = (&columns[..n * n], &mut b[..n]);
        for (entry, &row) in known.iter_mut().zip(&*order) {
            *entry = b[row];
        }
        change(known);
        // Of numbers with derivatives that would be much code for little: they take the factors of plain ones.
        if N >= WRITTEN_OUT && S::plain(&[]).is_some() {
            eliminate::<S, N>(columns, &mut few);
            b.copy_from_slice(&few);
            return;
        }
        for k in 0..n {
            let (known, below) = known.split_at_mut(k + 1);
            take(below, &columns[k * n + k + 1..], known[k]);
            known[k] *= columns[k * n + k];
        }
        for k in (0..n).rev() {
            let (above, known) = known.split_at_mut(k);
            b[k] = known[0];
            take(above, &columns[k * n..], known[0]);
        }
    }
}

impl Lu<f64> {
    /// Solves as [`Lu::solve_of`] for a `b` of another number type; `known` is a buffer of one entry for each row of the matrix.
    pub(super) fn solve_numbers<T: Scalar>(&self, b: &mut [T], known: &mut [T], change: impl FnOnce(&mut [T])) {
        let (n, columns) = (self.dim, &self.columns);
        for (entry, &row) in known.iter_mut().zip(&self.order) {
            *entry = b[row];
        }
        change(known);
        for k in 0..n {
            let (known, below) = known.split_at_mut(k + 1);
            take(below, &columns[k * n + k + 1..(k + 1) * n], known[k]);
            known[k] = known[k] * columns[k * n + k];
        }
        for k in (0..n).rev() {
            let (above, known) = known.split_at_mut(k);
            b[k] = known[0];
            take(above, &columns[k * n..], known[0]);
        }
    }
}

/// Takes `factor` times a column off in an LU factorisation.
#[inline]
pub(super) fn take<S: Scalar + Mul<F, Output = S>, F: Copy>(entries: &mut [S], column: &[F], factor: S) {
    for (entry, &part) in entries.iter_mut().zip(column) {
        *entry -= factor * part;
    }
}

/// Takes `factor` times the `pivots` off a row of an LU factorisation, right of `column`; N is their number, or 0 for any number.
#[inline(always)]
fn reduce<S: Scalar, const N: usize>(row: &mut [S], pivots: &[S], factor: S, column: usize) {
    match (row.first_chunk_mut::<N>(), pivots.first_chunk::<N>()) {
        // Few entries are quicker taken all, zeros on the left included, than counted. All are read before one is written, so
        // that the compiler takes several at a time.
        (Some(row), Some(pivots)) if N > 0 && S::plain(&[]).is_some() => {
            *row = std::array::from_fn(|k| row[k] - factor * pivots[k])
        }
        _ => take(&mut row[column + 1..], &pivots[column + 1..], factor),
    }
}

/// Solves by few LU `columns`, of N rows, in the place of `known`: written out, so that all numbers stay in registers.
#[inline(always)]
fn eliminate<S: Scalar, const N: usize>(columns: &[S], known: &mut [S; N]) {
    let Some((columns, _)) = columns.split_at_checked(N * N) else { return };
    macro_rules! each {
        ($k:ident in $($size:literal)* => $work:block) => { $({ const K: usize = $size; let $k = K; if K < N $work })* };
    }
    each!(k in 0 1 2 3 4 5 6 7 8 9 10 11 => {
        for row in k + 1..N {
            known[row] -= columns[k * N + row] * known[k];
        }
        known[k] *= columns[k * N + k];
    });
    each!(k in 11 10 9 8 7 6 5 4 3 2 1 0 => {
        for row in 0..k {
            known[row] -= columns[k * N + row] * known[k];
        }
    });
}

/// Pivot row of an LU factorisation from `column` down; incomparable numbers stay where they are.
#[inline(always)]
fn largest<S: Scalar>(factors: &[S], column: usize, n: usize) -> usize {
    let size = |row: usize| factors[row * n + column].abs();
    let (mut best, mut largest) = (column, size(column));
    for row in column + 1..n {
        let found = size(row);
        if largest.known_less(found) == Some(true) {
            (best, largest) = (row, found);
        }
    }
    best
}
