//! A simulation that somebody else drives: one sample at a time, with commands that depend on what was seen.

use std::sync::Arc;

use rayon::prelude::*;

use crate::description::Description;
use crate::error::{Diverged, Error, Result};
use crate::integrator::Integrator;
use crate::ode::Ode;
use crate::sensor::Sensor;
use crate::simulate::{
    Bounds, SampledDrives, Stepping, check_start, check_state, check_step, halted, output_name, repair,
    trouble_in_words,
};
use crate::system::System;
use crate::table::Table;

/// What an input stands for.
const INPUT: &str = "actuator and logged supply";
/// Steps that are worth a piece of their own: shorter ones cost more to hand over than to take.
const WORTH: usize = 64;
/// Samples that a delay may reach back.
const LONGEST_DELAY: f64 = 1e6;

/// A machine under commands that come one by one, with the memory that its delays need.
///
/// At sample k the state is x_k; [`Live::step`] holds a command from there to sample k + 1 and shows what the sensors see at its end,
/// the command still held. Positions and velocities are those of a free run; a step allocates nothing. A step that fails leaves state,
/// outputs and time those of the sample before, and every later step fails like it until [`Live::reset`].
#[derive(Clone, Debug)]
pub struct Live {
    description: Arc<Description>,
    stepping: Stepping,
    theta: Vec<f64>,
    system: System<f64>,
    integrator: Integrator<f64>,
    sensors: Vec<Sensor<f64>>,
    sampled: SampledDrives,
    bounds: Bounds,
    /// The state in the coordinates of the steps.
    local: Vec<f64>,
    /// The same as users know it.
    state: Vec<f64>,
    rate: Vec<f64>,
    outputs: Vec<f64>,
    /// State and outputs on their way to the next sample.
    next: (Vec<f64>, Vec<f64>),
    /// Why it cannot go on.
    lost: Option<Error>,
    /// Inputs and true channels of the last samples, sample k in row `k % depth`.
    commands: Vec<f64>,
    truth: Vec<f64>,
    depth: usize,
    sample: usize,
}

impl Live {
    /// Live machine in `state`, no command given yet.
    pub fn new(description: Arc<Description>, theta: &[f64], state: &[f64], stepping: Stepping) -> Result<Self> {
        check_state("state", &description, state)?;
        check_step(&description, theta, stepping, state)?;
        let mut system: System<f64> = description.system_to_step(theta)?;
        system.make_for(stepping.method)?;
        let (dim, sensors) = (system.dim(), description.sensors(theta));
        let depth = depth(&description, theta, stepping.time_step)?;
        let bounds = Bounds::new(&description, theta, system.dynamics());
        let (outputs, inputs) = (description.n_outputs(), description.n_inputs());
        let mut live = Self {
            stepping,
            theta: theta.to_vec(),
            system,
            integrator: Integrator::new(stepping.method, dim),
            bounds,
            sensors,
            sampled: SampledDrives::new(&description, stepping.time_step)?,
            local: vec![0.0; dim],
            state: vec![0.0; dim],
            rate: vec![0.0; dim],
            outputs: vec![0.0; outputs],
            next: (vec![0.0; dim], vec![0.0; outputs]),
            lost: None,
            commands: vec![0.0; depth * inputs],
            truth: vec![0.0; depth * outputs],
            depth,
            sample: 0,
            description,
        };
        live.reset(state)?;
        Ok(live)
    }

    /// Compiles the live machine, if the description has no code yet. That takes up to some tenths of a second now, and
    /// none later.
    ///
    /// # Errors
    /// Why there is no machine code, in one sentence; then the simulation goes on by direct evaluation.
    pub fn compile(&mut self) -> std::result::Result<(), String> {
        self.system.compile(self.stepping.method)?;
        self.rest();
        Ok(())
    }

    /// Whether the live machine goes on by machine code.
    pub fn is_compiled(&mut self) -> bool {
        self.system.has_code()
    }

