//! An arm of two links that bend, of any number of elements.

#![allow(dead_code, reason = "each user takes some of them")]

use vpm_core::beam::{BeamEntry, Component, DampingEntry, Level, Material, SectionEntry, Shape};
use vpm_core::body::{Body, Inertia, PointMass, Site, Weld};
use vpm_core::joint::{Joint, JointKind};
use vpm_core::model::Parts;
use vpm_core::mount::Mount;

/// No rotation.
const UPRIGHT: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
/// The root of a beam along x whose bending about its x is a turn about z, and the way back.
const ALONG_X: [f64; 9] = [0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0];

/// Joints about z under gravity along -y, beams along x with these strains, a motor at the elbow and a payload at the tip.
pub fn arm(level: Level, deforms: &[Component]) -> Parts<f64> {
    let ball = |mass: f64, moment: f64| Inertia {
        mass,
        center_of_mass: [0.0; 3],
        moments: [moment, moment, moment, 0.0, 0.0, 0.0],
    };
    let body = |name: &str, on, rotation, moment| Body {
        name: name.to_owned(),
        on,
        joint: Joint {
            name: format!("{name}.joint"),
            kind: JointKind::Revolute,
            axis: [0.0, 0.0, 1.0],
            translation: [0.0; 3],
            rotation,
        },
        inertia: Some(ball(1.0, moment)),
        rotor_inertia: None,
    };
    let beam = |name: &str, on: usize, length: f64| BeamEntry {
        name: name.to_owned(),
        on: Mount::Body(on),
        translation: [0.0; 3],
        rotation: ALONG_X,
        length,
        level,
        deforms: deforms.to_vec(),
        material: Some(Material { young: 210e9, poisson: 0.3, density: 7850.0 }),
        sections: vec![SectionEntry::new(0.0, Shape::Rectangle { width: 0.015, height: 0.004 })],
        rest: Vec::new(),
        damping: DampingEntry { stiffness: Some(5e-4), ..DampingEntry::default() },
        reduced: None,
    };
    let elbow = Mount::Section { beam: 0, at: 0.44 };
    let motor = Weld {
        name: "motor".to_owned(),
        on: elbow,
        translation: [0.0; 3],
        rotation: UPRIGHT,
        inertia: ball(1.0, 0.002),
    };
    Parts {
        gravity: [0.0, -9.81, 0.0],
        bodies: vec![body("shoulder", Mount::World, UPRIGHT, 0.02), body("elbow", elbow, ALONG_X, 0.002)],
        welds: vec![motor],
        beams: vec![beam("upper", 0, 0.44), beam("lower", 1, 0.41)],
        point_masses: vec![PointMass { on: Site::Tip(1), mass: 0.05, position: [0.0; 3] }],
        ..Parts::default()
    }
}
