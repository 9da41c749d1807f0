//! Flexible trees for tests, part by part.

use serde_json::{Value, json};
use vpm_core::beam::{BeamEntry, Component, DampingEntry, Level, Material, SectionEntry, Shape};
use vpm_core::body::{Body, Inertia, PointMass, Site, Weld};
use vpm_core::description::Description;
use vpm_core::joint::{Joint, JointKind};
use vpm_core::line::{Line, LineEnd, LinePart};
use vpm_core::model::{Model, Parts};
use vpm_core::mount::{Marker, Mount};
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Vector3};
use vpm_core::{Error, Result, Scalar};

/// No rotation.
pub const UPRIGHT: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// The same parts over another number type.
pub fn lift<S: Scalar>(parts: &Parts<f64>) -> Parts<S> {
    let number = &mut |&value: &f64| S::from_f64(value);
    Parts {
        gravity: parts.gravity.map(S::from_f64),
        bodies: parts.bodies.iter().map(|body| body.map(number)).collect(),
        welds: parts.welds.iter().map(|weld| weld.map(number)).collect(),
        beams: parts.beams.iter().map(|beam| beam.map(number)).collect(),
        point_masses: parts
            .point_masses
            .iter()
            .map(|p| PointMass { on: p.on, mass: S::from_f64(p.mass), position: p.position.map(S::from_f64) })
            .collect(),
        lines: parts.lines.iter().map(|line| line.map(number)).collect(),
        transmissions: parts.transmissions.iter().map(|shaft| shaft.map(number)).collect(),
        markers: parts.markers.clone(),
        imus: parts.imus.clone(),
        gauges: parts.gauges.clone(),
        attachments: parts.attachments.clone(),
        drop_velocity_terms: parts.drop_velocity_terms,
        omissions: parts.omissions.clone(),
        closed: parts.closed,
    }
}

/// The model of some parts.
pub fn model<S: Scalar>(parts: &Parts<f64>) -> Result<Model<S>> {
    Model::assemble(lift(parts))
}

/// Nine numbers of a random rotation.
pub fn turn(random: &mut Random) -> [f64; 9] {
    let turn = Matrix3::rotation(Vector3::from(random.direction()), 3.0 * random.symmetric());
    turn.columns.map(Vector3::to_array).as_flattened().try_into().unwrap_or(UPRIGHT)
}

/// A joint in a random place.
pub fn joint(random: &mut Random, name: &str, kind: JointKind) -> Joint {
    let (axis, translation, rotation) = (random.direction(), random.vector(0.3), turn(random));
    Joint { name: name.to_owned(), kind, axis, translation, rotation }
}

/// An inertia that a real body can have.
pub fn inertia(random: &mut Random) -> Inertia<f64> {
    let [a, b, c] = [0; 3].map(|_| 0.01 + 0.02 * random.unit());
    let mut off = || 0.002 * random.symmetric();
    let moments = [b + c, a + c, a + b, off(), off(), off()];
    Inertia { mass: 0.5 + random.unit(), center_of_mass: random.vector(0.1), moments }
}

/// A body on a random joint.
pub fn body(random: &mut Random, name: &str, on: Mount, kind: JointKind) -> Body<f64> {
    let joint = joint(random, &format!("{name}.joint"), kind);
    Body { name: name.to_owned(), on, joint, inertia: Some(inertia(random)), rotor_inertia: None }
}

/// A soft beam in a random place: it bends visibly at coordinates of the order of one tenth.
pub fn beam(random: &mut Random, name: &str, on: Mount, level: Level, deforms: &[Component]) -> BeamEntry<f64> {
    BeamEntry {
        name: name.to_owned(),
        on,
        translation: random.vector(0.1),
        rotation: turn(random),
        length: 0.5 + 0.3 * random.unit(),
        level,
        deforms: deforms.to_vec(),
        material: Some(Material { young: 2e9, poisson: 0.3, density: 1500.0 }),
        sections: vec![SectionEntry::new(0.0, Shape::Rectangle { width: 0.03, height: 0.01 })],
        rest: Vec::new(),
        damping: DampingEntry { stiffness: Some(1e-3), mass: Some(0.2), ratios: Vec::new() },
        reduced: None,
    }
}

/// A section of a beam at a share of its length.
pub fn section(parts: &Parts<f64>, beam: usize, share: f64) -> Mount {
    Mount::Section { beam, at: share * parts.beams[beam].length }
}

