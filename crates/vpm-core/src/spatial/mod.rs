//! Poses, twists, wrenches and inertias as different types, so that a twist cannot be added to a wrench.
//!
//! A spatial vector is `[angular; linear]`, taken at the origin of the frame whose axes it is written in. Source:
//! Featherstone 2008, "Rigid Body Dynamics Algorithms", chapter 2.

mod articulated;
mod inertia;
mod logarithm;
mod matrix;
mod pose;
mod quaternion;
mod twist;
mod vector;
mod vector2;
mod wrench;

pub use articulated::ArticulatedInertia;
pub use inertia::{SpatialInertia, principal_moments};
pub use matrix::{Matrix3, Symmetric3};
pub use pose::Pose;
pub use quaternion::Quaternion;
pub use twist::Twist;
pub use vector::Vector3;
pub use vector2::Vector2;
pub use wrench::Wrench;
