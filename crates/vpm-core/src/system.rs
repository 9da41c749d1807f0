//! A whole machine as one ordinary differential equation: rigid tree, effects and actuators.

use crate::actuator::Actuator;
use crate::data::Data;
use crate::dynamics::aba;
use crate::effect::JointEffect;
use crate::model::Model;
use crate::ode::Ode;
use crate::scalar::{Dual, Scalar};

/// Directions in which the state Jacobian is taken at once: the two states of a single axis, and a good fit to the vector registers.
const LANES: usize = 2;

/// A number with its derivatives along the states.
type Lifted<S> = Dual<S, LANES>;

/// The right-hand side: everything that acts, in one number type, with its buffers.
///
/// Law: with x = [q, v, s], `dq/dt = v`, `M(q) dv/dt + h(q, v) = sum of actuator and effect efforts`, `T ds/dt = w - s`.
#[derive(Clone, Debug)]
pub struct Dynamics<S> {
    /// The rigid tree with its payloads.
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
    efforts: Vec<S>,
    loads: Vec<S>,
}

impl<S: Scalar> Dynamics<S> {
    /// Puts the parts together. The joints that effects and actuators name must exist in the model.
    pub fn new(model: Model<S>, effects: Vec<(usize, JointEffect<S>)>, actuators: Vec<Actuator<S>>) -> Self {
        let (n, m, zero) = (model.n_joints(), actuators.len(), S::zero());
        let data = Data::new(&model);
        let (inputs, forces) = (vec![zero; m], vec![zero; m]);
        Self { model, data, effects, actuators, inputs, forces, efforts: vec![zero; n], loads: vec![zero; n] }
    }

    /// Number of joints.
    #[inline]
    pub fn joints(&self) -> usize {
        self.model.n_joints()
    }

    /// Length of the state: coordinates, rates, one state per lag.
    pub fn dim(&self) -> usize {
        2 * self.joints() + self.actuators.iter().filter(|actuator| actuator.lag.is_some()).count()
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

    /// Accelerations at (q, v) under `efforts` of the actuators, with all effects.
    pub fn accelerations(&mut self, q: &[S], v: &[S], efforts: &[S]) -> &[S] {
        self.loads.copy_from_slice(efforts);
        add_effects(&self.effects, q, v, &mut self.loads);
        aba(&self.model, &mut self.data, q, v, &self.loads)
    }

    /// dx/dt at x.
    #[inline]
    pub fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        self.rhs_with(x, dxdt, add_effects);
    }

    /// dx/dt at x, with the efforts of the effects at (q, v) added by `add`.
    #[inline]
    fn rhs_with(
        &mut self,
        x: &[S],
        dxdt: &mut [S],
        add: impl FnOnce(&[(usize, JointEffect<S>)], &[S], &[S], &mut [S]),
    ) {
        let n = self.joints();
        let ((q, v), lags) = (x[..2 * n].split_at(n), &x[2 * n..]);
        self.actuate(lags, &mut dxdt[2 * n..]);
        dxdt[..n].copy_from_slice(v);
        self.loads.copy_from_slice(&self.efforts);
        add(&self.effects, q, v, &mut self.loads);
        dxdt[n..2 * n].copy_from_slice(aba(&self.model, &mut self.data, q, v, &self.loads));
    }

    /// Forces and joint efforts of the actuators, and the rates of their lags.
    fn actuate(&mut self, lags: &[S], rates: &mut [S]) {
        self.efforts.fill(S::zero());
        let mut states = lags.iter().zip(rates);
        for ((actuator, &input), force) in self.actuators.iter().zip(&self.inputs).zip(&mut self.forces) {
            *force = match (&actuator.lag, if actuator.lag.is_some() { states.next() } else { None }) {
                (Some(lag), Some((&state, rate))) => {
                    *rate = lag.rate(state, input);
                    actuator.motor.effort(state)
                }
                _ => actuator.motor.effort(input),
            };
            self.efforts[actuator.joint] += *force;
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
    tangent: Dynamics<Lifted<S>>,
    tangent_state: Vec<Lifted<S>>,
    tangent_rate: Vec<Lifted<S>>,
    resistances: Vec<S>,
}

impl<S: Scalar> System<S> {
    /// From the same machine in both number types; `build` makes it from numbers.
    pub fn new<E>(theta: &[S], build: impl Build<Error = E>) -> Result<Self, E> {
        let lifted: Vec<_> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let (dynamics, tangent) = (build.dynamics(theta)?, build.dynamics(&lifted)?);
        let zero = vec![Dual::default(); dynamics.dim()];
        let resistances = vec![S::zero(); dynamics.joints()];
        Ok(Self { dynamics, tangent, tangent_state: zero.clone(), tangent_rate: zero, resistances })
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
        self.tangent.inputs[actuator] = Dual::constant(input);
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
        self.tangent_state.len()
    }

    #[inline]
    fn coordinates(&self) -> usize {
        self.dynamics.joints()
    }

    #[inline]
    fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        self.dynamics.rhs(x, dxdt);
    }

    /// Columns by forward accumulation; exact also where S itself carries derivatives.
    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        self.columns(x, jacobian, |tangent, x, rate, _| tangent.rhs(x, rate));
    }

    /// As df/dx, but with chords from rest in the place of the tangents of friction laws.
    ///
    /// The tangent of dry friction is flat beyond the transition velocity, so that a step which crosses it would not see the friction
    /// turn around, and could keep a joint creeping for ever; the chord sees it. At rest, and for viscous friction, they are the same.
    fn iteration_matrix(&mut self, x: &[S], matrix: &mut [S]) {
        let n = self.coordinates();
        self.resistances.fill(S::zero());
        for (joint, effect) in &self.dynamics.effects {
            self.resistances[*joint] += effect.resistance(x[n + joint]);
        }
        self.columns(x, matrix, |tangent, x, rate, resistances| {
            tangent.rhs_with(x, rate, |effects, q, v, total| {
                for (joint, effect) in effects {
                    total[*joint] += effect.effort_at_rest(q[*joint]);
                }
                for ((total, &v), &resistance) in total.iter_mut().zip(v).zip(resistances) {
                    *total -= Dual::constant(resistance) * v;
                }
            });
        });
    }
}

impl<S: Scalar> System<S> {
    /// The derivative of `rhs` along each state, [`LANES`] at a time, as columns of a matrix stored row by row.
    #[inline]
    fn columns(
        &mut self,
        x: &[S],
        matrix: &mut [S],
        rhs: impl Fn(&mut Dynamics<Lifted<S>>, &[Lifted<S>], &mut [Lifted<S>], &[S]),
    ) {
        let dim = x.len();
        for first in (0..dim).step_by(LANES) {
            for (column, (state, &value)) in self.tangent_state.iter_mut().zip(x).enumerate() {
                // A column before `first` wraps around to a lane that does not exist, which gives a constant.
                *state = Dual::variable(value, column.wrapping_sub(first));
            }
            rhs(&mut self.tangent, &self.tangent_state, &mut self.tangent_rate, &self.resistances);
            for (row, rate) in matrix.chunks_exact_mut(dim).zip(&self.tangent_rate) {
                for (entry, &slope) in row[first..].iter_mut().zip(&rate.gradient) {
                    *entry = slope;
                }
            }
        }
    }
}
