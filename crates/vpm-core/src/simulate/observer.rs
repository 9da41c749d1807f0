//! The machine beside its log, corrected at every sample by what was measured.
//!
//! Law: `e_k = y_k - h(x_k)`, `x_k <- x_k + K_k e_k`, `x_(k+1) = f(x_k, u_k)`: the innovations of an observer. Its gains are those of an
//! extended Kalman filter (Jazwinski 1970, chapter 8; Kristensen, Madsen & Jorgensen 2004): forces that nobody knows of move the machine,
//! and sensors err. They follow the machine's own linearisation at every sample, so that they know by themselves what a joint that sticks, a
//! play that is open or a contact lets through. What is left of the log is white where model and noise are right. Positions on their way
//! to a late sensor are moved as those of the machine: the readings that come next will show them. Closed loops are closed again after each
//! correction, and sampled drives go on with what they remember.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::stepper::Beside;
use super::{
    Drive, Inputs, Plan, Run, Setting, Simulation, Stepper, check_beginning, check_state, check_step, execute,
};
use crate::description::Description;
use crate::error::{Error, Result};
use crate::scalar::{Dual, Twins};
use crate::sensitivity::{Job, LANES, Pair};
use crate::sensor::Layout;
use crate::system::Dynamics;
use crate::table::Table;

/// A number with its derivatives along some of the states.
type Number = Dual<f64, LANES>;

/// What was measured.
#[derive(Clone, Copy, Debug)]
pub struct Readings<'a> {
    /// Which outputs, in the order of [`crate::sensor::Layout`].
    pub channels: &'a [usize],
    /// Row k: their readings at sample k.
    pub table: Table<'a>,
}

/// How far the machine and its sensors are trusted: standard deviations of what is independent from sample to sample.
#[derive(Clone, Copy, Debug)]
pub struct Noise<'a> {
    /// Of each reading.
    pub readings: &'a [f64],
    /// Of the force on each coordinate that nobody knows of, held for a sample (N or N m).
    pub forces: &'a [f64],
    /// Of what each state moves by over a sample for no known reason.
    pub states: &'a [f64],
    /// Of the first state.
    pub first: &'a [f64],
}

/// By how much each reading moves each state.
#[derive(Clone, Copy, Debug)]
pub struct Gains<'a> {
    /// What was measured.
    pub readings: Readings<'a>,
    /// Row k: states x channels, at sample k.
    pub gains: Table<'a>,
    /// Whether the readings are innovations, as of a machine in innovations form: outputs and these are what its sensors show.
    pub innovations: bool,
    /// Whether no other output than those that were measured is asked for.
    pub alone: bool,
    /// By how much each parameter by which there are derivatives may be moved. Then these may be approximate, where that takes less time than
    /// those of the steps: differences, or derivatives of the equations to the order of the steps.
    pub moves: Option<&'a [f64]>,
}

impl Gains<'_> {
    /// Whether an observer needs the state alone: then samples need no rates.
    pub(super) fn is_of_motion(&self, layout: Layout) -> bool {
        self.alone && self.readings.channels.iter().all(|&channel| layout.is_of_motion(channel))
    }

    /// Coordinates that the observer's readings move.
    pub(super) fn drawn(&self, coordinates: usize) -> Vec<u32> {
        let (rows, width) = (0..self.gains.rows(), self.readings.channels.len());
        let moves = |state: usize, row: usize| {
            self.gains.row(row)[state * width..(state + 1) * width].iter().any(|&gain| gain != 0.0)
        };
        let states = |place: u32| [place as usize, place as usize + coordinates];
        let drawn = |&place: &u32| states(place).into_iter().any(|state| rows.clone().any(|row| moves(state, row)));
        (0..coordinates as u32).filter(drawn).collect()
    }
}

