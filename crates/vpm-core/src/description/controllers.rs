//! What controllers must satisfy: each measures and commands what its law is made for, at times that there are.

use super::Description;
use super::check::{channel, within};
use super::entry::ControllerEntry;
use crate::actuator::{Drive, Target};
use crate::controller::ControlLaw;
use crate::error::{Error, Result};
use crate::sensor::Channel;

/// References, kinds of channels and actuators, and plain numbers of every controller.
pub(super) fn check(description: &Description) -> Result<()> {
    for controller in &description.controllers {
        let what = format!("controller `{}`", controller.name);
        for &actuator in &controller.actuators {
            within(&what, "actuator", actuator, description.n_actuators())?;
        }
        for &measured in &controller.measures {
            channel(&what, measured, description)?;
        }
        shape(&what, controller)?;
        for (place, &measured) in controller.measures.iter().enumerate() {
            sees(&what, controller, measured, description.lines.len())?;
            acts(&what, controller, description, place)?;
        }
        times(controller)?;
    }
    Ok(())
}

/// Checks that no controller needs the motion of every coordinate in a machine with elastic ones.
pub(super) fn check_rigid(description: &Description) -> Result<()> {
    let inverting = |controller: &&ControllerEntry| matches!(controller.law, ControlLaw::ComputedTorque(_));
    let elastic = description.beams.iter().zip(description.elastic()).find(|(_, len)| **len > 0);
    match (description.controllers.iter().find(inverting), elastic) {
        (Some(controller), Some((beam, _))) => refuse(format!(
            "controller `{}` inverts the model of the machine, but nobody measures the elastic coordinates of beam `{}`; make the \
             beam rigid or use another type, such as pd",
            controller.name, beam.name
        )),
        _ => Ok(()),
    }
}

fn refuse(message: String) -> Result<()> {
    Err(Error::Description { message })
}

/// Checks a controller's shape: one actuator, one channel; or as many of both as there are gains.
fn shape(what: &str, controller: &ControllerEntry) -> Result<()> {
    let (actuators, measures) = (controller.actuators.len(), controller.measures.len());
    let wanted = match &controller.law {
        ControlLaw::ComputedTorque(law) => {
            let limits = law.limit.as_ref().map_or(actuators, Vec::len);
            let counts = [measures, law.proportional.len(), law.derivative.len(), limits];
            if actuators == 0 || counts.iter().any(|&count| count != actuators) {
                return refuse(format!(
                    "{what} lists {actuators} actuators, {measures} measures, {} proportional and {} derivative gains and {limits} \
                     limits, but needs as many of each, and at least one",
                    counts[1], counts[2]
                ));
            }
            actuators
        }
        _ => 1,
    };
    if actuators == wanted && measures == wanted {
        return Ok(());
    }
    let kind = controller.law.name();
    refuse(format!("{what} lists {actuators} actuators and {measures} measures, but a {kind} has one of each"))
}

/// Checks what a controller measures. A law sees positions of joints; of lines, numbered below `lines`, and of shafts
/// after them some see the length or the angle.
fn sees(what: &str, controller: &ControllerEntry, measured: Channel, lines: usize) -> Result<()> {
    match (&controller.law, measured) {
        (ControlLaw::Cascade(_) | ControlLaw::Pid(_), Channel::Length { line }) if line >= lines => Ok(()),
        (_, Channel::Position { .. }) | (ControlLaw::Pd(_), Channel::Length { .. }) => Ok(()),
        (ControlLaw::Pd(_), _) => {
            refuse(format!("{what} measures {measured:?}, but a pd measures a position or a length"))
        }
        _ => refuse(format!("{what} measures {measured:?}, but a controller measures a position")),
    }
}

/// Checks what a controller acts on. A force loop needs the way from its joint to its actuator, computed torque the
/// joint itself.
fn acts(what: &str, controller: &ControllerEntry, description: &Description, place: usize) -> Result<()> {
    let (Channel::Position { joint }, Some(&number)) = (controller.measures[place], controller.actuators.get(place))
    else {
        return Ok(());
    };
    let actuator = &description.actuators[number];
    let own = actuator.on == Target::Joint(joint);
    let (bad, needs) = match controller.law {
        ControlLaw::ForceLoop(_) => {
            (!own && matches!(actuator.on, Target::Joint(_)), "a line or the joint it measures")
        }
        ControlLaw::ComputedTorque(_) => (
            !own || !matches!(actuator.drive, Drive::Ideal(_)),
            "the joint it measures in the same place, by a drive of type ideal",
        ),
        _ => (false, ""),
    };
    if !bad {
        return Ok(());
    }
    let (kind, joint) = (controller.law.name(), &description.bodies[joint].joint.name);
    refuse(format!(
        "{what} measures joint `{joint}` and commands actuator `{}`, but the actuator of a {kind} acts on {needs}; pair each actuator \
         with its own joint",
        actuator.name
    ))
}

fn times(controller: &ControllerEntry) -> Result<()> {
    for (key, value, least, condition) in [
        ("sample_time", controller.sample_time, f64::MIN_POSITIVE, "be a positive time in s"),
        ("delay", controller.delay, 0.0, "be a time in s that is not negative"),
    ] {
        if let Some(value) = value.filter(|value| !(*value >= least && value.is_finite())) {
            return Err(Error::Domain { path: format!("{}.{key}", controller.name), condition, value });
        }
    }
    Ok(())
}