/// Bodies and beams of every kind on each other, not in their order, with welds, payloads, carriers and a line that weighs something.
pub fn everything(seed: u64) -> Parts<f64> {
    use Component::{BendingX, BendingY, Extension, Torsion};
    let random = &mut Random::new(seed);
    let mut parts = Parts { gravity: [0.4, -9.0, 2.0], ..Parts::default() };
    parts.beams.push(beam(random, "upper", Mount::Body(1), Level::Strain(1), &[BendingX, BendingY, Torsion]));
    parts.beams.push(beam(random, "lower", Mount::Body(0), Level::Deflection(3), &[BendingX, Extension]));
    parts.beams.push(beam(random, "stiff", Mount::World, Level::Rigid, &[BendingX]));
    parts.beams[2].on = section(&parts, 0, 0.25);
    let (tip, middle, of_rigid) = (section(&parts, 0, 1.0), section(&parts, 1, 0.6), section(&parts, 2, 0.7));
    parts.bodies = vec![
        body(random, "elbow", tip, JointKind::Revolute),
        body(random, "shoulder", Mount::World, JointKind::Revolute),
        body(random, "slider", middle, JointKind::Prismatic),
        body(random, "carrier", of_rigid, JointKind::Helical { pitch: 0.05 }),
        body(random, "wrist", Mount::Body(3), JointKind::Revolute),
    ];
    parts.bodies[3].inertia = None;
    for (name, on) in [("motor", section(&parts, 0, 0.5)), ("hub", Mount::Body(4)), ("end", section(&parts, 1, 1.0))] {
        let (translation, rotation) = (random.vector(0.1), turn(random));
        parts.welds.push(Weld { name: name.to_owned(), on, translation, rotation, inertia: inertia(random) });
    }
    for on in [Site::Tip(1), Site::Tip(2), Site::Body(0), Site::Weld(1)] {
        parts.point_masses.push(PointMass { on, mass: 0.2 + random.unit(), position: random.vector(0.1) });
    }
    let part = |mass| Some(LinePart { mass, center: 0.1, inertia: 0.01 * mass });
    let end = |random: &mut Random, on| LineEnd { on, point: random.vector(0.3) };
    let (from, to) = (end(random, Mount::World), end(random, section(&parts, 1, 0.4)));
    parts.lines.push(Line { name: "ground".to_owned(), from, to, barrel: part(0.4), rod: part(0.3) });
    let (from, to) = (end(random, Mount::Body(4)), end(random, Mount::Body(2)));
    parts.lines.push(Line { name: "strut".to_owned(), from, to, barrel: None, rod: part(0.5) });
    for (name, on) in [("tip", section(&parts, 1, 1.0)), ("hand", Mount::Body(4)), ("root", section(&parts, 2, 0.1))] {
        let (translation, rotation) = (random.vector(0.2), turn(random));
        parts.markers.push(Marker { name: name.to_owned(), on, translation, rotation });
    }
    parts
}

/// The description of some parts, every number a parameter of its own; `change` may add to it.
#[cfg(test)]
pub fn description(parts: &Parts<f64>, change: impl FnOnce(&mut Value)) -> Description {
    try_description(parts, change).unwrap()
}

/// The same, with what is wrong in the parts.
pub fn try_description(parts: &Parts<f64>, change: impl FnOnce(&mut Value)) -> Result<Description> {
    let mut numbers = Numbers::default();
    let bodies: Vec<_> = parts.bodies.iter().map(|body| json!(body.map(&mut numbers.of(&body.name)))).collect();
    let welds: Vec<_> = parts.welds.iter().map(|weld| json!(weld.map(&mut numbers.of(&weld.name)))).collect();
    let lines: Vec<_> = parts.lines.iter().map(|line| json!(line.map(&mut numbers.of(&line.name)))).collect();
    let mut beams = Vec::new();
    for beam in &parts.beams {
        let indexed = BeamEntry::serialize(&beam.map(&mut numbers.of(&beam.name)), serde_json::value::Serializer);
        beams.push(indexed.map_err(|error| Error::Description { message: error.to_string() })?);
    }
    let mut effects = Vec::new();
    for point in &parts.point_masses {
        let mut number = numbers.of("payload");
        let (mass, position) = (number(&point.mass), point.position.each_ref().map(&mut number));
        let (site, place) = match point.on {
            Site::Body(body) => ("body", body),
            Site::Weld(weld) => ("weld", weld),
            Site::Tip(beam) => ("beam", beam),
        };
        effects.push(json!({"type": "payload", site: place, "mass": mass, "position": position}));
    }
    let mut content = json!({"gravity": parts.gravity, "bodies": bodies, "welds": welds, "beams": beams, "lines": lines,
        "markers": parts.markers, "imus": parts.imus, "gauges": parts.gauges, "effects": effects,
        "parameters": numbers.values, "parameter_names": numbers.names});
    change(&mut content);
    Description::from_json(&content.to_string())
}

/// Adds a parameter to a description and returns its place.
#[cfg(test)]
pub fn parameter(content: &mut Value, name: &str, value: f64) -> usize {
    content["parameter_names"].as_array_mut().unwrap().push(json!(name));
    let values = content["parameters"].as_array_mut().unwrap();
    values.push(json!(value));
    values.len() - 1
}

/// Adds a part to a list of a description.
#[cfg(test)]
pub fn push(content: &mut Value, list: &str, part: Value) {
    if content[list].is_null() {
        content[list] = json!([]);
    }
    content[list].as_array_mut().unwrap().push(part);
}

#[derive(Default)]
struct Numbers {
    values: Vec<f64>,
    names: Vec<String>,
}

impl Numbers {
    /// Makes every number of the part `name` a parameter.
    fn of<'a>(&'a mut self, name: &str) -> impl FnMut(&f64) -> usize + use<'a> {
        let name = name.to_owned();
        move |&value| {
            self.names.push(format!("{name}.{}", self.values.len()));
            self.values.push(value);
            self.values.len() - 1
        }
    }
}
