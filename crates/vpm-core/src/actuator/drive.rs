//! What turns a command into an effort: the last link of an actuator.

use serde::Deserialize;

use super::hydraulic::HydraulicDrive;
use super::{DcMotor, Ideal, Maxwell, SpringDamper};
use crate::effect::Domain;

/// Any drive.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Drive<P> {
    /// An effort in proportion to the command.
    Ideal(Ideal<P>),
    /// The command is a voltage, which drives a current.
    DcMotor(DcMotor<P>),
    /// Spring and damper along a line; the command (m) is added to the free length.
    SpringDamper(SpringDamper<P>),
    /// A visco-elastic element along a line; the command (m) is added to the free length.
    Maxwell(Maxwell<P>),
    /// A cylinder behind a servovalve; the command is the current in the valve.
    Hydraulic(Box<HydraulicDrive<P>>),
}

impl<P> Drive<P> {
    /// The same drive over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Drive<T> {
        match self {
            Self::Ideal(law) => Drive::Ideal(law.map(f)),
            Self::DcMotor(law) => Drive::DcMotor(law.map(f)),
            Self::SpringDamper(law) => Drive::SpringDamper(law.map(f)),
            Self::Maxwell(law) => Drive::Maxwell(law.map(f)),
            Self::Hydraulic(law) => Drive::Hydraulic(Box::new(law.map(f))),
        }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        match self {
            Self::Ideal(law) => law.domains(),
            Self::DcMotor(law) => law.domains(),
            Self::SpringDamper(law) => law.domains(),
            Self::Maxwell(law) => law.domains(),
            Self::Hydraulic(law) => law.domains(),
        }
    }

    /// Its type in descriptions and messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Ideal(_) => "ideal",
            Self::DcMotor(_) => "dc_motor",
            Self::SpringDamper(_) => "spring_damper",
            Self::Maxwell(_) => "maxwell",
            Self::Hydraulic(_) => "hydraulic",
        }
    }

    /// Names of its states, in their order.
    pub fn states(&self) -> &'static [&'static str] {
        match self {
            Self::Ideal(_) | Self::SpringDamper(_) => &[],
            Self::DcMotor(_) => &["current"],
            Self::Maxwell(_) => &["stretch"],
            Self::Hydraulic(_) => &["spool", "spool_rate", "chamber_a", "chamber_b"],
        }
    }
}
