//! A beam of segments against an ordinary tree of bodies, joints and springs, put together by hand.

use vpm_core::beam::{BeamEntry, Component, Level, Properties};
use vpm_core::body::{Body, Inertia};
use vpm_core::data::Data;
use vpm_core::dynamics::aba;
use vpm_core::joint::{Joint, JointKind};
use vpm_core::model::{Model, Parts};
use vpm_core::mount::Mount;
use vpm_core::samples::Random;
use vpm_core::{Result, evaluate};

use super::{Row, difference, slopes, vanishing};
use crate::common::entries::material;
use crate::common::trees;

const DEFORMS: [Component; 3] = [Component::BendingX, Component::BendingY, Component::Torsion];

/// Accelerations of the same arm in random states.
pub fn rows() -> Result<Vec<Row>> {
    [1, 3, 6].into_iter().map(row).collect()
}

fn row(count: usize) -> Result<Row> {
    let mut parts = slopes::arm(Level::Lumped(count));
    parts.beams[0].damping.mass = None;
    let d = trees::try_description(&parts, |_| ())?;
    let hand = Hand::new(&parts, count)?;
    let (random, n) = (&mut Random::new(3), d.n_coordinates());
    let mut found = Vec::new();
    for _ in 0..3 {
        let (q, v, efforts) = (random.numbers(n, 0.4), random.numbers(n, 1.0), random.numbers(2, 5.0));
        let a = evaluate::accelerations(&d, &d.parameters, &q, &v, &efforts)?;
        found.push(difference(&a, &hand.accelerations(&q, &v, &efforts)));
    }
    let name = format!("Arm with a lumped({count}) beam: accelerations in three random states, difference over size");
    Ok(vanishing(name, found, 1e-10, "aba on bodies, joints and springs put together by hand"))
}

/// The tree by hand; its joints are hub, hinges root first, hand.
struct Hand {
    model: Model<f64>,
    springs: Vec<f64>,
    damping: f64,
}

impl Hand {
    fn new(parts: &Parts<f64>, count: usize) -> Result<Self> {
        let (beam, size) = (&parts.beams[0], parts.beams[0].length / count as f64);
        let properties = beam.sections[0].shape.properties(material(beam).poisson)?;
        let (mut bodies, mut springs) = (vec![parts.bodies[0].clone()], Vec::new());
        for hinge in 0..count {
            // From the clamp to the middle of the first segment, and from middle to middle.
            let spring = if hinge == 0 { 0.5 * size } else { size };
            for (place, axis) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
                let name = format!("segment{hinge}.{place}");
                let (translation, rotation) = match (hinge, place) {
                    (0, 0) => (beam.translation, beam.rotation),
                    (_, 0) => ([0.0, 0.0, size], trees::UPRIGHT),
                    _ => ([0.0; 3], trees::UPRIGHT),
                };
                let joint =
                    Joint { name: format!("{name}.joint"), kind: JointKind::Revolute, axis, translation, rotation };
                let inertia = (place + 1 == DEFORMS.len()).then(|| segment(beam, &properties, size));
                bodies.push(Body { name, on: Mount::Body(bodies.len() - 1), joint, inertia, rotor_inertia: None });
                springs.push(stiffness(beam, &properties, DEFORMS[place]) / spring);
            }
        }
        let mut last = parts.bodies[1].clone();
        last.on = Mount::Body(bodies.len() - 1);
        last.joint.translation[2] += size;
        bodies.push(last);
        let model = Model::new(parts.gravity, &bodies, &[])?;
        Ok(Self { model, springs, damping: beam.damping.stiffness.unwrap_or_default() })
    }

    /// In the order of the machine with the beam: hub, hand, hinges.
    fn accelerations(&self, q: &[f64], v: &[f64], efforts: &[f64]) -> Vec<f64> {
        let along = |numbers: &[f64]| [&numbers[..1], &numbers[2..], &numbers[1..2]].concat();
        let spring = |(k, stiffness): (usize, &f64)| -stiffness * (q[2 + k] + self.damping * v[2 + k]);
        let springs: Vec<f64> = self.springs.iter().enumerate().map(spring).collect();
        let efforts = [&efforts[..1], &springs, &efforts[1..]].concat();
        let a = aba(&self.model, &mut Data::new(&self.model), &along(q), &along(v), &efforts).to_vec();
        let (last, inner) = (a.len() - 1, &a[1..a.len() - 1]);
        [&a[..1], &a[last..], inner].concat()
    }
}

/// `EJ` or `GJt`.
fn stiffness(beam: &BeamEntry<f64>, section: &Properties<f64>, component: Component) -> f64 {
    match component {
        Component::BendingX => material(beam).young * section.moment_x,
        Component::BendingY => material(beam).young * section.moment_y,
        _ => material(beam).young / (2.0 * (1.0 + material(beam).poisson)) * section.torsion,
    }
}

/// A bar from the origin along z: `m = rho A l`, transverse moments `rho J l + m l^2 / 12`, about the axis `rho (Jx + Jy) l`.
fn segment(beam: &BeamEntry<f64>, section: &Properties<f64>, size: f64) -> Inertia<f64> {
    let line = material(beam).density * size;
    let mass = line * section.area;
    let across = [section.moment_x, section.moment_y].map(|moment| line * moment + mass * size * size / 12.0);
    let about = line * (section.moment_x + section.moment_y);
    Inertia { mass, center_of_mass: [0.0, 0.0, 0.5 * size], moments: [across[0], across[1], about, 0.0, 0.0, 0.0] }
}
