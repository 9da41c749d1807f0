//! A machine as data: bodies, effects, actuators, sensors and controllers whose numbers are places in one parameter vector.
//!
//! The same description is built over any number type: values, or values with exact derivatives with respect to the parameters.

mod balls;
mod check;
mod connections;
mod controllers;
mod drives;
mod entry;
mod sampled;
mod stepping;
mod tree_effects;

use std::sync::Arc;

use serde::Deserialize;

pub use connections::LoadCell;
pub(crate) use drives::piston_outside;
pub use entry::{ControllerEntry, EffectEntry};
pub(crate) use sampled::{maxwell_of, narx_of};
pub use tree_effects::TreeEffect;

use crate::actuator::hydraulic::Supply;
use crate::actuator::{Actuator, Drive, Target};
use crate::ball::Ball;
use crate::beam::BeamEntry;
use crate::body::{Body, PointMass, Weld};
use crate::bushing::BushingEntry;
use crate::closure::LoopEntry;
use crate::contact::ContactEntry;
use crate::data::Data;
use crate::dynamics::check_regular;
use crate::effect::{JointEffect, MemoryEffect, Seat};
use crate::error::{Error, Result};
use crate::line::Line;
use crate::model::{Model, Omissions, Parts};
use crate::mount::{Gauge, Marker};
use crate::scalar::Scalar;
use crate::sensor::{Layout, Sensor};
use crate::system::{
    Build, Cache, Dynamics, Engine, Functions, Kind, Machine, Memories, Placed, Places, Recorder, System,
};
use crate::transmission::Transmission;

