//! Exact derivatives against difference quotients.

use vpm_core::beam::{Component, Level, Shape};
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::{Marker, Mount};
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::simulate::{Setting, Stepping, free_run};
use vpm_core::table::Table;
use vpm_core::{Error, Result};

use super::derivations::name;
use super::{Row, Tolerance, difference, vanishing};
use crate::common::entries::material;
use crate::common::trees;

const SOURCE: &str = "central differences of fourth order";

/// State Jacobians and sensitivities of an arm with a beam of two levels.
pub fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for level in [Level::Strain(2), Level::Deflection(3)] {
        let d = trees::try_description(&arm(level), |_| ())?;
        rows.push(jacobian(&d, level)?);
        rows.push(sensitivities(&d, level)?);
    }
    Ok(rows)
}

/// Two joints, the first with a rotor, and a beam between them that bends both ways and twists.
pub fn arm(level: Level) -> Parts<f64> {
    let random = &mut Random::new(5);
    let deforms = [Component::BendingX, Component::BendingY, Component::Torsion];
    let mut parts = Parts { gravity: [0.0, 0.0, -9.81], ..Parts::default() };
    parts.bodies.push(trees::body(random, "hub", Mount::World, JointKind::Revolute));
    parts.bodies[0].rotor_inertia = Some(0.05);
    parts.beams.push(trees::beam(random, "link", Mount::Body(0), level, &deforms));
    let tip = trees::section(&parts, 0, 1.0);
    parts.bodies.push(trees::body(random, "hand", tip, JointKind::Revolute));
    let rotation = trees::UPRIGHT;
    parts.markers.push(Marker { name: "tip".into(), on: Mount::Body(1), translation: [0.0, 0.1, 0.2], rotation });
    parts
}

/// Slope at zero from the values at one and two steps to both sides.
fn slope(step: f64, at: impl Fn(f64) -> Result<Vec<f64>>) -> Result<Vec<f64>> {
    let [a, b, c, d] = [at(-2.0 * step)?, at(-step)?, at(step)?, at(2.0 * step)?];
    Ok((0..a.len()).map(|k| (a[k] - d[k] + 8.0 * (c[k] - b[k])) / (12.0 * step)).collect())
}

fn jacobian(d: &Description, level: Level) -> Result<Row> {
    let mut system = d.system::<f64>(&d.parameters)?;
    let n = system.dim();
    let x = Random::new(9).numbers(n, 0.2);
    let mut exact = vec![0.0; n * n];
    system.jacobian(&x, &mut exact);
    let system = std::cell::RefCell::new(system);
    let mut worst = Vec::new();
    for k in 0..n {
        let found = slope(1e-3, |change| {
            let (mut moved, mut rate) = (x.clone(), vec![0.0; n]);
            moved[k] += change;
            system.borrow_mut().rhs(&moved, &mut rate);
            Ok(rate)
        })?;
        let column: Vec<f64> = exact.chunks(n).map(|row| row[k]).collect();
        worst.push(difference(&column, &found));
    }
    let name = format!("State Jacobian of an arm with a {} beam, each column", name(level));
    Ok(vanishing(name, worst, 1e-7, SOURCE))
}

/// Change of the tip's place after a fall of 0.2 s, per relative change of each of four parameters.
fn sensitivities(d: &Description, level: Level) -> Result<Row> {
    let beam = &d.beams[0];
    let Shape::Rectangle { width, .. } = beam.sections[0].shape else {
        return Err(Error::Description { message: "the beam of this arm is a rectangle".into() });
    };
    let rotor = d.bodies[0].rotor_inertia.unwrap_or_default();
    let by = [material(beam).young, material(beam).density, width, rotor];
    let mut start = vec![0.01; d.n_states()];
    start[0] = 0.7;
    let run = |theta: &[f64], sensitivities: &[usize]| {
        let stepping = Stepping::new(0.02, 8, Method::Rosenbrock)?;
        free_run(
            Setting { description: d, theta, stepping, sensitivities, interrupt: &|| false },
            &start,
            Table::new("inputs", &[], 11, 0)?,
        )
    };
    let last = 10 * d.n_outputs() + d.layout().markers();
    let jacobian = run(&d.parameters, &by)?.jacobian;
    let (mut found, mut expected) = (Vec::new(), Vec::new());
    for (lane, &place) in by.iter().enumerate() {
        let value = d.parameters[place];
        found.extend((0..3).map(|axis| jacobian[(last + axis) * by.len() + lane] * value));
        expected.extend(slope(1e-3, |change| {
            let mut theta = d.parameters.clone();
            theta[place] += change * value;
            Ok(run(&theta, &[])?.outputs[last..last + 3].to_vec())
        })?);
    }
    let name = format!("Tip of an arm with a {} beam by young, density, width, rotor inertia", name(level));
    Ok(Row { name, found, expected, unit: "m", source: SOURCE, tolerance: Tolerance::Absolute(1e-8) })
}
