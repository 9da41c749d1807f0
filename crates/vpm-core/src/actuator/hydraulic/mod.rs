//! Hydraulic drives: oil, edges of a valve, servovalve, cylinder, and a servo-cylinder as a rig of its own.
//!
//! Equation numbers are those of D'Imperio 2016, "Modelling and simulation techniques for advanced robotic systems", chapter 4;
//! where a printed equation is wrong the corrected one is given. All pressures are absolute, in Pa.

mod cylinder;
mod fluid;
mod orifice;
mod piston;
mod servo;
mod valve;

pub use cylinder::{Chambers, Cylinder};
pub use fluid::{EntrainedAir, Fluid};
pub use orifice::Orifice;
pub use piston::{EndStop, SealFriction};
pub use servo::{Load, ServoCylinder, ServoRig, ServoState};
pub use valve::{Flows, Valve};

use crate::effect::Domain;

/// A parameter with its name, and where it is defined.
pub type NamedDomain<'a, P> = (&'static str, &'a P, Domain);
