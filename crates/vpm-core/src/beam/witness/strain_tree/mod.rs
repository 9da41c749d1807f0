//! Flexible links in a tree, in strain coordinates, with their statics and their motion.
//!
//! Virtual work over the sections sums up to `M = sum w J^T m J`, with dense Jacobians in the axes of each section. Beams hang on joints
//! and rigid hubs in a [`FlexibleTree`].
//!
//! Sources: Renda, Boyer, Dias & Seneviratne 2018, "Discrete Cosserat approach for multisection soft manipulator dynamics",
//! IEEE Trans. Robotics 34(6), for strain coordinates; Featherstone 2008, "Rigid Body Dynamics Algorithms", for the spatial vectors.

mod beam;
mod motion;
mod statics;
mod sweep;
mod tree;

pub use beam::{Field, StrainBeam};
pub use motion::{Drive, TreeMotion};
pub use statics::TipLoad;
pub use sweep::{Frame, TreeWorkspace};
pub use tree::{FlexibleLink, FlexibleTree};
