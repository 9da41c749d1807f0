//! Kinematics of serial chains of lower pairs: poses, Jacobians, accelerations, singularities.
//!
//! Screws and twists are `[angular; linear]`; equation numbers are those of D'Imperio 2016, "Modelling and simulation
//! techniques for advanced robotic systems", chapter 2 ("the thesis").
//!
//! ```
//! use vpm_studies::kinematics::{Component, DenavitHartenberg, LowerPair, SerialChain, Singularity, Task};
//!
//! let link = |a| DenavitHartenberg { theta: 0.0, d: 0.0, alpha: 0.0, a, pair: LowerPair::Revolute };
//! let arm = SerialChain::from_denavit_hartenberg(&[link(0.4), link(0.3)]);
//! let motion = arm.motion_by_screws(&[0.3, 1.1], &[1.0, -2.0], &[0.0, 0.0]);
//! println!("tip at {:?} m, J_dot v = {:?} m/s^2", motion.pose.translation, motion.acceleration.linear);
//!
//! let in_plane = [Component::Translation(0), Component::Translation(1)];
//! let task = Task { components: in_plane.to_vec(), length: 0.7, tolerance: 1e-9 };
//! assert_eq!(arm.analyse(&[0.3, 0.0], &task)?.kind, Singularity::Boundary);
//! # Ok::<(), vpm_core::Error>(())
//! ```

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