/// What a filter gives, each table row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Filtered {
    /// Readings less outputs of each sample.
    pub innovations: Vec<f64>,
    /// Covariance of these, channels x channels at each sample.
    pub covariances: Vec<f64>,
    /// States x channels at each sample, see [`Gains`].
    pub gains: Vec<f64>,
    /// State of each sample, corrected by its readings.
    pub states: Vec<f64>,
    /// Standard deviation of each of these.
    pub deviations: Vec<f64>,
}

/// A record for an observer.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// State in which it begins.
    pub initial: &'a [f64],
    /// What drives the machine.
    pub inputs: Inputs<'a>,
    /// What corrects it.
    pub gains: Gains<'a>,
}

impl<'a> Observed<'a> {
    fn rows(&self) -> usize {
        self.inputs.table.rows()
    }

    /// Whether an observer treats another record in the same way.
    fn is_like(&self, other: &Self) -> bool {
        let (own, others) = (&self.gains, &other.gains);
        self.inputs.hold == other.inputs.hold
            && own.readings.channels == others.readings.channels
            && (own.innovations, own.alone) == (others.innovations, others.alone)
    }

    fn check(&self, setting: &Setting<'_>) -> Result<()> {
        let Self { initial, inputs, gains } = self;
        gains.readings.check(setting, inputs)?;
        let entries = setting.description.n_states() * gains.readings.channels.len();
        gains.gains.expect("gains", self.rows(), entries)?;
        if let Some(moves) = gains.moves {
            check_moves(moves, setting.sensitivities.len())?;
        }
        check_state("initial_state", setting.description, initial)
    }

    /// Plan for an observer of the record alone.
    fn plan(&self) -> Plan<'a> {
        let (drive, horizon) = (Drive::Commands(self.inputs), self.rows());
        Plan { drive, initial: self.initial, starts: &[0], horizon, gains: Some(self.gains), beside: None }
    }
}

impl Readings<'_> {
    fn check(&self, setting: &Setting<'_>, inputs: &Inputs<'_>) -> Result<()> {
        let count = setting.description.n_outputs();
        if let Some(&index) = self.channels.iter().find(|&&channel| channel >= count) {
            let what = "the list of measured channels".to_owned();
            return Err(Error::Reference { what, target: "output", index, count });
        }
        inputs.expect(setting)?;
        self.table.expect("readings", inputs.table.rows(), self.channels.len())
    }
}

impl Noise<'_> {
    pub(super) fn check(&self, description: &Description, channels: usize) -> Result<()> {
        let (n, states) = (description.n_coordinates(), description.n_states());
        Table::vector("noise of readings", self.readings, channels, "measured channel")?;
        Table::vector("noise of forces", self.forces, n, "coordinate")?;
        Table::vector("noise of states", self.states, states, "state")?;
        Table::vector("uncertainty of the first state", self.first, states, "state")?;
        let named = [("of readings", self.readings, true), ("of forces", self.forces, false)];
        for (name, values, positive) in
            named.into_iter().chain([("of states", self.states, false), ("of the first state", self.first, false)])
        {
            if let Some(&value) = values.iter().find(|&&value| value < 0.0 || (positive && value == 0.0)) {
                let condition = if positive { "be positive" } else { "not be negative" }.to_owned();
                let (setting, repair) =
                    ("a standard deviation", "give the resolution of the sensor where nothing else is known");
                return Err(Error::Setting { setting, condition: format!("{condition} ({name})"), value, repair });
            }
        }
        Ok(())
    }
}

/// What closed loops take away.
pub(super) const OBSERVED: &str = "an observer that corrects states one by one";

