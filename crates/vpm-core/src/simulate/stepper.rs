//! The loop over samples: what happens at a sample, and between two.

use std::mem::take;
use std::ops::Range;

use super::bounds::{Bounds, of_what};
use super::control::{Control, reading};
use super::hold::{Course, Hold, Inputs};
use super::moving::Courses;
use super::names::output_name;
use super::observer::Gains;
use super::sampled::{Astray, SampledDrives};
use super::{Setting, Stepping, diverged, halted, leapt, strayed, troubled};
use crate::delay::SampleDelay;
use crate::description::Description;
use crate::error::{Diverged, Result};
use crate::integrator::Integrator;
use crate::ode::Ode;
use crate::scalar::Scalar;
use crate::sensitivity::{Interrupt, Pair};
use crate::sensor::{Channel, Sensor};
use crate::system::{Calls, Counted, Dynamics, Matrix, System, code_pays, code_pays_in_fits};
use crate::table::Table;

/// Where the commands come from.
#[derive(Clone, Copy)]
pub(crate) enum Drive<'a> {
    /// Given, sample by sample.
    Commands(Inputs<'a>),
    /// From the model's controllers.
    Loop { references: Table<'a>, disturbances: Table<'a> },
}

/// Which pieces of the record to simulate.
#[derive(Clone, Copy)]
pub(crate) struct Plan<'a> {
    /// Where the commands come from.
    pub(crate) drive: Drive<'a>,
    /// State at each start, one after the other.
    pub(crate) initial: &'a [f64],
    /// Sample at which each piece begins.
    pub(crate) starts: &'a [usize],
    /// Samples of a piece.
    pub(crate) horizon: usize,
    /// What corrects the state at every sample, if anything does.
    pub(crate) gains: Option<Gains<'a>>,
    /// Another observer's plan for the second lanes of numbers, if they have any; the longer of both is the horizon.
    pub(crate) beside: Option<Beside<'a>>,
}

/// What differs in a plan from that of the first lanes: an observer of another record.
#[derive(Clone, Copy)]
pub(crate) struct Beside<'a> {
    /// State at its start.
    pub(crate) initial: &'a [f64],
    /// Inputs of its record.
    pub(crate) inputs: Table<'a>,
    /// Its readings.
    pub(crate) readings: Table<'a>,
    /// Gains on these.
    pub(crate) gains: Table<'a>,
}

impl Plan<'_> {
    /// Hold of inputs between samples in the stepper's plan; those of controllers are held.
    fn hold(&self) -> Hold {
        match self.drive {
            Drive::Commands(inputs) => inputs.hold,
            Drive::Loop { .. } => Hold::ZeroOrder,
        }
    }
}

/// A machine on its way through a piece of the record. All buffers are there before the first step.
pub(crate) struct Stepper<'a, S> {
    description: &'a Description,
    plan: Plan<'a>,
    stepping: Stepping,
    system: System<S>,
    integrator: Integrator<S>,
    /// Sensors, each with the column that it reads.
    sensors: Vec<(usize, Sensor<S>)>,
    /// The controllers, if there is a loop to close.
    control: Option<Control<S>>,
    sampled: SampledDrives<S>,
    /// Inputs that move between samples, if they do.
    courses: Option<Courses<S>>,
    bounds: Bounds,
    state: Vec<S>,
    /// Coordinates in plain numbers.
    place: Vec<f64>,
    rate: Vec<S>,
    /// Inputs of the whole record, row by row; given ones from the beginning, a controller's as time goes by.
    commands: Vec<S>,
    /// How many channels there are.
    width: usize,
    /// True channels, row by row, of as many of the last samples as somebody looks back on.
    truth: Vec<S>,
    /// How many that are.
    depth: usize,
    /// States of the piece, row by row, lane after lane.
    states: Vec<f64>,
    /// The state as users know it.
    posture: Vec<S>,
    /// Channels of a sample as the sensors show them.
    shown: Vec<S>,
    /// Those that are asked for, if these are not all.
    asked: Option<&'a [usize]>,
    /// What is asked for of the piece, row by row.
    outputs: Vec<S>,
    /// What the readings of a sample are more than its outputs.
    missed: Vec<S>,
}

impl<'a, S: Scalar> Stepper<'a, S> {
    pub(crate) fn new(setting: &Setting<'a>, plan: &Plan<'a>, theta: &[S]) -> Result<Self> {
        Self::of(setting, plan, theta, setting.description.system_to_step(theta)?)
    }

