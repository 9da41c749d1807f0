//! The two-link arm of `flexible_arm.json` as a machine of the general tree: joints about z, gravity along -y, beams along x.

use serde_json::{Value, json};
use vpm_core::description::Description;
use vpm_core::error::Result;

/// Stiffness (N m/rad) and damping (N m s/rad) of the servos.
pub const SERVOS: [[f64; 2]; 2] = [[400.0, 10.0], [50.0, 0.5]];
/// The root of a beam along x whose bending about its x is a turn about z, and the way back.
const ALONG_X: [f64; 9] = [0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0];
const UPRIGHT: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// The arm with beams of that level, its servos, and an effort on each joint as an input.
pub fn arm(level: &Value) -> Result<Description> {
    let (mut values, mut names): (Vec<f64>, Vec<String>) = (Vec::new(), Vec::new());
    let mut number = |name: &str, value: f64| {
        values.push(value);
        names.push(name.to_owned());
        values.len() - 1
    };
    let zero = number("zero", 0.0);
    let body = |number: &mut dyn FnMut(&str, f64) -> usize, name: &str, [mass, moment]: [f64; 2]| {
        let (mass, moment) = (number(&format!("{name}.mass"), mass), number(&format!("{name}.moment"), moment));
        json!({"mass": mass, "center_of_mass": [zero, zero, zero], "moments": [moment, moment, moment, zero, zero, zero]})
    };
    let joint = |name: &str, rotation: [f64; 9]| json!({"name": name, "kind": "revolute", "axis": [0.0, 0.0, 1.0], "translation": [0.0, 0.0, 0.0], "rotation": rotation});
    // Half of the elbow's mass turns with the second hub, which sits in the joint's axis.
    let [first, elbow, second] = [("shoulder", [1.0, 0.02]), ("elbow", [1.0, 0.002]), ("hub", [1.0, 0.002])]
        .map(|(name, numbers)| body(&mut number, name, numbers));
    let (young, poisson, density) = (number("young", 210e9), number("poisson", 0.3), number("density", 7850.0));
    let (width, height) = (number("width", 0.015), number("height", 0.004));
    let (damping, payload) = (number("damping", 5e-4), number("payload", 0.05));
    let gain = number("gain", 1.0);
    let mut effects = Vec::new();
    for (joint, [stiffness, viscous]) in SERVOS.into_iter().enumerate() {
        let (stiffness, viscous) = (number("stiffness", stiffness), number("viscous", viscous));
        effects.push(json!({"type": "spring", "joint": joint, "stiffness": stiffness, "rest": zero}));
        effects.push(json!({"type": "viscous_friction", "joint": joint, "viscous": viscous}));
    }
    effects.push(json!({"type": "payload", "beam": 1, "mass": payload, "position": [zero, zero, zero]}));
    let beam = |name: &str, on: usize, length: f64| {
        json!({"name": name, "on": {"body": on}, "translation": [0.0, 0.0, 0.0], "rotation": ALONG_X, "length": length,
            "level": level, "deforms": ["bending_x"],
            "material": {"young": young, "poisson": poisson, "density": density},
            "sections": [{"at": 0.0, "shape": {"shape": "rectangle", "width": width, "height": height}}],
            "damping": {"stiffness": damping, "mass": null, "ratios": []}})
    };
    let tip = |beam: usize, at: f64| json!({"section": {"beam": beam, "at": at}});
    let description = json!({
        "gravity": [0.0, -9.81, 0.0],
        "bodies": [
            {"name": "shoulder", "on": "world", "joint": joint("shoulder.joint", UPRIGHT), "inertia": first},
            {"name": "hub", "on": tip(0, 0.44), "joint": joint("elbow.joint", ALONG_X), "inertia": second}],
        "welds": [{"name": "elbow", "on": tip(0, 0.44), "translation": [0.0, 0.0, 0.0], "rotation": UPRIGHT, "inertia": elbow}],
        "beams": [beam("upper", 0, 0.44), beam("lower", 1, 0.41)],
        "gauges": [{"name": "first", "beam": 0, "at": 0.02, "x": 0.0, "y": 0.002},
            {"name": "second", "beam": 1, "at": 0.02, "x": 0.0, "y": 0.002}],
        "markers": [{"name": "tip", "on": tip(1, 0.41), "translation": [0.0, 0.0, 0.0], "rotation": UPRIGHT}],
        "effects": effects,
        "actuators": [{"name": "motor0", "on": {"joint": 0}, "drive": {"type": "ideal", "gain": gain}},
            {"name": "motor1", "on": {"joint": 1}, "drive": {"type": "ideal", "gain": gain}}],
        "parameters": values, "parameter_names": names,
    });
    Description::from_json(&description.to_string())
}
