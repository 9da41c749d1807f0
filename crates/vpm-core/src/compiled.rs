//! A compiled model: one text with all that a step needs, for callers that have no Python, as a controller in C.

use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::value::RawValue;

use crate::description::Description;
use crate::error::{Error, Result};
use crate::integrator::Method;
use crate::live::Live;
use crate::simulate::Stepping;

/// The version of the format that this core reads.
pub const FORMAT: u32 = 1;
/// Largest file that is read, bytes; machines of a hundred coordinates take less than a hundredth.
pub const LARGEST: u64 = 64 << 20;
/// Most states of a machine: several matrices of their square have to be held.
pub const MOST_STATES: usize = 4096;

/// What the file holds beside the description, whose `parameters` are the model's numbers in one flat block.
#[derive(Deserialize)]
struct Text {
    name: String,
    time_step: f64,
    substeps: usize,
    integrator: String,
    inputs: Vec<String>,
    outputs: Vec<String>,
    states: Vec<String>,
    start: Vec<f64>,
    description: Box<RawValue>,
}

/// Only the version, which has to be right before anything else is asked for.
#[derive(Deserialize)]
struct Version {
    format: u32,
}

/// A machine with its parameters, its start and the way that time advances.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// Name of the model.
    pub name: String,
    /// Dotted names of the inputs: commands of actuators, then pressures of logged supplies.
    pub inputs: Vec<String>,
    /// Dotted names of the outputs, as the sensors show them.
    pub outputs: Vec<String>,
    /// Dotted names of the states.
    pub states: Vec<String>,
    /// State at time zero.
    pub start: Vec<f64>,
    /// Time between samples and how it is integrated.
    pub stepping: Stepping,
    description: Arc<Description>,
}

impl Compiled {
    /// Reads what `vpm compile` wrote.
    pub fn read(path: &Path) -> Result<Self> {
        let faulty =
            |what: String| unreadable(format!("{}: {what}; give the file that `vpm compile` wrote", path.display()));
        let told = |error: std::io::Error| faulty(error.to_string());
        let found = std::fs::metadata(path).map_err(told)?;
        // A pipe never ends, and a file of no end takes all memory.
        if !found.is_file() {
            return Err(faulty("it is no ordinary file".to_owned()));
        }
        if found.len() > LARGEST {
            return Err(faulty(format!("it has {} bytes, and at most {LARGEST} are read", found.len())));
        }
        Self::parse(&std::fs::read_to_string(path).map_err(told)?)
    }

    /// Reads a compiled machine from the text of its file.
    pub fn parse(text: &str) -> Result<Self> {
        let faulty = |error: serde_json::Error| unreadable(format!("{error}; write it anew with `vpm compile`"));
        let Version { format } = serde_json::from_str(text).map_err(faulty)?;
        if format != FORMAT {
            return Err(unreadable(format!(
                "it has format {format}, and this library reads format {FORMAT}; write it anew with the `vpm compile` of this version"
            )));
        }
        let text: Text = serde_json::from_str(text).map_err(faulty)?;
        let description = Description::from_json(text.description.get())?;
        let states = description.n_states();
        if states > MOST_STATES {
            return Err(unreadable(format!(
                "its machine has {states} states, and at most {MOST_STATES} can be stepped; use coarser flexible links"
            )));
        }
        let lengths = [
            ("inputs", text.inputs.len(), description.n_inputs()),
            ("outputs", text.outputs.len(), description.n_outputs()),
            ("states", text.states.len(), description.n_states()),
            ("start", text.start.len(), description.n_states()),
        ];
        if let Some((what, found, expected)) = lengths.into_iter().find(|(_, found, expected)| found != expected) {
            return Err(unreadable(format!(
                "its list `{what}` has {found} entries, and the machine needs {expected}; write it anew with `vpm compile`"
            )));
        }
        Ok(Self {
            stepping: Stepping::new(text.time_step, text.substeps, Method::from_name(&text.integrator)?)?,
            name: text.name,
            inputs: text.inputs,
            outputs: text.outputs,
            states: text.states,
            start: text.start,
            description: Arc::new(description),
        })
    }

    /// The description of the compiled machine.
    pub fn description(&self) -> &Arc<Description> {
        &self.description
    }

    /// Live machine of a compiled model at its start, with its own parameters.
    pub fn live(&self) -> Result<Live> {
        Live::new(self.description.clone(), &self.description.parameters, &self.start, self.stepping)
    }
}

fn unreadable(message: String) -> Error {
    Error::Compiled { message }
}
