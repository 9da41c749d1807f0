//! What free motion without damping keeps.

use vpm_core::beam::{Component, DampingEntry, Level};
use vpm_core::description::Description;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::Mount;
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::{Result, evaluate};

use super::{Row, difference, larger, vanishing};
use crate::common::trees;

const STEP: f64 = 1e-4;

/// Energy under gravity, energy and momentum of a floating machine.
pub fn rows() -> Result<Vec<Row>> {
    let levels =
        [(Level::Strain(2), "strain(2)"), (Level::Bezier(3), "bezier(3)"), (Level::Deflection(3), "deflection(3)")];
    let mut rows = levels.into_iter().map(|(level, name)| falling(level, name)).collect::<Result<Vec<_>>>()?;
    rows.extend(floating()?);
    Ok(rows)
}

/// A joint, a soft beam that bends both ways without damping, and another joint with a body at its tip.
fn arm(level: Level, deforms: &[Component]) -> Parts<f64> {
    let random = &mut Random::new(5);
    let mut parts = Parts { gravity: [0.0, 0.0, -9.81], ..Parts::default() };
    parts.bodies.push(trees::body(random, "hub", Mount::World, JointKind::Revolute));
    parts.beams.push(trees::beam(random, "link", Mount::Body(0), level, deforms));
    parts.beams[0].damping = DampingEntry::default();
    let tip = trees::section(&parts, 0, 1.0);
    parts.bodies.push(trees::body(random, "hand", tip, JointKind::Revolute));
    parts
}

/// States at every hundredth of a second.
fn motion(d: &Description, start: &[f64], seconds: usize) -> Result<Vec<Vec<f64>>> {
    let mut system = d.system::<f64>(&d.parameters)?;
    let (mut x, mut integrator) = (start.to_vec(), Integrator::new(Method::Rk4, system.dim()));
    let mut states = vec![x.clone()];
    for _ in 0..100 * seconds {
        for _ in 0..100 {
            integrator.step(&mut system, &mut x, STEP);
        }
        states.push(x.clone());
    }
    Ok(states)
}

/// Largest change of the energy, as a share of the largest kinetic energy.
fn drift(d: &Description, states: &[Vec<f64>]) -> Result<f64> {
    let (mut most, mut size, mut start) = (0.0, 0.0, None);
    for x in states {
        let (q, v) = x.split_at(d.n_coordinates());
        let (kinetic, potential) = evaluate::energy(d, &d.parameters, q, v)?;
        let first = *start.get_or_insert(kinetic + potential);
        (most, size) = (larger(most, kinetic + potential - first), larger(size, kinetic));
    }
    Ok(most / size)
}

fn falling(level: Level, name: &str) -> Result<Row> {
    let d = trees::try_description(&arm(level, &[Component::BendingX, Component::BendingY]), |_| ())?;
    let mut start = vec![0.0; d.n_states()];
    (start[0], start[1]) = (1.0, -0.5);
    let drift = drift(&d, &motion(&d, &start, 3)?)?;
    let name = format!("Energy of an arm with a {name} beam after 3 s of free swing, change over its size");
    Ok(vanishing(name, vec![drift], 1e-6, "conservation of energy; rk4 at 0.1 ms"))
}

/// On two slides and a pin in their plane, without gravity: nothing from outside acts along the slides or about their normal.
fn floating() -> Result<Vec<Row>> {
    let mut parts = arm(Level::Strain(3), &[Component::BendingX]);
    parts.gravity = [0.0; 3];
    for (name, axis) in [("slide_x", [1.0, 0.0, 0.0]), ("slide_y", [0.0, 1.0, 0.0])] {
        let mut carrier = parts.bodies[0].clone();
        carrier.name = name.into();
        (carrier.joint.name, carrier.joint.kind, carrier.joint.axis) =
            (format!("{name}.joint"), JointKind::Prismatic, axis);
        (carrier.joint.translation, carrier.joint.rotation) = ([0.0; 3], trees::UPRIGHT);
        carrier.inertia = None;
        parts.bodies.push(carrier);
    }
    // Joints: pin of the hub on the second slide, hand, first slide, second slide.
    (parts.bodies[3].on, parts.bodies[0].on) = (Mount::Body(2), Mount::Body(3));
    let pin = &mut parts.bodies[0].joint;
    (pin.axis, pin.translation, pin.rotation) = ([0.0, 0.0, 1.0], [0.0; 3], trees::UPRIGHT);
    let d = trees::try_description(&parts, |_| ())?;
    let n = d.n_coordinates();
    let mut start = vec![0.0; 2 * n];
    start[n..n + 4].copy_from_slice(&[4.0, -3.0, 0.5, 0.8]);
    let states = motion(&d, &start, 3)?;
    let momentum = |x: &[f64]| -> Result<Vec<f64>> {
        let (q, v) = x.split_at(n);
        let mass = evaluate::mass_matrix(&d, &d.parameters, q)?;
        let of = |k: usize| -> f64 { mass[k * n..][..n].iter().zip(v).map(|(entry, rate)| entry * rate).sum() };
        Ok(vec![of(2), of(3), of(0) + q[2] * of(3) - q[3] * of(2)])
    };
    let first = momentum(&states[0])?;
    let mut most = vec![0.0; 3];
    for x in &states {
        for (k, (most, now)) in most.iter_mut().zip(momentum(x)?).enumerate() {
            *most = larger(*most, difference(&[now], &first[k..=k]));
        }
    }
    let name = "Floating machine with a beam after 3 s: change of".to_owned();
    Ok(vec![
        vanishing(format!("{name} energy"), vec![drift(&d, &states)?], 1e-6, "conservation of energy; rk4 at 0.1 ms"),
        vanishing(
            format!("{name} momentum along x, y, about z"),
            most,
            1e-8,
            "conservation of momentum; rk4 at 0.1 ms",
        ),
    ])
}
