//! Dense linear algebra: in flat buffers on hot paths, and of any size.

mod blocks;
mod cholesky;
pub mod dense;

pub use blocks::BlockCholesky;
pub use cholesky::Cholesky;
