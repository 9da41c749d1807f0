//! Dense linear algebra and polynomials: in arrays whose size the type knows, in flat buffers on hot paths, and of any size.

mod blocks;
mod cholesky;
pub mod dense;
mod polynomial;
mod singular;
mod solve;

pub use blocks::BlockCholesky;
pub use cholesky::Cholesky;
pub use polynomial::{Conic, degree, quadratic_roots, resultant};
pub use singular::{SingularValues, determinant, is_definite};
pub use solve::solve;
