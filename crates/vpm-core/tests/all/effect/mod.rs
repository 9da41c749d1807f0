//! Effects on joints.

mod frictions;
mod hysteresis;
mod laws;
