//! Chains of inextensible flexible links that move in one plane, exact at any deflection, in fixed sizes.
//!
//! The plane is (x, y) with gravity wherever it is given. A link turns about a joint, carries a rigid hub there, a beam from the
//! rim of the hub on, and a rigid body at its tip, where the next joint sits. Its coordinates are the *absolute* angle of
//! its hub and the coefficients of its curvature: `theta(s) = a + int_0^s Phi(sigma) c dsigma = w(s) . x`, and the centreline
//! is `r(s) = r_joint + radius e(a) + int_0^s e(theta) dsigma`, `e = (cos, sin)`. So inextensibility costs nothing, elastic
//! energy and damping are quadratic forms with constant matrices, joint angles are linear in the coordinates, and links
//! meet only through the motion of the joint between them:
//!
//! ```text
//! M_ii = int rhoA J_i^T J_i ds + m_beyond J_tip^T J_tip + constant rotary terms
//! M_ji = J_tip,j^T (int rhoA J_i ds + m_beyond J_tip,i)                                 j before i
//! ```
//!
//! Source: the virtual work of Simo & Vu-Quoc 1986, "On the dynamics of flexible beams under large overall motions", J. Appl. Mech.
//! 53, without shear and extension, discretised in the curvature. Checked against closed forms, converged series and the derivatives
//! of the energies.

mod additive;
mod arm;
mod chain;
mod cholesky;
mod dynamics;
mod link;
mod record;
mod rosenbrock;
mod statics;

pub use additive::Additive;
pub use arm::{Arm, Order, Reference, Servo, State};
pub use chain::{Hub, LinkParameters, PlanarChain};
pub use cholesky::Cholesky;
pub use dynamics::{Load, Motion, Terms, Workspace};
pub use rosenbrock::{Mechanism, Rosenbrock};