    /// As [`Stepper::new`], with the machine in a form of its own.
    pub(crate) fn of(setting: &Setting<'a>, plan: &Plan<'a>, theta: &[S], mut system: System<S>) -> Result<Self> {
        let description = setting.description;
        if let Some(gains) = plan.gains {
            if !description.loops.is_empty() {
                system = system.drawn_at(gains.drawn(description.n_coordinates()));
            }
            if gains.is_of_motion(description.layout()) {
                system = system.seen_in_motion();
            }
            if gains.moves.is_some() {
                system = system.with_approximate_derivatives();
            }
        }
        system.make_for(setting.stepping.method)?;
        let (dim, rows, zero) = (system.dim(), plan.horizon, S::zero());
        let bounds = Bounds::new(description, theta, system.dynamics());
        // A closed loop begins with its disturbances, to which the controllers add.
        let (given, control) = match plan.drive {
            Drive::Commands(inputs) => (inputs.table, None),
            Drive::Loop { references, disturbances } => {
                (disturbances, Some(Control::new(setting, theta, rows, references.columns())?))
            }
        };
        let courses = (plan.hold() != Hold::ZeroOrder)
            .then(|| Courses::new(description.n_inputs(), dim, setting.stepping.time_step));
        let (layout, width) = (description.layout(), description.n_outputs());
        let sensors = description.sensors(theta).into_iter().map(|sensor| (sensor.channel.column(layout), sensor));
        let sensors: Vec<_> = sensors.collect();
        let sampled = SampledDrives::new(description, setting.stepping.time_step)?;
        let looks_back = control.is_some() || !sampled.is_empty() || sensors.iter().any(|(_, one)| one.delay.is_some());
        let depth = if looks_back { rows.max(1) } else { 1 };
        let asked = plan.gains.and_then(|gains| gains.alone.then_some(gains.readings.channels));
        Ok(Self {
            description,
            plan: *plan,
            stepping: setting.stepping,
            integrator: Integrator::new(setting.stepping.method, dim + usize::from(courses.is_some())),
            courses,
            bounds,
            sensors,
            control,
            sampled,
            system,
            state: vec![zero; dim],
            place: vec![0.0; description.n_coordinates()],
            rate: vec![zero; dim],
            commands: commands(given, plan),
            truth: vec![zero; depth * width],
            states: vec![0.0; S::LANES * rows * dim],
            posture: vec![zero; dim],
            shown: vec![zero; width],
            outputs: vec![zero; rows * asked.map_or(width, <[usize]>::len)],
            width,
            depth,
            asked,
            missed: Vec::with_capacity(plan.gains.map_or(0, |gains| gains.readings.channels.len())),
        })
    }

    /// Compiles the stepper to machine code where the run is long enough; tells whether all of it has some.
    pub(crate) fn compile_if_it_pays(&mut self) -> bool {
        let Stepping { substeps, method, .. } = self.stepping;
        let evaluations = self.plan.starts.len() * self.plan.horizon * substeps * method.evaluations();
        let (derived, corrected) = (S::has_derivatives(), self.plan.gains.is_some());
        if !(code_pays(evaluations) || ((derived || corrected) && code_pays_in_fits(evaluations))) {
            return false;
        }
        // What has no code runs as it is.
        let made = match self.courses {
            Some(_) => self.compile(),
            None => self.system.compile_steps(method),
        };
        if let Some(control) = self.control.as_ref().filter(|_| made.is_ok()) {
            self.system.compile_answers(control.questions());
        }
        made.is_ok()
    }

    /// Compiles the stepper to machine code, or says why not.
    pub(crate) fn compile(&mut self) -> std::result::Result<(), String> {
        self.system.compile(self.stepping.method)
    }

