//! The state Jacobian of a machine whose drives have states of their own, by the chain rule through the forces of its drives.

use super::places::{Place, all_fed, places};
use super::tangent::Laws;
use super::{Build, Dynamics};
use crate::actuator::Target;
use crate::contact::ContactFriction;
use crate::dynamics::{flexible, poses, project, reach, weigh};
use crate::scalar::{Dual, Scalar};
use crate::spatial::Twist;

/// Directions that are taken at once.
pub(super) const LANES: usize = 8;
/// Lanes of the duals of the drives: the states of each, lag first, then what all have in common.
const LENGTH: usize = 5;
const RATE: usize = 6;
const PRESSURE: usize = 7;

type Number<S> = Dual<S, LANES>;

/// The machine in dual numbers.
///
/// Law: with the drives' forces F(s, l, dl, p), their states s and lengths l, and supplies at p, the motion is
/// `M a = tau(q, v) + L F - h(q, v)`, L the lever arms: `da/ds = M^-1 L dF/ds`, and by coordinates and rates `da/dx = -M^-1 dr/dx` with
/// the residual `r = M a + h - tau - L F` at constant a, which Newton and Euler's recursion gives without the mass matrix. Drives are
/// differentiated one by one, all in the same lanes, since they know each other only through q, v and p.
/// Source: the derivative of an implicit function; Carpentier & Mansard 2018, "Analytical derivatives of rigid body dynamics algorithms",
/// Robotics: Science and Systems, section IV. Checked: against the derivative of the whole right-hand side.
#[derive(Clone, Debug)]
pub(super) struct Driven<S> {
    pub(super) dynamics: Dynamics<Number<S>>,
    state: Vec<Number<S>>,
    rate: Vec<Number<S>>,
    acceleration: Vec<Number<S>>,
    residual: Vec<Number<S>>,
    extra: Vec<Twist<Number<S>>>,
    /// A column of the Jacobian on its way.
    column: Vec<S>,
}

impl<S: Scalar> Driven<S> {
    pub(super) fn new<E>(theta: &[S], build: impl Build<Error = E>, dim: usize) -> Result<Self, E> {
        let lifted: Vec<_> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let dynamics = build.dynamics(&lifted)?;
        let (n, zeros) = (dynamics.coordinates(), |count: usize| vec![Dual::default(); count]);
        Ok(Self {
            state: zeros(dim),
            rate: zeros(dim),
            acceleration: zeros(n),
            residual: zeros(n),
            extra: vec![Twist::zero(); dynamics.model.n_frames()],
            column: vec![S::zero(); n],
            dynamics,
        })
    }

    /// df/dx, row by row, at the state `x` where `machine` was evaluated last, of the laws that it was evaluated with.
    pub(super) fn jacobian(
        &mut self,
        machine: &mut Dynamics<S>,
        x: &[S],
        matrix: &mut [S],
        laws: &impl Laws<Number<S>>,
    ) {
        let (n, dim) = (machine.coordinates(), x.len());
        if !machine.has_mass_matrix() {
            machine.terms(&x[..n], &x[n..2 * n]);
            machine.data.factorise();
        }
        matrix.fill(S::zero());
        for k in 0..n {
            matrix[k * dim + n + k] = S::one();
        }
        self.differentiate_drives(machine, x);
        self.add_internal(machine, x, matrix);
        self.add_memories(machine, x, matrix);
        for (number, acceleration) in self.acceleration.iter_mut().zip(&machine.data.acceleration) {
            *number = Dual::constant(*acceleration);
        }
        for first in (0..2 * n).step_by(LANES) {
            self.sweep(x, first, laws);
            self.add_motion(machine, matrix, (dim, first));
        }
    }

