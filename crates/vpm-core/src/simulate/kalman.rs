//! An extended Kalman filter that is fed sample by sample.
//!
//! Law and noise are those of [`super::filter`], whose record it follows to rounding; here the samples come one by one, and a reading that
//! is no number is one that did not come.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::observer::{Noise, OBSERVED, add_process, corrected, gain, take};
use super::{Bounds, Stepping, check_state, check_step, halted, output_name, repair, trouble_in_words};
use crate::description::Description;
use crate::error::{Diverged, Error, Result};
use crate::integrator::Integrator;
use crate::scalar::Dual;
use crate::sensitivity::LANES;
use crate::sensor::Sensor;
use crate::system::System;
use crate::table::Table;

/// A number with its derivatives along some of the states.
type Number = Dual<f64, LANES>;

/// A filter of a machine with fixed parameters.
#[derive(Clone, Debug)]
pub struct Kalman {
    description: Arc<Description>,
    stepping: Stepping,
    system: System<Number>,
    integrator: Integrator<Number>,
    sensors: Vec<Sensor<Number>>,
    bounds: Bounds,
    channels: Vec<usize>,
    readings: Vec<f64>,
    forces: Vec<f64>,
    states: Vec<f64>,
    sample: usize,
    /// State and covariance before the readings of this sample.
    state: DVector<f64>,
    covariance: DMatrix<f64>,
    /// A gain that stays.
    steady: Option<DMatrix<f64>>,
    lost: Option<Error>,
    lifted: Vec<Number>,
    rate: Vec<Number>,
    shown: Vec<Number>,
    linear: Linear,
    found: Estimate,
}

/// What the readings of a sample give.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The state, corrected by them.
    pub state: DVector<f64>,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
    /// Readings less outputs; no number where there was no reading.
    pub innovation: DVector<f64>,
    /// Covariance of these, of all channels.
    pub spread: DMatrix<f64>,
}

/// The machine near its state.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Derivative of the next state by this one.
    pub transition: DMatrix<f64>,
    /// Derivative of the measured outputs by the state.
    pub output: DMatrix<f64>,
    /// Covariance of what moves the state over a sample for no known reason.
    pub process: DMatrix<f64>,
    predicted: DVector<f64>,
    next: DVector<f64>,
}

