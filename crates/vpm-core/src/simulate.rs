//! Simulation of a whole record: free run on commands, closed loop on references, restarts from many samples.

mod along;
mod bounds;
mod control;
mod guide;
mod hold;
mod kalman;
mod moving;
mod names;
mod observer;
mod prescribed;
mod resolution;
mod sampled;
mod stability;
mod start;
mod stepper;

pub use along::{Along, drives_along};
pub(crate) use bounds::{Bounds, repair};
pub use hold::{Course, Hold, Inputs};
pub use kalman::{Estimate, Kalman, Linear, by_rows};
pub(crate) use names::{output_name, state_name};
pub use observer::{Filtered, Gains, Noise, Observed, Readings, filter, observe, observe_all};
pub use prescribed::{observed, prescribed};
pub use resolution::{Unstuck, resolution, unstuck};
pub(crate) use sampled::SampledDrives;
pub(crate) use stability::{check_step, check_structure};
pub(crate) use start::check_start;
pub(crate) use stepper::{Drive, Plan, Stepper};

use crate::description::Description;
use crate::error::{Diverged, Error, Result};
use crate::integrator::{Halt, Method};
use crate::scalar::{Scalar, Twins, seed};
use crate::sensitivity::{Interrupt, Job, LANES, MANY, Pair, check_variables, difference, differentiate_by};
use crate::system::{Build, Trouble};
use crate::table::Table;
use sampled::Astray;

/// Most integration steps per sample: with more, one sample would take minutes that nobody can interrupt in C.
pub const MOST_SUBSTEPS: usize = 1_000_000;

/// How time advances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepping {
    /// Time between samples, s.
    pub time_step: f64,
    /// Integration steps per sample; with controlled errors, pieces of a sample that take one step at least.
    pub substeps: usize,
    /// The integrator.
    pub method: Method,
}

impl Stepping {
    /// Checks the settings of a simulation's time steps and keeps them.
    pub fn new(time_step: f64, substeps: usize, method: Method) -> Result<Self> {
        check_time_step(time_step)?;
        method.check()?;
        if substeps == 0 {
            let condition = "be at least 1".to_owned();
            return Err(Error::Setting { setting: "substeps", condition, value: 0.0, repair: "use 1 to begin with" });
        }
        if substeps > MOST_SUBSTEPS {
            let condition = format!("be at most {MOST_SUBSTEPS}");
            let repair = "use 1 to begin with, or an integrator with controlled errors";
            return Err(Error::Setting { setting: "substeps", condition, value: substeps as f64, repair });
        }
        Ok(Self { time_step, substeps, method })
    }

    /// Length of one integration step of a simulation, s.
    pub fn step(&self) -> f64 {
        self.time_step / self.substeps as f64
    }
}

pub(crate) fn check_time_step(time_step: f64) -> Result<()> {
    if time_step.is_finite() && time_step > 0.0 {
        return Ok(());
    }
    let condition = "be a positive time in s".to_owned();
    let repair = "take it from the time column of the log";
    Err(Error::Setting { setting: "time_step", condition, value: time_step, repair })
}

/// What a simulation gives, each table row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Outputs of each sample, in the order of [`crate::sensor::Layout`]; the measured ones, where an observer is asked for these alone.
    pub outputs: Vec<f64>,
    /// State of each sample.
    pub states: Vec<f64>,
    /// Derivative of each output, of an observer's measured ones alone, with respect to each requested parameter, of the discrete solution.
    pub jacobian: Vec<f64>,
}

/// The machine, its parameters and its time steps: what every simulation is given.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    /// The machine.
    pub description: &'a Description,
    /// Its parameters.
    pub theta: &'a [f64],
    /// How time advances.
    pub stepping: Stepping,
    /// Parameters (places in theta) to differentiate by.
    pub sensitivities: &'a [usize],
    /// Asked now and then whether to stop.
    pub interrupt: Interrupt<'a>,
}

