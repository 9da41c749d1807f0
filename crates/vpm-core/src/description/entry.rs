//! Entries of a description that say where a law sits: the site beside the law's own fields.

use serde::Deserialize;
use serde::de::Error as _;
use serde_json::{Map, Value};

use super::TreeEffect;
use crate::body::Site;
use crate::controller::ControlLaw;
use crate::effect::{Domain, JointEffect, MemoryEffect, Payload, Seat};
use crate::sensor::Channel;

/// An effect and its site, written as one flat table with a `type`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Map<String, Value>")]
pub enum EffectEntry {
    /// An effect on a joint or a shaft.
    Joint {
        /// Where it acts.
        seat: Seat<usize>,
        /// Its law.
        law: Box<JointEffect<usize>>,
    },
    /// An effect on a joint or a shaft that remembers.
    Memory {
        /// Where it acts.
        seat: Seat<usize>,
        /// Its law.
        law: MemoryEffect<usize>,
    },
    /// A payload on a body or at the tip of a beam.
    Payload {
        /// What carries it.
        on: Site,
        /// Its mass and place.
        law: Payload<usize>,
    },
    /// An effect on what the machine is made of.
    Tree(TreeEffect<usize>),
}

/// A controller: its law, what it measures and what it commands, and when, written as one flat table with a `type`.
///
/// A law of one joint has `actuator` and `measures`; one of several has lists, `actuators` and `measures`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Map<String, Value>")]
pub struct ControllerEntry {
    /// Name, unique in the model.
    pub name: String,
    /// Numbers of the actuators that it commands.
    pub actuators: Vec<usize>,
    /// The position that it controls with each of them.
    pub measures: Vec<Channel>,
    /// Its law.
    pub law: ControlLaw<usize>,
    /// Time between its samples, s; that of the record if none.
    pub sample_time: Option<f64>,
    /// Time from measuring to commanding, s; none at all if none.
    pub delay: Option<f64>,
}

impl EffectEntry {
    /// Parameters of an effect's entry and where each is defined.
    pub fn domains(&self) -> Vec<(&usize, Domain)> {
        match self {
            Self::Joint { law, .. } => law.domains(),
            Self::Memory { law, .. } => law.domains(),
            Self::Payload { law, .. } => law.domains(),
            Self::Tree(law) => law.domains(),
        }
    }
}

/// Takes one field out of an entry's table, so that the law can read the rest strictly.
fn take<T: for<'de> Deserialize<'de>>(table: &mut Map<String, Value>, field: &'static str) -> serde_json::Result<T> {
    serde_json::from_value(table.remove(field).ok_or_else(|| serde_json::Error::missing_field(field))?)
}

/// Takes a field of an entry as [`take`], where it may be missing or null.
fn optional(table: &mut Map<String, Value>, field: &'static str) -> serde_json::Result<Option<f64>> {
    table.remove(field).map_or(Ok(None), serde_json::from_value)
}

/// Reads what is left of a table, and says in which entry a mistake is.
fn named<T>(kind: &str, read: impl FnOnce() -> serde_json::Result<T>) -> Result<T, String> {
    read().map_err(|error| format!("{kind}: {error}"))
}

impl TryFrom<Map<String, Value>> for EffectEntry {
    type Error = String;

    fn try_from(mut table: Map<String, Value>) -> Result<Self, String> {
        let kind = table.get("type").and_then(Value::as_str).unwrap_or("effect without type").to_owned();
        named(&kind, || {
            if kind == "payload" {
                table.remove("type");
                let on = if table.contains_key("beam") {
                    Site::Tip(take(&mut table, "beam")?)
                } else if table.contains_key("weld") {
                    Site::Weld(take(&mut table, "weld")?)
                } else {
                    Site::Body(take(&mut table, "body")?)
                };
                return Ok(Self::Payload { on, law: serde_json::from_value(Value::Object(table))? });
            }
            if matches!(kind.as_str(), "rotor_inertia" | "gravity_tilt") || table.contains_key("beam") {
                return Ok(Self::Tree(serde_json::from_value(Value::Object(table))?));
            }
            let seat = if table.contains_key("transmission") {
                Seat::Shaft { transmission: take(&mut table, "transmission")?, ratios: take(&mut table, "ratios")? }
            } else {
                let behind = table.remove("behind").map_or(Ok(None), serde_json::from_value)?;
                Seat::Joint { joint: take(&mut table, "joint")?, behind }
            };
            if matches!(kind.as_str(), "hysteresis" | "lugre_friction" | "warming_friction") {
                return Ok(Self::Memory { seat, law: serde_json::from_value(Value::Object(table))? });
            }
            Ok(Self::Joint { seat, law: serde_json::from_value(Value::Object(table))? })
        })
    }
}

impl TryFrom<Map<String, Value>> for ControllerEntry {
    type Error = String;

    fn try_from(mut table: Map<String, Value>) -> Result<Self, String> {
        let name = named("controller", || take::<String>(&mut table, "name"))?;
        named(&format!("controller `{name}`"), || {
            let (sample_time, delay) = (optional(&mut table, "sample_time")?, optional(&mut table, "delay")?);
            let (actuators, measures) = if table.contains_key("actuators") {
                (take(&mut table, "actuators")?, take(&mut table, "measures")?)
            } else {
                (vec![take(&mut table, "actuator")?], vec![take(&mut table, "measures")?])
            };
            let law = serde_json::from_value(Value::Object(table))?;
            Ok(Self { name: name.clone(), actuators, measures, law, sample_time, delay })
        })
    }
}