    pub(crate) fn description(&self) -> &'a Description {
        self.description
    }

    pub(crate) fn stepping(&self) -> Stepping {
        self.stepping
    }

    /// Runs the stepper over all pieces: outputs and states.
    pub(crate) fn run(mut self, interrupt: Interrupt<'_>) -> Result<Pair<S>> {
        let (starts, rows) = (self.plan.starts, self.plan.horizon);
        if let [start] = starts {
            self.piece(0, *start, interrupt)?;
            return Ok(Pair { first: self.outputs, second: self.states });
        }
        let mut all = Pair {
            first: Vec::with_capacity(starts.len() * self.outputs.len()),
            second: Vec::with_capacity(starts.len() * rows * self.state.len()),
        };
        for (number, &start) in starts.iter().enumerate() {
            self.piece(number, start, interrupt)?;
            all.first.extend_from_slice(&self.outputs);
            all.second.extend_from_slice(&self.states);
        }
        Ok(all)
    }

    fn piece(&mut self, number: usize, start: usize, interrupt: Interrupt<'_>) -> Result<()> {
        self.restart(number);
        for row in 0..self.plan.horizon {
            self.sample(row, start)?;
            if row + 1 < self.plan.horizon {
                self.correct(row);
                self.advance(row, start, interrupt)?;
            }
        }
        Ok(())
    }

    /// Restarts the stepper in the initial state of piece `number`.
    pub(crate) fn restart(&mut self, number: usize) {
        let initial = &self.plan.initial[number * self.state.len()..];
        let beside = self.plan.beside.map_or(initial, |other| other.initial);
        for (state, (&value, &other)) in self.state.iter_mut().zip(initial.iter().zip(beside)) {
            *state = S::side_by_side(value, other);
        }
        self.system.enter(&mut self.state);
        self.integrator.reset();
        self.sampled.restart();
        if let Some(control) = &mut self.control {
            control.restart();
        }
    }

    /// Sample of the stepper: measure, command, hold, evaluate, record. `start` is the piece's place in the record.
    pub(crate) fn sample(&mut self, row: usize, start: usize) -> Result<()> {
        let dim = self.state.len();
        if let Some(place) = self.bounds.outside(&self.state) {
            let complaint = self.bounds.complaint(self.description, place, self.state[place]);
            return Err(diverged(self, complaint, row, start));
        }
        if let Some(trouble) = self.system.trouble() {
            return Err(troubled(self, trouble, row, start));
        }
        self.check_stops(row, start)?;
        self.system.show(&self.state, &mut self.posture);
        for lane in 0..S::LANES {
            let states = self.states[(lane * self.plan.horizon + row) * dim..].iter_mut();
            states.zip(&self.posture).for_each(|(state, number)| *state = number.lane(lane));
        }
        self.control(row, start);
        self.hold(row, start).map_err(|astray| strayed(self, astray, (row, start)))?;
        self.record(row, start);
        self.system.depart(&self.rate);
        self.read(row);
        if let Some(column) = self.shown.iter().position(|out| !out.is_finite()) {
            let what = of_what(&output_name(self.description, column), self.shown[column]);
            return Err(diverged(self, (what, Diverged::NOT_FINITE.to_owned()), row, start));
        }
        Ok(())
    }

    /// Advances the stepper from sample `row` of the piece that begins at `start` to the next.
    pub(crate) fn advance(&mut self, row: usize, start: usize, interrupt: Interrupt<'_>) -> Result<()> {
        let (stepping, Self { integrator, system, courses, state, .. }) = (self.stepping, &mut *self);
        let end = match courses {
            Some(courses) => courses.advance(system, integrator, state, stepping.substeps, interrupt),
            None => integrator.advance(system, state, (stepping.time_step, stepping.substeps), interrupt),
        };
        end.map_err(|halt| halted(self.description, stepping, start + row, halt, self.before(row + 1)))
    }

    /// Corrects the stepper's state by gains on readings of sample `row` less its outputs, if there are any.
    fn correct(&mut self, row: usize) {
        let Some(Gains { readings, gains, innovations, .. }) = self.plan.gains else { return };
        let (outputs, beside) = (&self.shown, self.plan.beside);
        let own = last_or(readings.table, row);
        let other = beside.map_or(own, |other| last_or(other.readings, row));
        let mut missed = take(&mut self.missed);
        missed.clear();
        missed.extend(readings.channels.iter().zip(own.iter().zip(other)).map(|(&channel, (&reading, &other))| {
            let predicted = if innovations { S::zero() } else { outputs[channel] };
            S::side_by_side(reading, other) - predicted
        }));
        let (own, other) = (last_or(gains, row), beside.map(|other| last_or(other.gains, row)));
        let moved = |place: usize| {
            let first = place * missed.len();
            let pairs = missed.iter().zip(&own[first..]);
            match other {
                None => pairs.fold(S::zero(), |sum, (&missed, &gain)| sum + missed * gain),
                Some(other) => pairs
                    .zip(&other[first..])
                    .fold(S::zero(), |sum, ((&missed, &gain), &other)| sum + missed * S::side_by_side(gain, other)),
            }
        };
        self.state.iter_mut().enumerate().for_each(|(place, state)| *state += moved(place));
        self.correct_arriving(row, moved);
        self.missed = missed;
        self.system.corrected(&mut self.state);
        // A correction is no event of the machine: what earlier steps have told goes on.
        self.integrator.correct(&self.state);
    }

    /// Corrects positions in the stepper that have not arrived at a delayed sensor by sample `row`. An observer has
    /// `moved` those of the machine. Else it would answer that much later, and a delayed sensor would differ from a
    /// delayed command.
    pub(crate) fn correct_arriving(&mut self, row: usize, moved: impl Fn(usize) -> S) {
        let (width, Self { sensors, truth, stepping, .. }) = (self.width, self);
        for (column, sensor) in &*sensors {
            if let (Channel::Position { joint }, Some(delay)) = (sensor.channel, sensor.delay) {
                for sample in SampleDelay::new(delay, stepping.time_step).arriving(row) {
                    truth[sample * width + column] += moved(joint);
                }
            }
        }
    }

    /// Places the stepper in another state.
    pub(crate) fn place(&mut self, state: impl Iterator<Item = S>) {
        self.state.iter_mut().zip(state).for_each(|(own, other)| *own = other);
        self.integrator.reset();
        self.system.forget();
    }

    /// State of the stepper now.
    pub(crate) fn state(&self) -> &[S] {
        &self.state
    }

    /// Machine of the stepper in plain numbers.
    pub(crate) fn dynamics(&mut self) -> &mut Dynamics<f64> {
        self.system.dynamics()
    }

    /// Settles the stepper's outputs at sample `row` as sensors show them. From then on they are mere numbers for
    /// sensors that look back on them.
    pub(crate) fn settle(&mut self, row: usize, seen: impl FnOnce(&[S])) {
        seen(&self.shown);
        let own = self.own(row);
        self.truth[own].iter_mut().for_each(|number| *number = number.frozen());
    }

    /// Refuses a stepper's piston that went through its stop; steps of controlled error do not let it.
    fn check_stops(&mut self, row: usize, start: usize) -> Result<()> {
        if self.stepping.method.controls_errors() {
            return Ok(());
        }
        self.place.iter_mut().zip(&self.state).for_each(|(value, state)| *value = state.re());
        let Some((number, place, reach)) = self.system.dynamics().piston_outside(&self.place) else {
            return Ok(());
        };
        let what = format!("the piston of actuator `{}`", self.description.actuators[number].name);
        Err(leapt(self, what, place.abs() - reach, (row, start)))
    }

    /// Lets controllers in the stepper command, and records what they see, if there is a loop to close.
    fn control(&mut self, row: usize, start: usize) {
        if self.control.as_ref().is_some_and(|control| control.feels(row)) {
            // Forces under the commands that are still held.
            let own = self.own(row);
            if !self.system.observe_feedback(&self.state, &mut self.truth[own]) {
                self.record(row, start);
            }
        } else if self.control.is_some() || !self.sampled.is_empty() {
            let own = self.own(row);
            self.system.observe_motion(&self.state, &mut self.truth[own]);
        }
        let Drive::Loop { references, .. } = self.plan.drive else { return };
        let Self { control: Some(control), system, state, sensors, truth, commands, .. } = self else { return };
        let (at, outputs) = ((row, self.stepping.time_step), (truth.as_slice(), self.width));
        control.sample(row, references, (system, state), |column| reading(sensors, outputs, at, column));
        let first = row * references.columns();
        control.arrive(row, |actuator, command| commands[first + actuator] += command);
    }

    /// Holds all inputs of the stepper at sample `row` of the piece, and their course until the next. The effort of a
    /// sampled drive is held until then.
    fn hold(&mut self, row: usize, start: usize) -> std::result::Result<(), Astray> {
        let own = self.own(row);
        let Self { system, commands, stepping, description, sampled, courses, plan, truth, .. } = self;
        let (inputs, truth) = (description.n_inputs(), &truth[own]);
        for number in 0..inputs {
            let command = |sample: usize| commands[sample * inputs + number];
            let input = |row: usize| system.input(number, row + start, stepping.time_step, command);
            let now = input(row);
            let effort = sampled.sample(number, row, now, |column| truth[column])?;
            if let Some(courses) = courses {
                let course = || plan.hold().course(row, plan.horizon - 1, input);
                courses.begin(number, effort.map_or_else(course, Course::constant));
            }
            system.hold(number, effort.unwrap_or(now));
        }
        Ok(())
    }

    /// Evaluates the machine at a sample of the stepper and records it.
    fn record(&mut self, row: usize, start: usize) {
        let own = self.own(row);
        self.system.sample(&self.state, &mut self.rate, &mut self.truth[own.clone()]);
        let (layout, inputs) = (self.description.layout(), self.description.n_inputs());
        let truth = &mut self.truth[own];
        let commands = &self.commands[(row + start) * inputs..];
        for (channels, &command) in truth[layout.actuators()..].chunks_exact_mut(2).zip(commands).take(layout.actuators)
        {
            channels[0] = command;
        }
    }

    /// Shows a row of the stepper's outputs as the sensors do.
    fn read(&mut self, row: usize) {
        let own = self.own(row);
        let Self { sensors, truth, shown, outputs, asked, stepping, width, depth, .. } = self;
        shown.copy_from_slice(&truth[own]);
        for (column, sensor) in &*sensors {
            let truth = |sample: usize| truth[sample % *depth * *width + column];
            shown[*column] = sensor.read(row, stepping.time_step, truth);
        }
        match asked {
            Some(asked) => {
                let outputs = outputs[row * asked.len()..].iter_mut();
                outputs.zip(*asked).for_each(|(output, &channel)| *output = shown[channel]);
            }
            None => outputs[row * *width..(row + 1) * *width].copy_from_slice(shown),
        }
    }

    /// Places of the stepper's true channels of sample `row`.
    #[inline]
    fn own(&self, row: usize) -> Range<usize> {
        let first = row % self.depth * self.width;
        first..first + self.width
    }

    /// Values of the stepper's samples before `row`, if all outputs are asked for: outputs and states.
    pub(crate) fn before(&self, row: usize) -> (Vec<f64>, Vec<f64>) {
        let rows = if self.asked.is_none() { row } else { 0 };
        let outputs = self.outputs[..rows * self.width].iter().map(Scalar::re).collect();
        (outputs, self.states[..rows * self.state.len()].to_vec())
    }
}