/// Observer by an extended Kalman filter: innovations on `readings` from `initial_state`, with its gains. A mere table
/// of inputs is held.
///
/// Its linear models are the exact derivatives of the steps that the integrator takes. A force that is held for a sample moves the machine by
/// `dt/2 (F + 1) [0; M^-1]`, F the transition of the sample.
///
/// # Errors
/// [`Error::Dimension`] or [`Error::Reference`] for tables and channels that do not fit, [`Error::Setting`] for noise that is none, and what a
/// free run complains about.
pub fn filter<'a>(
    setting: Setting<'a>,
    initial_state: &'a [f64],
    inputs: impl Into<Inputs<'a>>,
    readings: Readings<'a>,
    noise: Noise<'a>,
) -> Result<Filtered> {
    let inputs = inputs.into();
    setting.description.refuse_loops(OBSERVED, "compare free runs instead, or give the gains")?;
    setting.description.refuse_sampled(
        "no filter knows how it answers to a correction",
        "use an ideal drive that is given the measured effort, or give the gains",
    )?;
    readings.check(&setting, &inputs)?;
    noise.check(setting.description, readings.channels.len())?;
    check_state("initial_state", setting.description, initial_state)?;
    check_step(setting.description, setting.theta, setting.stepping, initial_state)?;
    let plan = Plan {
        drive: Drive::Commands(inputs),
        initial: initial_state,
        starts: &[0],
        horizon: inputs.table.rows(),
        gains: None,
        beside: None,
    };
    Filter::new(&setting, &plan, readings, noise)?.run(setting)
}

/// Innovations of an observer with given gains, with their derivatives by parameters while the gains stay: outputs are predicted from the
/// samples before, and readings less these are the innovations.
///
/// # Errors
/// As [`filter`].
pub fn observe<'a>(
    setting: Setting<'a>,
    initial_state: &'a [f64],
    inputs: impl Into<Inputs<'a>>,
    gains: Gains<'a>,
) -> Result<Run> {
    let record = Observed { initial: initial_state, inputs: inputs.into(), gains };
    record.check(&setting)?;
    execute(setting, record.plan())
}

/// Observers of many records, each as by [`observe`]. Without derivatives two of them run side by side, where there is machine
/// code for that.
///
/// # Errors
/// As [`filter`].
pub fn observe_all(setting: Setting<'_>, records: &[Observed<'_>]) -> Result<Vec<Run>> {
    records.iter().try_for_each(|record| record.check(&setting))?;
    let each = |records: &[Observed<'_>]| match records {
        [first, second] if setting.sensitivities.is_empty() => observe_two(setting, [first, second]),
        some => some.iter().map(|record| execute(setting, record.plan())).collect(),
    };
    Ok(records.chunks(2).map(each).collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// Observers of two records, side by side where that is possible. The shorter one waits at its end.
fn observe_two(setting: Setting<'_>, [first, second]: [&Observed<'_>; 2]) -> Result<Vec<Run>> {
    [first, second].iter().try_for_each(|record| check_beginning(setting, record.initial))?;
    let (readings, gains) = (second.gains.readings.table, second.gains.gains);
    let beside = Some(Beside { initial: second.initial, inputs: second.inputs.table, readings, gains });
    let horizon = first.rows().max(second.rows());
    let theta: Vec<Twins> = setting.theta.iter().map(|&value| Twins::from(value)).collect();
    let alike = first.is_like(second) && first.rows() > 0 && second.rows() > 0;
    let job = Simulation { setting, plan: Plan { horizon, beside, ..first.plan() } };
    let Some(runs) = alike.then(|| job.run_in_lanes(&theta)).flatten() else {
        return [first, second].iter().map(|record| execute(setting, record.plan())).collect();
    };
    let cut = |(mut run, record): (Pair<f64>, &Observed<'_>)| {
        let kept = |length: usize| length / horizon * record.rows();
        run.first.truncate(kept(run.first.len()));
        run.second.truncate(kept(run.second.len()));
        Run { outputs: run.first, states: run.second, jacobian: Vec::new() }
    };
    Ok(runs.into_iter().zip([first, second]).map(cut).collect())
}

/// Refuses moves of parameters that give the observer no differences.
fn check_moves(moves: &[f64], count: usize) -> Result<()> {
    Table::vector("moves", moves, count, "derivative")?;
    let Some(&value) = moves.iter().find(|&&value| value == 0.0) else { return Ok(()) };
    let (setting, condition) = ("a move of a parameter", "not be zero".to_owned());
    Err(Error::Setting {
        setting,
        condition,
        value,
        repair: "give about 1e-5 of what is uncertain about the parameter",
    })
}

/// A filter on its way through a record.
struct Filter<'a> {
    stepper: Stepper<'a, Number>,
    readings: Readings<'a>,
    noise: Noise<'a>,
    /// Time between samples, s.
    time_step: f64,
    rows: usize,
    state: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Derivative of the next state by this one.
    transition: DMatrix<f64>,
    /// Derivative of the outputs by the state.
    output: DMatrix<f64>,
    predicted: DVector<f64>,
}

