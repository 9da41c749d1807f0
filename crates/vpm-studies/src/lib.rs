//! Chains of screws and closed linkages of D'Imperio 2016, "Modelling and simulation techniques for advanced robotic systems",
//! chapter 2.
//!
//! They use the number types, the spatial algebra and the virtual work of `vpm_core`, which works without them. Machines of
//! model files close their loops by `vpm_core::closure`.

pub mod algebra;
pub mod error;
pub mod kinematics;
pub mod linkage;

pub use error::{Error, Result};
