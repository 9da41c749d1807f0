//! Sampled controllers: references and measurements in, commands out, held from one sample of the controller to its next.
//!
//! Each law is a file and a rig of its own; what a controller sees, and when its command arrives, is the simulation's affair.

mod cascade;
mod computed_torque;
mod force_loop;
mod memory;
mod pd;
mod pid;
mod timing;

use serde::Deserialize;

pub use cascade::Cascade;
pub use computed_torque::{ComputedTorque, Differences};
pub use force_loop::{ForceLoop, Stroke};
pub use memory::ControlMemory;
pub use pd::Pd;
pub use pid::Pid;
pub use timing::samples_between;

use crate::actuator::Saturation;
use crate::effect::Domain;

/// Any control law.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ControlLaw<P> {
    /// Position loop around a velocity loop.
    Cascade(Cascade<P>),
    /// Proportional, integral, derivative.
    Pid(Pid<P>),
    /// Proportional to error and measured rate.
    Pd(Pd<P>),
    /// A torque by way of a force that is measured.
    ForceLoop(ForceLoop<P>),
    /// The model of the machine, inverted.
    ComputedTorque(ComputedTorque<P>),
}

/// Missing number of a controller (the derive would ask for `P: Default`).
fn none<T>() -> Option<T> {
    None
}

/// Limit of a controller over another number type.
fn limit<P, T>(limit: Option<&Saturation<P>>, f: &mut impl FnMut(&P) -> T) -> Option<Saturation<T>> {
    limit.map(|limit| limit.map(f))
}

/// Domains of a controller's numbers that may be anything, and of a limit that has to be positive.
fn domains<'a, P>(free: Vec<&'a P>, limit: Option<&'a Saturation<P>>) -> Vec<(&'a P, Domain)> {
    let free = free.into_iter().map(|number| (number, Domain::Any));
    free.chain(limit.map(|limit| (&limit.limit, Domain::Positive))).collect()
}

impl<P> ControlLaw<P> {
    /// Controller law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> ControlLaw<T> {
        match self {
            Self::Cascade(law) => ControlLaw::Cascade(law.map(f)),
            Self::Pid(law) => ControlLaw::Pid(law.map(f)),
            Self::Pd(law) => ControlLaw::Pd(law.map(f)),
            Self::ForceLoop(law) => ControlLaw::ForceLoop(law.map(f)),
            Self::ComputedTorque(law) => ControlLaw::ComputedTorque(law.map(f)),
        }
    }

    /// Parameters of a controller and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        match self {
            Self::Cascade(law) => law.domains(),
            Self::Pid(law) => law.domains(),
            Self::Pd(law) => law.domains(),
            Self::ForceLoop(law) => law.domains(),
            Self::ComputedTorque(law) => law.domains(),
        }
    }

    /// Name of a controller's law in descriptions.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cascade(_) => "cascade",
            Self::Pid(_) => "pid",
            Self::Pd(_) => "pd",
            Self::ForceLoop(_) => "force_loop",
            Self::ComputedTorque(_) => "computed_torque",
        }
    }
}
