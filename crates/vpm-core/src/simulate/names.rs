//! States and outputs of a machine in words.

use crate::description::Description;
use crate::sensor::Layout;

/// A state in words.
pub(crate) fn state_name(description: &Description, place: usize) -> String {
    let n = description.n_coordinates();
    if place < n {
        return coordinate_name(description, "position", place);
    }
    if place < 2 * n {
        return coordinate_name(description, "velocity", place - n);
    }
    let mut lagging = description.actuators.iter().filter(|actuator| actuator.lag.is_some());
    format!("lag of actuator `{}`", lagging.nth(place - 2 * n).map_or("", |actuator| &actuator.name))
}

fn coordinate_name(description: &Description, quantity: &str, place: usize) -> String {
    match description.bodies.get(place) {
        Some(body) => format!("{quantity} of joint `{}`", body.joint.name),
        None => format!("{quantity} of {}", coordinate(description, place)),
    }
}

/// A coordinate in words.
pub(super) fn coordinate(description: &Description, place: usize) -> String {
    if let Some(body) = description.bodies.get(place) {
        return body.joint.name.clone();
    }
    let mut number = place - description.n_joints();
    for (beam, &len) in description.beams.iter().zip(description.elastic()) {
        if number < len {
            return format!("elastic coordinate {number} of beam {}", beam.name);
        }
        number -= len;
    }
    format!("coordinate {place}")
}

/// An output in words.
pub(super) fn output_name(description: &Description, column: usize) -> String {
    const JOINT: [&str; 4] = ["position", "velocity", "acceleration", "effort"];
    const MARKER: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
    const WRENCH: [&str; 6] = ["mx", "my", "mz", "fx", "fy", "fz"];
    let layout: Layout = description.layout();
    let pick = |first: usize, quantities: &[&str], kind: &str, names: &[&str]| {
        let (place, quantity) = ((column - first) / quantities.len(), (column - first) % quantities.len());
        format!("{} of {kind} `{}`", quantities[quantity], names.get(place).unwrap_or(&""))
    };
    let d = description;
    if column < layout.actuators() {
        let names: Vec<_> = d.bodies.iter().map(|body| body.joint.name.as_str()).collect();
        return pick(0, &JOINT, "joint", &names);
    }
    if column < layout.lines() {
        let names: Vec<_> = d.actuators.iter().map(|actuator| actuator.name.as_str()).collect();
        return pick(layout.actuators(), &["command", "force"], "actuator", &names);
    }
    if column < layout.gauges() {
        let names: Vec<_> = d.lines.iter().map(|line| line.name.as_str()).collect();
        return pick(layout.lines(), &["length", "rate", "force"], "line", &names);
    }
    if column < layout.markers() {
        let names: Vec<_> = d.gauges.iter().map(|gauge| gauge.name.as_str()).collect();
        return pick(layout.gauges(), &["strain"], "gauge", &names);
    }
    if column < layout.contacts() {
        let names: Vec<_> = d.markers.iter().map(|marker| marker.name.as_str()).collect();
        return pick(layout.markers(), &MARKER, "marker", &names);
    }
    if column < layout.bushings() {
        let names: Vec<_> = d.contacts.iter().map(|contact| contact.name.as_str()).collect();
        return pick(layout.contacts(), &["depth", "normal_force", "fx", "fy", "fz"], "contact", &names);
    }
    if column < layout.load_cells() {
        let names: Vec<_> = d.bushings.iter().map(|bushing| bushing.name.as_str()).collect();
        return pick(layout.bushings(), &WRENCH, "bushing", &names);
    }
    let names: Vec<_> = d.load_cells.iter().map(|cell| cell.name.as_str()).collect();
    pick(layout.load_cells(), &WRENCH, "load cell", &names)
}
