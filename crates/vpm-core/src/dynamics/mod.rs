//! Tree dynamics `M(q) a + h(q, v) = tau`, by algorithms that know nothing of each other and so check each other.
//!
//! [`rnea`], [`crba`], [`aba`], [`energy()`] and [`kinematics()`] are for rigid trees ([`Model::is_recursive`]), [`articulated`] for
//! trees without lines that weigh something or couplings left out ([`Model::is_segmented`]), [`flexible`] for all, [`virtual_work`] for
//! the Jacobians of single bodies, closed linkages included, in arrays. All others take the coordinates `q`, rates `v` and so on as slices
//! of length `n_coordinates`, leave their results in [`Data`] and, but for [`check_regular`], allocate nothing. Lengths are the caller's
//! business: a wrong one is a bug in the caller, not an input error. Only [`articulated`] goes on with the steps of another, [`aba`].
//!
//! [`Data`]: crate::data::Data
//! [`Model::is_recursive`]: crate::model::Model::is_recursive
//! [`Model::is_segmented`]: crate::model::Model::is_segmented

mod aba;
pub mod articulated;
mod crba;
mod energy;
pub mod flexible;
mod frames;
mod kinematics;
mod reaction;
mod regular;
mod rnea;
mod slices;
mod virtual_work;
mod wrenches;

pub use aba::aba;
pub use crba::crba;
pub use energy::{Energy, energy};
pub use frames::frames;
pub(crate) use frames::{Stations, for_each_column, lines, motion, outward, poses, shafts, specific_force};
pub use kinematics::kinematics;
pub(crate) use reaction::{Motion, accelerated, in_axes, reactions, take_off};
pub use regular::check_regular;
pub use rnea::rnea;
pub use virtual_work::{Carried, Rate, Terms, effort_of_wrench, virtual_work};
pub(crate) use wrenches::add_wrench;
