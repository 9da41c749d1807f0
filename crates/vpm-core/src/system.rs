//! A whole machine as one ordinary differential equation: tree, effects and actuators.

mod additive;
mod answers;
mod call_count;
mod connections;
mod constant;
mod drives;
mod engine;
mod following;
mod functions;
mod guided;
mod loops;
mod memory;
mod observe;
mod ode;
mod quintic;
mod rate_slopes;
mod recorded;
mod routine;
mod settle;
mod slopes;
mod stages;
mod step;
mod stiff;
mod turning;

pub(crate) use call_count::{Calls, Counted, Matrix};
pub use connections::Connections;
pub(crate) use engine::Engine;
pub(crate) use following::Following;
pub(crate) use functions::Recorder;
pub use functions::{Cache, Functions};
pub use guided::{Guidance, Part};
pub use loops::LoopState;
pub(crate) use loops::Loops;
pub use memory::Memories;
pub use ode::System;
pub(crate) use recorded::Recording;
pub use recorded::{Kind, Placed, Places};
pub(crate) use routine::{Routine, code_pays, code_pays_in_fits};
pub(crate) use turning::Trouble;

use std::sync::Arc;

use crate::actuator::hydraulic::Supply;
use crate::actuator::{Actuator, Drive, Target};
use crate::ball::Ball;
use crate::contact::ContactFriction;
use crate::data::Data;
use crate::dynamics::articulated::articulated;
use crate::dynamics::{aba, flexible, frames, lines, motion, poses, shafts};
use crate::effect::{JointEffect, Seat};
use crate::model::Model;
use crate::scalar::Scalar;
use crate::sensor::Sensor;
use drives::Shown;

/// The right-hand side: everything that acts, in one number type, with its buffers.
///
/// Law: with x = [q, v, s], `dq/dt = v`, `M(q) dv/dt + h(q, v) + K q + D v = sum of actuator and effect efforts`; s are the states of
/// each actuator in order (lag, then drive), then those of each supply (pressure where it sags, then its drop), then the memories of
/// hystereses.
#[derive(Clone, Debug)]
pub struct Dynamics<S> {
    /// The tree with its payloads.
    pub model: Model<S>,
    /// Working memory of the tree's algorithms.
    pub data: Data<S>,
    /// Effects, each with its seat.
    pub effects: Vec<(Seat<S>, JointEffect<S>)>,
    /// Actuators.
    pub actuators: Vec<Actuator<S>>,
    /// Supplies of the hydraulic ones.
    pub supplies: Vec<Supply<S>>,
    /// What enters each actuator's lag, then the pressure of each logged supply; held constant over a sample interval.
    inputs: Vec<S>,
    forces: Vec<S>,
    /// The same before the friction of each of them.
    driven: Vec<S>,
    /// Efforts of the actuators on the joints.
    efforts: Vec<S>,
    /// Forces of the actuators on the lines, then their efforts on the shafts of transmissions.
    tensions: Vec<S>,
    /// Whether any actuator acts on a line or a shaft.
    pulls: bool,
    /// Whether any acts on a line.
    stretches: bool,
    /// Number of states of drives and supplies.
    internal: usize,
    /// Whether all actuators give efforts by their commands alone, and nothing feeds them.
    ideal: bool,
    shown: Shown<S>,
    /// Resistance of each actuator's seals and friction in the place of these, where an iteration matrix asks for it.
    seals: Vec<Option<S>>,
    loads: Vec<S>,
    /// Contacts, bushings and load cells.
    pub(crate) connections: Connections<S>,
    /// Closed loops, if there are any.
    pub(crate) loops: Option<Box<Loops<S>>>,
    /// Effects that remember.
    pub(crate) memories: Memories<S>,
    /// Joints of three angles.
    pub(crate) balls: Vec<Ball>,
}

impl<S: Scalar> Dynamics<S> {
    /// Puts the parts of a system together. The joints, lines and supplies that effects and actuators name must exist.
    pub fn new(
        model: Model<S>,
        effects: Vec<(Seat<S>, JointEffect<S>)>,
        actuators: Vec<Actuator<S>>,
        supplies: Vec<Supply<S>>,
    ) -> Self {
        let zeros = |count: usize| vec![S::zero(); count];
        let (mut inputs, n_lines) = (zeros(actuators.len()), model.lines().len());
        inputs.extend(supplies.iter().filter(|supply| supply.is_logged()).map(|supply| supply.pressure));
        let of_supplies: usize = supplies.iter().map(|supply| supply.states().count()).sum();
        Self {
            data: Data::new(&model),
            inputs,
            internal: actuators.iter().map(Actuator::n_states).sum::<usize>() + of_supplies,
            ideal: supplies.is_empty() && actuators.iter().all(Actuator::is_direct),
            shown: Shown::new(&actuators, &supplies),
            seals: vec![None; actuators.len()],
            forces: zeros(actuators.len()),
            driven: zeros(actuators.len()),
            efforts: zeros(model.n_joints()),
            tensions: zeros(model.n_wires()),
            pulls: actuators.iter().any(|actuator| matches!(actuator.on, Target::Line(_))),
            stretches: actuators.iter().any(|actuator| matches!(actuator.on, Target::Line(line) if line < n_lines)),
            loads: zeros(model.n_coordinates()),
            connections: Connections::default(),
            loops: None,
            memories: Memories::new(Vec::new()),
            balls: Vec::new(),
            model,
            effects,
            actuators,
            supplies,
        }
    }