    /// Forces of the drives and rates of their states with their derivatives by the states of each, its length and rate, and the pressure
    /// of its supply.
    fn differentiate_drives(&mut self, machine: &Dynamics<S>, x: &[S]) {
        let n = machine.coordinates();
        let Self { dynamics, state, rate, .. } = self;
        let internal = &x[2 * n..machine.first_memory()];
        let mut lifted = state[2 * n..].iter_mut().zip(internal);
        for actuator in &machine.actuators {
            for (lane, (state, &value)) in lifted.by_ref().take(actuator.n_states()).enumerate() {
                *state = Dual::variable(value, lane);
            }
        }
        for supply in &machine.supplies {
            // The pressure at the valves is the one direction of a supply: its pressure rises with it, or a drop falls.
            let slope = if supply.is_sagging() { S::one() } else { -S::one() };
            for (number, (state, &value)) in lifted.by_ref().take(supply.states().count()).enumerate() {
                *state = Dual::constant(value);
                state.gradient[PRESSURE] = if number == 0 { slope } else { S::zero() };
            }
        }
        let lines = &machine.data.composite.lines;
        let moving = |on| {
            let [length, rate] = super::drives::motion(on, &x[..n], &x[n..2 * n], lines);
            [Dual::variable(length, LENGTH), Dual::variable(rate, RATE)]
        };
        dynamics.actuate_moving(&state[2 * n..], &mut rate[2 * n..], |on, _| moving(on));
    }

    /// The columns of the states of drives and supplies.
    fn add_internal(&mut self, machine: &Dynamics<S>, x: &[S], matrix: &mut [S]) {
        let Self { dynamics, rate, column, .. } = self;
        let (n, dim) = (machine.coordinates(), x.len());
        let mut drawn = dynamics.shown.drawn.iter();
        for (place, (actuator, force)) in places(machine).zip(dynamics.actuators.iter().zip(&dynamics.forces)) {
            let drawn = if place.draws(actuator) { drawn.next() } else { None };
            let Place { first, count, supply } = place;
            let fed = || supply.iter().flatten();
            let lanes = || {
                let own = (0..count).map(move |lane| (first + lane, lane, 1.0));
                own.chain(fed().map(|state| (state.at, PRESSURE, state.sign)))
            };
            if count == 0 && supply.iter().all(Option::is_none) {
                continue;
            }
            column.fill(S::zero());
            match actuator.on {
                Target::Joint(joint) => column[joint] = machine.push_through(joint, x),
                Target::Line(line) => machine.data.line_load(line, S::one(), column),
            }
            machine.data.solve(column);
            for (at, lane, sign) in lanes() {
                for (row, &pushed) in matrix[n * dim..].chunks_exact_mut(dim).zip(&*column) {
                    row[2 * n + at] += pushed * force.gradient[lane] * sign;
                }
                for row in first..first + count {
                    matrix[(2 * n + row) * dim + 2 * n + at] = rate[2 * n + row].gradient[lane] * sign;
                }
            }
            for (row, drawn) in fed().zip(drawn.into_iter().cycle()) {
                for (at, lane, sign) in lanes() {
                    matrix[(2 * n + row.at) * dim + 2 * n + at] += row.by_flow * drawn.gradient[lane] * sign;
                }
            }
        }
        for state in all_fed(machine) {
            matrix[(2 * n + state.at) * dim + 2 * n + state.at] += state.by_itself;
        }
    }

    /// The columns and rows of the memories, which know the velocity of their joint alone.
    fn add_memories(&mut self, machine: &Dynamics<S>, x: &[S], matrix: &mut [S]) {
        let Self { dynamics, state, rate, column, .. } = self;
        let (n, first, dim) = (machine.coordinates(), machine.first_memory(), x.len());
        let memories = state[first..].iter_mut().zip(&x[first..]);
        memories.for_each(|(state, &value)| *state = Dual::variable(value, 0));
        state[n..2 * n].iter_mut().zip(&x[n..2 * n]).for_each(|(state, &value)| *state = Dual::variable(value, 1));
        let (moving, held) = state.split_at(first);
        dynamics.memories.rates(held, &moving[n..2 * n], &mut rate[first..]);
        let memories = state[first..].iter_mut().zip(&x[first..]);
        memories.for_each(|(state, &value)| *state = Dual::constant(value));
        dynamics.memories.hold(&state[first..]);
        for (place, (joint, law, _)) in (first..).zip(machine.memories.iter()) {
            column.fill(S::zero());
            column[joint] = law.effort(S::one());
            machine.data.solve(column);
            for (row, &entry) in matrix[n * dim..].chunks_exact_mut(dim).zip(&*column) {
                row[place] = entry;
            }
            let [by_memory, by_velocity, ..] = rate[place].gradient;
            matrix[place * dim + place] = by_memory;
            matrix[place * dim + n + joint] = by_velocity;
        }
    }

