//! The servo-cylinder and its load as a machine of the general tree.
#![allow(dead_code, reason = "each test file uses its own part of this")]

use serde_json::{Value, json};
use vpm_core::actuator::hydraulic::{PistonSize, ServoCylinder};
use vpm_core::evaluate::internal_state;
use vpm_core::samples::slider;

use crate::common::Machine;

/// Where the joint stands with the piston at mid-stroke, m.
pub const MIDDLE: f64 = 0.5;

/// What the drive acts on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum On {
    Joint,
    Line,
}

pub fn supply(servo: &ServoCylinder<f64>, source: Value) -> Value {
    json!({"pressure": servo.supply_pressure, "tank_pressure": servo.tank_pressure, "source": source,
        "oil": {"bulk_modulus": servo.fluid.bulk_modulus, "vapour_pressure": servo.fluid.vapour_pressure}})
}

pub fn drive(servo: &ServoCylinder<f64>) -> Value {
    let (valve, cylinder) = (&servo.valve, &servo.cylinder);
    let size = match cylinder.size {
        PistonSize::Diameters { bore, rod } => json!({"bore": bore, "rod": rod}),
        PistonSize::Areas { area, area_ratio } => json!({"area": area, "area_ratio": area_ratio}),
    };
    json!({"type": "hydraulic", "supply": 0, "retracted_length": MIDDLE - 0.5 * cylinder.stroke,
        "valve": {"gain": valve.gain, "frequency": valve.frequency, "damping": valve.damping, "stroke": valve.stroke,
            "overlap": valve.overlap.width,
            "orifice": {"gain": valve.orifice.gain, "transition_pressure": valve.orifice.transition_pressure}},
        "cylinder": {"size": size, "stroke": cylinder.stroke, "line_a": cylinder.line_a, "line_b": cylinder.line_b,
            "internal_leakage": cylinder.internal_leakage, "external_leakage": cylinder.external_leakage,
            "stop": {"stiffness": cylinder.stop.stiffness, "damping": cylinder.stop.damping}, "seal": {}}})
}

/// The rig as a machine: a mass on a rail with damper and spring, pushed by the cylinder.
pub fn machine(servo: &ServoCylinder<f64>, on: On) -> Machine {
    let mut machine = Machine::new(&slider(servo.load.mass));
    machine.effect("viscous_friction", 0, &[("viscous", servo.load.damping)]);
    machine.effect("spring", 0, &[("stiffness", servo.load.stiffness), ("rest", MIDDLE)]);
    machine.add("supplies", json!({"name": "pump"}), supply(servo, json!("constant")));
    let target = match on {
        On::Joint => json!({"joint": 0}),
        On::Line => {
            // From a point behind the rail's origin: the length is the coordinate.
            let end = |on: Value| json!({"on": on, "point": [0.0, 0.0, 0.0]});
            let line = json!({"name": "strut", "from": end(json!("world")), "to": end(json!({"body": 0})), "barrel": null, "rod": null});
            machine.add("lines", line, json!({}));
            json!({"line": 0})
        }
    };
    machine.add("actuators", json!({"name": "hip", "on": target}), json!({"drive": drive(servo)}));
    machine
}

/// The state at rest at mid-stroke.
pub fn rest(machine: &Machine) -> Vec<f64> {
    let internal = internal_state(&machine.build(), &machine.values, &[MIDDLE]).unwrap();
    [vec![MIDDLE, 0.0], internal].concat()
}
