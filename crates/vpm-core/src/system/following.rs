//! A machine whose joints follow a motion, for the integrators.

use std::sync::Arc;

use super::guided::{Guidance, Guided, Part};
use super::recorded::Kind;
use super::routine::{Routines, kind_of};
use super::{Dynamics, Machine, drives};
use crate::actuator::Actuator;
use crate::error::Result;
use crate::integrator::Method;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// Size of a coordinate, rad or m, that a step control counts as small; rates have 1.
const COORDINATE_SCALE: f64 = 1e-2;

/// What answers to the motion of some joints, see [`Guided`], as an [`Ode`] in numbers `S`: free coordinates, their rates, states of drives,
/// supplies and memories, time since the last sample.
///
/// Plain numbers go through the laws themselves, or through machine code where it pays. Numbers with derivatives, and exact derivatives of
/// the rates, go through the recorded functions.
pub(crate) struct Following<S> {
    laws: Guided<f64>,
    routines: Routines<S>,
    guidance: Arc<Guidance>,
    actuators: Vec<Actuator<S>>,
    /// Number of inputs of the machine.
    inputs: usize,
    /// Time between samples, s.
    interval: f64,
    /// Whether the laws were evaluated last where the next step begins.
    ready: bool,
    /// Rates beside a matrix that is asked for alone.
    rates: Vec<S>,
}

impl<S: Scalar> Following<S> {
    /// Following `machine` with `interval` (s) between samples, for steps by `method`.
    ///
    /// # Errors
    /// [`crate::error::Error::Unrecorded`] where a law decides by the value of a state.
    pub(crate) fn new(machine: Machine<'_, S>, guidance: Guidance, (interval, method): (f64, Method)) -> Result<Self> {
        let Machine { dynamics, functions, theta, inputs, actuators, .. } = machine;
        let inputs = inputs.len();
        let held = vec![S::zero(); inputs + guidance.given()];
        let laws = Guided::new(dynamics, &guidance);
        let mut machine = Self {
            rates: vec![S::zero(); laws.rates.len()],
            laws,
            routines: Routines::new(functions, theta, held),
            guidance: Arc::new(guidance),
            actuators,
            inputs,
            interval,
            ready: false,
        };
        let matrix = machine.matrix_of(method);
        for part in [Some(Part::Rates), Some(Part::Sample), matrix].into_iter().flatten() {
            if !Self::is_direct(part) {
                machine.routines.make(&machine.kind(part))?;
            }
        }
        Ok(machine)
    }

    /// Compiles samples and steps of a following machine to machine code, or says why not.
    pub(crate) fn compile(&mut self, method: Method) -> std::result::Result<(), String> {
        self.routines.compile_all(&[Part::Rates, Part::Sample].map(|part| self.kind(part)))?;
        // A matrix alone that has no code is worked out as before.
        if let Some(part) = self.matrix_of(method).filter(|part| *part != Part::Elasticity) {
            let kind = self.kind(part);
            if self.routines.compile(&kind).is_err() && Self::is_direct(part) {
                self.routines.forget(&kind);
            }
        }
        Ok(())
    }

    /// Kind of matrix that steps of a following machine by `method` need, if any.
    fn matrix_of(&self, method: Method) -> Option<Part> {
        match kind_of(method)? {
            Kind::Elasticity => Some(Part::Elasticity),
            Kind::Prepared => Some(self.prepared()),
            Kind::Linearised => Some(Part::Linearised),
            _ => None,
        }
    }

    /// Whether a function of a following machine is evaluated by its laws now.
    fn by_laws(&mut self, part: Part) -> bool {
        Self::is_direct(part) && self.routines.get(&self.kind(part)).is_none()
    }

    /// Whether a function of a following machine comes directly from its laws.
    fn is_direct(part: Part) -> bool {
        part != Part::Linearised && S::plain(&[]).is_some()
    }

    /// Kind of matrix for an implicit step of a following machine.
    fn prepared(&self) -> Part {
        if self.laws.is_stiff_by_beams_alone() { Part::Prepared } else { Part::Linearised }
    }

    fn kind(&self, part: Part) -> Kind {
        Kind::Guided(self.guidance.clone(), part)
    }

    /// Following machine in plain numbers.
    pub(crate) fn dynamics(&self) -> &Dynamics<f64> {
        &self.laws.dynamics
    }

    /// Free coordinates of a following machine: passive joints, then elastic ones.
    pub(crate) fn free(&self) -> &[usize] {
        &self.laws.free
    }

    /// Index of a state of the following machine in the whole machine; the time has none.
    pub(crate) fn place(&self, state: usize) -> usize {
        let (n, count, dim) = (self.laws.dynamics.coordinates(), self.free().len(), self.laws.dynamics.dim());
        let last = self.laws.rates.len() - 1;
        let place = match state.checked_sub(2 * count) {
            Some(_) => dim + state - last,
            None if state < count => self.free()[state],
            None => n + self.free()[state - count],
        };
        place.min(dim - 1)
    }

