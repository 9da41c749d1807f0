//! A machine as data: bodies, effects, actuators, sensors and controllers whose numbers are places in one parameter vector.
//!
//! The same description is built over any number type: values, or values with exact derivatives with respect to the parameters.

mod check;
mod controllers;
mod entry;

use serde::Deserialize;

pub use entry::{ControllerEntry, EffectEntry};

use crate::actuator::Actuator;
use crate::beam::BeamEntry;
use crate::body::{Body, PointMass, Weld};
use crate::data::Data;
use crate::dynamics::check_regular;
use crate::error::{Error, Result};
use crate::line::Line;
use crate::model::{Model, Parts};
use crate::mount::{Gauge, Marker};
use crate::scalar::Scalar;
use crate::sensor::{Layout, Sensor};
use crate::system::{Build, Dynamics, System};

/// The parts of a machine. Every `usize` in a law is a place in [`Description::parameters`]; all numbers are SI.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Gravity in the world frame, m/s^2.
    pub gravity: [f64; 3],
    /// Value of each parameter.
    pub parameters: Vec<f64>,
    /// Dotted name of each parameter, for messages.
    pub parameter_names: Vec<String>,
    /// Bodies with their joints. A body, a beam or a part on them may hang on a later one, as long as the whole is a tree.
    pub bodies: Vec<Body<usize>>,
    /// Bodies without joints.
    #[serde(default)]
    pub welds: Vec<Weld<usize>>,
    /// Beams.
    #[serde(default)]
    pub beams: Vec<BeamEntry<usize>>,
    /// Strain gauges.
    #[serde(default)]
    pub gauges: Vec<Gauge>,
    /// Frames to watch.
    #[serde(default)]
    pub markers: Vec<Marker>,
    /// Straight connections.
    #[serde(default)]
    pub lines: Vec<Line<usize>>,
    /// Physical effects.
    #[serde(default)]
    pub effects: Vec<EffectEntry>,
    /// Actuators.
    #[serde(default)]
    pub actuators: Vec<Actuator<usize>>,
    /// Sensors.
    #[serde(default)]
    pub sensors: Vec<Sensor<usize>>,
    /// Controllers.
    #[serde(default)]
    pub controllers: Vec<ControllerEntry>,
    /// Number of elastic coordinates of each beam, known once the beams are built.
    #[serde(skip)]
    elastic: Vec<usize>,
}

impl Description {
    /// Reads a description from JSON and checks that everything it refers to is there and that its values are physical.
    pub fn from_json(text: &str) -> Result<Self> {
        let mut description: Self =
            serde_json::from_str(text).map_err(|error| Error::Description { message: error.to_string() })?;
        check::references(&description)?;
        check::parameters(&description, &description.parameters)?;
        let model = description.model(&description.parameters)?;
        description.elastic = (0..model.n_beams()).filter_map(|k| model.beam(k)).map(|(beam, _)| beam.len()).collect();
        controllers::check_rigid(&description)?;
        check_regular(&model, &mut Data::new(&model))?;
        Ok(description)
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.bodies.len()
    }

    /// Number of generalised coordinates: those of the joints lead, then the elastic ones, beam by beam.
    pub fn n_coordinates(&self) -> usize {
        self.n_joints() + self.n_elastic()
    }

    /// Number of elastic coordinates.
    pub fn n_elastic(&self) -> usize {
        self.elastic.iter().sum()
    }

    /// Number of elastic coordinates of each beam.
    pub fn elastic(&self) -> &[usize] {
        &self.elastic
    }

    /// Number of beams.
    pub fn n_beams(&self) -> usize {
        self.beams.len()
    }

    /// Number of actuators, which is the number of inputs.
    pub fn n_actuators(&self) -> usize {
        self.actuators.len()
    }

    /// Length of the state: coordinates, rates, one state per lag in the order of the actuators.
    pub fn n_states(&self) -> usize {
        2 * self.n_coordinates() + self.actuators.iter().filter(|actuator| actuator.lag.is_some()).count()
    }

    /// Number of output channels.
    pub fn n_outputs(&self) -> usize {
        self.layout().count()
    }

    /// Where the outputs are.
    pub fn layout(&self) -> Layout {
        Layout {
            joints: self.bodies.len(),
            actuators: self.actuators.len(),
            lines: self.lines.len(),
            gauges: self.gauges.len(),
            markers: self.markers.len(),
        }
    }

    /// Number of parameters.
    pub fn n_parameters(&self) -> usize {
        self.parameters.len()
    }

    /// Whether the machine exists with these parameters: right length, finite, every law defined, inertia physical, no joint without
    /// inertia.
    pub fn check_values(&self, theta: &[f64]) -> Result<()> {
        check::parameters(self, theta)?;
        let model = self.model(theta)?;
        check_regular(&model, &mut Data::new(&model))
    }

    /// The machine with the parameters `theta`, after [`Description::check_values`].
    pub fn system<S: Scalar>(&self, theta: &[S]) -> Result<System<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::re).collect();
        self.check_values(&values)?;
        System::new(theta, self)
    }

    /// The sensors over the number type of `theta`.
    pub(crate) fn sensors<S: Scalar>(&self, theta: &[S]) -> Vec<Sensor<S>> {
        self.sensors.iter().map(|sensor| sensor.map(&mut |&index| theta[index])).collect()
    }

    fn model<S: Scalar>(&self, theta: &[S]) -> Result<Model<S>> {
        let number = &mut |&index: &usize| theta[index];
        Model::assemble(Parts {
            gravity: self.gravity,
            bodies: self.bodies.iter().map(|body| body.map(number)).collect(),
            welds: self.welds.iter().map(|weld| weld.map(number)).collect(),
            beams: self.beams.iter().map(|beam| beam.map(number)).collect(),
            point_masses: self.effects.iter().filter_map(|entry| entry.payload(theta)).collect(),
            lines: self.lines.iter().map(|line| line.map(number)).collect(),
            markers: self.markers.clone(),
            gauges: self.gauges.clone(),
        })
    }
}

impl Build for &Description {
    type Error = Error;

    fn dynamics<S: Scalar>(&self, theta: &[S]) -> Result<Dynamics<S>> {
        let effects = self.effects.iter().filter_map(|entry| entry.on_joint(theta)).collect();
        let actuators = self.actuators.iter().map(|actuator| actuator.map(&mut |&index| theta[index])).collect();
        Ok(Dynamics::new(self.model(theta)?, effects, actuators))
    }
}

impl EffectEntry {
    fn payload<S: Scalar>(&self, theta: &[S]) -> Option<PointMass<S>> {
        match self {
            Self::Payload { on, law } => {
                let payload = law.map(&mut |&index| theta[index]);
                Some(PointMass { on: *on, mass: payload.mass, position: payload.position })
            }
            Self::Joint { .. } => None,
        }
    }

    fn on_joint<S: Scalar>(&self, theta: &[S]) -> Option<(usize, crate::effect::JointEffect<S>)> {
        match self {
            Self::Joint { joint, law } => Some((*joint, law.map(&mut |&index| theta[index]))),
            Self::Payload { .. } => None,
        }
    }
}