    /// Description of the live machine.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Whether another live simulation has the same machine, parameters and steps, at whatever time.
    pub fn is_alike(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.description, &other.description)
            && self.stepping == other.stepping
            && self.theta == other.theta
    }

    /// Parameters of the live machine.
    pub fn parameters(&self) -> &[f64] {
        &self.theta
    }

    /// State of the live machine now.
    pub fn state(&self) -> &[f64] {
        &self.state
    }

    /// Outputs of the live machine now, as sensors show them.
    pub fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    /// Time of the live machine since the beginning, s.
    pub fn time(&self) -> f64 {
        self.sample as f64 * self.stepping.time_step
    }

    /// Resets the live machine to `state` at time zero, with no command and nothing remembered.
    pub fn reset(&mut self, state: &[f64]) -> Result<()> {
        check_state("state", &self.description, state)?;
        let mut start = state.to_vec();
        self.system.enter(&mut start);
        let Self { description, theta, system, .. } = self;
        if let Err(error) = check_start(description, theta, system.dynamics(), &start) {
            self.local.copy_from_slice(&self.state);
            self.system.enter(&mut self.local);
            return Err(error);
        }
        self.local = start;
        self.sample = 0;
        self.integrator.reset();
        self.commands.fill(0.0);
        self.feed();
        self.sampled.restart();
        self.rest();
        self.lost = self.observe(0).err();
        self.lost.clone().map_or(Ok(()), Err)
    }

    /// Puts logged supplies of the live machine at their own pressure, until one is given.
    fn feed(&mut self) {
        let (actuators, inputs) = (self.description.n_actuators(), self.description.n_inputs());
        for row in self.commands.chunks_exact_mut(inputs.max(1)) {
            let logged = self.description.supplies.iter().filter(|supply| supply.is_logged());
            for (input, supply) in row[actuators..].iter_mut().zip(logged) {
                *input = self.theta[supply.pressure];
            }
        }
    }

    /// Steps the live machine: holds the inputs for the time of one sample, and shows the outputs at its end. There is
    /// a command for each actuator, a pressure for each logged supply.
    pub fn step(&mut self, inputs: &[f64]) -> Result<&[f64]> {
        Table::vector("inputs", inputs, self.description.n_inputs(), INPUT)?;
        if let Some(error) = &self.lost {
            return Err(error.clone());
        }
        if let Err(error) = self.go_on(inputs) {
            self.lost = Some(error.clone());
            return Err(error);
        }
        Ok(&self.outputs)
    }

    fn go_on(&mut self, inputs: &[f64]) -> Result<()> {
        let width = inputs.len();
        let row = self.sample % self.depth;
        self.commands[row * width..(row + 1) * width].copy_from_slice(inputs);
        self.hold()?;
        let (pieces, sample) = ((self.stepping.time_step, self.stepping.substeps), self.sample);
        self.integrator
            .advance(&mut self.system, &mut self.local, pieces, &|| false)
            .map_err(|halt| halted(&self.description, self.stepping, sample, halt, (Vec::new(), Vec::new())))?;
        self.observe(sample + 1)
    }

    /// Holds on the live machine's actuators and supplies what inputs amount to over the coming interval. Sampled
    /// drives that are due act.
    fn hold(&mut self) -> Result<()> {
        for number in 0..self.description.n_inputs() {
            let input = self.arrived(number);
            let Self { description, sampled, truth, outputs, stepping, sample, depth, .. } = self;
            let truth = &truth[*sample % *depth * outputs.len()..];
            let effort = sampled.sample(number, *sample, input, |column| truth[column]).map_err(|astray| {
                let at = (*sample as f64 * stepping.time_step, *sample);
                astray.error(description, at, stepping.method.to_string(), stepping.step())
            })?;
            self.system.hold(number, effort.unwrap_or(input));
        }
        Ok(())
    }

    /// As [`Live::hold`] before the first command.
    fn rest(&mut self) {
        if !self.sampled.is_empty() && self.local.iter().all(|number| number.is_finite()) {
            let (state, width) = (&self.local, self.outputs.len());
            self.system.observe_motion(state, &mut self.truth[..width]);
        }
        for number in 0..self.description.n_inputs() {
            let input = self.arrived(number);
            let effort = self.sampled.rest(number, input, |column| self.truth[column]);
            self.system.hold(number, effort.unwrap_or(input));
        }
    }

    /// Input `number` of the live machine that arrives over the coming interval.
    fn arrived(&self, number: usize) -> f64 {
        let Self { system, commands, depth, sample, description, .. } = self;
        let inputs = description.n_inputs();
        let command = |sample: usize| commands[(sample % *depth) * inputs + number];
        system.input(number, *sample, self.stepping.time_step, command)
    }

    /// Observes the live machine's next state at `sample`, if it and the readings are what they can be.
    fn observe(&mut self, sample: usize) -> Result<()> {
        if let Some(place) = self.bounds.outside(&self.local) {
            let (what, event) = self.bounds.complaint(&self.description, place, self.local[place]);
            return Err(self.astray(sample, what, event, repair(self.stepping.method)));
        }
        if let Some(trouble) = self.system.trouble() {
            let (what, event, repair) = trouble_in_words(&self.description, trouble);
            return Err(self.astray(sample, what, event, repair));
        }
        let (state, outputs) = (&mut self.next.0, &mut self.next.1);
        self.system.show(&self.local, state);
        let (layout, width) = (self.description.layout(), outputs.len());
        let row = sample % self.depth * width;
        let truth = &mut self.truth[row..row + width];
        self.system.sample(&self.local, &mut self.rate, truth);
        // The command that is still held at the end of its interval; none before the first.
        let held = sample.saturating_sub(1) % self.depth * self.description.n_inputs();
        let channels = self.truth[row + layout.actuators()..row + layout.lines()].chunks_exact_mut(2);
        for (channels, &command) in channels.zip(&self.commands[held..]) {
            channels[0] = command;
        }
        outputs.copy_from_slice(&self.truth[row..row + width]);
        for sensor in &self.sensors {
            let column = sensor.channel.column(layout);
            let truth = |sample: usize| self.truth[(sample % self.depth) * width + column];
            outputs[column] = sensor.read(sample, self.stepping.time_step, truth);
        }
        // A state may be finite still where its rate is not.
        if let Some(column) = outputs.iter().position(|output| !output.is_finite()) {
            let what = format!("the {}", output_name(&self.description, column));
            let event = Diverged::NOT_FINITE.to_owned();
            return Err(self.astray(sample, what, event, repair(self.stepping.method)));
        }
        std::mem::swap(&mut self.state, &mut self.next.0);
        std::mem::swap(&mut self.outputs, &mut self.next.1);
        self.sample = sample;
        Ok(())
    }

    #[cold]
    fn astray(&self, sample: usize, what: String, event: String, repair: &'static str) -> Error {
        Error::Diverged(Box::new(Diverged {
            what,
            event,
            time: sample as f64 * self.stepping.time_step,
            sample_index: sample,
            method: self.stepping.method.to_string(),
            step: self.stepping.step(),
            repair,
            outputs: Vec::new(),
            states: Vec::new(),
        }))
    }
}

