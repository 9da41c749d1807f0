//! Contacts, bushings and load cells for descriptions in the making.

use serde_json::{Value, json};
use vpm_core::body::{Body, Inertia};
use vpm_core::joint::{Joint, JointKind};
use vpm_core::mount::Mount;

use super::trees::{UPRIGHT, parameter, push};

/// A contact: stiffness, exponent, damping and its depth; friction by its coefficients and velocities.
pub fn contact(
    content: &mut Value,
    (name, on, point): (&str, Mount, [f64; 3]),
    plane: [[f64; 3]; 2],
    normal: [f64; 4],
    friction: Option<[f64; 4]>,
) {
    let mut table = |keys: [&str; 4], numbers: [f64; 4]| -> Value {
        let places = keys.iter().zip(numbers);
        places
            .map(|(key, value)| (key.to_string(), json!(parameter(content, &format!("{name}.{key}"), value))))
            .collect()
    };
    let normal = table(["stiffness", "exponent", "damping", "damping_depth"], normal);
    let keys = ["static_coefficient", "static_velocity", "dynamic_coefficient", "dynamic_velocity"];
    let friction = friction.map(|numbers| table(keys, numbers));
    let plane = json!({"point": plane[0], "normal": plane[1]});
    let part = json!({"name": name, "on": on, "point": point, "plane": plane, "normal": normal, "friction": friction});
    push(content, "contacts", part);
}

/// A bushing between two places without turn, by the diagonals of its matrices and its preload.
pub fn bushing(
    content: &mut Value,
    name: &str,
    ends: [(Mount, [f64; 3]); 2],
    stiffness: [f64; 6],
    damping: [f64; 6],
    preload: [f64; 6],
) {
    let mut full = |key: &str, diagonal: [f64; 6]| -> Vec<Vec<Option<usize>>> {
        let place = |i: usize| parameter(content, &format!("{name}.{key}.{i}"), diagonal[i]);
        let places: Vec<usize> = (0..6).map(place).collect();
        (0..6).map(|i| (0..6).map(|j| (i == j).then_some(places[i])).collect()).collect()
    };
    let (stiffness, damping) = (full("stiffness", stiffness), full("damping", damping));
    let preload: Vec<usize> = preload
        .iter()
        .enumerate()
        .map(|(i, &value)| parameter(content, &format!("{name}.preload.{i}"), value))
        .collect();
    let [a, b] = ends.map(|(on, translation)| json!({"on": on, "translation": translation, "rotation": UPRIGHT}));
    let part = json!({"name": name, "a": a, "b": b, "stiffness": stiffness, "damping": damping, "preload": preload});
    push(content, "bushings", part);
}

/// A load cell at a joint.
pub fn load_cell(content: &mut Value, name: &str, joint: usize) {
    push(content, "load_cells", json!({"name": name, "joint": joint}));
}

/// Joints that carry one body, each along (prismatic) or about (revolute) an axis, the others massless.
pub fn chain(
    name: &str,
    first: usize,
    on: Mount,
    joints: &[(JointKind, [f64; 3])],
    inertia: Option<Inertia<f64>>,
) -> Vec<Body<f64>> {
    let last = joints.len() - 1;
    let one = |(k, &(kind, axis)): (usize, &(JointKind, [f64; 3]))| Body {
        name: if k == last { name.to_owned() } else { format!("{name}.{k}") },
        on: if k == 0 { on } else { Mount::Body(first + k - 1) },
        joint: Joint { name: format!("{name}.joint{k}"), kind, axis, translation: [0.0; 3], rotation: UPRIGHT },
        inertia: if k == last { inertia } else { None },
        rotor_inertia: None,
    };
    joints.iter().enumerate().map(one).collect()
}

/// Three translations, then three angles.
pub const FREE: [(JointKind, [f64; 3]); 6] = [
    (JointKind::Prismatic, [1.0, 0.0, 0.0]),
    (JointKind::Prismatic, [0.0, 1.0, 0.0]),
    (JointKind::Prismatic, [0.0, 0.0, 1.0]),
    (JointKind::Revolute, [1.0, 0.0, 0.0]),
    (JointKind::Revolute, [0.0, 1.0, 0.0]),
    (JointKind::Revolute, [0.0, 0.0, 1.0]),
];
