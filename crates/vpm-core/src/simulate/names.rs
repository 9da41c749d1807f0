//! States and outputs of a machine in words.

use crate::actuator::Drive;
use crate::description::Description;
use crate::effect::Seat;
use crate::sensor::Layout;

/// Name of a state in words.
pub(crate) fn state_name(description: &Description, place: usize) -> String {
    let n = description.n_coordinates();
    if place < n {
        return coordinate_name(description, "position", place);
    }
    if place < 2 * n {
        return coordinate_name(description, "velocity", place - n);
    }
    let of_drives =
        description.actuators.iter().flat_map(|actuator| actuator.states().map(move |state| (state, actuator)));
    let of_drives =
        of_drives.map(|(state, actuator)| format!("{} of actuator `{}`", state.replace('_', " "), actuator.name));
    let states = description.supplies.iter().flat_map(|supply| supply.states().map(move |state| (state, supply)));
    let of_supplies = states.map(|(state, supply)| format!("{state} of supply `{}`", supply.name));
    let of_effects =
        description.remembering().map(|seat| format!("memory of an effect of {}", site(description, seat)));
    of_drives.chain(of_supplies).chain(of_effects).nth(place - 2 * n).unwrap_or_default()
}

/// Name of an effect's site in words.
pub(super) fn site(description: &Description, seat: &Seat<usize>) -> String {
    match seat {
        Seat::Joint { joint, .. } => format!("joint `{}`", description.bodies[*joint].joint.name),
        Seat::Shaft { transmission, .. } => {
            format!("transmission `{}`", description.transmissions[*transmission].name)
        }
    }
}

fn coordinate_name(description: &Description, quantity: &str, place: usize) -> String {
    match description.bodies.get(place) {
        Some(body) => format!("{quantity} of joint `{}`", body.joint.name),
        None => format!("{quantity} of {}", coordinate(description, place)),
    }
}

/// Name of a coordinate in words.
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

/// Name of an output in words.
pub(crate) fn output_name(description: &Description, column: usize) -> String {
    const JOINT: [&str; 4] = ["position", "velocity", "acceleration", "effort"];
    const MARKER: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
    const HYDRAULIC: [&str; 5] = ["spool", "pressure a", "pressure b", "flow a", "flow b"];
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
        let first = layout.lines() + 3 * names.len();
        if column >= first {
            let names: Vec<_> = d.transmissions.iter().map(|shaft| shaft.name.as_str()).collect();
            return pick(first, &["position", "velocity", "effort"], "transmission", &names);
        }
        return pick(layout.lines(), &["length", "rate", "force"], "line", &names);
    }
    if column < layout.markers() {
        let names: Vec<_> = d.gauges.iter().map(|gauge| gauge.name.as_str()).collect();
        return pick(layout.gauges(), &["strain"], "gauge", &names);
    }
    if column < layout.hydraulics() {
        let names: Vec<_> = d.markers.iter().map(|marker| marker.name.as_str()).collect();
        return pick(layout.markers(), &MARKER, "marker", &names);
    }
    let of_kind = |kind: fn(&Drive<usize>) -> bool| -> Vec<&str> {
        d.actuators.iter().filter(|actuator| kind(&actuator.drive)).map(|actuator| actuator.name.as_str()).collect()
    };
    if column < layout.dc_motors() {
        let names = of_kind(|drive| matches!(drive, Drive::Hydraulic(_)));
        return pick(layout.hydraulics(), &HYDRAULIC, "actuator", &names);
    }
    if column < layout.supplies() {
        let names = of_kind(|drive| matches!(drive, Drive::DcMotor(_)));
        return pick(layout.dc_motors(), &["current"], "actuator", &names);
    }
    if column < layout.contacts() {
        let names: Vec<_> = d.supplies.iter().map(|supply| supply.name.as_str()).collect();
        return pick(layout.supplies(), &["pressure", "flow"], "supply", &names);
    }
    if column < layout.bushings() {
        let names: Vec<_> = d.contacts.iter().map(|contact| contact.name.as_str()).collect();
        return pick(layout.contacts(), &["depth", "normal_force", "fx", "fy", "fz"], "contact", &names);
    }
    if column < layout.load_cells() {
        let names: Vec<_> = d.bushings.iter().map(|bushing| bushing.name.as_str()).collect();
        return pick(layout.bushings(), &WRENCH, "bushing", &names);
    }
    if column < layout.balls() {
        let names: Vec<_> = d.load_cells.iter().map(|cell| cell.name.as_str()).collect();
        return pick(layout.load_cells(), &WRENCH, "load cell", &names);
    }
    if column >= layout.imus() {
        let names: Vec<_> = d.imus.iter().map(|imu| imu.name.as_str()).collect();
        return pick(layout.imus(), &["ax", "ay", "az", "wx", "wy", "wz"], "inertial measurement unit", &names);
    }
    if column >= layout.loops() {
        let names: Vec<_> = d.loops.iter().map(|closure| closure.name.as_str()).collect();
        return pick(layout.loops(), &WRENCH, "loop", &names);
    }
    let names: Vec<_> = d.balls.iter().map(|ball| ball.name.as_str()).collect();
    pick(layout.balls(), &["qw", "qx", "qy", "qz", "wx", "wy", "wz"], "joint", &names)
}
