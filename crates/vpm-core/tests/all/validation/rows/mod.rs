//! Rows of the validation table that only the core can show: derivations, derivatives, conservation, convergence, limits.

mod bases;
mod conservation;
mod derivations;
mod limits;
mod orders;
mod rolling;
mod segments;
mod slopes;

use serde_json::{Value, json};
use vpm_core::Result;

/// Largest difference that is allowed.
#[derive(Clone, Copy, Debug)]
pub enum Tolerance {
    /// As it stands.
    Absolute(f64),
    /// As a share of what is expected.
    Relative(f64),
}

/// Numbers beside their reference.
#[derive(Clone, Debug)]
pub struct Row {
    /// What is compared.
    pub name: String,
    found: Vec<f64>,
    expected: Vec<f64>,
    unit: &'static str,
    source: &'static str,
    tolerance: Tolerance,
}

impl Row {
    /// Whether all numbers are within their tolerance.
    pub fn holds(&self) -> bool {
        let within = |(found, expected): (&f64, &f64)| {
            let allowed = match self.tolerance {
                Tolerance::Absolute(size) => size,
                Tolerance::Relative(size) => size * expected.abs(),
            };
            (found - expected).abs() <= allowed
        };
        !self.found.is_empty()
            && self.found.len() == self.expected.len()
            && self.found.iter().zip(&self.expected).all(within)
    }

    /// As one JSON object.
    pub fn json(&self) -> Value {
        let (absolute, relative) = match self.tolerance {
            Tolerance::Absolute(size) => (size, 0.0),
            Tolerance::Relative(size) => (0.0, size),
        };
        json!({"name": self.name, "found": self.found, "expected": self.expected, "unit": self.unit,
            "source": self.source, "absolute": absolute, "relative": relative})
    }
}

/// A group of rows.
pub type Group = fn() -> Result<Vec<Row>>;

/// Every group, by its name.
pub const GROUPS: [(&str, Group); 8] = [
    ("derivations", derivations::rows),
    ("slopes", slopes::rows),
    ("conservation", conservation::rows),
    ("orders", orders::rows),
    ("rolling", rolling::rows),
    ("limits", limits::rows),
    ("bases", bases::rows),
    ("segments", segments::rows),
];

/// A row of differences that ought to vanish.
fn vanishing(name: String, found: Vec<f64>, tolerance: f64, source: &'static str) -> Row {
    let expected = vec![0.0; found.len()];
    Row { name, found, expected, unit: "-", source, tolerance: Tolerance::Absolute(tolerance) }
}

/// The larger size of two numbers; one that is not a number stays.
fn larger(most: f64, next: f64) -> f64 {
    if next.abs() <= most { most } else { next.abs() }
}

/// Largest difference, as a share of the largest entry.
fn difference(found: &[f64], expected: &[f64]) -> f64 {
    let size = expected.iter().copied().fold(f64::MIN_POSITIVE, larger);
    found.iter().zip(expected).map(|(found, expected)| found - expected).fold(0.0, larger) / size
}