/// Simulates a free run on `inputs` from `initial_state`. Inputs are N x inputs: commands, then pressures of logged
/// supplies. A mere table is held from each sample to the next.
pub fn free_run<'a>(setting: Setting<'a>, initial_state: &'a [f64], inputs: impl Into<Inputs<'a>>) -> Result<Run> {
    let inputs = inputs.into();
    inputs.expect(&setting)?;
    check_state("initial_state", setting.description, initial_state)?;
    let horizon = inputs.table.rows();
    let drive = Drive::Commands(inputs);
    execute(setting, Plan { drive, initial: initial_state, starts: &[0], horizon, gains: None, beside: None })
}

/// Simulates in closed loop: the controllers follow `references`, with `disturbances` on commands. Both are N x inputs.
/// What no controller commands, other actuators and the pressures of logged supplies, is given by the disturbances
/// alone.
pub fn closed_loop(
    setting: Setting<'_>,
    initial_state: &[f64],
    references: Table<'_>,
    disturbances: Table<'_>,
) -> Result<Run> {
    let description = setting.description;
    let (rows, inputs) = (references.rows(), description.n_inputs());
    references.expect("references", rows, inputs)?;
    disturbances.expect("disturbances", rows, inputs)?;
    check_state("initial_state", description, initial_state)?;
    if description.controllers.is_empty() {
        return Err(Error::OpenLoop);
    }
    let drive = Drive::Loop { references, disturbances };
    execute(setting, Plan { drive, initial: initial_state, starts: &[0], horizon: rows, gains: None, beside: None })
}

/// Simulates free runs of `horizon` samples from each sample in `starts`. Each begins in its row of `initial_states`.
/// Delayed commands reach back into the record before the start; sensor delays see the start value held.
pub fn restarts<'a>(
    setting: Setting<'a>,
    initial_states: Table<'a>,
    starts: &'a [usize],
    horizon: usize,
    inputs: impl Into<Inputs<'a>>,
) -> Result<Run> {
    let (description, inputs) = (setting.description, inputs.into());
    description.refuse_sampled(
        "a simulation cannot start again from a state in the middle of a record",
        "simulate the record as a whole",
    )?;
    inputs.expect(&setting)?;
    let rows = inputs.table.rows();
    initial_states.expect("initial_states", starts.len(), description.n_states())?;
    if horizon == 0 || horizon > rows {
        let condition = format!("lie between 1 and the {} samples of the inputs", rows);
        let repair = "choose a horizon that fits into the record";
        return Err(Error::Setting { setting: "horizon", condition, value: horizon as f64, repair });
    }
    for &start in starts {
        if start > rows - horizon {
            let condition = format!("leave {horizon} samples of the {} behind it", rows);
            let repair = "drop the last starts or shorten the horizon";
            return Err(Error::Setting { setting: "a start", condition, value: start as f64, repair });
        }
    }
    let initial = initial_states.numbers();
    let plan = Plan { drive: Drive::Commands(inputs), initial, starts, horizon, gains: None, beside: None };
    execute(setting, plan)
}

pub(crate) fn check_state(name: &str, description: &Description, state: &[f64]) -> Result<()> {
    Table::vector(
        name,
        state,
        description.n_states(),
        "state of the model: positions, velocities, states of drives and supplies",
    )?;
    description.check_closed(state)
}

struct Simulation<'a> {
    setting: Setting<'a>,
    plan: Plan<'a>,
}

impl<'a> Simulation<'a> {
    /// Stepper of a simulation; states in it are corrected as angles.
    fn stepper<S: Scalar>(&self, theta: &[S]) -> Result<Stepper<'a, S>> {
        match self.plan.gains {
            Some(_) => Stepper::of(&self.setting, &self.plan, theta, self.setting.description.system(theta)?),
            None => Stepper::new(&self.setting, &self.plan, theta),
        }
    }
}

impl Simulation<'_> {
    /// Moves for difference quotients in a simulation, where steps have no machine code of derivatives.
    fn moves(&self) -> Option<&[f64]> {
        let Setting { theta, sensitivities: by, .. } = self.setting;
        let moves = self.plan.gains.and_then(|gains| gains.moves).filter(|moves| !moves.is_empty())?;
        let stepper = self.stepper(&seed::<f64, LANES>(theta, &by[..by.len().min(LANES)]));
        (!stepper.is_ok_and(|mut stepper| stepper.compile_if_it_pays())).then_some(moves)
    }
}

