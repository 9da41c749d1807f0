//! The axis of a beam whose strain is interpolated: exact geometry at any deflection, with a constant stiffness.
//!
//! The pose of the section follows from the strain, `H' = H (e0 + e)` with `e0 = [0; k]` and `e = Phi c`, by exponentials
//! on SE(3). The twist of a section relative to the root and its Jacobian follow by the same recursion. Where a beam bends in one plane,
//! sine and cosine of its slope are integrated instead.
//!
//! Sources: Renda, Boyer, Dias & Seneviratne 2018, "Discrete Cosserat approach for multisection soft manipulator dynamics",
//! IEEE Trans. Robotics 34(6), for strain coordinates; Iserles, Munthe-Kaas, Nørsett & Zanna 2000, "Lie-group methods", Acta
//! Numerica 9, for the exponentials.

mod angles;
mod exponential;
mod plane;
mod space;
mod sums;

pub(super) use exponential::rotation;
pub use exponential::{exponential, tangent};
pub(super) use plane::{PlaneAxis, Rule};
pub(super) use space::{Crossing, SpaceAxis};
pub(crate) use sums::{Slices, Sums};
