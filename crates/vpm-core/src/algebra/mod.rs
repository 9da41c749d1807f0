//! Small dense linear algebra and polynomials, in arrays whose size the type knows.

mod polynomial;
mod singular;
mod solve;

pub use polynomial::{Conic, degree, quadratic_roots, resultant};
pub use singular::{SingularValues, determinant, is_definite};
pub use solve::solve;