impl Kalman {
    /// Kalman filter that begins in `state` with the noise's deviations of the first state.
    ///
    /// # Errors
    /// As [`super::filter`], and [`Error::Setting`] for a machine with delays, which remembers what no state holds.
    pub fn new(
        description: Arc<Description>,
        theta: &[f64],
        state: &[f64],
        (channels, noise): (&[usize], Noise<'_>),
        stepping: Stepping,
    ) -> Result<Self> {
        description
            .refuse_sampled("no observer can correct it", "use an ideal drive that is given the measured effort")?;
        description.refuse_loops(OBSERVED, "compare free runs instead")?;
        check_state("state", &description, state)?;
        noise.check(&description, channels.len())?;
        let count = description.n_outputs();
        if let Some(&index) = channels.iter().find(|&&channel| channel >= count) {
            let what = "the list of measured channels".to_owned();
            return Err(Error::Reference { what, target: "output", index, count });
        }
        check_step(&description, theta, stepping, state)?;
        prompt(&description, theta)?;
        let lifted: Vec<Number> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let mut system: System<Number> = description.system(&lifted)?;
        system.make_for(stepping.method)?;
        let (nx, m) = (state.len(), channels.len());
        let variance = DVector::from_iterator(nx, noise.first.iter().map(|deviation| deviation * deviation));
        let (state, covariance) = (DVector::from_column_slice(state), DMatrix::from_diagonal(&variance));
        Ok(Self {
            integrator: Integrator::new(stepping.method, nx),
            sensors: description.sensors(&lifted),
            bounds: Bounds::new(&description, &lifted, system.dynamics()),
            channels: channels.to_vec(),
            readings: noise.readings.to_vec(),
            forces: noise.forces.to_vec(),
            states: noise.states.to_vec(),
            sample: 0,
            steady: None,
            lost: None,
            lifted: vec![Number::default(); nx],
            rate: vec![Number::default(); nx],
            shown: vec![Number::default(); count],
            linear: Linear {
                transition: DMatrix::zeros(nx, nx),
                output: DMatrix::zeros(m, nx),
                process: DMatrix::zeros(nx, nx),
                predicted: DVector::zeros(m),
                next: state.clone(),
            },
            found: Estimate {
                innovation: DVector::zeros(m),
                spread: DMatrix::zeros(m, m),
                state: state.clone(),
                covariance: covariance.clone(),
            },
            state,
            covariance,
            system,
            stepping,
            description,
        })
    }

    /// Machine of the Kalman filter.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Estimate of the Kalman filter after the last readings; before the first, the known beginning.
    pub fn estimate(&self) -> &Estimate {
        &self.found
    }

    /// State that the Kalman filter expects at the coming sample.
    pub fn expected(&self) -> &[f64] {
        self.state.as_slice()
    }

    /// Resets the Kalman filter to `state` with this covariance, nx x nx.
    pub fn reset(&mut self, state: &[f64], covariance: &[f64]) -> Result<()> {
        check_state("state", &self.description, state)?;
        let nx = state.len();
        Table::vector("covariance", covariance, nx * nx, "entry of nx x nx")?;
        self.state.copy_from_slice(state);
        self.covariance = DMatrix::from_row_slice(nx, nx, covariance);
        self.found.state.copy_from(&self.state);
        if self.steady.is_none() {
            self.found.covariance.copy_from(&self.covariance);
        }
        (self.sample, self.lost) = (0, None);
        Ok(())
    }

    /// Holds this Kalman gain (nx x m) from now on. The estimate then has this covariance (nx x nx) and the innovations
    /// that one (m x m).
    pub fn hold_gain(&mut self, (gain, covariance, spread): (&[f64], &[f64], &[f64])) -> Result<()> {
        let (nx, m) = (self.state.len(), self.channels.len());
        Table::vector("gain", gain, nx * m, "entry of nx x channels")?;
        Table::vector("covariance", covariance, nx * nx, "entry of nx x nx")?;
        Table::vector("covariance of innovations", spread, m * m, "entry of channels x channels")?;
        self.steady = Some(DMatrix::from_row_slice(nx, m, gain));
        self.found.covariance = DMatrix::from_row_slice(nx, nx, covariance);
        self.found.spread = DMatrix::from_row_slice(m, m, spread);
        Ok(())
    }

    /// Machine linearised near the Kalman filter's expected state under these inputs.
    pub fn linearised(&mut self, inputs: &[f64]) -> Result<&Linear> {
        self.expect(inputs)?;
        self.hold(inputs);
        self.look(true)?;
        self.advance(true)?;
        Ok(&self.linear)
    }

    /// Step of the Kalman filter: corrects the state by readings and carries it on, with the inputs held. Readings of
    /// outputs that depend on inputs are those under these inputs.
    pub fn step(&mut self, readings: &[f64], inputs: &[f64]) -> Result<&Estimate> {
        let (expected, found) = (self.channels.len(), readings.len());
        if found != expected {
            let (what, each) = ("readings".to_owned(), "measured channel".to_owned());
            return Err(Error::Dimension { what, expected, found, each });
        }
        if let Some(place) = readings.iter().position(|reading| reading.is_infinite()) {
            return Err(Error::NonFinite { path: format!("readings[{place}]"), value: readings[place] });
        }
        self.expect(inputs)?;
        if let Some(error) = &self.lost {
            return Err(error.clone());
        }
        if let Err(error) = self.go_on(readings, inputs) {
            self.lost = Some(error.clone());
            return Err(error);
        }
        Ok(&self.found)
    }

    fn go_on(&mut self, readings: &[f64], inputs: &[f64]) -> Result<()> {
        let changing = self.steady.is_none();
        self.hold(inputs);
        self.look(changing)?;
        self.found.innovation = DVector::from_column_slice(readings) - &self.linear.predicted;
        match &self.steady {
            Some(gain) => {
                // What did not come is taken to be as expected.
                let innovation = self.found.innovation.map(|number| if number.is_nan() { 0.0 } else { number });
                self.state += gain * innovation;
            }
            None => self.correct()?,
        }
        self.found.state.copy_from(&self.state);
        self.advance(changing)?;
        if changing {
            let Linear { transition, process, .. } = &self.linear;
            self.covariance = transition * &self.covariance * transition.transpose() + process;
        }
        self.state.copy_from(&self.linear.next);
        self.sample += 1;
        Ok(())
    }

    /// Kalman correction of state and covariance by the readings that came.
    fn correct(&mut self) -> Result<()> {
        let came: Vec<usize> =
            (0..self.channels.len()).filter(|&place| !self.found.innovation[place].is_nan()).collect();
        let (_, spread) = gain(&self.covariance, &self.linear.output, &self.readings, self.sample)?;
        self.found.spread = spread;
        if !came.is_empty() {
            let output = self.linear.output.select_rows(&came);
            let deviations: Vec<f64> = came.iter().map(|&place| self.readings[place]).collect();
            let (gain, _) = gain(&self.covariance, &output, &deviations, self.sample)?;
            self.state += &gain * self.found.innovation.select_rows(&came);
            self.covariance = corrected(&self.covariance, &gain, &output, &deviations);
        }
        self.found.covariance.copy_from(&self.covariance);
        Ok(())
    }

    fn expect(&self, inputs: &[f64]) -> Result<()> {
        Table::vector("inputs", inputs, self.description.n_inputs(), "actuator and logged supply").map(|_| ())
    }

    fn hold(&mut self, inputs: &[f64]) {
        for (number, &input) in inputs.iter().enumerate() {
            let arrived = self.system.input(number, 0, self.stepping.time_step, |_| Number::constant(input));
            self.system.hold(number, arrived);
        }
        let layout = self.description.layout();
        let channels = self.shown[layout.actuators()..layout.lines()].chunks_exact_mut(2);
        channels.zip(inputs).for_each(|(channels, &input)| channels[0] = Number::constant(input));
    }

    /// Passes of an evaluation in the Kalman filter: one, or as many as give all derivatives.
    fn passes(&self, derived: bool) -> impl Iterator<Item = usize> + use<> {
        (0..if derived { self.state.len() } else { 1 }).step_by(LANES)
    }

    /// Seeds the Kalman filter's state with derivatives along [`LANES`] directions from `first` on.
    fn seed(&mut self, first: usize) {
        for (place, (number, &value)) in self.lifted.iter_mut().zip(&self.state).enumerate() {
            // A direction before `first` wraps around to a lane that does not exist, which gives a constant.
            *number = Dual::variable(value, place.wrapping_sub(first));
        }
        self.system.forget();
        self.integrator.reset();
    }

    /// Measured outputs at the Kalman filter's state, and their derivative by it.
    fn look(&mut self, derived: bool) -> Result<()> {
        if let Some(place) = self.bounds.outside(self.state.as_slice()) {
            let (what, event) = self.bounds.complaint(&self.description, place, self.state[place]);
            return Err(self.astray(what, event, repair(self.stepping.method)));
        }
        for first in self.passes(derived) {
            self.seed(first);
            self.observe();
            for (place, &channel) in self.channels.iter().enumerate() {
                self.linear.predicted[place] = self.shown[channel].value;
                take(&mut self.linear.output, place, first, &self.shown[channel]);
            }
        }
        match self.channels.iter().position(|&channel| !self.shown[channel].value.is_finite()) {
            None => Ok(()),
            Some(place) => {
                let what = format!("the {}", output_name(&self.description, self.channels[place]));
                Err(self.astray(what, Diverged::NOT_FINITE.to_owned(), repair(self.stepping.method)))
            }
        }
    }

    /// All outputs of the Kalman filter as the sensors show them.
    fn observe(&mut self) {
        let (layout, held) = (self.description.layout(), self.shown.clone());
        self.system.sample(&self.lifted, &mut self.rate, &mut self.shown);
        let commands = layout.actuators()..layout.lines();
        for (channels, held) in self.shown[commands.clone()].chunks_exact_mut(2).zip(held[commands].chunks_exact(2)) {
            channels[0] = held[0];
        }
        for sensor in &self.sensors {
            let reading = &mut self.shown[sensor.channel.column(layout)];
            *reading = sensor.show(*reading);
        }
    }

    /// Next state of the Kalman filter, its derivative by this one, and the process noise.
    fn advance(&mut self, derived: bool) -> Result<()> {
        let pieces = (self.stepping.time_step, self.stepping.substeps);
        let pushed =
            derived.then(|| super::observer::pushed(self.system.dynamics(), self.state.as_slice(), &self.forces));
        for first in self.passes(derived) {
            self.seed(first);
            let Self { integrator, system, lifted, description, stepping, sample, .. } = self;
            integrator
                .advance(system, lifted, pieces, &|| false)
                .map_err(|halt| halted(description, *stepping, *sample, halt, (Vec::new(), Vec::new())))?;
            for (place, reached) in self.lifted.iter().enumerate() {
                self.linear.next[place] = reached.value;
                take(&mut self.linear.transition, place, first, reached);
            }
        }
        if let Some(trouble) = self.system.trouble() {
            let (what, event, repair) = trouble_in_words(&self.description, trouble);
            return Err(self.astray(what, event, repair));
        }
        if let Some(pushed) = pushed {
            let Linear { transition, process, .. } = &mut self.linear;
            process.fill(0.0);
            add_process(process, transition, &pushed, (0.5 * pieces.0, &self.states));
        }
        Ok(())
    }

    #[cold]
    fn astray(&self, what: String, event: String, repair: &'static str) -> Error {
        Error::Diverged(Box::new(Diverged {
            what,
            event,
            time: self.sample as f64 * self.stepping.time_step,
            sample_index: self.sample,
            method: self.stepping.method.to_string(),
            step: self.stepping.step(),
            repair,
            outputs: Vec::new(),
            states: Vec::new(),
        }))
    }
}

/// Refuses delays in a Kalman filter that is fed sample by sample.
fn prompt(description: &Description, theta: &[f64]) -> Result<()> {
    let of_actuators = description.actuators.iter().filter_map(|actuator| actuator.delay.as_ref().map(|d| d.time));
    let of_sensors = description.sensors.iter().filter_map(|sensor| sensor.delay);
    match of_actuators.chain(of_sensors).find(|&place| theta[place] > 0.0) {
        None => Ok(()),
        Some(place) => Err(Error::Setting {
            setting: "each delay of a machine that is observed sample by sample",
            condition: "be zero".to_owned(),
            value: theta[place],
            repair: "set it to zero, or observe whole records, which remember",
        }),
    }
}

/// Matrix of the Kalman filter row by row, and its shape.
pub fn by_rows(matrix: &DMatrix<f64>) -> (Vec<f64>, [usize; 2]) {
    (matrix.transpose().as_slice().to_vec(), [matrix.nrows(), matrix.ncols()])
}