/// The parts of a machine. Every `usize` in a law is a place in [`Description::parameters`]; all numbers are SI.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Gravity in the world frame, m/s^2.
    pub gravity: [f64; 3],
    /// Whether products of rates are left out of the dynamics: Coriolis, centrifugal and gyroscopic terms.
    #[serde(default)]
    pub drop_velocity_terms: bool,
    /// What else the dynamics leave out, part by part.
    #[serde(default)]
    pub omissions: Omissions,
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
    /// Frames of inertial measurement units.
    #[serde(default)]
    pub imus: Vec<Marker>,
    /// Straight connections.
    #[serde(default)]
    pub lines: Vec<Line<usize>>,
    /// Transmissions. Where something acts along a line, or reads one, they are numbered after the lines.
    #[serde(default)]
    pub transmissions: Vec<Transmission<usize>>,
    /// Physical effects.
    #[serde(default)]
    pub effects: Vec<EffectEntry>,
    /// Hydraulic supplies.
    #[serde(default)]
    pub supplies: Vec<Supply<usize>>,
    /// Actuators.
    #[serde(default)]
    pub actuators: Vec<Actuator<usize>>,
    /// Sensors.
    #[serde(default)]
    pub sensors: Vec<Sensor<usize>>,
    /// Controllers.
    #[serde(default)]
    pub controllers: Vec<ControllerEntry>,
    /// Contacts of points with planes.
    #[serde(default)]
    pub contacts: Vec<ContactEntry<usize>>,
    /// Elastic connections of two frames.
    #[serde(default)]
    pub bushings: Vec<BushingEntry<usize>>,
    /// Load cells.
    #[serde(default)]
    pub load_cells: Vec<LoadCell>,
    /// Joints of three angles.
    #[serde(default)]
    pub balls: Vec<Ball>,
    /// Closed loops.
    #[serde(default)]
    pub loops: Vec<LoopEntry>,
    /// Number of elastic coordinates of each beam, known once the beams are built.
    #[serde(skip)]
    elastic: Vec<usize>,
    /// What of the machine was recorded.
    #[serde(skip)]
    recorded: Cache,
    /// The same of the machine whose ball joints turn freely.
    #[serde(skip)]
    turned: Cache,
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
        description.connections(&description.parameters, &model)?;
        description.closures(&model)?;
        controllers::check_rigid(&description)?;
        check_regular(&model, &mut Data::new(&model))?;
        Ok(description)
    }

    /// Number of joints in a description.
    pub fn n_joints(&self) -> usize {
        self.bodies.len()
    }

    /// Number of coordinates in a description: joints lead, then the elastic ones, beam by beam.
    pub fn n_coordinates(&self) -> usize {
        self.n_joints() + self.n_elastic()
    }

    /// Number of elastic coordinates in a description.
    pub fn n_elastic(&self) -> usize {
        self.elastic.iter().sum()
    }

    /// Number of elastic coordinates of each beam in a description.
    pub fn elastic(&self) -> &[usize] {
        &self.elastic
    }

    /// Number of beams in a description.
    pub fn n_beams(&self) -> usize {
        self.beams.len()
    }

    /// Number of lines and transmissions in a description.
    pub fn n_wires(&self) -> usize {
        self.lines.len() + self.transmissions.len()
    }

    /// Number of actuators in a description.
    pub fn n_actuators(&self) -> usize {
        self.actuators.len()
    }

    /// Number of inputs in a description: a command for each actuator, a pressure for each logged supply.
    pub fn n_inputs(&self) -> usize {
        self.actuators.len() + self.supplies.iter().filter(|supply| supply.is_logged()).count()
    }

    /// Length of the state in a description. It has coordinates, rates, the states of each actuator (lag, then drive),
    /// states of each supply, and memories of hystereses.
    pub fn n_states(&self) -> usize {
        let of_supplies: usize = self.supplies.iter().map(|supply| supply.states().count()).sum();
        let drives = self.actuators.iter().map(Actuator::n_states).sum::<usize>();
        2 * self.n_coordinates() + drives + of_supplies + self.remembering().count()
    }

    /// Seats of the described effects that remember, one for each.
    pub(crate) fn remembering(&self) -> impl Iterator<Item = &Seat<usize>> {
        self.effects.iter().filter_map(|entry| match entry {
            EffectEntry::Memory { seat, .. } => Some(seat),
            EffectEntry::Joint { .. } | EffectEntry::Payload { .. } | EffectEntry::Tree(_) => None,
        })
    }

    /// Number of output channels in a description.
    pub fn n_outputs(&self) -> usize {
        self.layout().count()
    }

    /// Layout of a description's outputs.
    pub fn layout(&self) -> Layout {
        let count =
            |kind: fn(&Drive<usize>) -> bool| self.actuators.iter().filter(|actuator| kind(&actuator.drive)).count();
        Layout {
            joints: self.bodies.len(),
            actuators: self.actuators.len(),
            lines: self.n_wires(),
            gauges: self.gauges.len(),
            markers: self.markers.len(),
            hydraulics: count(|drive| matches!(drive, Drive::Hydraulic(_))),
            dc_motors: count(|drive| matches!(drive, Drive::DcMotor(_))),
            supplies: self.supplies.len(),
            contacts: self.contacts.len(),
            bushings: self.bushings.len(),
            load_cells: self.load_cells.len(),
            balls: self.balls.len(),
            loops: self.loops.len(),
            imus: self.imus.len(),
        }
    }

    /// Number of parameters of a description.
    pub fn n_parameters(&self) -> usize {
        self.parameters.len()
    }

    /// Checks whether the described machine exists with these parameters. They have the right length and are finite,
    /// every law is defined, inertia physical, and no joint without inertia.
    pub fn check_values(&self, theta: &[f64]) -> Result<()> {
        check::parameters(self, theta)?;
        let model = self.model(theta)?;
        self.connections(theta, &model)?;
        check_regular(&model, &mut Data::new(&model))
    }

    /// The machine with the parameters `theta`, after [`Description::check_values`].
    pub fn system<S: Scalar>(&self, theta: &[S]) -> Result<System<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.check_values(&values)?;
        Ok(System::new(self.machine(theta, &values)?)?.with_balls(self.balls.iter().map(|ball| (ball, false))))
    }

    /// Described machine for a [`System`], with the checked parameters `theta`, whose values are `values`.
    pub(crate) fn machine<'a, S: Scalar>(&self, theta: &'a [S], values: &[f64]) -> Result<Machine<'a, S>> {
        let supplies = self.supplies.iter().filter(|supply| supply.is_logged());
        let commands = self.actuators.iter().map(|_| S::zero());
        Ok(Machine {
            dynamics: Build::dynamics(&self, values)?,
            functions: self.functions(),
            theta,
            inputs: commands.chain(supplies.map(|supply| theta[supply.pressure])).collect(),
            actuators: self.actuators_of(theta),
            memories: self.memories_of(theta),
        })
    }

    /// Functions of the described machine, recorded as they are asked for.
    pub(crate) fn functions(&self) -> Arc<Functions> {
        self.recorded.functions(|| Box::new(self.clone()))
    }

    /// Engine of the described machine for the function `kind` of many motions, with the parameters `theta`.
    ///
    /// # Errors
    /// The parts cannot be built, or a law decides by the value of a state.
    pub(crate) fn engine(&self, theta: &[f64], kind: &Kind, motions: usize) -> Result<Engine> {
        let function = || self.functions().function(kind, theta);
        Engine::of_values((kind, theta, motions), function, || Build::dynamics(&self, theta))
    }

    /// Program of a described machine's function, built for the checked parameters `theta`.
    ///
    /// # Errors
    /// [`Error::Unrecorded`] where a law decides by the value of a state.
    pub fn program(&self, kind: &Kind, theta: &[f64]) -> Result<Placed> {
        Placed::new(self, self.places(), theta, kind)
    }

    /// Places of the inputs of a described machine's functions.
    pub(crate) fn places(&self) -> Places {
        Places {
            coordinates: self.n_coordinates(),
            states: self.n_states(),
            inputs: self.n_inputs(),
            parameters: self.n_parameters(),
        }
    }

    /// Sensors of a description over the number type of `theta`.
    pub(crate) fn sensors<S: Scalar>(&self, theta: &[S]) -> Vec<Sensor<S>> {
        self.sensors.iter().map(|sensor| sensor.map(&mut |&index| theta[index])).collect()
    }

    /// Actuators of a description over the number type of `theta`.
    pub(crate) fn actuators_of<S: Scalar>(&self, theta: &[S]) -> Vec<Actuator<S>> {
        self.actuators.iter().map(|actuator| actuator.map(&mut |&index| theta[index])).collect()
    }

    /// Memories of a description's effects, relaxed, over the number type of `theta`.
    pub(crate) fn memories_of<S: Scalar>(&self, theta: &[S]) -> Memories<S> {
        Memories::new(self.effects.iter().filter_map(|entry| entry.with_memory(theta)).collect())
    }

    fn model<S: Scalar>(&self, theta: &[S]) -> Result<Model<S>> {
        let number = &mut |&index: &usize| theta[index];
        let mut bodies: Vec<_> = self.bodies.iter().map(|body| body.map(number)).collect();
        let mut transmissions: Vec<_> = self.transmissions.iter().map(|shaft| shaft.map(number)).collect();
        for actuator in &self.actuators {
            if let Drive::DcMotor(motor) = &actuator.drive {
                let rotor = match actuator.on {
                    Target::Joint(joint) => &mut bodies[joint].rotor_inertia,
                    Target::Line(line) => &mut transmissions[line - self.lines.len()].inertia,
                };
                let own = motor.map(number).reflected_inertia();
                // A motor without a rotor of its own leaves a shaft without one, which is cheaper.
                if motor.rotor_inertia.is_some() || matches!(actuator.on, Target::Joint(_)) {
                    *rotor = Some(rotor.map_or(own, |rotor| rotor + own));
                }
            }
        }
        let mut parts = Parts {
            gravity: self.gravity.map(S::from_f64),
            bodies,
            welds: self.welds.iter().map(|weld| weld.map(number)).collect(),
            beams: self.beams.iter().map(|beam| beam.map(number)).collect(),
            point_masses: self.effects.iter().filter_map(|entry| entry.payload(theta)).collect(),
            lines: self.lines.iter().map(|line| line.map(number)).collect(),
            transmissions,
            markers: self.markers.clone(),
            imus: self.imus.clone(),
            gauges: self.gauges.clone(),
            attachments: self.attachments(),
            closed: !self.loops.is_empty(),
            drop_velocity_terms: self.drop_velocity_terms,
            omissions: self.omissions.clone(),
        };
        for effect in &self.effects {
            if let EffectEntry::Tree(law) = effect {
                law.map(number).apply(&mut parts)?;
            }
        }
        Model::assemble(parts)
    }
}

