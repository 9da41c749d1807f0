//! Linear systems, singular values and polynomials of small sizes.

mod polynomial;
mod singular;
mod solve;

pub use polynomial::{Conic, degree, quadratic_roots, resultant};
pub use singular::{SingularValues, determinant, is_definite};
pub use solve::solve;
