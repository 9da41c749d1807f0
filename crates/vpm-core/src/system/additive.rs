//! The rates of an additive step: linear stiffness, damping and friction where the stage will be, everything else where it has come to.

use super::Dynamics;
use crate::contact::ContactFriction;
use crate::dynamics::articulated::{Shift, response, shifted};
use crate::dynamics::{flexible, poses};
use crate::effect::{JointEffect, Seat};
use crate::integrator::Lu;
use crate::scalar::Scalar;

/// How often the resistances of friction are taken anew, at the velocity that the last ones led to.
///
/// They begin at the velocity where the stage before ended, and each time gains an order, so that four keep that of the step. The
/// others serve friction far sharper than the step, where chords from rest get closer with every turn, from however far
/// (majorisation: the potential of friction that saturates is a concave function of the square of the velocity).
const TURNS: usize = 8;

/// Working memory of additive steps.
#[derive(Clone, Debug)]
pub(super) struct Split<S> {
    /// The explicit state with the lags where the stage ends.
    state: Vec<S>,
    /// Where the coordinates would be without acceleration.
    coasting: Vec<S>,
    /// Where friction that is not linear acts, or a memory, or anything on a shaft or on the link side of a joint
    /// with compliance.
    seats: Vec<Seat<S>>,
    /// Acceleration of all coordinates per effort at each of these.
    columns: Vec<S>,
    /// Linear damping of each joint, and what its springs do as such over the reach of a stage.
    damping: Vec<S>,
    /// Velocity there at the end of the stage: with no friction, and as the last turn has it.
    free: Vec<S>,
    velocity: Vec<S>,
    /// Resistance of each, and what acts on it at rest.
    resistance: Vec<S>,
    rest: Vec<S>,
    lu: Lu<S>,
}

/// The states of a stage of an additive step, explicit and implicit, and the time by which its own rates move the latter on, s.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a, S> {
    pub(super) explicit: &'a [S],
    pub(super) implicit: &'a [S],
    pub(super) reach: S,
}

/// What a law does at rest, linear about where it has come to.
struct Spring<S> {
    at_rest: S,
    stiffness: S,
}

impl<S: Scalar> Spring<S> {
    /// Linear spring of an additive step about `q`; a spring that pushes away is left explicit. A spring that pushes
    /// away is left explicit.
    fn new(effect: &JointEffect<S>, q: S) -> Self {
        Self { at_rest: effect.law().effort_at_rest(q), stiffness: -effect.slope_at_rest(q).min(S::zero()) }
    }

    /// Effort of an additive step's linear spring at `other`.
    fn effort(&self, q: S, other: S) -> S {
        self.at_rest + self.stiffness * (q - other)
    }
}

impl<S: Scalar> Split<S> {
    /// Split of the machine `dynamics` into explicit and implicit parts of an additive step.
    pub(super) fn new(dynamics: &Dynamics<S>) -> Self {
        let apart =
            |(seat, effect): &&(Seat<S>, JointEffect<S>)| seat.alone().is_none() || effect.law().damping().is_none();
        let mut seats: Vec<Seat<S>> = dynamics.effects.iter().filter(apart).map(|(seat, _)| seat.clone()).collect();
        seats.extend(dynamics.memories.seats().cloned());
        seats.sort_by_key(Seat::place);
        seats.dedup_by_key(|seat| seat.place());
        let (n, count) = (dynamics.coordinates(), seats.len());
        let [free, velocity, resistance, rest] = [0; 4].map(|_| vec![S::zero(); count]);
        let (coasting, columns) = (vec![S::zero(); n], vec![S::zero(); n * count]);
        let state = vec![S::zero(); dynamics.dim()];
        let damping = vec![S::zero(); dynamics.joints()];
        Self { state, coasting, seats, columns, damping, free, velocity, resistance, rest, lu: Lu::new(count) }
    }

    /// Begins an additive step at the rates `v` of all coordinates.
    pub(super) fn depart(&mut self, v: &[S]) {
        for (velocity, seat) in self.velocity.iter_mut().zip(&self.seats) {
            *velocity = seat.of(v);
        }
    }

