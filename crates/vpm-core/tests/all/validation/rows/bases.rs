//! One machine with beams in different bases.

use serde_json::json;
use vpm_core::beam::{Component, DampingEntry, Level};
use vpm_core::body::{PointMass, Site};
use vpm_core::{Result, evaluate};

use super::derivations::name;
use super::{Row, Tolerance, difference, slopes};
use crate::common::trees;
use crate::common::two_link::arm;

/// Slowest frequencies that are compared.
const COUNT: usize = 4;
/// Of enough coordinates for these frequencies to nine digits.
const EXACT: Level = Level::Strain(10);

/// A machine with beams of a level: its frequencies in Hz, joints locked, beams straight, without gravity.
type Frequencies = fn(Level) -> Result<Vec<f64>>;

/// Frequencies that agree between bases, and the orders at which the others come near them.
pub fn rows() -> Result<Vec<Row>> {
    let (arm, strip): ((_, Frequencies), (_, Frequencies)) =
        (("two-link arm", two_link), ("strip with a point mass at its tip", strip));
    let mut rows = Vec::new();
    for level in [Level::Bezier(9), Level::Hermite(24), Level::Elements(24)] {
        rows.push(agreement(arm, level, 1e-6)?);
    }
    for level in [Level::Modal(8), Level::Bezier(9)] {
        rows.push(agreement(("strip", bare), level, 1e-6)?);
    }
    for (machine, kind, first, order) in [
        (arm, Level::Hermite as fn(usize) -> Level, 2, 4.0),
        (arm, Level::Elements, 2, 4.0),
        (strip, Level::Lumped, 8, 2.0),
        // The shapes of a free tip have no force there: what is left of it falls as the sum of 1/k^4.
        (strip, Level::Modal, 2, 3.0),
    ] {
        rows.push(convergence(machine, kind, first, order)?);
    }
    Ok(rows)
}

fn agreement((machine, frequencies): (&str, Frequencies), level: Level, tolerance: f64) -> Result<Row> {
    Ok(Row {
        name: format!("Slowest frequencies of a {machine} with {}", name(level)),
        found: frequencies(level)?,
        expected: frequencies(EXACT)?,
        unit: "Hz",
        source: "the same machine with strain(10)",
        tolerance: Tolerance::Relative(tolerance),
    })
}

/// Orders from three levels, each twice as fine as the one before.
fn convergence(
    (machine, frequencies): (&str, Frequencies),
    kind: fn(usize) -> Level,
    first: usize,
    order: f64,
) -> Result<Row> {
    let exact = frequencies(EXACT)?;
    let error = |times: usize| -> Result<f64> { Ok(difference(&frequencies(kind(times * first))?[..1], &exact[..1])) };
    let [coarse, middle, fine] = [error(1)?, error(2)?, error(4)?];
    Ok(Row {
        name: format!(
            "Order of {} to {} in the first frequency of a {machine}",
            name(kind(first)),
            name(kind(4 * first))
        ),
        found: vec![(coarse / middle).log2(), (middle / fine).log2()],
        expected: vec![order; 2],
        unit: "-",
        source: "order of the interpolation; errors against strain(10)",
        tolerance: Tolerance::Absolute(0.3),
    })
}

fn two_link(level: Level) -> Result<Vec<f64>> {
    let mut d = arm(&json!(level))?;
    d.gravity = [0.0; 3];
    let mut found = evaluate::natural_frequencies(&d, &d.parameters, &[0.3, -0.8])?;
    found.truncate(COUNT);
    Ok(found)
}

fn strip(level: Level) -> Result<Vec<f64>> {
    clamped(level, Some(PointMass { on: Site::Tip(0), mass: 0.1, position: [0.0; 3] }))
}

fn bare(level: Level) -> Result<Vec<f64>> {
    let mut found = clamped(level, None)?;
    found.truncate(COUNT / 2);
    Ok(found)
}

/// A beam that bends in one plane, on a joint.
fn clamped(level: Level, payload: Option<PointMass<f64>>) -> Result<Vec<f64>> {
    let mut parts = slopes::arm(level);
    parts.gravity = [0.0; 3];
    parts.bodies.truncate(1);
    parts.markers.clear();
    (parts.beams[0].deforms, parts.beams[0].damping) = (vec![Component::BendingY], DampingEntry::default());
    parts.point_masses.extend(payload);
    let d = trees::try_description(&parts, |_| ())?;
    let mut found = evaluate::natural_frequencies(&d, &d.parameters, &[0.0])?;
    found.truncate(COUNT);
    Ok(found)
}