impl<'a> Filter<'a> {
    fn new(setting: &Setting<'a>, plan: &Plan<'a>, readings: Readings<'a>, noise: Noise<'a>) -> Result<Self> {
        let theta: Vec<Number> = setting.theta.iter().map(|&value| Dual::constant(value)).collect();
        let (nx, m) = (plan.initial.len(), readings.channels.len());
        let variance = DVector::from_iterator(nx, noise.first.iter().map(|deviation| deviation * deviation));
        Ok(Self {
            // Covariances are those of the angles.
            stepper: Stepper::of(setting, plan, &theta, setting.description.system(&theta)?)?,
            readings,
            noise,
            time_step: setting.stepping.time_step,
            rows: plan.horizon,
            state: DVector::from_column_slice(plan.initial),
            covariance: DMatrix::from_diagonal(&variance),
            transition: DMatrix::zeros(nx, nx),
            output: DMatrix::zeros(m, nx),
            predicted: DVector::zeros(m),
        })
    }

    fn run(mut self, setting: Setting<'a>) -> Result<Filtered> {
        let (nx, m) = (self.state.len(), self.readings.channels.len());
        let table = |width: usize| Vec::with_capacity(self.rows * width);
        let [mut innovations, mut covariances, mut gains] = [table(m), table(m * m), table(nx * m)];
        let [mut states, mut deviations] = [table(nx), table(nx)];
        self.stepper.restart(0);
        for row in 0..self.rows {
            self.predict(row)?;
            let innovation = DVector::from_column_slice(self.readings.table.row(row)) - &self.predicted;
            let (gain, spread) = gain(&self.covariance, &self.output, self.noise.readings, row)?;
            let moved = &gain * &innovation;
            self.state += &moved;
            self.stepper.correct_arriving(row, |place| Number::constant(moved[place]));
            self.covariance = corrected(&self.covariance, &gain, &self.output, self.noise.readings);
            innovations.extend(innovation.iter());
            covariances.extend(spread.iter());
            // Row by row, where nalgebra keeps columns.
            gains.extend(gain.transpose().iter());
            states.extend(self.state.iter());
            deviations.extend(self.covariance.diagonal().iter().map(|variance| variance.max(0.0).sqrt()));
            if row + 1 < self.rows {
                self.advance(row, setting)?;
            }
        }
        Ok(Filtered { innovations, covariances, gains, states, deviations })
    }

    /// Seeds the observer's state with derivatives along [`LANES`] directions from `first` on.
    fn seed(&mut self, first: usize) {
        // A direction before `first` wraps around to a lane that does not exist, which gives a constant.
        let lift = |(place, &value): (usize, &f64)| Dual::variable(value, place.wrapping_sub(first));
        self.stepper.place(self.state.iter().enumerate().map(lift));
    }

    /// Outputs that the observer predicts at its state, and their derivative by it.
    fn predict(&mut self, row: usize) -> Result<()> {
        for first in (0..self.state.len()).step_by(LANES) {
            self.seed(first);
            self.stepper.sample(row, 0)?;
            let Self { stepper, readings, output, predicted, .. } = self;
            stepper.settle(row, |seen| {
                for (place, &channel) in readings.channels.iter().enumerate() {
                    predicted[place] = seen[channel].value;
                    take(output, place, first, &seen[channel]);
                }
            });
        }
        Ok(())
    }