/// Row of a table; past its end the last.
#[inline]
fn last_or(table: Table<'_>, row: usize) -> &[f64] {
    table.row(row.min(table.rows().saturating_sub(1)))
}

/// Inputs that are `given` in a stepper's plan, row by row.
fn commands<S: Scalar>(given: Table<'_>, plan: &Plan<'_>) -> Vec<S> {
    let Some(beside) = plan.beside else {
        return given.numbers().iter().map(|&command| S::from_f64(command)).collect();
    };
    let rows = (0..plan.horizon).map(|row| last_or(given, row).iter().zip(last_or(beside.inputs, row)));
    rows.flatten().map(|(&first, &second)| S::side_by_side(first, second)).collect()
}

impl Stepper<'_, f64> {
    /// As [`Stepper::advance`], and tells what the integrator asked for.
    pub(crate) fn advance_counted(&mut self, row: usize, start: usize, interrupt: Interrupt<'_>) -> Result<Calls> {
        let (stepping, Self { integrator, system, state, .. }) = (self.stepping, &mut *self);
        let pieces = (stepping.time_step, stepping.substeps);
        let mut counted = Counted { system, calls: Calls { samples: 1, ..Calls::default() } };
        let end = integrator.advance(&mut counted, state, pieces, interrupt);
        let calls = counted.calls;
        end.map_err(|halt| halted(self.description, stepping, start + row, halt, self.before(row + 1)))?;
        Ok(calls)
    }

    /// Seconds of each named part of the stepper's step at the state now, with the matrices that steps need.
    pub(crate) fn parts(&mut self, asked: &Calls) -> Vec<(&'static str, f64)> {
        let Self { system, state, description, stepping, .. } = self;
        let has_code = system.has_code();
        let mut seconds: Vec<_> = match has_code {
            true => vec![("rates", system.rates_seconds(stepping.method, state))],
            false => system.dynamics().parts(state).named().into(),
        };
        for kind in Matrix::ALL.into_iter().filter(|kind| asked.of(kind.name()) > 0.0) {
            seconds.push((kind.name(), system.matrix_seconds(kind, state)));
        }
        let mut seen = vec![0.0; description.n_outputs()];
        seconds.push(match has_code {
            true => ("sample", system.sample_seconds(state, &mut seen)),
            false => ("sensors", system.dynamics().observing(state, &mut seen)),
        });
        seconds
    }
}
