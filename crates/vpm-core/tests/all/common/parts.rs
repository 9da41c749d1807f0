//! Descriptions that are still open for parts: controllers, and an actuator on a line.

use super::{Bench, Machine};
use serde_json::{Value, json};
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::simulate::{Hold, Stepping};

/// A description that is still open for parts.
pub struct Parts(pub Value);

impl Parts {
    pub fn of(machine: &Machine) -> Self {
        Self(serde_json::from_str(&machine.json()).unwrap())
    }

    pub fn number(&mut self, name: &str, value: f64) -> usize {
        self.0["parameter_names"].as_array_mut().unwrap().push(json!(name));
        let values = self.0["parameters"].as_array_mut().unwrap();
        values.push(json!(value));
        values.len() - 1
    }

    /// Adds a part; `numbers` become parameters, as lists where their names repeat.
    pub fn add(&mut self, list: &str, mut part: Value, numbers: &[(&str, &[f64])]) -> &mut Self {
        for (key, values) in numbers {
            let places: Vec<_> = values.iter().map(|&value| json!(self.number(key, value))).collect();
            let several = part["type"] == "computed_torque";
            part[*key] = if several { json!(places) } else { places[0].clone() };
        }
        if self.0[list].is_null() {
            self.0[list] = json!([]);
        }
        self.0[list].as_array_mut().unwrap().push(part);
        self
    }

    /// A massless line of the world's `from` to `to` on a body, with an actuator of some gain and lag on it.
    pub fn drive_line(&mut self, body: usize, from: [f64; 3], to: [f64; 3], gain: f64, lag: Option<f64>) -> &mut Self {
        let ends =
            [("from", json!({"on": "world", "point": from})), ("to", json!({"on": {"body": body}, "point": to}))];
        let mut line = json!({"name": "stroke", "barrel": null, "rod": null});
        for (key, end) in ends {
            line[key] = end;
        }
        self.add("lines", line, &[]);
        let mut actuator = json!({"name": "piston", "on": {"line": 0}});
        actuator["drive"] = json!({"type": "ideal", "gain": self.number("piston.gain", gain)});
        if let Some(lag) = lag {
            actuator["lag"] = json!(self.number("piston.lag", lag));
        }
        self.add("actuators", actuator, &[])
    }

    pub fn try_build(&self) -> vpm_core::Result<Description> {
        Description::from_json(&self.0.to_string())
    }

    pub fn bench(&self, time_step: f64, substeps: usize) -> Bench {
        let description = self.try_build().unwrap();
        let stepping = Stepping::new(time_step, substeps, Method::Rk4).unwrap();
        Bench {
            theta: description.parameters.clone(),
            description,
            stepping,
            sensitivities: Vec::new(),
            hold: Hold::default(),
        }
    }
}

pub fn position(joint: usize) -> Value {
    json!({"kind": "position", "joint": joint})
}

/// A controller of one actuator.
pub fn controller(kind: &str, actuator: usize, measures: Value) -> Value {
    json!({"type": kind, "name": format!("of {actuator}"), "actuator": actuator, "measures": measures})
}
