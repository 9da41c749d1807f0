//! Machines for the tests: built part by part, with every number a named parameter.

pub mod beams;
pub mod both;
pub mod connections;
pub mod derivatives;
pub mod element_arm;
pub mod entries;
pub mod hydraulics;
pub mod parts;
pub mod places;
pub mod random_machine;
pub mod servo_machine;
pub mod sums;
pub mod trees;
pub mod two_beams;
pub mod two_link;
pub mod values;

use serde_json::{Value, json, to_value};
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::samples::Sample;
use vpm_core::sensitivity::Interrupt;
use vpm_core::simulate::{Hold, Inputs, Run, Setting, Stepping, closed_loop, free_run, restarts};
use vpm_core::system::System;
use vpm_core::table::Table;

/// Never stops a computation.
pub const ALWAYS: Interrupt<'static> = &|| false;

/// A description in the making.
pub struct Machine {
    pub values: Vec<f64>,
    pub names: Vec<String>,
    parts: Value,
}

impl Machine {
    /// The rigid tree of a sample, without effects or actuators.
    pub fn new(sample: &Sample) -> Self {
        let parts = json!({"gravity": sample.gravity, "bodies": [], "effects": [], "actuators": [], "sensors": [],
            "controllers": []});
        let mut machine = Self { values: Vec::new(), names: Vec::new(), parts };
        for body in &sample.bodies {
            let name = body.name.clone();
            let indexed = body.map(&mut |&value| machine.parameter(&format!("{name}.{}", machine.values.len()), value));
            machine.push("bodies", to_value(indexed).unwrap());
        }
        machine
    }

    fn push(&mut self, list: &str, part: Value) {
        if self.parts[list].is_null() {
            self.parts[list] = json!([]);
        }
        self.parts[list].as_array_mut().unwrap().push(part);
    }

    /// A part of any kind: what is in `fixed` as it is, and of `numbers` every float as a parameter named by its way.
    pub fn add(&mut self, list: &str, mut fixed: Value, numbers: Value) -> &mut Self {
        let name = fixed["name"].as_str().unwrap().to_owned();
        for (key, value) in numbers.as_object().unwrap() {
            fixed[key] = self.numbered(&format!("{name}.{key}"), value);
        }
        self.push(list, fixed);
        self
    }

    fn numbered(&mut self, way: &str, value: &Value) -> Value {
        match value {
            Value::Number(number) if number.is_f64() => json!(self.parameter(way, number.as_f64().unwrap())),
            Value::Object(parts) => {
                parts.iter().map(|(key, part)| (key.clone(), self.numbered(&format!("{way}.{key}"), part))).collect()
            }
            Value::Array(parts) => {
                let parts = parts.iter().enumerate();
                parts.map(|(place, part)| self.numbered(&format!("{way}.{place}"), part)).collect()
            }
            other => other.clone(),
        }
    }

    pub fn parameter(&mut self, name: &str, value: f64) -> usize {
        self.names.push(name.to_owned());
        self.values.push(value);
        self.values.len() - 1
    }

    fn part(&mut self, list: &str, site: &str, mut part: Value, numbers: &[(&str, f64)]) -> &mut Self {
        for (name, value) in numbers {
            part[name] = json!(self.parameter(&format!("{site}.{name}"), *value));
        }
        self.push(list, part);
        self
    }

    /// An effect on a joint; its parameters are named `type.parameter`.
    pub fn effect(&mut self, kind: &str, joint: usize, numbers: &[(&str, f64)]) -> &mut Self {
        self.part("effects", kind, json!({"type": kind, "joint": joint}), numbers)
    }

    /// The same on the sum of two joints' coordinates; its parameters are named `type_behind.parameter`.
    pub fn effect_behind(&mut self, kind: &str, [joint, behind]: [usize; 2], numbers: &[(&str, f64)]) -> &mut Self {
        let part = json!({"type": kind, "joint": joint, "behind": behind});
        self.part("effects", &format!("{kind}_behind"), part, numbers)
    }

