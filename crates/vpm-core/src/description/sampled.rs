//! Sampled drives of a description: their models, and what these must satisfy.

use super::Description;
use super::check::within;
use crate::actuator::{Actuator, Drive, MaxwellNarxDrive, NarxDrive, Reading, Scheme};
use crate::error::{DriveError, Error, Result};
use crate::narx::{Factor, MaxwellNarx, MaxwellScheme, Narx, Structure, Surface, Term};

/// Model of a sampled NARX drive; its output is called `effort`.
pub(crate) fn narx_of(drive: &NarxDrive) -> Result<Narx> {
    let names: Vec<String> =
        ["effort"].into_iter().chain(drive.inputs.iter().map(|(name, _)| name.as_str())).map(str::to_owned).collect();
    let term = |factors: &Vec<(usize, usize)>| {
        Term::new(factors.iter().map(|&(signal, delay)| Factor { signal, delay }).collect())
    };
    Narx::new(Structure::new(&names, drive.terms.iter().map(term).collect())?, &drive.coefficients)
}

/// Element of a sampled drive of type maxwell_narx.
pub(crate) fn maxwell_of(drive: &MaxwellNarxDrive) -> Result<MaxwellNarx> {
    let scheme = match drive.scheme {
        Scheme::Trapezoidal => MaxwellScheme::Trapezoidal,
        Scheme::Printed => MaxwellScheme::Printed,
        Scheme::CentralMean => MaxwellScheme::CentralMean,
    };
    MaxwellNarx::new(Surface(drive.k0), Surface(drive.s0), drive.k1, drive.c1, drive.sample_time, scheme)
}

/// Complains about a sampled drive that reads what is not there, has a lag, or whose numbers make no model.
pub(super) fn references(description: &Description, actuator: &Actuator<usize>) -> Result<()> {
    let (sample_time, limit) = match &actuator.drive {
        Drive::Narx(drive) => {
            let what = format!("actuator `{}`", actuator.name);
            for (_, reading) in &drive.inputs {
                match *reading {
                    Reading::Command => {}
                    Reading::Position(joint) | Reading::Velocity(joint) => {
                        within(&what, "joint", joint, description.n_joints())?;
                    }
                    Reading::Length(line) | Reading::Rate(line) => {
                        within(&what, "line", line, description.n_wires())?;
                    }
                }
            }
            finite(actuator, "initial", drive.initial)?;
            narx_of(drive)?;
            (drive.sample_time, drive.limit)
        }
        Drive::MaxwellNarx(drive) => {
            maxwell_of(drive)?;
            (drive.sample_time, drive.limit)
        }
        _ => return Ok(()),
    };
    for (key, value) in [("sample_time", Some(sample_time)), ("limit", limit)] {
        if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
            let (path, condition) = (format!("{}.{key}", actuator.name), "be positive and finite");
            return Err(Error::Domain { path, condition, value });
        }
    }
    if actuator.lag.is_some() {
        let what = "that a lag, whose state goes on between samples, cannot stand before it";
        return Err(sampled(actuator, what, "take the lag out, or identify it with the model"));
    }
    Ok(())
}

fn finite(actuator: &Actuator<usize>, key: &str, value: f64) -> Result<()> {
    match value.is_finite() {
        true => Ok(()),
        false => Err(Error::NonFinite { path: format!("{}.{key}", actuator.name), value }),
    }
}

fn sampled(actuator: &Actuator<usize>, what: &'static str, repair: &'static str) -> Error {
    DriveError::Sampled { actuator: actuator.name.clone(), drive: actuator.drive.name(), what, repair }.into()
}

impl Description {
    /// Complains if an actuator acts at samples of its own, where that makes impossible `what`.
    pub(crate) fn refuse_sampled(&self, what: &'static str, repair: &'static str) -> Result<()> {
        match self.actuators.iter().find(|actuator| actuator.drive.is_sampled()) {
            Some(actuator) => Err(sampled(actuator, what, repair)),
            None => Ok(()),
        }
    }
}