impl Job for Simulation<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let mut stepper = self.stepper(theta)?;
        stepper.compile_if_it_pays();
        stepper.run(self.setting.interrupt)
    }

    /// None as well where one fails, or where steps have no machine code.
    fn run_in_lanes(&self, theta: &[Twins]) -> Option<[Pair<f64>; 2]> {
        let Setting { description, stepping, interrupt, .. } = self.setting;
        let by_values =
            !description.balls.is_empty() || description.actuators.iter().any(|actuator| actuator.drive.is_sampled());
        if by_values || stepping.method.controls_errors() {
            return None;
        }
        let mut stepper = self.stepper(theta).ok()?;
        let Pair { first: outputs, second: states } =
            stepper.compile_if_it_pays().then(|| stepper.run(interrupt).ok())??;
        let (first, second) = states.split_at(states.len() / 2);
        let lane = |lane: usize, states: &[f64]| Pair {
            first: outputs.iter().map(|number| number.lane(lane)).collect(),
            second: states.to_vec(),
        };
        Some([lane(0, first), lane(1, second)])
    }
}

/// Checks whether the steps of a simulation suit its machine, and its `initial` states.
fn check_beginning(setting: Setting<'_>, initial: &[f64]) -> Result<()> {
    let Some(first) = initial.get(..setting.description.n_states()) else { return Ok(()) };
    check_step(setting.description, setting.theta, setting.stepping, first)?;
    check_starts(setting, initial)
}

fn execute(setting: Setting<'_>, plan: Plan<'_>) -> Result<Run> {
    check_beginning(setting, plan.initial)?;
    let job = Simulation { setting, plan };
    let width = setting.description.n_outputs();
    let measured = plan.gains.filter(|gains| !gains.alone).map(|gains| {
        let places = |row: usize| gains.readings.channels.iter().map(move |channel| row * width + channel);
        (0..plan.horizon).flat_map(places).collect::<Vec<_>>()
    });
    let (theta, by) = (setting.theta, setting.sensitivities);
    check_variables(theta, by)?;
    let (pair, jacobian) = match (job.moves(), plan.gains) {
        (Some(moves), _) => difference(&job, theta, by, moves, measured.as_deref())?,
        (None, Some(Gains { alone: true, .. })) if by.len() > LANES => {
            differentiate_by::<_, MANY>(&job, theta, by, None)?
        }
        _ => differentiate_by::<_, LANES>(&job, theta, by, measured.as_deref())?,
    };
    Ok(Run { outputs: pair.first, states: pair.second, jacobian })
}

/// Checks the `initial` states of a simulation, see [`check_start`].
pub(crate) fn check_starts(setting: Setting<'_>, initial: &[f64]) -> Result<()> {
    let Setting { description, theta, .. } = setting;
    if description.n_states() == 2 * description.n_coordinates() {
        return Ok(());
    }
    description.check_values(theta)?;
    let mut dynamics = Build::dynamics(&description, theta)?;
    initial
        .chunks_exact(description.n_states().max(1))
        .try_for_each(|state| check_start(description, theta, &mut dynamics, state))
}

/// Error of a simulation whose sampled drive went astray at sample `row` of the piece from `start`.
pub(crate) fn strayed<S: Scalar>(stepper: &Stepper<'_, S>, astray: Astray, (row, start): (usize, usize)) -> Error {
    let stepping = stepper.stepping();
    let at = ((start + row) as f64 * stepping.time_step, start + row);
    match astray.error(stepper.description(), at, stepping.method.to_string(), stepping.step()) {
        Error::Diverged(diverged) => {
            let (outputs, states) = stepper.before(row);
            Error::Diverged(Box::new(Diverged { outputs, states, ..*diverged }))
        }
        other => other,
    }
}

/// Error of a simulation in which a state left its bounds, in the words of the model.
pub(crate) fn diverged<S: Scalar>(
    stepper: &Stepper<'_, S>,
    (what, event): (String, String),
    row: usize,
    start: usize,
) -> Error {
    let event = (event, repair(stepper.stepping().method));
    lost(stepper.stepping(), what, event, (row, start), stepper.before(row))
}