impl Recorder for Description {
    fn record(&self, kind: &Kind, theta: &[f64]) -> Result<Placed> {
        self.program(kind, theta)
    }
}

impl Build for &Description {
    type Error = Error;

    fn dynamics<S: Scalar>(&self, theta: &[S]) -> Result<Dynamics<S>> {
        let effects = self.effects.iter().filter_map(|entry| entry.on_joint(theta)).collect();
        let actuators = self.actuators_of(theta);
        let supplies = self.supplies.iter().map(|supply| supply.map(&mut |&index| theta[index])).collect();
        let model = self.model(theta)?;
        let (connections, loops) = (self.connections(theta, &model)?, self.closures(&model)?);
        let machine = Dynamics::new(model, effects, actuators, supplies).connected(connections).closed_by(loops);
        Ok(machine.remembering(self.memories_of(theta)).with_balls(self.balls.clone()))
    }

    fn sensors<S: Scalar>(&self, theta: &[S]) -> Vec<Sensor<S>> {
        Description::sensors(self, theta)
    }
}

impl EffectEntry {
    fn payload<S: Scalar>(&self, theta: &[S]) -> Option<PointMass<S>> {
        match self {
            Self::Payload { on, law } => {
                let payload = law.map(&mut |&index| theta[index]);
                Some(PointMass { on: *on, mass: payload.mass, position: payload.position })
            }
            Self::Joint { .. } | Self::Memory { .. } | Self::Tree(_) => None,
        }
    }

