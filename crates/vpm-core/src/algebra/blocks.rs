//! Symmetric positive definite systems that fall apart.

use super::Cholesky;
use crate::scalar::Scalar;

/// Cholesky factors of a matrix of blocks between which all entries are zero: each block by itself.
#[derive(Clone, Debug)]
pub struct BlockCholesky<S> {
    dim: usize,
    blocks: Vec<Block<S>>,
}

/// The rows of a block, ascending, and its factors.
#[derive(Clone, Debug)]
struct Block<S> {
    places: Vec<usize>,
    factors: Cholesky<S>,
}

impl<S: Scalar> BlockCholesky<S> {
    /// Buffers for a matrix of which row i is in the block with the number `blocks[i]`.
    pub fn new(blocks: &[usize]) -> Self {
        let mut numbers = blocks.to_vec();
        numbers.sort_unstable();
        numbers.dedup();
        let block = |number| {
            let places: Vec<usize> = (0..blocks.len()).filter(|&row| blocks[row] == number).collect();
            Block { factors: Cholesky::new(places.len()), places }
        };
        Self { dim: blocks.len(), blocks: numbers.into_iter().map(block).collect() }
    }

    /// Factorises the blocks of `matrix`, of which the lower triangle counts, row by row.
    pub fn factorise(&mut self, matrix: &[S]) {
        let dim = self.dim;
        match &mut self.blocks[..] {
            [whole] => whole.factors.factorise(matrix),
            blocks => {
                for Block { places, factors } in blocks {
                    factors.factorise_by(|row, column| matrix[places[row] * dim + places[column]]);
                }
            }
        }
    }

    /// Solves `A x = b` by blocks: x takes the place of `b`.
    pub fn solve(&self, b: &mut [S]) {
        match &self.blocks[..] {
            [whole] => whole.factors.solve(b),
            blocks => blocks.iter().for_each(|Block { places, factors }| factors.solve_at(b, places)),
        }
    }

    /// The square of the pivot of a row: what is left of its diagonal entry after the rows of its block before it.
    pub fn pivot(&self, row: usize) -> S {
        let own = self.blocks.iter().find_map(|Block { places, factors }| {
            let place = places.iter().position(|&place| place == row)?;
            Some(factors.pivot(place))
        });
        own.unwrap_or_else(S::zero)
    }
}
