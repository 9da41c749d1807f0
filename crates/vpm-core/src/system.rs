//! A whole machine as one ordinary differential equation: tree, effects and actuators.

mod answers;
mod connections;
mod observe;
mod slopes;
mod stiff;
mod tangent;

pub use connections::Connections;

use crate::actuator::{Actuator, Target};
use crate::contact::ContactFriction;
use crate::data::Data;
use crate::dynamics::{aba, flexible, frames, lines, poses};
use crate::effect::JointEffect;
use crate::model::Model;
use crate::ode::Ode;
use crate::scalar::Scalar;
use tangent::Tangent;

/// The right-hand side: everything that acts, in one number type, with its buffers.
///
/// Law: with x = [q, v, s], `dq/dt = v`, `M(q) dv/dt + h(q, v) + K q + D v = sum of actuator and effect efforts`, `T ds/dt = w - s`.
#[derive(Clone, Debug)]
pub struct Dynamics<S> {
    /// The tree with its payloads.
    pub model: Model<S>,
    /// Working memory of the tree's algorithms.
    pub data: Data<S>,
    /// Effects, each with the number of its joint.
    pub effects: Vec<(usize, JointEffect<S>)>,
    /// Actuators.
    pub actuators: Vec<Actuator<S>>,
    /// What enters each actuator's lag, held constant over a sample interval.
    inputs: Vec<S>,
    forces: Vec<S>,
    /// Efforts of the actuators on the joints.
    efforts: Vec<S>,
    /// Forces of the actuators on the lines.
    tensions: Vec<S>,
    /// Whether any actuator acts on a line.
    pulls: bool,
    loads: Vec<S>,
    /// Contacts, bushings and load cells.
    pub(crate) connections: Connections<S>,
}

impl<S: Scalar> Dynamics<S> {
    /// Puts the parts together. The joints and lines that effects and actuators name must exist in the model.
    pub fn new(model: Model<S>, effects: Vec<(usize, JointEffect<S>)>, actuators: Vec<Actuator<S>>) -> Self {
        let zeros = |count: usize| vec![S::zero(); count];
        Self {
            data: Data::new(&model),
            inputs: zeros(actuators.len()),
            forces: zeros(actuators.len()),
            efforts: zeros(model.n_joints()),
            tensions: zeros(model.lines().len()),
            pulls: actuators.iter().any(|actuator| matches!(actuator.on, Target::Line(_))),
            loads: zeros(model.n_coordinates()),
            connections: Connections::default(),
            model,
            effects,
            actuators,
        }
    }

    /// With contacts, bushings and load cells.
    #[must_use]
    pub fn connected(self, connections: Connections<S>) -> Self {
        Self { connections, ..self }
    }

    /// Number of joints.
    #[inline]
    pub fn joints(&self) -> usize {
        self.model.n_joints()
    }

    /// Number of coordinates: joints, then elastic ones.
    #[inline]
    pub fn coordinates(&self) -> usize {
        self.model.n_coordinates()
    }

    /// Length of the state: coordinates, rates, one state per lag.
    pub fn dim(&self) -> usize {
        2 * self.coordinates() + self.actuators.iter().filter(|actuator| actuator.lag.is_some()).count()
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
        self.accelerate(q, v, (add_effects, ContactFriction::resistance), &[]);
        &self.data.acceleration
    }

    /// Mass matrix and bias at (q, v), left in the data, by the algorithm for trees of every kind.
    pub(crate) fn terms(&mut self, q: &[S], v: &[S]) {
        flexible::terms(&self.model, &mut self.data, q, v);
    }

    /// dx/dt at x.
    #[inline]
    pub fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        self.rhs_with(x, dxdt, (add_effects, ContactFriction::resistance));
    }

    /// dx/dt at x, with the efforts of the effects at (q, v) and the resistances of contacts by `laws`.
    #[inline]
    fn rhs_with(
        &mut self,
        x: &[S],
        dxdt: &mut [S],
        laws: (impl FnOnce(&[(usize, JointEffect<S>)], &[S], &[S], &mut [S]), impl Fn(&ContactFriction<S>, S, S) -> S),
    ) {
        let n = self.coordinates();
        let ((q, v), lags) = (x[..2 * n].split_at(n), &x[2 * n..]);
        self.actuate(lags, &mut dxdt[2 * n..]);
        dxdt[..n].copy_from_slice(v);
        self.accelerate(q, v, laws, &[]);
        dxdt[n..2 * n].copy_from_slice(&self.data.acceleration);
    }

    /// Accelerations under the efforts and tensions that stand, and efforts on the elastic coordinates if any are given, left in the
    /// data.
    #[inline]
    fn accelerate(
        &mut self,
        q: &[S],
        v: &[S],
        (add, resistance): (
            impl FnOnce(&[(usize, JointEffect<S>)], &[S], &[S], &mut [S]),
            impl Fn(&ContactFriction<S>, S, S) -> S,
        ),
        on_beams: &[S],
    ) {
        let Self { model, data, loads, tensions, connections, .. } = self;
        let (of_joints, elastic) = loads.split_at_mut(model.n_joints());
        of_joints.copy_from_slice(&self.efforts);
        elastic.fill(S::zero());
        elastic[..on_beams.len()].copy_from_slice(on_beams);
        add(&self.effects, q, v, of_joints);
        if model.is_recursive() {
            if self.pulls || !connections.is_free() {
                frames(model, data, q, v);
                poses(model, data);
                lines(model, data);
                flexible::add_line_forces(data, tensions, loads);
                connections.add_loads(model, data, resistance, loads);
            }
            aba(model, data, q, v, loads);
        } else {
            flexible::terms(model, data, q, v);
            flexible::add_line_forces(data, tensions, loads);
            if !connections.is_free() {
                poses(model, data);
                connections.add_loads(model, data, resistance, loads);
            }
            flexible::solve(model, data, q, v, loads);
        }
    }

    /// Forces, joint efforts and tensions of the actuators, and the rates of their lags.
    fn actuate(&mut self, lags: &[S], rates: &mut [S]) {
        self.efforts.fill(S::zero());
        self.tensions.fill(S::zero());
        let mut states = lags.iter().zip(rates);
        for ((actuator, &input), force) in self.actuators.iter().zip(&self.inputs).zip(&mut self.forces) {
            *force = match (&actuator.lag, if actuator.lag.is_some() { states.next() } else { None }) {
                (Some(lag), Some((&state, rate))) => {
                    *rate = lag.rate(state, input);
                    actuator.motor.effort(state)
                }
                _ => actuator.motor.effort(input),
            };
            match actuator.on {
                Target::Joint(joint) => self.efforts[joint] += *force,
                Target::Line(line) => self.tensions[line] += *force,
            }
        }
    }
}

