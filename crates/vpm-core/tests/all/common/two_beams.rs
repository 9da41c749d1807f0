//! A planar arm of two flexible links.

#![allow(dead_code, reason = "each test uses some of it")]

use serde_json::{Value, json};
use vpm_core::beam::{BeamEntry, Component, DampingEntry, Level, Material, Properties, SectionEntry, Shape};
use vpm_core::body::{Body, Inertia, Weld};
use vpm_core::description::Description;
use vpm_core::joint::{Joint, JointKind};
use vpm_core::model::Parts;
use vpm_core::mount::Mount;

use crate::common::trees::{UPRIGHT, description, parameter, push};

/// Lengths of the links in m.
pub const LENGTHS: [f64; 2] = [0.44, 0.41];
/// Springs and dampers of the joints, N m/rad and N m s/rad.
pub const SERVOS: [[f64; 2]; 2] = [[400.0, 10.0], [50.0, 0.5]];
const MATERIAL: Material = Material { young: 210e9, poisson: 0.3, density: 7850.0 };
const GRAVITY: f64 = -9.81;
const HUB: [f64; 2] = [0.05, 0.02];
const TIPS: [[f64; 2]; 2] = [[2.0, 0.002], [0.05, 1e-4]];
/// Damping per stiffness of the links, s.
const DAMPING: f64 = 5e-4;
/// Turns a beam along x of its joint, and what is at its end back.
const TURNED: [f64; 9] = [0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0];

fn strip() -> Properties<f64> {
    let (width, height) = (0.015, 0.004);
    let (area, moment) = (width * height, width * height * height * height / 12.0);
    Properties { area, moment_x: moment, moment_y: moment, torsion: 2.0 * moment, shear_x: 0.8, shear_y: 0.8 }
}

fn ball(mass: f64, inertia: f64) -> Inertia<f64> {
    Inertia { mass, center_of_mass: [0.0; 3], moments: [inertia, inertia, inertia, 0.0, 0.0, 0.0] }
}

/// The arm with that many curvature coordinates in each link; `change` may add to its description.
pub fn machine(count: usize, change: impl FnOnce(&mut Value)) -> Description {
    let mut parts = Parts { gravity: [0.0, GRAVITY, 0.0], ..Parts::default() };
    for (number, length) in LENGTHS.into_iter().enumerate() {
        let (on, rotation) = match number {
            0 => (Mount::World, UPRIGHT),
            _ => (Mount::Section { beam: 0, at: LENGTHS[0] }, TURNED),
        };
        let joint = Joint {
            name: format!("joint{number}"),
            kind: JointKind::Revolute,
            axis: [0.0, 0.0, 1.0],
            translation: [0.0; 3],
            rotation,
        };
        let name = format!("hub{number}");
        parts.bodies.push(Body { name, on, joint, inertia: Some(ball(HUB[0], HUB[1])), rotor_inertia: None });
        parts.beams.push(BeamEntry {
            name: format!("link{number}"),
            on: Mount::Body(number),
            translation: [0.0; 3],
            rotation: TURNED,
            length,
            level: Level::Strain(count),
            deforms: vec![Component::BendingX],
            material: Some(MATERIAL),
            sections: vec![SectionEntry::new(0.0, Shape::Given(strip()))],
            rest: Vec::new(),
            damping: DampingEntry { stiffness: Some(DAMPING), ..DampingEntry::default() },
            reduced: None,
        });
        let [mass, inertia] = TIPS[number];
        let on = Mount::Section { beam: number, at: length };
        let weld = Weld {
            name: format!("tip{number}"),
            on,
            translation: [0.0; 3],
            rotation: UPRIGHT,
            inertia: ball(mass, inertia),
        };
        parts.welds.push(weld);
    }
    description(&parts, change)
}

/// An effect on a joint of a description.
pub fn effect(content: &mut Value, kind: &str, joint: usize, numbers: &[(&str, f64)]) {
    let mut part = json!({"type": kind, "joint": joint});
    for (name, value) in numbers {
        part[*name] = json!(parameter(content, &format!("{kind}{joint}.{name}"), *value));
    }
    push(content, "effects", part);
}

/// Springs and dampers that hold the joints at zero.
pub fn hold(content: &mut Value) {
    for (joint, [stiffness, damping]) in SERVOS.into_iter().enumerate() {
        effect(content, "joint_compliance", joint, &[("stiffness", stiffness), ("damping", damping)]);
    }
}
