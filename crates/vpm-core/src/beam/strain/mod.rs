//! Beams whose strain is interpolated, in space: exact geometry at any deflection, with a constant stiffness.
//!
//! The pose of the section follows from the strain, `H' = H (e0 + e)` with `e0 = [0; k]` and `e = Phi c`, by exponentials
//! on SE(3). The twist of a section relative to the root and its Jacobian follow by the same recursion, and virtual work sums up
//! to `M = sum w J^T m J`. Beams hang on joints and rigid hubs in a [`FlexibleTree`].
//!
//! Sources: Renda, Boyer, Dias & Seneviratne 2018, "Discrete Cosserat approach for multisection soft manipulator dynamics",
//! IEEE Trans. Robotics 34(6), for strain coordinates; Iserles, Munthe-Kaas, Nørsett & Zanna 2000, "Lie-group methods", Acta
//! Numerica 9, for the exponentials; Featherstone 2008, "Rigid Body Dynamics Algorithms", for the spatial vectors.

mod angles;
mod beam;
mod exponential;
mod motion;
mod plane;
mod space;
mod statics;
mod sums;
mod sweep;
mod tree;

pub use beam::{Field, StrainBeam};
pub(super) use exponential::rotation;
pub use exponential::{exponential, tangent};
pub use motion::{Drive, TreeMotion};
pub(super) use plane::{PlaneAxis, Rule};
pub(super) use space::SpaceAxis;
pub use statics::TipLoad;
pub(crate) use sums::{Slices, Sums};
pub use sweep::{Frame, TreeWorkspace};
pub use tree::{FlexibleLink, FlexibleTree};