    /// Holds command `number` of a following machine over the interval from sample `k`.
    pub(crate) fn command(&mut self, number: usize, k: usize, command: impl Fn(usize) -> S) {
        let input = drives::input(&self.actuators, number, (k, self.interval), command);
        self.hold(number, input);
    }

    /// Gives the following machine its motion, see [`Guidance::given`].
    pub(crate) fn give(&mut self, numbers: &[S]) {
        (self.inputs..).zip(numbers).for_each(|(number, &value)| self.hold(number, value));
    }

    fn hold(&mut self, number: usize, value: S) {
        self.ready = false;
        self.laws.hold(number, value.re());
        self.routines.hold(number, value);
    }

    /// Samples a following machine at `y`, where the next step begins, see [`Guided::sample`].
    pub(crate) fn sample(&mut self, y: &[S], seen: &mut [S]) {
        match (S::plain(y), S::plain_mut(seen)) {
            (Some(y), Some(seen)) if self.by_laws(Part::Sample) => {
                self.laws.sample(y, seen);
                self.ready = true;
            }
            _ => self.routines.copy(&self.kind(Part::Sample), y, &[], seen),
        }
    }

    /// Begins a step of a following machine at `y`: evaluates the laws unless that was done.
    fn begin(&mut self, y: &[f64]) {
        if !std::mem::take(&mut self.ready) {
            self.laws.evaluate(y);
        }
    }

    /// Recorded matrix of a following machine in rows of `width` entries, with the rates.
    fn matrix(&mut self, part: Part, y: &[S], matrix: &mut [S], width: usize, rates: &mut [S]) {
        self.ready = false;
        let kind = self.kind(part);
        self.routines.matrix(&kind, y, matrix, width, rates);
    }

    fn matrix_alone(&mut self, part: Part, y: &[S], matrix: &mut [S], width: usize) {
        let mut rates = std::mem::take(&mut self.rates);
        self.matrix(part, y, matrix, width, &mut rates);
        self.rates = rates;
    }
}

impl<S: Scalar> Ode<S> for Following<S> {
    fn dim(&self) -> usize {
        self.laws.rates.len()
    }

    fn coordinates(&self) -> usize {
        self.free().len()
    }

    fn rhs(&mut self, y: &[S], dydt: &mut [S]) {
        self.ready = false;
        match (S::plain(y), S::plain_mut(dydt)) {
            (Some(y), Some(dydt)) if self.by_laws(Part::Rates) => {
                self.laws.evaluate(y);
                dydt.copy_from_slice(&self.laws.rates);
            }
            _ => self.routines.copy(&self.kind(Part::Rates), y, &[], dydt),
        }
    }

    fn jacobian(&mut self, y: &[S], jacobian: &mut [S]) {
        self.matrix_alone(Part::Linearised, y, jacobian, y.len());
    }

    fn linearise(&mut self, y: &[S], jacobian: &mut [S], rates: &mut [S]) {
        self.matrix(Part::Linearised, y, jacobian, y.len(), rates);
    }

    /// Prepares the matrix of a following machine: all that is stiff, or exact derivatives.
    fn prepare(&mut self, y: &[S], matrix: &mut [S], rates: &mut [S]) {
        let part = self.prepared();
        let plain = (S::plain(y), S::plain_mut(matrix), S::plain_mut(rates));
        match plain {
            (Some(y), Some(matrix), Some(rates)) if self.by_laws(part) => {
                self.begin(y);
                rates.copy_from_slice(&self.laws.rates);
                self.laws.stiff(matrix);
            }
            _ => self.matrix(part, y, matrix, y.len(), rates),
        }
    }

    fn turns(&self) -> bool {
        self.routines.turns()
    }

    fn turned(&mut self, k: &[S], product: &mut [S]) {
        self.routines.turned(k, product);
    }

    fn elasticity(&mut self, y: &[S], block: &mut [S]) -> bool {
        let count = self.coordinates();
        if count == 0 {
            return false;
        }
        if let (Some(y), Some(block)) = (S::plain(y), S::plain_mut(block)) {
            self.ready = false;
            self.laws.evaluate(y);
            self.laws.elasticity(block);
        } else {
            self.matrix_alone(Part::Elasticity, y, block, 2 * count);
        }
        true
    }

    fn scales(&self, scales: &mut [f64]) {
        let (count, last) = (self.coordinates(), scales.len() - 1);
        scales.fill(1.0);
        scales[..count].fill(COORDINATE_SCALE);
        self.laws.dynamics.drive_scales(&mut scales[2 * count..last]);
        scales[last] = self.interval;
    }
}
