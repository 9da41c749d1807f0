//! Hydraulic drives: oil, edges of a valve, servovalve, cylinder, supply; as drives of a machine, and a servo-cylinder as a rig of its
//! own.
//!
//! Equation numbers are those of D'Imperio 2016, "Modelling and simulation techniques for advanced robotic systems", chapter 4;
//! where a printed equation is wrong the corrected one is given. All pressures are absolute, in Pa.

mod balance;
mod cylinder;
mod drive;
mod fluid;
mod load;
mod orifice;
mod piston;
mod servo;
mod size;
mod supply;
mod valve;

pub use balance::Balance;
pub use cylinder::{Chambers, Cylinder};
pub use drive::{DriveAction, HydraulicDrive};
pub use fluid::{EntrainedAir, Fluid};
pub use load::{Pressures, chambers_under_load};
pub use orifice::Orifice;
pub use piston::{EndStop, PressedSeals, SealFriction};
pub use servo::{Load, ServoCylinder, ServoRig, ServoState};
pub use size::PistonSize;
pub use supply::{Sagging, Source, Supply, SupplyDrop};
pub use valve::{Flows, Valve};

use crate::effect::Domain;

/// A parameter with its name, and where it is defined.
pub type NamedDomain<'a, P> = (&'static str, &'a P, Domain);