    /// Writes the accelerations of an additive step's stage into `rates`.
    ///
    /// Law: with a without friction from `M + reach D + reach^2 K` and the columns Y of its inverse, the seats of the friction move at
    /// `(1 + reach Y R) w = v_I + reach (a + Y f)`, R and f taken where they are at w; then `a += Y (f - R w)`.
    pub(super) fn accelerate(&mut self, dynamics: &mut Dynamics<S>, stage: Stage<'_, S>, rates: &mut [S]) {
        let (n, count, reach) = (dynamics.coordinates(), self.seats.len(), stage.reach);
        let v = &stage.implicit[n..2 * n];
        self.coasting.copy_from_slice(&stage.implicit[..n]);
        self.coasting.iter_mut().zip(v).for_each(|(q, &v)| *q += v * reach);
        dynamics.push_apart(stage, &self.coasting, &mut self.damping);
        let acceleration = &mut rates[n..2 * n];
        dynamics.solve_apart(stage, &self.damping, acceleration, (&self.seats, &mut self.columns));
        for (free, seat) in self.free.iter_mut().zip(&self.seats) {
            *free = seat.of(v) + seat.of(acceleration) * reach;
        }
        for _ in 0..if count == 0 { 0 } else { TURNS } {
            self.rub(dynamics, stage);
            self.turn(n, reach);
        }
        let ends = self.rest.iter().zip(&self.resistance).zip(&self.velocity);
        for (column, ((&rest, &resistance), &w)) in self.columns.chunks_exact(n.max(1)).zip(ends) {
            let effort = rest - resistance * w;
            acceleration.iter_mut().zip(column).for_each(|(a, &entry)| *a += entry * effort);
        }
        for (k, &v) in v.iter().enumerate() {
            rates[k] = v + rates[n + k] * reach;
        }
    }

    /// Resistances in an additive step at the known velocities, and what acts on the seats beside them.
    fn rub(&mut self, dynamics: &Dynamics<S>, Stage { explicit, implicit, reach }: Stage<'_, S>) {
        let n = dynamics.coordinates();
        for (k, seat) in self.seats.iter().enumerate() {
            let (q, w, u) = (seat.of(explicit), self.velocity[k], seat.load(&dynamics.efforts));
            let (mut resistance, mut rest) = (S::zero(), S::zero());
            for (_, effect) in dynamics.effects.iter().filter(|(other, _)| other.place() == seat.place()) {
                let (law, linear) = (effect.law(), effect.law().damping().unwrap_or_default());
                resistance += law.resistance(q, w) - linear;
                if law.follows_load() {
                    let (load, per_load) = (u.abs(), law.resistance_per_load(w, u));
                    resistance += per_load * load;
                    rest -= (law.share_of_load(q, w, u) - per_load * w) * load;
                }
                if seat.alone().is_none() {
                    let spring = Spring::new(effect, q);
                    let (coasting, v) = (seat.of(&self.coasting), seat.of(&implicit[n..]));
                    // Where the stage ends, `coasting + reach (w - v)`.
                    resistance += linear + spring.stiffness * reach;
                    rest += spring.effort(q, coasting - v * reach);
                }
            }
            let memories = &implicit[dynamics.first_memory()..];
            for [own, at_rest] in dynamics.memories.at_end(seat.place(), w, memories, reach) {
                resistance += own;
                rest += at_rest;
            }
            // What drives instead of resisting would take the inverse apart.
            let driving = resistance.min(S::zero());
            (self.resistance[k], self.rest[k]) = (resistance - driving, rest - driving * w);
        }
    }

    /// Velocities to which these resistances lead in an additive step.
    fn turn(&mut self, n: usize, reach: S) {
        let count = self.seats.len();
        self.velocity.copy_from_slice(&self.free);
        for (k, seat) in self.seats.iter().enumerate() {
            let row = &mut self.lu.matrix()[k * count..(k + 1) * count];
            for (other, (entry, column)) in row.iter_mut().zip(self.columns.chunks_exact(n)).enumerate() {
                let moved = seat.of(column) * reach;
                self.velocity[k] += moved * self.rest[other];
                *entry = moved * self.resistance[other];
            }
            row[k] = row[k] + 1.0;
        }
        self.lu.factorise();
        self.lu.solve(&mut self.velocity);
    }
}