/// Error of a simulation in which fixed steps carried a piston `beyond` (m) the end of its stroke. No stop lets it: the
/// steps leapt over the impact.
pub(crate) fn leapt<S: Scalar>(stepper: &Stepper<'_, S>, what: String, beyond: f64, at: (usize, usize)) -> Error {
    let event = format!("is {beyond:.6} m beyond the end of its stroke, where these steps leapt over its stop,");
    let repair = "use the integrator adaptive, or guarded where the time of a step has a bound";
    lost(stepper.stepping(), what, (event, repair), at, stepper.before(at.0))
}

/// Error of a simulation whose ball joint's coordinates failed on the way to sample `row`.
pub(crate) fn troubled<S: Scalar>(stepper: &Stepper<'_, S>, trouble: Trouble, row: usize, start: usize) -> Error {
    let (what, event, repair) = trouble_in_words(stepper.description(), trouble);
    lost(stepper.stepping(), what, (event, repair), (row, start), stepper.before(row))
}

/// Sentence on a ball joint that failed in a simulation: which one, what happened, and what helps.
pub(crate) fn trouble_in_words(description: &Description, trouble: Trouble) -> (String, String, &'static str) {
    let (number, angle) = match trouble {
        Trouble::Singular(number, angle) | Trouble::Leap(number, angle) => (number, angle),
        Trouble::Open(gap) => {
            let event = format!("cannot be closed again after a step, {gap:.3e} (m or a cosine) is left");
            return (
                loops_in_words(description),
                event,
                "use more substeps, or start away from where the loops cannot close",
            );
        }
        Trouble::Dependent(usual, now) => {
            let event = format!(
                "come into a singular configuration (only {now} of their {usual} independent equations are independent there)"
            );
            return (
                loops_in_words(description),
                event,
                "keep the motion away from it; model.loops.singularities finds such places",
            );
        }
    };
    let ball = &description.balls[number];
    let (what, degrees) = (format!("joint `{}`", ball.name), angle.to_degrees());
    if let Trouble::Leap(..) = trouble {
        let event = format!("turns by {:.0} degrees in a single step", degrees.abs());
        return (what, event, "use more substeps or shorter samples");
    }
    let name = &description.bodies[ball.angles[1][0]].joint.name;
    let why = description.hindrance(ball).unwrap_or_else(|| "its angles are the coordinates here".to_owned());
    let event = format!("comes too near to the singularity of its angles (`{name}` is {degrees:.3} degrees; {why})");
    (
        what,
        event,
        "turn the frame of the joint so that this angle stays away from 90 degrees, or take off what needs its angles",
    )
}

fn loops_in_words(description: &Description) -> String {
    let names: Vec<_> = description.loops.iter().map(|closure| format!("`{}`", closure.name)).collect();
    format!("the closed loops ({})", names.join(", "))
}

/// Error of a simulation at sample `row` of the piece from `start`, with the partial run. `tables` are the outputs and
/// states of its samples until then.
fn lost(
    stepping: Stepping,
    what: String,
    (event, repair): (String, &'static str),
    (row, start): (usize, usize),
    (outputs, states): (Vec<f64>, Vec<f64>),
) -> Error {
    Error::Diverged(Box::new(Diverged {
        what,
        event,
        time: (start + row) as f64 * stepping.time_step,
        sample_index: start + row,
        method: stepping.method.to_string(),
        step: stepping.step(),
        repair,
        outputs,
        states,
    }))
}

/// Error of a simulation whose step control could not follow from a sample, with the partial run. The sample has its
/// number and its time from the beginning, in the words of the model. `tables` are the outputs and states until then.
pub(crate) fn halted(
    description: &Description,
    stepping: Stepping,
    sample: usize,
    halt: Halt,
    (outputs, states): (Vec<f64>, Vec<f64>),
) -> Error {
    let Halt::Stuck(stuck) = halt else { return Error::Interrupted };
    Error::Diverged(Box::new(Diverged {
        what: format!("the {}", state_name(description, stuck.state)),
        event: stuck.event(),
        time: sample as f64 * stepping.time_step + stuck.reached,
        sample_index: sample + 1,
        method: stepping.method.to_string(),
        step: stuck.step,
        repair: stuck.repair(),
        outputs,
        states,
    }))
}