    /// System with contacts, bushings and load cells.
    #[must_use]
    pub fn connected(self, connections: Connections<S>) -> Self {
        Self { connections, ..self }
    }

    /// System with closed loops.
    #[must_use]
    pub(crate) fn closed_by(self, loops: Option<Loops<S>>) -> Self {
        Self { loops: loops.map(Box::new), ..self }
    }

    /// System with joints of three angles.
    #[must_use]
    pub(crate) fn with_balls(self, balls: Vec<Ball>) -> Self {
        Self { balls, ..self }
    }

    /// System with effects that remember.
    #[must_use]
    pub(crate) fn remembering(self, memories: Memories<S>) -> Self {
        Self { memories, ..self }
    }

    /// Number of joints of the system.
    #[inline]
    pub fn joints(&self) -> usize {
        self.model.n_joints()
    }

    /// Number of coordinates of the system: joints, then elastic ones.
    #[inline]
    pub fn coordinates(&self) -> usize {
        self.model.n_coordinates()
    }

    /// Length of the state: coordinates, rates, states of drives and supplies, memories.
    #[inline]
    pub fn dim(&self) -> usize {
        self.first_memory() + self.memories.len()
    }

    /// Place of the first memory in the state.
    #[inline]
    pub(crate) fn first_memory(&self) -> usize {
        2 * self.coordinates() + self.internal
    }

    /// Effort that each actuator delivers in the last state evaluated, N or N m.
    #[inline]
    pub fn forces(&self) -> &[S] {
        &self.forces
    }

    /// Total effort of the actuators on each joint in the last state evaluated, N or N m.
    #[inline]
    pub fn efforts(&self) -> &[S] {
        &self.efforts
    }

    /// Accelerations of all coordinates at (q, v) under `efforts` of the actuators on the joints, with all effects.
    pub fn accelerations(&mut self, q: &[S], v: &[S], efforts: &[S]) -> &[S] {
        self.tensions.fill(S::zero());
        self.efforts.copy_from_slice(efforts);
        self.locate(q, v);
        self.accelerate(q, v, (add_effects, ContactFriction::resistance), &[]);
        &self.data.acceleration
    }

    /// Mass matrix and bias at (q, v), left in the data, by the algorithm for trees of every kind.
    pub(crate) fn terms(&mut self, q: &[S], v: &[S]) {
        flexible::terms(&self.model, &mut self.data, q, v);
    }

    /// Brings coordinates and rates, which lead `x`, to where all loops are closed, see [`Loops::close`].
    pub(crate) fn close(&mut self, x: &mut [S], held: &[u32]) -> [S; 2] {
        let n = self.coordinates();
        let (q, v) = x[..2 * n].split_at_mut(n);
        let Self { model, data, loops, .. } = self;
        loops.as_mut().map_or([S::zero(); 2], |loops| loops.close(model, data, (q, v), held))
    }

    /// Where the closed loops are at (q, v).
    pub fn loops_at(&mut self, q: &[S], v: &[S]) -> LoopState<S> {
        let Self { model, data, loops, .. } = self;
        let Some(loops) = loops else { return LoopState::default() };
        frames(model, data, q, v);
        poses(model, data);
        loops.place(model, data);
        loops.choose(q.len());
        loops.state()
    }

    /// Resistance of each effect at (q, v), under the efforts of the actuators in the last state evaluated.
    fn write_resistances(&self, q: &[S], v: &[S], resistances: &mut [S]) {
        for ((seat, effect), resistance) in self.effects.iter().zip(resistances) {
            let (law, q, v, u) = (effect.law(), seat.of(q), seat.of(v), seat.load(&self.efforts));
            *resistance = law.resistance(q, v) + law.resistance_per_load(v, u) * u.abs();
        }
    }

    /// Whether the system's states have units of like size: no pressures, and no elastic coordinates.
    fn is_well_scaled(&self) -> bool {
        let hydraulic = |actuator: &Actuator<S>| matches!(actuator.drive, Drive::Hydraulic(_));
        self.model.n_elastic() == 0 && self.supplies.is_empty() && !self.actuators.iter().any(hydraulic)
    }

    /// Whether beams are all that is stiff in the system.
    fn is_stiff_by_beams_alone(&self) -> bool {
        self.model.n_elastic() > 0 && self.ideal && self.connections.is_free() && self.loops.is_none()
    }