    /// Seat of a described effect's effort on joints; nowhere for what belongs to the tree.
    pub(crate) fn seat(&self) -> Option<&Seat<usize>> {
        match self {
            Self::Joint { seat, .. } | Self::Memory { seat, .. } => Some(seat),
            Self::Payload { .. } | Self::Tree(_) => None,
        }
    }

    /// Joint with which the rotor of a described effect turns, if it adds one.
    fn rotor(&self) -> Option<usize> {
        match self {
            Self::Tree(TreeEffect::RotorInertia { joint, .. }) => Some(*joint),
            _ => None,
        }
    }

    pub(crate) fn on_joint<S: Scalar>(&self, theta: &[S]) -> Option<(Seat<S>, JointEffect<S>)> {
        let number = &mut |&index: &usize| theta[index];
        match self {
            Self::Joint { seat, law } => Some((seat.map(number), law.map(number))),
            Self::Payload { .. } | Self::Memory { .. } | Self::Tree(_) => None,
        }
    }

    pub(crate) fn with_memory<S: Scalar>(&self, theta: &[S]) -> Option<(Seat<S>, MemoryEffect<S>)> {
        let number = &mut |&index: &usize| theta[index];
        match self {
            Self::Memory { seat, law } => Some((seat.map(number), law.map(number))),
            Self::Payload { .. } | Self::Joint { .. } | Self::Tree(_) => None,
        }
    }
}
