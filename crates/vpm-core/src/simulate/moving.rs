//! A machine whose inputs move on between samples.

use super::hold::Course;
use crate::integrator::{Ask, Halt, Integrator, Stuck};
use crate::ode::Ode;
use crate::scalar::Scalar;
use crate::system::System;

/// The courses of all inputs over an interval, with the buffers that steps along them need.
#[derive(Clone, Debug)]
pub(super) struct Courses<S> {
    inputs: Vec<Course<S>>,
    /// Time between samples, s.
    interval: f64,
    /// Time since the sample at which the machine holds its inputs now, s.
    now: S,
    /// State of the machine and time since the sample.
    state: Vec<S>,
    /// Rates and a matrix of the machine alone.
    rates: Vec<S>,
    matrix: Vec<S>,
}

impl<S: Scalar> Courses<S> {
    /// Courses of moving `inputs`, all zero yet, for `dim` states and `interval` (s) between samples.
    pub(super) fn new(inputs: usize, dim: usize, interval: f64) -> Self {
        Self {
            inputs: vec![Course::constant(S::zero()); inputs],
            interval,
            now: S::zero(),
            state: vec![S::zero(); dim + 1],
            rates: vec![S::zero(); dim],
            matrix: vec![S::zero(); dim * dim],
        }
    }

    /// Begins the course of moving input `number` from a sample on, at its held value.
    pub(super) fn begin(&mut self, number: usize, course: Course<S>) {
        self.inputs[number] = course;
        self.now = S::zero();
    }

    /// Advances a machine with moving inputs by [`Integrator::advance`], with the time as one state more.
    pub(super) fn advance(
        &mut self,
        system: &mut System<S>,
        integrator: &mut Integrator<S>,
        x: &mut [S],
        pieces: usize,
        ask: Ask<'_>,
    ) -> Result<(), Halt> {
        let mut state = std::mem::take(&mut self.state);
        state[..x.len()].copy_from_slice(x);
        state[x.len()] = S::zero();
        integrator.recount(x.len(), S::zero());
        let duration = self.interval;
        let end = integrator.advance(&mut Moving { system, courses: self }, &mut state, (duration, pieces), ask);
        x.copy_from_slice(&state[..x.len()]);
        self.state = state;
        let last = x.len().saturating_sub(1);
        end.map_err(|halt| match halt {
            Halt::Stuck(stuck) => Halt::Stuck(Stuck { state: stuck.state.min(last), ..stuck }),
            Halt::Interrupted => halt,
        })
    }
}

/// A machine with the time since the last sample as a state more, by which its inputs move.
///
/// Law: `dx/dt = f(x, u(t))`, `dt/dt = 1`. Derivatives by the time are `f(x, u + h u') - f(x, u)` over the interval h: exact where the rates
/// are affine in the inputs, as those of all drives are that have no valve.
/// Checked: exact solutions of linear machines, orders of all integrators on a smooth command.
struct Moving<'a, S> {
    system: &'a mut System<S>,
    courses: &'a mut Courses<S>,
}

impl<S: Scalar> Moving<'_, S> {
    /// Moves inputs to their values at a time since the sample; gives the state of the machine alone.
    fn enter<'x>(&mut self, x: &'x [S]) -> &'x [S] {
        let (state, time) = x.split_at(x.len() - 1);
        // Inputs that stand where they are wanted leave the system with what it knows of the state.
        if time[0].re() != self.courses.now.re() {
            self.courses.now = time[0];
            self.hold(|course, share| course.at(share));
        }
        state
    }

    fn hold(&mut self, value: impl Fn(&Course<S>, S) -> S) {
        let share = self.courses.now / self.courses.interval;
        for (number, course) in self.courses.inputs.iter().enumerate() {
            self.system.hold(number, value(course, share));
        }
    }

    /// Matrix of a machine with moving inputs: its derivatives `by`, and the column of the time.
    fn matrix(
        &mut self,
        x: &[S],
        matrix: &mut [S],
        rates: &mut [S],
        by: impl Fn(&mut System<S>, &[S], &mut [S], &mut [S]),
    ) {
        let state = self.enter(x);
        let (own, dim) = (x.len(), state.len());
        matrix.fill(S::zero());
        let mut alone = std::mem::take(&mut self.courses.matrix);
        by(self.system, state, &mut alone, &mut rates[..dim]);
        rates[dim] = S::one();
        for (row, entries) in matrix.chunks_exact_mut(own).zip(alone.chunks_exact(dim.max(1))) {
            row[..dim].copy_from_slice(entries);
        }
        self.courses.matrix = alone;
        self.hold(|course, share| course.at(share) + course.slope(share));
        let mut ahead = std::mem::take(&mut self.courses.rates);
        self.system.rhs(state, &mut ahead);
        for (row, (&ahead, &rate)) in matrix.chunks_exact_mut(own).zip(ahead.iter().zip(&*rates)) {
            row[dim] = (ahead - rate) / self.courses.interval;
        }
        self.courses.rates = ahead;
        self.hold(|course, share| course.at(share));
    }
}

impl<S: Scalar> Ode<S> for Moving<'_, S> {
    fn dim(&self) -> usize {
        self.system.dim() + 1
    }

    fn coordinates(&self) -> usize {
        self.system.coordinates()
    }

    fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        let state = self.enter(x);
        self.system.rhs(state, &mut dxdt[..state.len()]);
        dxdt[state.len()] = S::one();
    }

    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        let mut rates = vec![S::zero(); x.len()];
        self.linearise(x, jacobian, &mut rates);
    }

    fn linearise(&mut self, x: &[S], jacobian: &mut [S], rates: &mut [S]) {
        self.matrix(x, jacobian, rates, |system, x, jacobian, rates| system.linearise(x, jacobian, rates));
    }

    fn prepare(&mut self, x: &[S], matrix: &mut [S], rates: &mut [S]) {
        self.matrix(x, matrix, rates, |system, x, matrix, rates| system.prepare(x, matrix, rates));
    }

    fn turns(&self) -> bool {
        self.system.turns()
    }

    fn turned(&mut self, k: &[S], product: &mut [S]) {
        let dim = self.system.dim();
        product[dim] = S::zero();
        self.system.turned(&k[..dim], &mut product[..dim]);
    }

    fn elasticity(&mut self, x: &[S], block: &mut [S]) -> bool {
        let state = self.enter(x);
        self.system.elasticity(state, block)
    }

    fn additive_rates(&mut self, explicit: &[S], implicit: &[S], reach: f64, rates: &mut [S]) -> bool {
        let state = self.enter(explicit);
        let dim = state.len();
        rates[dim] = S::one();
        self.system.additive_rates(state, &implicit[..dim], reach, &mut rates[..dim])
    }

    fn along_path(&mut self, x: &[S], step: f64, rates: &mut [S]) {
        let dim = self.system.dim();
        self.system.along_path(&x[..dim], step, &mut rates[..dim]);
    }

    fn arrive(&mut self, x: &mut [S], step: Option<f64>) {
        let dim = self.system.dim();
        self.system.arrive(&mut x[..dim], step);
    }

    fn horizon(&mut self, x: &[S]) -> f64 {
        self.system.horizon(&x[..x.len() - 1])
    }

    fn scales(&self, scales: &mut [f64]) {
        let (machine, time) = scales.split_at_mut(self.system.dim());
        self.system.scales(machine);
        time.fill(self.courses.interval);
    }
}
