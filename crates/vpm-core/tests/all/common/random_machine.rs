//! Machines of bodies and beams of all kinds, at random.

use vpm_core::beam::{Component, DampingEntry, Level};
use vpm_core::body::{PointMass, Site, Weld};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::Mount;
use vpm_core::samples::Random;

use super::trees::{beam, body, inertia, section, turn};

/// One of so many, evenly.
fn pick(random: &mut Random, count: usize) -> usize {
    ((random.unit() * count as f64) as usize).min(count - 1)
}

fn level(random: &mut Random) -> Level {
    let size = 1 + pick(random, 4);
    match pick(random, 10) {
        0 => Level::Rigid,
        1..3 => Level::Lumped(size),
        3 => Level::Strain(size),
        4 => Level::Bezier(size + 1),
        5 => Level::Hermite(size),
        6 => Level::Modal(1 + size / 3),
        _ => Level::Elements(size),
    }
}

fn deforms(random: &mut Random) -> Vec<Component> {
    if random.unit() < 0.3 {
        return vec![[Component::BendingX, Component::BendingY][pick(random, 2)]];
    }
    let some: Vec<_> = Component::ALL.into_iter().filter(|_| random.unit() < 0.5).collect();
    if some.is_empty() { vec![Component::Torsion] } else { some }
}

fn damping(random: &mut Random) -> DampingEntry<f64> {
    let mass = (random.unit() < 0.2).then_some(0.3);
    DampingEntry { stiffness: (random.unit() < 0.8).then_some(1e-3), mass, ratios: Vec::new() }
}

/// Anything before, anywhere along it: at its root, at its tip, at a node of its elements, or elsewhere.
fn carrier(random: &mut Random, parts: &Parts<f64>) -> Mount {
    let (bodies, beams) = (parts.bodies.len(), parts.beams.len());
    let share = [0.0, 0.25, 0.5, 1.0, random.unit()][pick(random, 5)];
    match pick(random, bodies + 2 * beams + 1) {
        0 => Mount::World,
        k if k <= bodies => Mount::Body(k - 1),
        k => section(parts, (k - bodies - 1) / 2, share),
    }
}

/// Bodies and beams on each other, with what is welded to them.
pub fn machine(seed: u64) -> Parts<f64> {
    let random = &mut Random::new(seed);
    let mut parts = Parts { gravity: [0.4, -9.0, 2.0], ..Parts::default() };
    for number in 0..3 + pick(random, 5) {
        let on = carrier(random, &parts);
        if random.unit() < 0.5 {
            let kind = [JointKind::Revolute, JointKind::Prismatic, JointKind::Helical { pitch: 0.1 }][pick(random, 3)];
            parts.bodies.push(body(random, &format!("body {number}"), on, kind));
        } else {
            let (level, deforms) = (level(random), deforms(random));
            let mut entry = beam(random, &format!("beam {number}"), on, level, &deforms);
            entry.damping = damping(random);
            parts.beams.push(entry);
        }
    }
    for number in 0..pick(random, 3) {
        let (on, translation, rotation) = (carrier(random, &parts), random.vector(0.1), turn(random));
        if on != Mount::World {
            let name = format!("weld {number}");
            parts.welds.push(Weld { name, on, translation, rotation, inertia: inertia(random) });
        }
    }
    for beam in 0..parts.beams.len() {
        if random.unit() < 0.4 {
            let point = PointMass { on: Site::Tip(beam), mass: 0.2 + random.unit(), position: random.vector(0.1) };
            parts.point_masses.push(point);
        }
    }
    parts.drop_velocity_terms = random.unit() < 0.1;
    parts
}
