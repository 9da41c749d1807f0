//! The servo-cylinder and its load as a machine of the general tree.

use serde_json::{Value, json};
use vpm_core::actuator::hydraulic::{EntrainedAir, PistonSize, ServoCylinder};
use vpm_core::evaluate::internal_state;
use vpm_core::samples::{pendulum, slider};

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
    let bubbles = |air: EntrainedAir<f64>| json!({"fraction": air.fraction, "exponent": air.exponent, "reference_pressure": air.reference_pressure});
    let [air, more_air] = [servo.fluid.air, servo.fluid.more_air].map(|air| air.map(bubbles));
    // A source that has a drop says both.
    let (own, drop) = match source.get("own") {
        Some(own) => (own.clone(), source["drop"].clone()),
        None => (source, Value::Null),
    };
    json!({"pressure": servo.supply_pressure, "tank_pressure": servo.tank_pressure, "source": own, "drop": drop,
        "oil": {"bulk_modulus": servo.fluid.bulk_modulus, "vapour_pressure": servo.fluid.vapour_pressure, "air": air,
            "more_air": more_air}})
}

pub fn drive(servo: &ServoCylinder<f64>) -> Value {
    let (valve, cylinder) = (&servo.valve, &servo.cylinder);
    let size = match cylinder.size {
        PistonSize::Diameters { bore, rod } => json!({"bore": bore, "rod": rod}),
        PistonSize::Areas { area, area_ratio } => json!({"area": area, "area_ratio": area_ratio}),
    };
    json!({"type": "hydraulic", "supply": 0, "retracted_length": MIDDLE - 0.5 * cylinder.stroke,
        "valve": {"gain": valve.gain, "frequency": valve.frequency, "damping": valve.damping, "stroke": valve.stroke,
            "overlap": valve.overlap.width, "delay": valve.delay, "clearance": valve.clearance,
            "orifice": {"gain": valve.orifice.gain, "transition_pressure": valve.orifice.transition_pressure}},
        "cylinder": {"size": size, "stroke": cylinder.stroke, "line_a": cylinder.line_a, "line_b": cylinder.line_b,
            "internal_leakage": cylinder.internal_leakage, "worn_leakage": cylinder.worn_leakage, "external_leakage": cylinder.external_leakage,
            "stop": {"stiffness": cylinder.stop.stiffness, "damping": cylinder.stop.damping}, "seal": seal(servo)}})
}

fn seal(servo: &ServoCylinder<f64>) -> Value {
    let seal = &servo.cylinder.seal;
    json!({"viscous": seal.viscous.map(|law| json!({"viscous": law.viscous})),
        "coulomb": seal.coulomb.map(|law| json!({"coulomb": law.coulomb, "transition_velocity": law.transition_velocity})),
        "stribeck": seal.stribeck.map(|law| json!({"stribeck": law.stribeck, "stribeck_velocity": law.stribeck_velocity,
            "transition_velocity": law.transition_velocity})),
        "pressed": seal.pressed.map(|law| json!({"share": law.share, "transition_velocity": law.transition_velocity}))})
}

/// The rig as a machine: a mass on a rail with damper and spring, pushed by the cylinder.
pub fn machine(servo: &ServoCylinder<f64>, on: On) -> Machine {
    machine_fed(servo, on, json!("constant"))
}

/// The same with another source of oil.
pub fn machine_fed(servo: &ServoCylinder<f64>, on: On, source: Value) -> Machine {
    let mut machine = Machine::new(&slider(servo.load.mass));
    machine.effect("viscous_friction", 0, &[("viscous", servo.load.damping)]);
    machine.effect("spring", 0, &[("stiffness", servo.load.stiffness), ("rest", MIDDLE)]);
    machine.add("supplies", json!({"name": "pump"}), supply(servo, source));
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

/// The mass on its rail without a spring, pushed by a cylinder with the pressures of `kind`: `chambers`, `load` or `quasi_static`.
pub fn with_pressures(servo: &ServoCylinder<f64>, kind: &str, source: Value) -> Machine {
    let mut machine = Machine::new(&slider(servo.load.mass));
    machine.effect("viscous_friction", 0, &[("viscous", servo.load.damping)]);
    machine.add("supplies", json!({"name": "pump"}), supply(servo, source));
    let mut law = drive(servo);
    law["pressures"] = json!(kind);
    machine.add("actuators", json!({"name": "hip", "on": {"joint": 0}}), json!({"drive": law}));
    machine
}

/// The mass with every drive that is simpler than chambers behind a spool, each with its name; a table of its force is one of them.
pub fn simpler_drives(servo: &ServoCylinder<f64>) -> Vec<(&'static str, Machine)> {
    let mut leaking = *servo;
    leaking.valve.clearance = Some(2e-4);
    let mut at_once = leaking;
    (at_once.valve.frequency, at_once.valve.damping) = (None, None);
    let of = |servo, kind| with_pressures(servo, kind, json!("constant"));
    let mut table = Machine::new(&slider(servo.load.mass));
    let law = json!({"type": "table", "commands": [-5e-3, 0.0, 5e-3], "velocities": [-0.2, 0.2],
        "efforts": [-900.0, -1100.0, 100.0, -100.0, 1100.0, 900.0]});
    table.add("actuators", json!({"name": "hip", "on": {"joint": 0}, "drive": law}), json!({}));
    vec![
        ("load", of(servo, "load")),
        ("static spool", of(&at_once, "chambers")),
        ("static spool, load", of(&at_once, "load")),
        ("quasi-static", of(&leaking, "quasi_static")),
        ("static spool, quasi-static", of(&at_once, "quasi_static")),
        ("table", table),
    ]
}

/// The state at rest at mid-stroke.
pub fn rest(machine: &Machine) -> Vec<f64> {
    let internal = internal_state(&machine.build(), &machine.values, &[MIDDLE]).unwrap();
    [vec![MIDDLE, 0.0], internal].concat()
}

/// A pendulum of 5 kg that a cylinder aslant swings, with everything that a drive can have; its rest at 0.2 rad.
pub fn leg(servo: &ServoCylinder<f64>, source: Value) -> (Machine, Vec<f64>) {
    let (from, at, angle) = ([0.2, 0.1, 0.1], [0.05, 0.0, -0.3], 0.2_f64);
    let (sin, cos) = angle.sin_cos();
    let across = [at[0] * cos + at[2] * sin - from[0], -from[1], at[2] * cos - at[0] * sin - from[2]];
    let length = across.iter().map(|side| side * side).sum::<f64>().sqrt();
    let mut sample = pendulum(5.0, 0.4);
    sample.bodies[0].inertia.iter_mut().for_each(|inertia| inertia.moments[..3].fill(0.02));
    let mut machine = Machine::new(&sample);
    machine.add("supplies", json!({"name": "pump"}), supply(servo, source));
    let line = json!({"name": "strut", "from": {"on": "world", "point": from}, "to": {"on": {"body": 0}, "point": at},
        "barrel": null, "rod": null});
    machine.add("lines", line, json!({}));
    let mut drive = drive(servo);
    drive["retracted_length"] = json!(length - 0.45 * servo.cylinder.stroke);
    let fixed = json!({"name": "hip", "on": {"line": 0}});
    machine.add("actuators", fixed, json!({"drive": drive, "lag": 2e-3, "saturation": 5e-3}));
    let internal = internal_state(&machine.build(), &machine.values, &[angle]).unwrap();
    (machine, [vec![angle, 0.0], internal].concat())
}
