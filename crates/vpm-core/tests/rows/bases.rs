//! One machine with beams in different bases.

use serde_json::{Value, json};
use vpm_core::{Result, evaluate};

use super::two_link::arm;
use super::{Row, Tolerance, difference};

/// Slowest frequencies that are compared.
const COUNT: usize = 4;

/// Frequencies that agree between bases, and the orders at which the others come near them.
pub fn rows() -> Result<Vec<Row>> {
    let exact = frequencies(&json!({"strain": 10}))?;
    let mut rows = Vec::new();
    for level in [json!({"bezier": 9}), json!({"hermite": 24}), json!({"elements": 24}), json!({"modal": 8})] {
        rows.push(Row {
            name: format!("Two-link arm with joints locked, four frequencies with {}", name(&level)),
            found: frequencies(&level)?,
            expected: exact.clone(),
            unit: "Hz",
            source: "the same arm with strain(10)",
            tolerance: Tolerance::Relative(if level["modal"].is_null() { 1e-6 } else { 1e-3 }),
        });
    }
    for (kind, first, order) in [("hermite", 2, 4.0), ("elements", 2, 4.0), ("lumped", 16, 2.0), ("modal", 2, 3.0)] {
        let error =
            |count: usize| -> Result<f64> { Ok(difference(&frequencies(&json!({ kind: count }))?[..1], &exact[..1])) };
        let [coarse, middle, fine]: [Result<f64>; 3] = [first, 2 * first, 4 * first].map(error);
        let (coarse, middle, fine): (f64, f64, f64) = (coarse?, middle?, fine?);
        rows.push(Row {
            name: format!("Order of {kind}({first}) to {kind}({}) in the first frequency of the arm", 4 * first),
            found: vec![(coarse / middle).log2(), (middle / fine).log2()],
            expected: vec![order; 2],
            unit: "-",
            source: "order of the interpolation; errors against strain(10)",
            tolerance: Tolerance::Absolute(0.3),
        });
    }
    Ok(rows)
}

fn name(level: &Value) -> String {
    let kinds = level.as_object().into_iter().flatten();
    kinds.map(|(kind, count)| format!("{kind}({count})")).collect()
}

/// About the straight beams, without gravity, in Hz.
fn frequencies(level: &Value) -> Result<Vec<f64>> {
    let mut d = arm(level)?;
    d.gravity = [0.0; 3];
    let mut found = evaluate::natural_frequencies(&d, &d.parameters, &[0.3, -0.8])?;
    found.truncate(COUNT);
    Ok(found)
}
