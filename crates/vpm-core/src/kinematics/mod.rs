//! Kinematics of serial chains of lower pairs: poses, Jacobians, accelerations, singularities.
//!
//! Screws and twists are `[angular; linear]`; equation numbers are those of D'Imperio 2016, "Modelling and simulation
//! techniques for advanced robotic systems", chapter 2 ("the thesis").

mod chain;
mod denavit_hartenberg;
mod jacobian;
mod pair;
mod screw;
mod singularity;

pub use chain::{Motion, SerialChain};
pub use denavit_hartenberg::DenavitHartenberg;
pub use jacobian::at_point;
pub use pair::LowerPair;
pub use screw::Screw;
pub use singularity::{Analysis, Component, Singularity, Task};
