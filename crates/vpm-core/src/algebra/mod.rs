//! Small dense linear algebra and polynomials, most of it in arrays whose size the type knows.

mod blocks;
mod cholesky;
mod polynomial;
mod singular;
mod solve;

pub use blocks::BlockCholesky;
pub use cholesky::Cholesky;
pub use polynomial::{Conic, degree, quadratic_roots, resultant};
pub use singular::{SingularValues, determinant, is_definite};
pub use solve::solve;
