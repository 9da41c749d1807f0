//! What turns a command into an effort: the last link of an actuator.

use serde::Deserialize;

use super::hydraulic::HydraulicDrive;
use super::{DcMotor, Ideal, Maxwell, MaxwellNarxDrive, NarxDrive, SpringDamper, TableDrive};
use crate::effect::Domain;
use crate::scalar::Scalar;

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
    /// An effort looked up by the command and the velocity.
    Table(Box<TableDrive>),
    /// A polynomial NARX model; its input in the equations of motion is the effort that it holds.
    Narx(Box<NarxDrive>),
    /// A Maxwell element in sampled time; likewise.
    MaxwellNarx(Box<MaxwellNarxDrive>),
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
            Self::Table(law) => Drive::Table(law.clone()),
            Self::Narx(law) => Drive::Narx(law.clone()),
            Self::MaxwellNarx(law) => Drive::MaxwellNarx(law.clone()),
        }
    }

    /// Parameters of a drive and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        match self {
            Self::Ideal(law) => law.domains(),
            Self::DcMotor(law) => law.domains(),
            Self::SpringDamper(law) => law.domains(),
            Self::Maxwell(law) => law.domains(),
            Self::Hydraulic(law) => law.domains(),
            Self::Table(_) | Self::Narx(_) | Self::MaxwellNarx(_) => Vec::new(),
        }
    }

    /// Type of a drive in descriptions and messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Ideal(_) => "ideal",
            Self::DcMotor(_) => "dc_motor",
            Self::SpringDamper(_) => "spring_damper",
            Self::Maxwell(_) => "maxwell",
            Self::Hydraulic(_) => "hydraulic",
            Self::Table(_) => "table",
            Self::Narx(_) => "narx",
            Self::MaxwellNarx(_) => "maxwell_narx",
        }
    }

    /// Names of a drive's states, in their order.
    pub fn states(&self) -> &'static [&'static str] {
        match self {
            Self::Ideal(_) | Self::SpringDamper(_) | Self::Table(_) | Self::Narx(_) | Self::MaxwellNarx(_) => &[],
            Self::DcMotor(_) => &["current"],
            Self::Maxwell(_) => &["stretch"],
            Self::Hydraulic(law) => law.states(),
        }
    }

    /// Whether a drive acts at samples of its own and holds its effort in between.
    pub fn is_sampled(&self) -> bool {
        matches!(self, Self::Narx(_) | Self::MaxwellNarx(_))
    }

    /// Whether a drive's effort follows from its input alone, without states and motion.
    pub fn is_direct(&self) -> bool {
        matches!(self, Self::Ideal(_)) || self.is_sampled()
    }
}

impl<S: Scalar> Drive<S> {
    /// Effort of a drive that [`Drive::is_direct`] under `input`; none of the others.
    #[inline]
    pub fn direct(&self, input: S) -> Option<S> {
        match self {
            Self::Ideal(law) => Some(law.effort(input)),
            Self::Narx(_) | Self::MaxwellNarx(_) => Some(input),
            _ => None,
        }
    }
}
