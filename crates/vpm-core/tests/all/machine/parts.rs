//! Welds, carriers, screws, lines: each against something simpler that must be the same.

use std::f64::consts::FRAC_PI_2;

use vpm_core::body::{Body, Inertia, Weld};
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, flexible, rnea};
use vpm_core::joint::{Joint, JointKind};
use vpm_core::line::{Line, LineEnd, LinePart};
use vpm_core::linkage::ActuatorBody;
use vpm_core::linkage::leg::{HyqData, Leg, LegParameters};
use vpm_core::model::{Model, Parts};
use vpm_core::mount::Mount;
use vpm_core::samples::{Random, random_tree};
use vpm_core::spatial::{Matrix3, SpatialInertia, Vector2, Vector3};
use vpm_core::{Dual, Result};

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

/// The leg as a tree: a slider, two legs and two lines that weigh something. The foot is left free.
fn leg_tree(p: &LegParameters) -> Result<Model<f64>> {
    let leg = Leg::new(*p)?;
    let points = leg.points([0.0, 0.0]);
    let joint = |name: &str, kind, axis, y| Joint {
        name: name.into(),
        kind,
        axis,
        translation: [0.0, y, 0.0],
        rotation: UPRIGHT,
    };
    let flat = |mass, center: [f64; 2], turning| {
        let moments = [turning, turning, turning, 0.0, 0.0, 0.0];
        Some(Inertia { mass, center_of_mass: [center[1], -center[0], 0.0], moments })
    };
    let z = [0.0, 0.0, 1.0];
    let slider = Body {
        name: "slider".into(),
        on: Mount::World,
        joint: joint("rail", JointKind::Prismatic, [0.0, 1.0, 0.0], 0.0),
        inertia: flat(p.slider_mass, [0.0, 0.0], 1.0),
        rotor_inertia: None,
    };
    let limb = |name: &str, on, y, part: &vpm_core::linkage::leg::LegBody| Body {
        name: name.into(),
        on: Mount::Body(on),
        joint: joint(&format!("{name}.joint"), JointKind::Revolute, z, y),
        inertia: flat(part.mass, part.center, part.inertia),
        rotor_inertia: None,
    };
    let bodies = vec![slider, limb("upper", 0, 0.0, &p.upper), limb("lower", 1, -p.upper.length, &p.lower)];
    let end = |on, point: Vector2<f64>, origin: Vector2<f64>| {
        let at = point - origin;
        LineEnd { on: Mount::Body(on), point: [at.x, at.y, 0.0] }
    };
    let part = |body: ActuatorBody| Some(LinePart { mass: body.mass, center: body.center, inertia: body.inertia });
    let line = |k: usize, from, to| Line {
        name: format!("cylinder{k}"),
        from,
        to,
        barrel: part(p.actuators[k].barrel),
        rod: part(p.actuators[k].rod),
    };
    let lines = vec![
        line(0, end(0, points.bases[0], points.hip), end(1, points.tips[0], points.hip)),
        line(1, end(1, points.bases[1], points.hip), end(2, points.tips[1], points.knee)),
    ];
    Model::assemble(Parts { gravity: [0.0, -p.gravity, 0.0], bodies, lines, ..Parts::default() })
}

#[test]
fn a_leg_with_heavy_cylinders_is_that_of_the_closed_linkage() -> Result<()> {
    let parameters = LegParameters::hyq(HyqData::Plausible, 0.341);
    let (leg, tree) = (Leg::new(parameters)?, leg_tree(&parameters)?);
    let mut data = Data::new(&tree);
    for (q, v, a) in [([0.35, -1.4], [2.0, -3.0], [4.0, -5.0]), ([-0.2, -FRAC_PI_2], [-1.0, 4.0], [7.0, 2.0])] {
        // The foot on the ground makes the height of the hip a function of the angles.
        let moving: [Dual<Dual<f64, 2>, 1>; 2] = std::array::from_fn(|k| {
            let angle = Dual::variable(q[k], k);
            Dual { value: angle, gradient: [Dual::constant(v[k])] }
        });
        let height = leg.points(moving).hip.y;
        let psi = [height.value.gradient, [1.0, 0.0], [0.0, 1.0]];
        let rate = [height.gradient[0].value, v[0], v[1]];
        let psi_rate = height.gradient[0].gradient;
        let lift: f64 = (0..2).map(|k| psi[0][k] * a[k] + psi_rate[k] * v[k]).sum();
        flexible::terms(&tree, &mut data, &[height.value.value, q[0], q[1]], &rate);
        let mut efforts = [0.0; 3];
        flexible::required(&tree, &data, (&[0.0; 3], &rate), &[lift, a[0], a[1]], &mut efforts);
        let found = [0, 1].map(|k| (0..3).map(|b| psi[b][k] * efforts[b]).sum::<f64>());
        let terms = leg.terms(q, v);
        close(&found, &terms.effort(&a), 1e-12);
        let mass = data.mass_matrix();
        let reduced: Vec<f64> = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .iter()
            .map(|&(i, j)| (0..9).map(|b| psi[b / 3][i] * mass[b] * psi[b % 3][j]).sum())
            .collect();
        close(&reduced, terms.mass_matrix.as_flattened(), 1e-12);
    }
    Ok(())
}