impl<S: Scalar> Dynamics<S> {
    /// Writes the rates of an additive step; see [`crate::ode::Ode::additive_rates`]. Lags of ideal drives and memories
    /// are taken implicitly too, whose laws are linear in their own states.
    pub(super) fn additive_rates(&mut self, stage: Stage<'_, S>, rates: &mut [S], split: &mut Split<S>) {
        let (n, first) = (self.coordinates(), self.first_memory());
        let (q, v) = stage.explicit[..2 * n].split_at(n);
        if self.model.is_articulated() {
            self.locate(q, v);
        } else {
            self.terms(q, v);
            if !self.connections.is_free() {
                poses(&self.model, &mut self.data);
            }
        }
        split.state.copy_from_slice(stage.explicit);
        self.settle_lags(stage, &mut split.state);
        self.actuate(&split.state, rates);
        split.accelerate(self, stage, rates);
        let (motion, memories) = rates.split_at_mut(first);
        self.memories.rates_at_end(&stage.implicit[first..], motion, stage.reach, memories);
    }

    /// Sets the lags to the end of an additive step's stage.
    fn settle_lags(&self, Stage { implicit, reach, .. }: Stage<'_, S>, state: &mut [S]) {
        let mut place = 2 * self.coordinates();
        for (actuator, &input) in self.actuators.iter().zip(&self.inputs) {
            if let Some(lag) = &actuator.lag {
                let slope = lag.rate(S::one(), S::zero());
                state[place] = implicit[place] + lag.rate(implicit[place], input) * reach / (S::one() - slope * reach);
            }
            place += actuator.n_states();
        }
    }

    /// All loads of an additive step's stage but nonlinear friction. Also the `damping` of joints that their implicit
    /// part amounts to.
    fn push_apart(&mut self, Stage { explicit, implicit, reach }: Stage<'_, S>, coasting: &[S], damping: &mut [S]) {
        let Self { model, data, loads, tensions, connections, efforts, effects, .. } = self;
        let (n, joints) = (model.n_coordinates(), efforts.len());
        let v = &implicit[n..2 * n];
        loads[..joints].copy_from_slice(efforts);
        loads[joints..].fill(S::zero());
        if self.pulls {
            flexible::add_line_forces(data, tensions, loads);
        }
        if !connections.is_free() {
            connections.add_loads(model, data, ContactFriction::resistance, loads);
        }
        flexible::subtract_elastic(model, coasting, v, loads);
        damping.fill(S::zero());
        for (joint, effect) in effects.iter().filter_map(|(seat, effect)| Some((seat.alone()?, effect))) {
            let q = explicit[joint];
            let (spring, linear) = (Spring::new(effect, q), effect.law().damping().unwrap_or_default());
            loads[joint] += spring.effort(q, coasting[joint]) - linear * v[joint];
            damping[joint] += linear + spring.stiffness * reach;
        }
    }

    /// Accelerations of an additive step: solves with `M + reach D + reach^2 K` in place of the mass matrix. Also those
    /// that a unit of effort on each of the `seats` adds.
    fn solve_apart(
        &mut self,
        stage: Stage<'_, S>,
        damping: &[S],
        acceleration: &mut [S],
        (seats, columns): (&[Seat<S>], &mut [S]),
    ) {
        let n = self.coordinates();
        let columns = columns.chunks_exact_mut(n.max(1)).zip(seats);
        let Self { model, data, loads, .. } = self;
        if model.is_articulated() {
            let (q, v) = stage.explicit[..2 * n].split_at(n);
            let shift = Shift { reach: stage.reach, resistances: damping };
            acceleration.copy_from_slice(shifted(model, data, (q, v), loads, shift));
            for (column, seat) in columns {
                loads.fill(S::zero());
                seat.push(loads, S::one());
                column.copy_from_slice(response(model, data, loads));
            }
            return;
        }
        flexible::stiffen(model, stage.reach, &mut data.mass_matrix);
        for (joint, &damping) in damping.iter().enumerate() {
            data.mass_matrix[joint * n + joint] += damping * stage.reach;
        }
        data.factorise();
        for ((acceleration, &load), &bias) in acceleration.iter_mut().zip(&*loads).zip(&data.composite.bias) {
            *acceleration = load - bias;
        }
        data.solve(acceleration);
        for (column, seat) in columns {
            column.fill(S::zero());
            seat.push(column, S::one());
            data.solve(column);
        }
    }
}