    /// A transmission of these joints and ratios, `shaft0`, `shaft1`, ..., with a rotor if it has an inertia.
    pub fn transmission(&mut self, ratios: &[(usize, f64)], inertia: Option<f64>) -> &mut Self {
        let number = self.parts["transmissions"].as_array().map_or(0, Vec::len);
        let ratios: Vec<_> = ratios.iter().map(|(joint, ratio)| json!({"joint": joint, "ratio": ratio})).collect();
        let numbers = inertia.map_or_else(
            || json!({"ratios": ratios.clone()}),
            |inertia| json!({"ratios": ratios.clone(), "inertia": inertia}),
        );
        self.add("transmissions", json!({"name": format!("shaft{number}"), "inertia": null}), numbers)
    }

    /// An effect on the shaft of a transmission; its parameters are named `type_shaft.parameter`.
    pub fn effect_on_shaft(&mut self, kind: &str, transmission: usize, numbers: &[(&str, f64)]) -> &mut Self {
        let ratios = self.parts["transmissions"][transmission]["ratios"].clone();
        let part = json!({"type": kind, "transmission": transmission, "ratios": ratios});
        self.part("effects", &format!("{kind}_shaft"), part, numbers)
    }

    /// An ideal drive on a transmission of a machine without lines.
    pub fn actuator_on_shaft(&mut self, transmission: usize, numbers: &[(&str, f64)]) -> &mut Self {
        let name = format!("motor{transmission}");
        let gain = numbers.iter().find(|(key, _)| *key == "gain").map_or(1.0, |(_, gain)| *gain);
        let drive = json!({"type": "ideal", "gain": self.parameter(&format!("{name}.gain"), gain)});
        let others: Vec<_> = numbers.iter().filter(|(key, _)| *key != "gain").copied().collect();
        self.part("actuators", &name, json!({"name": name, "on": {"line": transmission}, "drive": drive}), &others)
    }

    /// A payload on a body.
    pub fn payload(&mut self, body: usize, mass: f64, position: [f64; 3]) -> &mut Self {
        let position: Vec<_> = ["x", "y", "z"]
            .iter()
            .zip(position)
            .map(|(axis, p)| self.parameter(&format!("payload.{axis}"), p))
            .collect();
        let part = json!({"type": "payload", "body": body, "position": position});
        self.part("effects", "payload", part, &[("mass", mass)])
    }

    /// An actuator `drive0`, `drive1`, ... on a joint, with an ideal drive.
    pub fn actuator(&mut self, joint: usize, numbers: &[(&str, f64)]) -> &mut Self {
        let name = format!("drive{joint}");
        let of_drive = |known: &&(&str, f64)| ["gain", "limit"].contains(&known.0);
        let mut drive = json!({"type": "ideal"});
        for (number, value) in numbers.iter().filter(of_drive) {
            drive[number] = json!(self.parameter(&format!("{name}.{number}"), *value));
        }
        let others: Vec<_> = numbers.iter().filter(|number| !of_drive(number)).copied().collect();
        self.part("actuators", &name, json!({"name": name, "on": {"joint": joint}, "drive": drive}), &others)
    }

    /// A second drive `pressed` on a joint, which loses these shares of its effort where it drives and where it is driven.
    pub fn rubbing_actuator(&mut self, joint: usize, gain: f64, [driving, driven, transition]: [f64; 3]) -> &mut Self {
        let friction = json!({"driving": driving, "driven": driven, "transition_velocity": transition});
        let numbers = json!({"drive": {"type": "ideal", "gain": gain}, "friction": friction});
        self.add("actuators", json!({"name": "pressed", "on": {"joint": joint}}), numbers)
    }

    /// A sensor on a channel, `{"kind": ..., "joint": ...}`.
    pub fn sensor(&mut self, channel: Value, numbers: &[(&str, f64)]) -> &mut Self {
        let name = format!("sensor{}", self.parts["sensors"].as_array().unwrap().len());
        self.part("sensors", &name, json!({"name": name, "channel": channel}), numbers)
    }

