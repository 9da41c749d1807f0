//! What the drives and supplies of a description must satisfy.

use super::Description;
use super::check::within;
use super::sampled;
use crate::actuator::hydraulic::{PistonSize, Pressures};
use crate::actuator::{Actuator, Drive, Target};
use crate::error::{DriveError, Error, Result};
use crate::joint::JointKind;

/// Every drive acts on something that it can act on, and every hydraulic one has its supply.
pub(super) fn references(description: &Description) -> Result<()> {
    for actuator in &description.actuators {
        if let Drive::Hydraulic(law) = &actuator.drive {
            let what = format!("actuator `{}`", actuator.name);
            within(&what, "supply", law.supply, description.supplies.len())?;
            if law.pressures == Pressures::QuasiStatic && law.valve.clearance.is_none() {
                return Err(DriveError::Clearance { actuator: actuator.name.clone() }.into());
            }
        }
        if let Drive::Table(law) = &actuator.drive
            && let Some((what, repair)) = law.complaint()
        {
            return Err(DriveError::Table { actuator: actuator.name.clone(), what, repair }.into());
        }
        target(description, actuator)?;
        sampled::references(description, actuator)?;
    }
    Ok(())
}

fn target(description: &Description, actuator: &Actuator<usize>) -> Result<()> {
    let sliding =
        |joint: usize| description.bodies.get(joint).is_some_and(|body| body.joint.kind == JointKind::Prismatic);
    let lines = description.lines.len();
    let needed = match (&actuator.drive, actuator.on) {
        (Drive::DcMotor(_), Target::Line(line)) if line < lines => "a joint or a shaft",
        (
            Drive::SpringDamper(_) | Drive::Maxwell(_) | Drive::Hydraulic(_) | Drive::MaxwellNarx(_),
            Target::Line(line),
        ) if line >= lines => "a line",
        (Drive::SpringDamper(_) | Drive::Maxwell(_), Target::Joint(_)) => "a line",
        (Drive::Hydraulic(_) | Drive::MaxwellNarx(_), Target::Joint(joint)) if !sliding(joint) => {
            "a line or a prismatic joint"
        }
        _ => return Ok(()),
    };
    let found = measured(description, actuator.on).1;
    let (actuator, drive) = (actuator.name.clone(), actuator.drive.name());
    Err(DriveError::Target { actuator, drive, found, needed }.into())
}

/// Words for what a drive acts on: the quantity that it changes, and the part.
fn measured(description: &Description, on: Target) -> (&'static str, String) {
    match on {
        Target::Joint(joint) => {
            let name = description.bodies.get(joint).map_or("", |body| &body.joint.name);
            ("the position of", format!("joint `{name}`"))
        }
        Target::Line(line) => {
            let (quantity, kind, name) = match description.lines.get(line) {
                Some(line) => ("the length of", "line", &line.name),
                None => {
                    ("the angle of", "transmission", &description.transmissions[line - description.lines.len()].name)
                }
            };
            (quantity, format!("{kind} `{name}`"))
        }
    }
}

/// Parameters of drives whose order has a meaning.
pub(super) fn orders(description: &Description, theta: &[f64]) -> Result<()> {
    let order = |low: usize, high: usize, repair: &'static str| -> Result<()> {
        let [path, other] = [low, high].map(|place| description.parameter_names[place].clone());
        let (value, limit) = (theta[low], theta[high]);
        if value < limit {
            return Ok(());
        }
        Err(DriveError::Order { path, value, other, limit, repair }.into())
    };
    for supply in &description.supplies {
        order(
            supply.tank_pressure,
            supply.pressure,
            "give both as absolute pressures, that of the supply above that of the tank",
        )?;
    }
    for actuator in &description.actuators {
        if let Drive::Hydraulic(law) = &actuator.drive
            && let PistonSize::Diameters { bore, rod } = law.cylinder.size
        {
            order(rod, bore, "give both as diameters, or the size as area and area_ratio")?;
        }
    }
    Ok(())
}

/// Complaint about a drive whose piston is at `place` from mid-stroke, with a stroke to ± `reach`.
pub(crate) fn piston_outside(
    description: &Description,
    theta: &[f64],
    (number, place, reach): (usize, f64, f64),
) -> Error {
    let actuator = &description.actuators[number];
    let least = match &actuator.drive {
        Drive::Hydraulic(law) => theta[law.retracted_length],
        _ => 0.0,
    };
    let (quantity, part) = measured(description, actuator.on);
    let (measure, most) = (format!("{quantity} {part}"), least + 2.0 * reach);
    DriveError::Piston { actuator: actuator.name.clone(), place, reach, measure, least, most }.into()
}
