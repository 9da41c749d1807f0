//! Welds, carriers, screws, lines: each against something simpler that must be the same.

use vpm_core::Result;
use vpm_core::body::{Body, Inertia, Weld};
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, flexible, rnea};
use vpm_core::joint::{Joint, JointKind};
use vpm_core::line::{Line, LineEnd, LinePart};
use vpm_core::model::{Model, Parts};
use vpm_core::mount::Mount;
use vpm_core::samples::{Random, random_tree};
use vpm_core::spatial::{Matrix3, SpatialInertia, Vector3};

use crate::common::trees::{UPRIGHT, body, inertia, turn};

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < tolerance * size, "{found} is not {expected}");
    }
}

/// Accelerations by the recursions, and by composite bodies.
fn both_ways(parts: Parts<f64>, q: &[f64], v: &[f64], tau: &[f64]) -> Result<Vec<f64>> {
    let tree = Model::assemble(parts)?;
    assert!(tree.is_recursive());
    let (mut data, mut other) = (Data::new(&tree), Data::new(&tree));
    let found = aba(&tree, &mut data, q, v, tau).to_vec();
    flexible::terms(&tree, &mut other, q, v);
    close(flexible::solve(&tree, &mut other, q, v, tau), &found, 1e-10);
    Ok(found)
}

#[test]
fn forward_dynamics_solve_the_equation_of_motion() -> Result<()> {
    // a = M^-1 (tau - h), each part by an algorithm of its own, with screws and a carrier in the tree.
    for seed in 0..20 {
        let random = &mut Random::new(seed);
        let mut sample = random_tree(seed, 6);
        sample.bodies[2].joint.kind = JointKind::Helical { pitch: 0.3 * random.symmetric() };
        sample.bodies[4].joint.kind = JointKind::Helical { pitch: 0.1 };
        sample.bodies[5].on = Mount::Body(4);
        sample.bodies[4].inertia = None;
        let tree = sample.model::<f64>()?;
        let (mut data, [q, v, tau]) = (Data::new(&tree), [2.0, 3.0, 20.0].map(|size| random.numbers(6, size)));
        let a = aba(&tree, &mut data, &q, &v, &tau).to_vec();
        let bias = rnea(&tree, &mut data, &q, &v, &[0.0; 6]).to_vec();
        let mass = crba(&tree, &mut data, &q).to_vec();
        let found: Vec<f64> = (0..6).map(|i| bias[i] + (0..6).map(|j| mass[6 * i + j] * a[j]).sum::<f64>()).collect();
        close(&found, &tau, 1e-8);
    }
    Ok(())
}

#[test]
fn a_weld_is_part_of_its_body() -> Result<()> {
    for seed in 0..10 {
        let random = &mut Random::new(seed);
        let mut parts = Parts { gravity: random.vector(10.0), ..Parts::default() };
        parts.bodies.push(body(random, "upper", Mount::World, JointKind::Revolute));
        parts.bodies.push(body(random, "lower", Mount::Body(0), JointKind::Prismatic));
        let (on, translation, rotation) = (Mount::Body(1), random.vector(0.5), turn(random));
        let own = inertia(random);
        let mut merged = parts.clone();
        parts.welds.push(Weld { name: "motor".into(), on, translation, rotation, inertia: own });
        // The same by hand: the sum of both about the common centre of mass.
        let pose = vpm_core::spatial::Pose::new(Matrix3::from_rows_f64(rotation), Vector3::from_f64(translation));
        let total: SpatialInertia<f64> = parts.bodies[1].spatial_inertia()? + pose.inertia(own.spatial());
        let (mass, center_of_mass) = (total.mass, total.center_of_mass().to_array());
        merged.bodies[1].inertia = Some(Inertia { mass, center_of_mass, moments: total.central().to_array() });
        let [q, v, tau] = [2.0, 3.0, 20.0].map(|size| random.numbers(2, size));
        close(&both_ways(parts, &q, &v, &tau)?, &both_ways(merged, &q, &v, &tau)?, 1e-9);
    }
    Ok(())
}

/// A body of mass m and inertia I about z, on joints along z.
fn spindle(mass: f64, turning: f64, kind: JointKind) -> Body<f64> {
    let joint = Joint { name: "z".into(), kind, axis: [0.0, 0.0, 1.0], translation: [0.0; 3], rotation: UPRIGHT };
    let moments = [turning, turning, turning, 0.0, 0.0, 0.0];
    let inertia = Some(Inertia { mass, center_of_mass: [0.0; 3], moments });
    Body { name: "spindle".into(), on: Mount::World, joint, inertia, rotor_inertia: None }
}

#[test]
fn a_nut_falls_along_its_screw() -> Result<()> {
    // (I + m p^2) a = tau - m g p.
    let (mass, turning, pitch, g, torque) = (3.0, 0.02, 0.05, 9.81, 0.7);
    let bodies = vec![spindle(mass, turning, JointKind::Helical { pitch })];
    let parts = Parts { gravity: [0.0, 0.0, -g], bodies, ..Parts::default() };
    let expected = (torque - mass * g * pitch) / (turning + mass * pitch * pitch);
    close(&both_ways(parts, &[0.4], &[2.0], &[torque])?, &[expected], 1e-13);
    Ok(())
}

#[test]
fn a_carrier_makes_a_cylindrical_joint() -> Result<()> {
    // Turn and slide about one axis do not know of each other: I a = tau, m a = F - m g.
    let (mass, turning, g) = (3.0, 0.02, 9.81);
    let mut carrier = spindle(mass, turning, JointKind::Revolute);
    (carrier.name, carrier.inertia) = ("carrier".into(), None);
    let mut slider = spindle(mass, turning, JointKind::Prismatic);
    slider.on = Mount::Body(0);
    let parts = Parts { gravity: [0.0, 0.0, -g], bodies: vec![carrier, slider], ..Parts::default() };
    close(&both_ways(parts, &[0.4, 0.1], &[2.0, 1.0], &[0.3, 5.0])?, &[0.3 / turning, 5.0 / mass - g], 1e-12);
    Ok(())
}

#[test]
fn a_rod_that_hangs_on_two_points_is_a_pendulum() -> Result<()> {
    // A needle from the world to a massless-like slider: about its begin it turns with m c^2 + I.
    let (mass, center, turning) = (2.0, 0.3, 0.04);
    let part = LinePart { mass, center, inertia: turning };
    let mut arm = spindle(1e-9, 1e-9, JointKind::Revolute);
    arm.joint.axis = [0.0, 1.0, 0.0];
    let ends = [(Mount::World, [0.0; 3]), (Mount::Body(0), [0.0, 0.0, -1.0])].map(|(on, point)| LineEnd { on, point });
    let line = Line { name: "rod".into(), from: ends[0], to: ends[1], barrel: Some(part), rod: None };
    let parts = Parts { gravity: [0.0, 0.0, -9.81], bodies: vec![arm], lines: vec![line], ..Parts::default() };
    let tree = Model::assemble(parts)?;
    let (mut data, angle) = (Data::new(&tree), 0.6);
    flexible::terms(&tree, &mut data, &[angle], &[3.0]);
    let found = flexible::solve(&tree, &mut data, &[angle], &[3.0], &[0.0]);
    close(found, &[-mass * 9.81 * center * angle.sin() / (mass * center * center + turning)], 1e-7);
    Ok(())
}
