//! Drives and supplies of a machine: what they push, and how their states change.

use super::Dynamics;
use crate::actuator::hydraulic::{Chambers, Source, Supply};
use crate::actuator::{Actuator, Drive, Maxwell, SpringDamper, Target};
use crate::data::LineSlot;
use crate::dynamics::flexible;
use crate::scalar::Scalar;

/// What drives and supplies show beside their forces, in the state last evaluated.
#[derive(Clone, Debug)]
pub(super) struct Shown<S> {
    /// Spool, pressures a and b (Pa), flows into a and out of b (m^3/s) of each hydraulic drive.
    pub(super) hydraulics: Vec<[S; 5]>,
    /// Current of each motor, A.
    pub(super) currents: Vec<S>,
    /// Pressure (Pa) of each supply, and the flow (m^3/s) drawn from it.
    pub(super) supplies: Vec<[S; 2]>,
    /// What is lost between each supply and its valves, Pa.
    pub(super) drops: Vec<S>,
    /// Flow (m^3/s) that each hydraulic drive draws.
    pub(super) drawn: Vec<S>,
}

impl<S: Scalar> Shown<S> {
    pub(super) fn new(actuators: &[Actuator<S>], supplies: &[Supply<S>]) -> Self {
        let count = |kind: fn(&Drive<S>) -> bool| actuators.iter().filter(|actuator| kind(&actuator.drive)).count();
        let cylinders = count(|drive| matches!(drive, Drive::Hydraulic(_)));
        Self {
            hydraulics: vec![[S::zero(); 5]; cylinders],
            drawn: vec![S::zero(); cylinders],
            currents: vec![S::zero(); count(|drive| matches!(drive, Drive::DcMotor(_)))],
            drops: vec![S::zero(); supplies.len()],
            supplies: supplies.iter().map(|supply| [supply.pressure, S::zero()]).collect(),
        }
    }

    /// Pressures of the cylinders (Pa) as shown, in the order of the hydraulic drives.
    pub(super) fn chambers(&self) -> impl Iterator<Item = Chambers<S>> {
        self.hydraulics.iter().map(|&[_, a, b, ..]| Chambers { a, b })
    }
}

/// Motion of what a drive acts on: length or coordinate, and its rate.
#[inline]
pub(super) fn motion<S: Scalar>(on: Target, q: &[S], v: &[S], lines: &[LineSlot<S>]) -> [S; 2] {
    match on {
        Target::Joint(joint) => [q[joint], v[joint]],
        Target::Line(line) => [lines[line].length, lines[line].rate()],
    }
}

impl<S: Scalar> Dynamics<S> {
    /// Efforts and tensions of all drives, and rates of the states of drives and supplies, at state `x`. Lines are
    /// where they were placed before.
    #[inline]
    pub(super) fn actuate(&mut self, x: &[S], dxdt: &mut [S]) {
        let first = 2 * self.coordinates();
        if self.ideal {
            self.actuate_ideal(&x[first..], &mut dxdt[first..]);
        } else {
            let (q, v) = x[..first].split_at(self.coordinates());
            self.actuate_moving(&x[first..], &mut dxdt[first..], |on, lines| motion(on, q, v, lines));
        }
    }

    /// Rates of the states of drives, supplies and memories at state `x`, written into `dxdt`, and drive efforts.
    pub(crate) fn drive(&mut self, x: &[S], dxdt: &mut [S]) {
        let (q, v) = x[..2 * self.coordinates()].split_at(self.coordinates());
        self.locate(q, v);
        self.actuate(x, dxdt);
        self.remember(x, dxdt);
    }

    /// Rates of the memories at state `x`, written into `dxdt`; the memories are held.
    pub(super) fn remember(&mut self, x: &[S], dxdt: &mut [S]) {
        let (n, first) = (self.coordinates(), self.first_memory());
        self.memories.rates(&x[first..], &x[n..2 * n], &mut dxdt[first..]);
    }

    /// Holds input `number` of the drives, see [`super::System::input`].
    pub fn hold(&mut self, number: usize, input: S) {
        match number.checked_sub(self.inputs.len()) {
            None => self.inputs[number] = input,
            Some(place) => self.model.orient(place, input),
        }
    }

    /// Number of inputs that the drives hold.
    pub(crate) fn n_inputs(&self) -> usize {
        self.inputs.len()
    }

    /// Number of held values of the drives: inputs, then orientations of freely turning joints.
    pub(crate) fn n_held(&self) -> usize {
        self.inputs.len() + self.model.n_orientations()
    }

    /// Adds the efforts of the drives to `loads` on all coordinates, after [`Dynamics::drive`] in the same state.
    pub(crate) fn add_drives(&self, loads: &mut [S]) {
        for (load, &effort) in loads.iter_mut().zip(&self.efforts) {
            *load += effort;
        }
        if self.pulls {
            flexible::add_line_forces(&self.data, &self.tensions, loads);
        }
    }

    /// Efforts of ideal drives, as [`Dynamics::actuate`] where all follow from commands alone.
    #[inline]
    fn actuate_ideal(&mut self, lags: &[S], rates: &mut [S]) {
        self.efforts.fill(S::zero());
        self.tensions.fill(S::zero());
        let mut states = lags.iter().zip(rates);
        for ((actuator, &input), force) in self.actuators.iter().zip(&self.inputs).zip(&mut self.forces) {
            let input = match (&actuator.lag, if actuator.lag.is_some() { states.next() } else { None }) {
                (Some(lag), Some((&state, rate))) => {
                    *rate = lag.rate(state, input);
                    state
                }
                _ => input,
            };
            // Drives of no other kind come here.
            let Some(effort) = actuator.drive.direct(input) else { continue };
            *force = effort;
            match actuator.on {
                Target::Joint(joint) => self.efforts[joint] += *force,
                Target::Line(line) => self.tensions[line] += *force,
            }
        }
    }