/// Steps many live simulations of the same machine, on several threads; what became of each. Inputs (row by row, one
/// row each) are held over so many samples. A simulation does the same as by [`Live::step`], whatever the others do.
pub fn step_all(lives: &mut [&mut Live], inputs: Table<'_>, samples: usize) -> Result<Vec<Result<()>>> {
    let width = lives.first().map_or(0, |live| live.description.n_inputs());
    inputs.expect("inputs", lives.len(), width)?;
    let least = (WORTH / samples.max(1)).max(1);
    let one =
        |(row, live): (usize, &mut &mut Live)| (0..samples).try_for_each(|_| live.step(inputs.row(row)).map(|_| ()));
    Ok(lives.par_iter_mut().with_min_len(least).enumerate().map(|(row, live)| one((row, live))).collect())
}

/// Samples that a live machine remembers: the longest delay, interpolation beyond it, and the sample itself.
fn depth(description: &Description, theta: &[f64], time_step: f64) -> Result<usize> {
    let of_actuators = description.actuators.iter().filter_map(|actuator| actuator.delay.as_ref().map(|d| d.time));
    let of_sensors = description.sensors.iter().filter_map(|sensor| sensor.delay);
    let longest = of_actuators.chain(of_sensors).map(|place| theta[place] / time_step).fold(0.0, f64::max);
    if longest > LONGEST_DELAY {
        let condition = format!("be no shorter than a millionth of the longest delay of {} s", longest * time_step);
        return Err(Error::Setting { setting: "time_step", condition, value: time_step, repair: "shorten the delay" });
    }
    Ok(longest.ceil() as usize + 3)
}