    /// The residual of the equations of motion with its derivatives along the directions from `first`: coordinates, then rates.
    fn sweep(&mut self, x: &[S], first: usize, laws: &impl Laws<Number<S>>) {
        let Self { dynamics, state, acceleration, residual, extra, .. } = self;
        let n = dynamics.coordinates();
        for (column, (state, &value)) in state[..2 * n].iter_mut().zip(x).enumerate() {
            // A column before `first` wraps around to a lane that does not exist, which gives a constant.
            *state = Dual::variable(value, column.wrapping_sub(first));
        }
        let (q, v) = state[..2 * n].split_at(n);
        let Dynamics {
            model, data, connections, tensions, efforts, actuators, forces, effects, memories, loads, ..
        } = dynamics;
        // Newton and Euler's recursion has the whole mass matrix in it; one that falls apart has to be there.
        let couples = model.couples();
        if couples {
            reach(model, data, [q, v, acceleration], extra);
        } else {
            flexible::terms(model, data, q, v);
            poses(model, data);
        }
        efforts.fill(Dual::default());
        tensions.fill(Dual::default());
        for (actuator, force) in actuators.iter().zip(&*forces) {
            let [length, rate] = super::drives::motion(actuator.on, q, v, &data.composite.lines);
            let along = |lane: usize| {
                length.gradient[lane] * force.gradient[LENGTH] + rate.gradient[lane] * force.gradient[RATE]
            };
            let force = Dual { value: force.value, gradient: std::array::from_fn(along) };
            match actuator.on {
                Target::Joint(joint) => efforts[joint] += force,
                Target::Line(line) => tensions[line] += force,
            }
        }
        let resistance = |law: &ContactFriction<Number<S>>, square, normal| laws.resistance(law, square, normal);
        if couples {
            weigh(model, data, tensions, |data| connections.take_off(data, resistance));
        }
        loads.fill(Dual::default());
        loads[..efforts.len()].copy_from_slice(efforts);
        laws.add(effects, [q, v, efforts], &mut loads[..efforts.len()]);
        memories.add_efforts(&mut loads[..efforts.len()]);
        if couples {
            flexible::subtract_elastic(model, q, v, loads);
            project(model, data, residual);
        } else {
            flexible::add_line_forces(data, tensions, loads);
            connections.add_loads(model, data, resistance, loads);
            flexible::required(model, data, (q, v), acceleration, residual);
        }
        for (residual, &load) in residual.iter_mut().zip(&*loads) {
            *residual -= load;
        }
    }

    /// The columns of the coordinates and rates from direction `first` on.
    fn add_motion(&mut self, machine: &Dynamics<S>, matrix: &mut [S], (dim, first): (usize, usize)) {
        let Self { dynamics, state, rate, residual, column, .. } = self;
        let n = machine.coordinates();
        for lane in 0..LANES.min(2 * n - first) {
            for (entry, residual) in column.iter_mut().zip(&*residual) {
                *entry = -residual.gradient[lane];
            }
            machine.data.solve(column);
            for (row, &entry) in matrix[n * dim..].chunks_exact_mut(dim).zip(&*column) {
                row[first + lane] = entry;
            }
        }
        let (q, v) = state[..2 * n].split_at(n);
        let lines = &dynamics.data.composite.lines;
        let mut drawn = dynamics.shown.drawn.iter();
        for (place, actuator) in places(machine).zip(&dynamics.actuators) {
            let drawn = if place.draws(actuator) { drawn.next() } else { None };
            let [length, speed] = super::drives::motion(actuator.on, q, v, lines);
            let mut add = |row: usize, by: &Number<S>, factor: S| {
                let (length, speed) = (length.gradient.iter(), speed.gradient.iter());
                let [by_length, by_rate] = [LENGTH, RATE].map(|lane| by.gradient[lane] * factor);
                let entries = matrix[(2 * n + row) * dim..][first..2 * n].iter_mut();
                for ((entry, &length), &speed) in entries.zip(length).zip(speed) {
                    *entry += length * by_length + speed * by_rate;
                }
            };
            for row in place.first..place.first + place.count {
                add(row, &rate[2 * n + row], S::one());
            }
            for (state, drawn) in place.supply.iter().flatten().zip(drawn.into_iter().cycle()) {
                add(state.at, drawn, state.by_flow);
            }
        }
    }
}
