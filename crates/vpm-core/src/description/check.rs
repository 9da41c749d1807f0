//! What a description must satisfy before anything is built from it.

use super::{Description, EffectEntry, connections, controllers, drives};
use crate::actuator::Target;
use crate::body::Site;
use crate::effect::{Domain, JointEffect, Seat};
use crate::error::{Error, Result};
use crate::sensor::Channel;

/// Checks that every number that refers to something refers to something that exists. Nothing may be claimed twice.
pub(super) fn references(description: &Description) -> Result<()> {
    if description.parameter_names.len() != description.parameters.len() {
        return Err(Error::Dimension {
            what: "parameter_names".to_owned(),
            expected: description.parameters.len(),
            found: description.parameter_names.len(),
            each: "parameter".to_owned(),
        });
    }
    if description.bodies.is_empty() && description.beams.is_empty() {
        let message = "it has no body and no beam, but a machine needs at least one".to_owned();
        return Err(Error::Description { message });
    }
    for (what, index) in used_parameters(description) {
        within(&what, "parameter", index, description.parameters.len())?;
    }
    sites(description)?;
    drives::references(description)?;
    for cell in &description.load_cells {
        within(&format!("load cell `{}`", cell.name), "joint", cell.joint, description.n_joints())?;
    }
    channels(description)?;
    unique_claims(description)
}

/// Checks length, finiteness and domain of every parameter.
pub(super) fn parameters(description: &Description, theta: &[f64]) -> Result<()> {
    if theta.len() != description.n_parameters() {
        return Err(Error::Dimension {
            what: "theta".to_owned(),
            expected: description.n_parameters(),
            found: theta.len(),
            each: "parameter of the model".to_owned(),
        });
    }
    for (path, &value) in description.parameter_names.iter().zip(theta) {
        if !value.is_finite() {
            return Err(Error::NonFinite { path: path.clone(), value });
        }
    }
    for (index, domain) in domains(description) {
        let (path, value) = (&description.parameter_names[index], theta[index]);
        if !domain.contains(value) {
            return Err(Error::Domain { path: path.clone(), condition: domain.condition(), value });
        }
    }
    drives::orders(description, theta)
}

fn domains(description: &Description) -> impl Iterator<Item = (usize, Domain)> {
    let effects = description.effects.iter().flat_map(EffectEntry::domains);
    let actuators = description.actuators.iter().flat_map(|actuator| actuator.domains());
    let supplies = description.supplies.iter().flat_map(|supply| supply.domains());
    let sensors = description.sensors.iter().flat_map(|sensor| sensor.domains());
    let controllers = description.controllers.iter().flat_map(|controller| controller.law.domains());
    let connections = connections::domains(description);
    let shafts = description.transmissions.iter().flat_map(|shaft| {
        let ratios = shaft.ratios.iter().map(|entry| (&entry.ratio, Domain::NonZero));
        ratios.chain(shaft.inertia.as_ref().map(|inertia| (inertia, Domain::NonNegative)))
    });
    let domains =
        shafts.chain(effects).chain(actuators).chain(supplies).chain(sensors).chain(controllers).chain(connections);
    domains.map(|(&index, domain)| (index, domain))
}

/// Places in the parameter vector that are used, and by what, for their check.
fn used_parameters(description: &Description) -> Vec<(String, usize)> {
    let mut used = Vec::new();
    for body in &description.bodies {
        body.map(&mut |&index| used.push((format!("body `{}`", body.name), index)));
    }
    for weld in &description.welds {
        weld.map(&mut |&index| used.push((format!("body `{}`", weld.name), index)));
    }
    for beam in &description.beams {
        beam.map(&mut |&index| used.push((format!("beam `{}`", beam.name), index)));
    }
    for line in &description.lines {
        line.map(&mut |&index| used.push((format!("line `{}`", line.name), index)));
    }
    for transmission in &description.transmissions {
        transmission.map(&mut |&index| used.push((format!("transmission `{}`", transmission.name), index)));
    }
    for (number, effect) in description.effects.iter().enumerate() {
        let what = format!("effect number {number}");
        used.extend(effect.domains().into_iter().map(|(&index, _)| (what.clone(), index)));
        // The ratios of a shaft have no domain of their own here.
        if let Some(seat) = effect.seat() {
            seat.map(&mut |&index| used.push((what.clone(), index)));
        }
    }
    for actuator in &description.actuators {
        actuator.map(&mut |&index| used.push((format!("actuator `{}`", actuator.name), index)));
    }
    for supply in &description.supplies {
        supply.map(&mut |&index| used.push((format!("supply `{}`", supply.name), index)));
    }
    for sensor in &description.sensors {
        sensor.map(&mut |&index| used.push((format!("sensor `{}`", sensor.name), index)));
    }
    for controller in &description.controllers {
        controller.law.map(&mut |&index| used.push((format!("controller `{}`", controller.name), index)));
    }
    used.extend(connections::used(description));
    used
}

