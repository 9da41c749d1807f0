//! Actuators: the chain from a command to the effort on a joint, each link a file and a rig of its own.

mod dc_motor;
mod dead_zone;
mod drive;
pub mod hydraulic;
mod ideal;
mod input_delay;
mod lag;
mod maxwell;
mod sampled;
mod saturation;
mod spring_damper;
mod table;

use serde::Deserialize;

pub use dc_motor::DcMotor;
pub use dead_zone::DeadZone;
pub use drive::Drive;
pub use ideal::Ideal;
pub use input_delay::InputDelay;
pub use lag::Lag;
pub use maxwell::Maxwell;
pub use sampled::{MaxwellNarxDrive, NarxDrive, Reading, Scheme};
pub use saturation::Saturation;
pub use spring_damper::SpringDamper;
pub use table::TableDrive;

use self::hydraulic::Chambers;
use crate::effect::Domain;
use crate::effect::Law;
use crate::effect::LoadDependentFriction;
use crate::scalar::Scalar;

/// What an actuator acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// The joint of that number, along its coordinate.
    Joint(usize),
    /// The line of that number; a positive force pushes its ends apart. Transmissions count after the lines; a positive effort turns
    /// their shaft forward.
    Line(usize),
}

/// An actuator: delay, dead zone, saturation, lag, drive, friction, in this order; links that are not there pass their input on.
///
/// Checked: see each link.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Actuator<P> {
    /// Name, unique in the model.
    pub name: String,
    /// What it acts on.
    pub on: Target,
    /// From command to effort.
    pub drive: Drive<P>,
    /// Time between command and effect.
    #[serde(default = "none")]
    pub delay: Option<InputDelay<P>>,
    /// Commands without effect.
    #[serde(default = "none")]
    pub dead_zone: Option<DeadZone<P>>,
    /// Largest command with effect.
    #[serde(default = "none")]
    pub saturation: Option<Saturation<P>>,
    /// Time to follow.
    #[serde(default = "none")]
    pub lag: Option<Lag<P>>,
    /// What of its effort is lost where it moves: seals under pressure, a gear of its own.
    #[serde(default = "none")]
    pub friction: Option<LoadDependentFriction<P>>,
}

/// Missing link of an actuator (the derive would ask for `P: Default`).
fn none<T>() -> Option<T> {
    None
}

impl<P> Actuator<P> {
    /// The same actuator over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Actuator<T> {
        Actuator {
            name: self.name.clone(),
            on: self.on,
            drive: self.drive.map(f),
            delay: self.delay.as_ref().map(|link| link.map(f)),
            dead_zone: self.dead_zone.as_ref().map(|link| link.map(f)),
            saturation: self.saturation.as_ref().map(|link| link.map(f)),
            lag: self.lag.as_ref().map(|link| link.map(f)),
            friction: self.friction.as_ref().map(|link| link.map(f)),
        }
    }

    /// Parameters of an actuator and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut domains = self.drive.domains();
        domains.extend(self.delay.as_ref().map(|link| (&link.time, Domain::NonNegative)));
        domains.extend(self.dead_zone.as_ref().map(|link| (&link.width, Domain::NonNegative)));
        domains.extend(self.saturation.as_ref().map(|link| (&link.limit, Domain::Positive)));
        domains.extend(self.lag.as_ref().map(|link| (&link.time_constant, Domain::Positive)));
        domains.extend(self.friction.as_ref().into_iter().flat_map(LoadDependentFriction::domains));
        domains
    }

    /// Names of an actuator's states, in their order: that of the lag, then those of the drive.
    pub fn states(&self) -> impl Iterator<Item = &'static str> {
        self.lag.as_ref().map(|_| "lag").into_iter().chain(self.drive.states().iter().copied())
    }

    /// Whether an actuator's effort follows from its input alone, without drive states and motion.
    pub fn is_direct(&self) -> bool {
        self.drive.is_direct() && self.friction.is_none()
    }

    /// Number of an actuator's states.
    pub fn n_states(&self) -> usize {
        usize::from(self.lag.is_some()) + self.drive.states().len()
    }
}

impl<S: Scalar> Actuator<S> {
    /// Input of an actuator's lag over the interval from sample `k`: the held command after all before it. That is
    /// delay, dead zone and saturation.
    #[inline]
    pub fn input(&self, k: usize, time_step: f64, command: impl Fn(usize) -> S) -> S {
        self.enter(match &self.delay {
            Some(delay) => delay.held(k, time_step, command),
            None => command(k),
        })
    }

    /// Input of an actuator's lag from an arrived command: what dead zone and saturation leave.
    #[inline]
    pub fn enter(&self, arrived: S) -> S {
        let mut input = arrived;
        if let Some(dead_zone) = &self.dead_zone {
            input = dead_zone.apply(input);
        }
        if let Some(saturation) = &self.saturation {
            input = saturation.apply(input);
        }
        input
    }

    /// The part of the drive's `force` that the actuator's own friction takes away at `rate`.
    ///
    /// Law: [`LoadDependentFriction`] of this drive alone, whatever else moves the joint.
    #[inline]
    pub fn friction(&self, force: S, rate: S) -> S {
        self.friction.as_ref().map_or_else(S::zero, |law| -law.effort_under(S::zero(), rate, force))
    }

    /// Friction resistance of an actuator at `rate`: the chord from rest, where its drive gives `force` at rest. Seals of
    /// a cylinder are between `pressures` (Pa).
    pub(crate) fn resistance(&self, force: S, rate: S, pressures: Chambers<S>) -> S {
        let own = match &self.drive {
            Drive::Hydraulic(law) => law.cylinder.rubbing_chord(rate, pressures),
            Drive::DcMotor(law) => law.gear_resistance(force, rate),
            _ => S::zero(),
        };
        own + self.friction_chord(force, rate)
    }

    /// Resistance of the actuator's own friction under `force` at `rate`: the chord from rest.
    #[inline]
    pub fn friction_chord(&self, force: S, rate: S) -> S {
        self.friction.as_ref().map_or_else(S::zero, |law| law.resistance_per_load(rate, force) * force.abs())
    }
}
