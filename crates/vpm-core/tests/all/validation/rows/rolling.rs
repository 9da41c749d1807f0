//! A moment at the tip rolls a cantilever up to a circle.

use std::f64::consts::TAU;

use vpm_core::Result;
use vpm_core::beam::witness::two_node::{NodeLoad, TwoNodeChain};
use vpm_core::beam::{BeamEntry, Component, Level, Material, Properties, Section, SectionEntry, Shape};

use super::derivations::name;
use super::{Row, Tolerance};
use crate::common::entries;
use crate::common::sums::{Load, Root, equilibrium, tip};

const SOURCE: &str = "constant curvature M/EI: sin(phi)/phi along, (1 - cos phi)/phi across, phi = M L/EI";
/// Parts of a full circle.
const TURNS: [f64; 6] = [0.125, 0.25, 0.5, 0.75, 1.0, 2.0];

/// The levels of exact geometry, and the two-node element.
pub fn rows() -> Result<Vec<Row>> {
    let (plane, space) = (&[Component::BendingY][..], &[Component::BendingY, Component::Torsion][..]);
    let mut rows = Vec::new();
    for (level, deforms, turns, tolerance) in [
        (Level::Strain(1), space, &TURNS[..], 1e-8),
        (Level::Strain(3), space, &TURNS, 1e-8),
        // Of sixth order in what an element bends by, here up to pi.
        (Level::Elements(4), plane, &TURNS[..4], 1e-6),
        (Level::Strain(8), plane, &TURNS[..4], 1e-8),
        // A quadrature from station to station, and few stations.
        (Level::Strain(1), plane, &TURNS[..5], 1e-5),
    ] {
        let mut found = Vec::new();
        for turns in turns {
            let load = Load { moment: [0.0, turns * TAU, 0.0], ..Load::default() };
            let beam = unit(level, deforms);
            let [across, _, along] = tip(&beam, &equilibrium(&beam, &load, &Root::resting([0.0; 3]), 1)?)?;
            found.extend([along, across]);
        }
        let plane = if deforms.len() == 1 { "in the plane" } else { "in space" };
        let most = turns.last().copied().unwrap_or_default();
        rows.push(Row {
            name: format!("Roll-up by a tip moment, {} {plane}: tip at 1/8 to {most} turns", name(level)),
            found,
            expected: turns.iter().flat_map(|turns| circle(turns * TAU)).collect(),
            unit: "L",
            source: SOURCE,
            tolerance: Tolerance::Absolute(tolerance),
        });
    }
    rows.extend(two_node()?);
    Ok(rows)
}

/// Tip along and across.
fn circle(phi: f64) -> [f64; 2] {
    [phi.sin() / phi, (1.0 - phi.cos()) / phi]
}

/// A beam of length 1 and `EJ = 1`.
fn unit(level: Level, deforms: &[Component]) -> BeamEntry<f64> {
    let given = Properties { area: 1.0, moment_x: 1.0, moment_y: 1.0, torsion: 1.0, shear_x: 1.0, shear_y: 1.0 };
    BeamEntry {
        material: Some(Material { young: 1.0, poisson: 0.0, density: 1.0 }),
        sections: vec![SectionEntry::new(0.0, Shape::Given(given))],
        rest: Vec::new(),
        ..entries::entry(level, deforms, 1.0, [1.0, 1.0])
    }
}

/// Tip of a chain of elements, rolled up in stages to a full circle.
fn chain(count: usize) -> Result<[f64; 2]> {
    let section = Section::given([1.0, 1.0, 1.0, 1e9, 1e9, 1e7], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])?;
    let chain = TwoNodeChain::new(&section, 1.0, count)?;
    let mut x = chain.straight();
    for stage in 1..=16 {
        let moment = [0.0, TAU * f64::from(stage) / 16.0, 0.0];
        x = chain.equilibrium(&x, &NodeLoad { moment, ..NodeLoad::default() })?;
    }
    let last = &x[x.len() - 7..];
    Ok([last[2], last[0]])
}

fn two_node() -> Result<Vec<Row>> {
    let [coarse, middle, fine] = [chain(8)?, chain(16)?, chain(32)?];
    let size = |[along, across]: [f64; 2]| along.hypot(across);
    let order = vec![(size(coarse) / size(middle)).log2(), (size(middle) / size(fine)).log2()];
    let left = (0..2).map(|k| (4.0 * fine[k] - middle[k]) / 3.0).collect();
    let row = |name: &str, (found, expected), unit, tolerance| Row {
        name: format!("Roll-up by a tip moment, two-node elements: {name}"),
        found,
        expected,
        unit,
        source: SOURCE,
        tolerance: Tolerance::Absolute(tolerance),
    };
    Ok(vec![
        row("order from 8, 16, 32 elements", (order, vec![2.0; 2]), "-", 0.3),
        row("tip at 1 turn, extrapolated from 16 and 32", (left, circle(TAU).to_vec()), "L", 2e-3),
    ])
}