    /// Advances state and covariance of the observer to the next sample.
    fn advance(&mut self, row: usize, setting: Setting<'_>) -> Result<()> {
        let pushed = pushed(self.stepper.dynamics(), self.state.as_slice(), self.noise.forces);
        let mut next = self.state.clone();
        for first in (0..self.state.len()).step_by(LANES) {
            self.seed(first);
            self.stepper.advance(row, 0, setting.interrupt)?;
            for (place, reached) in self.stepper.state().iter().enumerate() {
                next[place] = reached.value;
                take(&mut self.transition, place, first, reached);
            }
        }
        self.covariance = &self.transition * &self.covariance * self.transition.transpose();
        let half = 0.5 * self.time_step;
        add_process(&mut self.covariance, &self.transition, &pushed, (half, self.noise.states));
        self.state = next;
        Ok(())
    }
}

/// Observer gain `K = P H' S^-1` with `S = H P H' + R`, of readings with these deviations at a sample.
pub(super) fn gain(
    covariance: &DMatrix<f64>,
    output: &DMatrix<f64>,
    deviations: &[f64],
    sample: usize,
) -> Result<(DMatrix<f64>, DMatrix<f64>)> {
    let shared = covariance * output.transpose();
    let mut spread = output * &shared;
    for (place, deviation) in deviations.iter().enumerate() {
        spread[(place, place)] += deviation * deviation;
    }
    let factors: Option<Cholesky<f64, Dyn>> = spread.clone().cholesky();
    let Some(factors) = factors else {
        let path = format!("the covariance of the innovations at sample {sample}");
        return Err(Error::NonFinite { path, value: f64::NAN });
    };
    Ok((factors.solve(&shared.transpose()).transpose(), spread))
}

/// Observer covariance `P <- (1 - K H) P (1 - K H)' + K R K'`, definite despite rounding (Bucy & Joseph 1968).
pub(super) fn corrected(
    covariance: &DMatrix<f64>,
    gain: &DMatrix<f64>,
    output: &DMatrix<f64>,
    deviations: &[f64],
) -> DMatrix<f64> {
    let nx = covariance.nrows();
    let left = DMatrix::identity(nx, nx) - gain * output;
    let mut weighed = gain.clone();
    for (mut column, deviation) in weighed.column_iter_mut().zip(deviations) {
        column *= *deviation;
    }
    &left * covariance * left.transpose() + &weighed * weighed.transpose()
}

/// Adds the process noise over a sample to the observer's covariance. Of that sample `half` is half. It has the
/// `pushed` accelerations under the transition, and the deviations of the states.
pub(super) fn add_process(
    covariance: &mut DMatrix<f64>,
    transition: &DMatrix<f64>,
    pushed: &DMatrix<f64>,
    (half, states): (f64, &[f64]),
) {
    let n = pushed.nrows();
    let mut moved = transition.columns(n, n) * pushed * half;
    let mut rates = moved.rows_mut(n, n);
    rates += pushed * half;
    *covariance += &moved * moved.transpose();
    for (place, deviation) in states.iter().enumerate() {
        covariance[(place, place)] += deviation * deviation;
    }
}

/// Accelerations of the observer's process noise: one deviation of force on each coordinate. They are `M^-1` with
/// columns of these lengths.
pub(super) fn pushed(dynamics: &mut Dynamics<f64>, state: &[f64], forces: &[f64]) -> DMatrix<f64> {
    let n = forces.len();
    let (q, v) = state[..2 * n].split_at(n);
    dynamics.terms(q, v);
    dynamics.data.factorise();
    let mut pushed = DMatrix::from_diagonal(&DVector::from_column_slice(forces));
    for column in pushed.as_mut_slice().chunks_exact_mut(n.max(1)) {
        dynamics.data.solve(column);
    }
    pushed
}

/// Takes the derivatives of an observer's number along the directions from `first` into a row.
pub(super) fn take(matrix: &mut DMatrix<f64>, row: usize, first: usize, number: &Number) {
    let width = matrix.ncols();
    for (column, &slope) in (first..width).zip(&number.gradient) {
        matrix[(row, column)] = slope;
    }
}