    /// Right-hand side dx/dt of the system at x.
    #[inline]
    pub fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        self.rhs_with(x, dxdt, (add_effects, ContactFriction::resistance));
    }

    /// Right-hand side dx/dt of the system at x, with effects at (q, v) and contact resistances by `laws`.
    #[inline]
    fn rhs_with(
        &mut self,
        x: &[S],
        dxdt: &mut [S],
        laws: (impl FnOnce(&[(Seat<S>, JointEffect<S>)], [&[S]; 3], &mut [S]), impl Fn(&ContactFriction<S>, S, S) -> S),
    ) {
        let n = self.coordinates();
        let (q, v) = x[..2 * n].split_at(n);
        self.locate(q, v);
        self.actuate(x, dxdt);
        dxdt[..n].copy_from_slice(v);
        let first = self.first_memory();
        self.memories.rates(&x[first..], v, &mut dxdt[first..]);
        self.accelerate(q, v, laws, &[]);
        dxdt[n..2 * n].copy_from_slice(&self.data.acceleration);
    }

    /// Whether the system's right-hand side leaves a mass matrix and its factors.
    #[inline]
    fn has_mass_matrix(&self) -> bool {
        !self.model.is_recursive() && !self.model.is_articulated()
    }

    /// Moves lines and frames of the system to (q, v), as far as anything acts on them. Of a machine that is no rigid
    /// tree all that its dynamics need is moved.
    #[inline]
    fn locate(&mut self, q: &[S], v: &[S]) {
        let (full, pulls) = (self.has_mass_matrix(), self.stretches || !self.connections.is_free());
        let Self { model, data, connections, loops, .. } = self;
        shafts(model, data, q, v);
        if full {
            flexible::terms(model, data, q, v);
            if !connections.is_free() || loops.is_some() {
                poses(model, data);
            }
        } else if pulls {
            if model.is_recursive() {
                motion(model, data, q, v);
            } else {
                frames(model, data, q, v);
                poses(model, data);
            }
            lines(model, data);
        }
    }

    /// Accelerations of the system under its present efforts and tensions, left in the data. Efforts on the elastic
    /// coordinates count if any are given. It follows [`Dynamics::locate`] at the same place.
    #[inline]
    fn accelerate(
        &mut self,
        q: &[S],
        v: &[S],
        (add, resistance): (
            impl FnOnce(&[(Seat<S>, JointEffect<S>)], [&[S]; 3], &mut [S]),
            impl Fn(&ContactFriction<S>, S, S) -> S,
        ),
        on_beams: &[S],
    ) {
        let Self { model, data, loads, tensions, connections, loops, .. } = self;
        let (of_joints, elastic) = loads.split_at_mut(model.n_joints());
        of_joints.copy_from_slice(&self.efforts);
        elastic.fill(S::zero());
        elastic[..on_beams.len()].copy_from_slice(on_beams);
        add(&self.effects, [q, v, &self.efforts], of_joints);
        self.memories.add_efforts(v, of_joints);
        if self.pulls {
            flexible::add_line_forces(data, tensions, loads);
        }
        if !connections.is_free() {
            connections.add_loads(model, data, resistance, loads);
        }
        if model.is_recursive() {
            aba(model, data, q, v, loads);
        } else if model.is_articulated() {
            flexible::subtract_elastic(model, q, v, loads);
            articulated(model, data, q, v, loads);
        } else {
            flexible::solve(model, data, q, v, loads);
            if let Some(loops) = loops {
                loops.constrain(model, data);
            }
        }
    }
}

/// Adds the efforts of all the system's effects to `total`, at q and v, where actuators push with u.
#[inline]
pub(crate) fn add_effects<S: Scalar>(effects: &[(Seat<S>, JointEffect<S>)], [q, v, u]: [&[S]; 3], total: &mut [S]) {
    for (seat, effect) in effects {
        let (law, q, v, u) = (effect.law(), seat.of(q), seat.of(v), seat.load(u));
        seat.push(total, law.effort_under(q, v, u));
    }
}

/// A machine as its description hands it to somebody who runs it in numbers `S`.
pub(crate) struct Machine<'a, S> {
    /// The laws in plain numbers.
    pub(crate) dynamics: Dynamics<f64>,
    /// What is recorded of it.
    pub(crate) functions: Arc<Functions>,
    /// Its parameters.
    pub(crate) theta: &'a [S],
    /// What its inputs hold at first.
    pub(crate) inputs: Vec<S>,
    /// Its actuators.
    pub(crate) actuators: Vec<Actuator<S>>,
    /// Its effects that remember, relaxed.
    pub(crate) memories: Memories<S>,
}

/// Makes the right-hand side of one machine over any number type.
pub trait Build {
    /// What can go wrong.
    type Error;
    /// Right-hand side of the system with the parameters `theta`.
    fn dynamics<S: Scalar>(&self, theta: &[S]) -> Result<Dynamics<S>, Self::Error>;
    /// Sensors of the system with the parameters `theta`.
    fn sensors<S: Scalar>(&self, theta: &[S]) -> Vec<Sensor<S>>;
}