    /// A controller of the position of a joint by an actuator.
    pub fn controller(&mut self, kind: &str, actuator: usize, joint: usize, numbers: &[(&str, f64)]) -> &mut Self {
        let measures = json!({"kind": "position", "joint": joint});
        let name = format!("servo{actuator}");
        self.part(
            "controllers",
            &name,
            json!({"type": kind, "name": name, "actuator": actuator, "measures": measures}),
            numbers,
        )
    }

    /// The JSON text.
    pub fn json(&self) -> String {
        let mut parts = self.parts.clone();
        parts["parameters"] = json!(self.values);
        parts["parameter_names"] = json!(self.names);
        parts.to_string()
    }

    /// The description.
    pub fn build(&self) -> Description {
        Description::from_json(&self.json()).unwrap()
    }

    /// The machine as a system of equations.
    pub fn system(&self) -> System<f64> {
        self.build().system(&self.values).unwrap()
    }

    /// The place of a parameter.
    pub fn index(&self, name: &str) -> usize {
        self.names.iter().position(|known| known == name).unwrap_or_else(|| panic!("no {name} in {:?}", self.names))
    }
}

/// The same with moments of inertia, so that differences can move these either way.
pub fn solid(mut sample: Sample) -> Sample {
    let inertias = sample.bodies.iter_mut().filter_map(|body| body.inertia.as_mut());
    inertias.for_each(|inertia| inertia.moments[..3].fill(0.02));
    sample
}

/// How the tests simulate.
pub struct Bench {
    pub description: Description,
    pub theta: Vec<f64>,
    pub stepping: Stepping,
    pub sensitivities: Vec<usize>,
    pub hold: Hold,
}

impl Bench {
    pub fn new(machine: &Machine, time_step: f64, substeps: usize, method: Method) -> Self {
        let (description, theta) = (machine.build(), machine.values.clone());
        let stepping = Stepping::new(time_step, substeps, method).unwrap();
        Self { description, theta, stepping, sensitivities: Vec::new(), hold: Hold::ZeroOrder }
    }

    pub fn setting(&self) -> Setting<'_> {
        Setting {
            description: &self.description,
            theta: &self.theta,
            stepping: self.stepping,
            sensitivities: &self.sensitivities,
            interrupt: ALWAYS,
        }
    }

    fn table<'a>(&self, name: &str, numbers: &'a [f64]) -> Table<'a> {
        let columns = self.description.n_inputs();
        Table::new(name, numbers, numbers.len() / columns.max(1), columns).unwrap()
    }

    fn inputs<'a>(&self, numbers: &'a [f64]) -> Inputs<'a> {
        Inputs { table: self.table("inputs", numbers), hold: self.hold }
    }

    pub fn try_free(&self, initial: &[f64], inputs: &[f64]) -> vpm_core::Result<Run> {
        free_run(self.setting(), initial, self.inputs(inputs))
    }

    pub fn free(&self, initial: &[f64], inputs: &[f64]) -> Run {
        self.try_free(initial, inputs).unwrap()
    }

    pub fn closed(&self, initial: &[f64], references: &[f64], disturbances: &[f64]) -> Run {
        let (references, disturbances) =
            (self.table("references", references), self.table("disturbances", disturbances));
        closed_loop(self.setting(), initial, references, disturbances).unwrap()
    }

    pub fn restart(&self, states: &[f64], starts: &[usize], horizon: usize, inputs: &[f64]) -> Run {
        let states = Table::new("initial_states", states, starts.len(), self.description.n_states()).unwrap();
        restarts(self.setting(), states, starts, horizon, self.inputs(inputs)).unwrap()
    }

    /// One output channel over time.
    pub fn channel(&self, run: &Run, column: usize) -> Vec<f64> {
        run.outputs.iter().skip(column).step_by(self.description.n_outputs()).copied().collect()
    }

    /// One state over time.
    pub fn state(&self, run: &Run, place: usize) -> Vec<f64> {
        run.states.iter().skip(place).step_by(self.description.n_states()).copied().collect()
    }
}

/// Asserts that two numbers agree within a tolerance, and says which did not.
#[track_caller]
pub fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "found {found}, expected {expected} within {tolerance}");
}

/// How far two points are apart.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
