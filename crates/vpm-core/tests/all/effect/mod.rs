//! Effects on joints.

mod hysteresis;
mod laws;
