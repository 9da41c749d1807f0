//! Ball joints of a machine: which of them turn freely when it is stepped, and the functions of the machine in which they do.

use std::sync::Arc;

use super::Description;
use crate::actuator::Target;
use crate::ball::Ball;
use crate::controller::ControlLaw;
use crate::error::{Error, Result};
use crate::model::Omissions;
use crate::mount::Mount;
use crate::scalar::Scalar;
use crate::sensor::Sensor;
use crate::system::{Build, Dynamics, Functions, Kind, Placed, Places, Recorder, Recording};

/// The machine with its free ball joints turning from orientations that stand among its inputs.
#[derive(Clone, Debug)]
struct Turned(Description);

impl Description {
    /// The functions of the machine whose free ball joints turn, recorded as they are asked for.
    pub(super) fn functions_of_turned(&self) -> Arc<Functions> {
        self.turned.functions(|| Box::new(Turned(self.clone())))
    }

    /// A function of the machine whose free ball joints turn from orientations that follow its inputs, with the parameters at the places
    /// `free` as inputs. At orientations of no rotation it is that of the machine in its angles.
    pub(crate) fn recorded_turned(&self, given: (&[f64], &[usize]), kind: &Kind) -> Result<(Places, Recording)> {
        let places = Places { parameters: given.1.len(), ..self.places_of_turned() };
        Recording::new(&Turned(self.clone()), places, given, kind).map(|recording| (places, recording))
    }

    /// What keeps a ball joint from turning freely: whatever needs its angles for coordinates.
    pub(crate) fn hindrance(&self, ball: &Ball) -> Option<String> {
        let Some(angles) = ball.places().filter(|&angles| self.is_chain(angles)) else {
            return Some("an effect divides one of them".to_owned());
        };
        let own = |joint: usize| angles.contains(&joint);
        let coordinate = |joint: usize| &self.bodies[joint].joint.name;
        let effect = self.effects.iter().find_map(|effect| {
            let sits = effect.seat().into_iter().flat_map(|seat| seat.joints());
            let turns = effect.rotor().into_iter();
            sits.chain(turns).find(|&joint| own(joint))
        });
        if let Some(joint) = effect {
            return Some(format!("an effect acts on `{}`", coordinate(joint)));
        }
        if let Some(joint) = angles.into_iter().find(|&joint| self.bodies[joint].rotor_inertia.is_some()) {
            return Some(format!("a rotor turns with `{}`", coordinate(joint)));
        }
        let acts = |on: Target| matches!(on, Target::Joint(joint) if own(joint));
        if let Some(actuator) = self.actuators.iter().find(|actuator| acts(actuator.on)) {
            return Some(format!("actuator `{}` acts on one of them", actuator.name));
        }
        let drives = self.transmissions.iter().find(|shaft| shaft.ratios.iter().any(|ratio| own(ratio.joint)));
        if let Some(shaft) = drives {
            return Some(format!("transmission `{}` turns one of them", shaft.name));
        }
        let inverts = |law: &ControlLaw<usize>| matches!(law, ControlLaw::ComputedTorque(_) | ControlLaw::ForceLoop(_));
        if let Some(controller) = self.controllers.iter().find(|controller| inverts(&controller.law)) {
            return Some(format!("controller `{}` works with all coordinates", controller.name));
        }
        (self.drop_velocity_terms || self.omissions != Omissions::default())
            .then(|| "the model leaves out terms that depend on the choice of coordinates".to_owned())
    }

    /// Whether the angles of a ball joint follow each other with nothing between them.
    fn is_chain(&self, [first, second, third]: [usize; 3]) -> bool {
        [(first, second), (second, third)].into_iter().all(|(before, after)| {
            let carried = self.bodies.iter().filter(|body| body.on == Mount::Body(before)).count();
            self.bodies[after].on == Mount::Body(before) && carried == 1 && self.bodies[before].inertia.is_none()
        })
    }

    /// Ball joints that turn freely, in their order.
    pub(super) fn free_balls(&self) -> impl Iterator<Item = &Ball> {
        self.balls.iter().filter(|ball| self.hindrance(ball).is_none())
    }

    /// Lets the free ball joints turn freely in the dynamics of this machine.
    pub(super) fn turn_freely<S: Scalar>(&self, dynamics: &mut Dynamics<S>) {
        self.free_balls().for_each(|ball| dynamics.model.turn_freely(ball.angles[0][0]));
    }

    /// Places of the inputs of functions with ball joints: orientations follow the inputs.
    fn places_of_turned(&self) -> Places {
        Places { inputs: self.n_inputs() + 4 * self.free_balls().count(), ..self.places() }
    }
}

impl Recorder for Turned {
    fn record(&self, kind: &Kind, theta: &[f64]) -> Result<Placed> {
        Placed::new(self, self.0.places_of_turned(), theta, kind)
    }
}

impl Build for &Turned {
    type Error = Error;

    fn dynamics<S: Scalar>(&self, theta: &[S]) -> Result<Dynamics<S>> {
        let mut dynamics = Build::dynamics(&&self.0, theta)?;
        self.0.turn_freely(&mut dynamics);
        Ok(dynamics)
    }

    fn sensors<S: Scalar>(&self, theta: &[S]) -> Vec<Sensor<S>> {
        self.0.sensors(theta)
    }
}