/// Adds to `total` the efforts of all effects on the joints at coordinates `q` and rates `v`.
#[inline]
pub(crate) fn add_effects<S: Scalar>(effects: &[(usize, JointEffect<S>)], q: &[S], v: &[S], total: &mut [S]) {
    for (joint, effect) in effects {
        total[*joint] += effect.effort(q[*joint], v[*joint]);
    }
}

/// The machine as an [`Ode`]: the right-hand side in `S`, and a copy of it in dual numbers over `S` for the exact state Jacobian.
#[derive(Clone, Debug)]
pub struct System<S> {
    dynamics: Dynamics<S>,
    tangent: Tangent<S>,
    resistances: Vec<S>,
    /// A column of an iteration matrix on its way.
    column: Vec<S>,
}

impl<S: Scalar> System<S> {
    /// From the same machine in several number types; `build` makes it from numbers.
    pub fn new<E>(theta: &[S], build: impl Build<Error = E>) -> Result<Self, E> {
        let dynamics = build.dynamics(theta)?;
        let tangent = Tangent::new(theta, build, dynamics.dim())?;
        let resistances = vec![S::zero(); dynamics.joints()];
        let column = vec![S::zero(); dynamics.coordinates()];
        Ok(Self { dynamics, tangent, resistances, column })
    }

    /// The right-hand side.
    #[inline]
    pub fn dynamics(&mut self) -> &mut Dynamics<S> {
        &mut self.dynamics
    }

    /// Holds `input` (after delay, dead zone and saturation) on an actuator from now on.
    #[inline]
    pub fn hold(&mut self, actuator: usize, input: S) {
        self.dynamics.inputs[actuator] = input;
        self.tangent.hold(actuator, input);
    }
}

/// Makes the right-hand side of one machine over any number type.
pub trait Build {
    /// What can go wrong.
    type Error;
    /// The right-hand side with the parameters `theta`.
    fn dynamics<S: Scalar>(&self, theta: &[S]) -> Result<Dynamics<S>, Self::Error>;
}

impl<S: Scalar> Ode<S> for System<S> {
    #[inline]
    fn dim(&self) -> usize {
        self.dynamics.dim()
    }

    #[inline]
    fn coordinates(&self) -> usize {
        self.dynamics.coordinates()
    }

    #[inline]
    fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        self.dynamics.rhs(x, dxdt);
    }

    /// Columns by forward accumulation; exact also where S itself carries derivatives.
    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        self.tangent.jacobian(x, jacobian);
    }

    /// As df/dx, but with chords from rest in the place of the tangents of friction laws; of a machine with elastic beams, all that is
    /// stiff in it, for the price of one mass matrix.
    ///
    /// The tangent of dry friction is flat beyond the transition velocity, so that a step which crosses it would not see the friction
    /// turn around, and could keep a joint creeping for ever; the chord sees it. At rest, and for viscous friction, they are the same.
    fn iteration_matrix(&mut self, x: &[S], matrix: &mut [S]) {
        let n = self.coordinates();
        self.resistances.fill(S::zero());
        for (joint, effect) in &self.dynamics.effects {
            self.resistances[*joint] += effect.resistance(x[n + joint]);
        }
        if self.dynamics.model.n_elastic() == 0 || !self.dynamics.connections.is_free() {
            self.tangent.chords(x, matrix, &self.resistances);
        } else {
            stiff::iteration_matrix(&mut self.dynamics, x, matrix, &self.resistances, &mut self.column);
        }
    }

    /// Stiffness and damping of the beams.
    fn elasticity(&mut self, x: &[S], block: &mut [S]) -> bool {
        let n = self.coordinates();
        if self.dynamics.model.n_elastic() == 0 {
            return false;
        }
        let (q, v) = x[..2 * n].split_at(n);
        self.dynamics.terms(q, v);
        self.dynamics.data.factorise();
        block.fill(S::zero());
        stiff::elasticity(&self.dynamics, block, 2 * n, &mut self.column);
        true
    }
}
