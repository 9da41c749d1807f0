//! Published and recomputed values of linkages and hydraulics, each with its unit, tolerance and source, and how near the core
//! comes.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

/// A number or several, with the tolerance of each.
#[derive(Deserialize)]
struct Value {
    id: String,
    value: Numbers,
    unit: String,
    tolerance: Tolerance,
    source: String,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Numbers {
    One(f64),
    Several(Vec<f64>),
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Tolerance {
    Abs(f64),
    Rel(f64),
}

impl Value {
    fn numbers(&self) -> &[f64] {
        match &self.value {
            Numbers::One(number) => std::slice::from_ref(number),
            Numbers::Several(numbers) => numbers,
        }
    }

    /// Largest error as a fraction of what is allowed.
    fn used(&self, found: &[f64]) -> f64 {
        let expected = self.numbers();
        assert_eq!(expected.len(), found.len(), "`{}` has {} numbers", self.id, expected.len());
        let share = |(wanted, got): (&f64, &f64)| {
            let allowed = match self.tolerance {
                Tolerance::Abs(size) => size,
                Tolerance::Rel(size) => size * wanted.abs(),
            };
            let error = (wanted - got).abs();
            if error == 0.0 { 0.0 } else { error / allowed }
        };
        expected.iter().zip(found).map(share).fold(0.0, |most, next| if next <= most { most } else { next })
    }
}

/// Compares what was found with every value whose name begins with `prefix`: none may be missing, none may be off.
/// The largest part of a tolerance that is used.
pub fn check_all(prefix: &str, found: &[(&str, Vec<f64>)]) -> serde_json::Result<f64> {
    let mut values: Vec<Value> = serde_json::from_str(include_str!("../../values/linkages.json"))?;
    values.extend(serde_json::from_str::<Vec<Value>>(include_str!("../../values/hydraulic.json"))?);
    let wanted: BTreeMap<&str, &Value> =
        values.iter().filter(|value| value.id.starts_with(prefix)).map(|value| (value.id.as_str(), value)).collect();
    let names: BTreeSet<&str> = found.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, wanted.keys().copied().collect(), "every value has to be computed, and no other");
    let mut most = 0.0_f64;
    for (name, numbers) in found {
        let value = wanted[name];
        let used = value.used(numbers);
        most = most.max(used);
        println!("{name}: {used:.1e} of the tolerance");
        let (expected, unit, source) = (value.numbers(), &value.unit, &value.source);
        assert!(
            used <= 1.0,
            "`{name}` is {numbers:?} {unit} instead of {expected:?} ({source}): {used} of the tolerance"
        );
    }
    Ok(most)
}