    /// Efforts of drives of every kind in their `states`, each at the length and rate that `motion` tells.
    pub(super) fn actuate_moving(
        &mut self,
        states: &[S],
        rates: &mut [S],
        motion: impl Fn(Target, &[LineSlot<S>]) -> [S; 2],
    ) {
        self.efforts.fill(S::zero());
        self.tensions.fill(S::zero());
        if !self.supplies.is_empty() {
            self.feed(states);
        }
        let Self { actuators, supplies, inputs, data, shown, seals, .. } = self;
        let (mut at, mut motors, mut cylinders) = (0, 0, 0);
        for (number, actuator) in actuators.iter().enumerate() {
            let mut input = inputs[number];
            if let Some(lag) = &actuator.lag {
                rates[at] = lag.rate(states[at], input);
                input = states[at];
                at += 1;
            }
            let moving = || motion(actuator.on, &data.composite.lines);
            let force = match &actuator.drive {
                Drive::Ideal(law) => law.effort(input),
                Drive::Narx(_) | Drive::MaxwellNarx(_) => input,
                Drive::Table(law) => law.effort(input, moving()[1]),
                Drive::DcMotor(law) => {
                    let (current, [_, rate]) = (states[at], moving());
                    rates[at] = law.current_rate(current, input, rate);
                    shown.currents[motors] = current;
                    (at, motors) = (at + 1, motors + 1);
                    if seals[number].is_none() { law.effort(current, rate) } else { law.driving(current) }
                }
                Drive::SpringDamper(law) => {
                    let [length, rate] = moving();
                    SpringDamper { free_length: law.free_length + input, ..*law }.force(length, rate)
                }
                Drive::Maxwell(law) => {
                    let (stretch, [length, _]) = (states[at], moving());
                    let law = Maxwell { free_length: law.free_length + input, ..*law };
                    rates[at] = law.rate(length, stretch);
                    at += 1;
                    -law.force(length, stretch)
                }
                Drive::Hydraulic(law) => {
                    let [length, rate] = moving();
                    let (piston, [pressure, drawn]) = (law.piston(length), &mut shown.supplies[law.supply]);
                    let pressure = *pressure - shown.drops[law.supply];
                    let own = at..at + law.states().len();
                    let fed = (&supplies[law.supply], pressure);
                    let action = law.action(&states[own.clone()], &mut rates[own.clone()], input, [piston, rate], fed);
                    *drawn += action.flows.supply;
                    shown.drawn[cylinders] = action.flows.supply;
                    let (pressures, flows) = (action.pressures, action.flows);
                    shown.hydraulics[cylinders] =
                        [action.spool, pressures.a, pressures.b, flows.into_a, flows.out_of_b];
                    (at, cylinders) = (own.end, cylinders + 1);
                    let seal = if seals[number].is_none() { law.cylinder.rubbing(rate, pressures) } else { S::zero() };
                    action.force + seal
                }
            };
            self.driven[number] = force;
            let force = match seals[number] {
                Some(resistance) => force - resistance * moving()[1],
                None if actuator.friction.is_some() => force - actuator.friction(force, moving()[1]),
                None => force,
            };
            self.forces[number] = force;
            match actuator.on {
                Target::Joint(joint) => self.efforts[joint] += force,
                Target::Line(line) => self.tensions[line] += force,
            }
        }
        if !self.supplies.is_empty() {
            self.sag(&mut rates[at..]);
        }
    }

    /// Pressures of the drives' supplies before any flow is drawn.
    fn feed(&mut self, states: &[S]) {
        let Self { supplies, inputs, shown, actuators, internal, .. } = self;
        let mut logged = inputs[actuators.len()..].iter();
        let count: usize = supplies.iter().map(|supply| supply.states().count()).sum();
        let mut own = states[*internal - count..].iter();
        for ((supply, shown), lost) in supplies.iter().zip(&mut shown.supplies).zip(&mut shown.drops) {
            let pressure = match supply.source {
                Source::Constant => None,
                Source::Logged => logged.next(),
                Source::Sagging(_) => own.next(),
            };
            *shown = [pressure.copied().unwrap_or(supply.pressure), S::zero()];
            let drop = if supply.drop.is_some() { own.next() } else { None };
            *lost = drop.copied().unwrap_or_default();
        }
    }

    /// Rates of the states of the drives' supplies, whose pressure sags.
    fn sag(&self, rates: &mut [S]) {
        let mut rates = rates.iter_mut();
        for ((supply, &[pressure, flow]), &drop) in
            self.supplies.iter().zip(&self.shown.supplies).zip(&self.shown.drops)
        {
            if let Source::Sagging(law) = &supply.source
                && let Some(rate) = rates.next()
            {
                *rate = law.rate(pressure, supply.pressure, flow);
            }
            if let Some(law) = &supply.drop
                && let Some(rate) = rates.next()
            {
                *rate = law.rate(drop, flow);
            }
        }
    }
}

/// Input `number` of drives over the interval from sample `k`: after delay, dead zone and saturation. That of a supply
/// is as it is.
#[inline]
pub(super) fn input<S: Scalar>(
    actuators: &[Actuator<S>],
    number: usize,
    (k, time_step): (usize, f64),
    command: impl Fn(usize) -> S,
) -> S {
    match actuators.get(number) {
        Some(actuator) => actuator.input(k, time_step, command),
        None => command(k),
    }
}
