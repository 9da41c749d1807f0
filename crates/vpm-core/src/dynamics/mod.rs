//! Rigid tree dynamics `M(q) a + h(q, v) = tau`, by algorithms that know nothing of each other and so check each other.
//!
//! [`virtual_work`] takes the Jacobians of single bodies, closed linkages included, in arrays. All others take the
//! coordinates `q`, rates `v` and so on as slices of length `n_joints`, leave their results in [`Data`] and, but for
//! [`check_regular`], allocate nothing. Lengths are the caller's business: a wrong one is a bug in the caller, not an
//! input error.
//!
//! [`Data`]: crate::data::Data

mod aba;
mod crba;
mod energy;
mod kinematics;
mod rnea;
mod virtual_work;

pub use aba::{aba, check_regular};
pub use crba::crba;
pub use energy::{Energy, energy};
pub use kinematics::kinematics;
pub use rnea::rnea;
pub use virtual_work::{Carried, Rate, Terms, effort_of_wrench, virtual_work};