fn sites(description: &Description) -> Result<()> {
    let joints = description.n_joints();
    for ball in &description.balls {
        let what = format!("joint `{}`", ball.name);
        ball.angles.iter().flatten().try_for_each(|&joint| within(&what, "joint", joint, joints))?;
        if ball.angles.iter().any(Vec::is_empty) {
            let message = format!("{what} has an angle without coordinate; name one for each angle");
            return Err(Error::Description { message });
        }
    }
    for shaft in &description.transmissions {
        let (what, own) = (format!("transmission `{}`", shaft.name), &shaft.ratios);
        own.iter().try_for_each(|entry| within(&what, "joint", entry.joint, joints))?;
        let twice = (1..own.len()).any(|k| own[..k].iter().any(|entry| entry.joint == own[k].joint));
        if own.is_empty() || twice {
            let message = format!("{what} names no joint, or one twice; give each joint that turns it one ratio");
            return Err(Error::Description { message });
        }
    }
    for (number, effect) in description.effects.iter().enumerate() {
        let what = format!("effect number {number}");
        match effect {
            EffectEntry::Joint { seat, .. } | EffectEntry::Memory { seat, .. } => {
                seat.joints().into_iter().try_for_each(|joint| within(&what, "joint", joint, joints))?;
                if let Seat::Shaft { transmission, .. } = seat {
                    within(&what, "transmission", *transmission, description.transmissions.len())?;
                    let name = &description.transmissions[*transmission].name;
                    follows_no_load(&what, name, effect)?;
                }
            }
            EffectEntry::Payload { on: Site::Body(body), .. } => within(&what, "body", *body, joints)?,
            EffectEntry::Payload { on: Site::Weld(weld), .. } => within(&what, "weld", *weld, description.welds.len())?,
            EffectEntry::Payload { on: Site::Tip(beam), .. } => within(&what, "beam", *beam, description.n_beams())?,
            EffectEntry::Tree(law) => {
                if let Some((target, index)) = law.site() {
                    let count = if target == "beam" { description.n_beams() } else { joints };
                    within(&what, target, index, count)?;
                }
            }
        }
    }
    for actuator in &description.actuators {
        let what = format!("actuator `{}`", actuator.name);
        match actuator.on {
            Target::Joint(joint) => within(&what, "joint", joint, joints)?,
            Target::Line(line) => within(&what, "line", line, description.n_wires())?,
        }
    }
    Ok(())
}

/// Checks that effects of shafts need no load: a shaft does not know that of a joint.
fn follows_no_load(what: &str, transmission: &str, effect: &EffectEntry) -> Result<()> {
    let EffectEntry::Joint { law, .. } = effect else { return Ok(()) };
    let follows = |law: &JointEffect<usize>| {
        matches!(
            law,
            JointEffect::LoadDependentFriction(_) | JointEffect::CurrentRipple(_) | JointEffect::EmpiricalForce(_)
        )
    };
    if !follows(law) {
        return Ok(());
    }
    let message = format!(
        "{what} follows the load of a joint, but sits at transmission `{transmission}`; give the friction to its actuator, or take a joint"
    );
    Err(Error::Description { message })
}

fn channels(description: &Description) -> Result<()> {
    for sensor in &description.sensors {
        channel(&format!("sensor `{}`", sensor.name), sensor.channel, description)?;
    }
    controllers::check(description)
}

pub(super) fn channel(what: &str, channel: Channel, description: &Description) -> Result<()> {
    let layout = description.layout();
    match channel {
        Channel::Position { joint }
        | Channel::Velocity { joint }
        | Channel::Acceleration { joint }
        | Channel::Effort { joint } => within(what, "joint", joint, description.n_joints()),
        Channel::Command { actuator } | Channel::Force { actuator } => {
            within(what, "actuator", actuator, description.n_actuators())
        }
        Channel::Length { line } | Channel::Rate { line } | Channel::Tension { line } => {
            within(what, "line", line, description.n_wires())
        }
        Channel::Strain { gauge } => within(what, "gauge", gauge, description.gauges.len()),
        Channel::X { marker }
        | Channel::Y { marker }
        | Channel::Z { marker }
        | Channel::Rx { marker }
        | Channel::Ry { marker }
        | Channel::Rz { marker } => within(what, "marker", marker, description.markers.len()),
        Channel::Hydraulic { hydraulic, .. } => within(what, "hydraulic drive", hydraulic, layout.hydraulics),
        Channel::Current { dc_motor } => within(what, "direct-current motor", dc_motor, layout.dc_motors),
        Channel::Supply { supply, .. } => within(what, "supply", supply, layout.supplies),
        Channel::Contact { contact, .. } => within(what, "contact", contact, description.contacts.len()),
        Channel::Bushing { bushing, .. } => within(what, "bushing", bushing, description.bushings.len()),
        Channel::Ball { ball, .. } => within(what, "ball joint", ball, description.balls.len()),
        Channel::Loop { closure, .. } => within(what, "loop", closure, description.loops.len()),
        Channel::LoadCell { load_cell, .. } => within(what, "load cell", load_cell, description.load_cells.len()),
        Channel::Imu { imu, .. } => within(what, "inertial measurement unit", imu, layout.imus),
    }
}

/// Checks for one sensor per channel, one controller per actuator.
fn unique_claims(description: &Description) -> Result<()> {
    for (k, second) in description.sensors.iter().enumerate() {
        if let Some(first) = description.sensors[..k].iter().find(|first| first.channel == second.channel) {
            return Err(twice(&first.name, &second.name, "measure the same channel"));
        }
    }
    let mut commanded = vec![None; description.n_actuators()];
    for controller in &description.controllers {
        for &actuator in &controller.actuators {
            if let Some(first) = commanded[actuator].replace(&controller.name) {
                return Err(twice(first, &controller.name, "command the same actuator"));
            }
        }
    }
    Ok(())
}

fn twice(first: &str, second: &str, claim: &str) -> Error {
    Error::Twice { first: first.to_owned(), second: second.to_owned(), claim: claim.to_owned() }
}

pub(super) fn within(what: &str, target: &'static str, index: usize, count: usize) -> Result<()> {
    if index < count {
        return Ok(());
    }
    Err(Error::Reference { what: what.to_owned(), target, index, count })
}
