//! Drives along a given motion: what motors and cylinders do to their commands while the joints move as they were seen to.

use super::quintic::{State, between};
use super::{Setting, Stepping, check_starts, halted, names};
use crate::description::Description;
use crate::error::{Diverged, Error, Result};
use crate::integrator::{Halt, Integrator, Stuck};
use crate::motion::{JointMotion, position_sensors, state_sensors};
use crate::ode::Ode;
use crate::scalar::{Dual, Scalar};
use crate::sensitivity::{Interrupt, Job, Pair, differentiate, differentiate_by};
use crate::sensor::Sensor;
use crate::system::{Build, Dynamics};
use crate::table::Table;

/// Derivatives by states taken in one sweep: those of one cylinder behind its valve, and of time; two cylinders take two.
const LANES: usize = 5;

/// What a sampled drive takes away.
const NO_STATES: &str = "its effort cannot be worked out along a given motion";

/// What drives do along a motion, each table row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Along {
    /// Outputs of each sample, in the order of [`crate::sensor::Layout`], then the effort of the drives on each joint.
    pub outputs: Vec<f64>,
    /// State of each sample.
    pub states: Vec<f64>,
    /// Derivative of each number of `outputs` with respect to each requested parameter.
    pub jacobian: Vec<f64>,
}

/// All joints follow `motion`, readings of the model's position sensors; drives and supplies answer to it and to `inputs` (N x inputs,
/// each row held until the next), from the states `internal` at the first sample.
///
/// Law: `ds/dt = f(s, l(q(t)), dl(q(t), v(t)), u)`, s the states of drives and supplies; q(t) between samples is the polynomial of degree 5
/// with position, velocity and acceleration of both. The outputs `effort` of the joints are the efforts that the motion needs, as in
/// [`super::prescribed`]; those of the drives follow after all outputs. Unlike in a free run no error of a force moves the machine, so that
/// what is wrong with a drive and what is wrong with the machine show apart. Where states of drives were measured too, as pressures of
/// chambers, `seen` gives their readings (N x their number) and `places` which states they are: the efforts of the drives are those of what
/// is behind these readings. Checked: a free run gives its drives' states back.
pub fn drives_along(
    setting: Setting<'_>,
    motion: JointMotion<'_>,
    inputs: Table<'_>,
    internal: &[f64],
    (places, seen): (&[usize], Table<'_>),
) -> Result<Along> {
    let Setting { description, theta, .. } = setting;
    let (rows, joints) = (motion.position.rows(), description.n_joints());
    description.refuse_sampled(NO_STATES, "simulate it in the mode free_run or closed_loop")?;
    if let Some((beam, _)) = description.beams.iter().zip(description.elastic()).find(|(_, len)| **len > 0) {
        return Err(Error::Flexible { beam: beam.name.clone() });
    }
    for (name, table) in
        [("position", motion.position), ("velocity", motion.velocity), ("acceleration", motion.acceleration)]
    {
        table.expect(name, rows, joints)?;
    }
    inputs.expect("inputs", rows, description.n_inputs())?;
    let states = description.n_states() - 2 * joints;
    Table::vector("internal", internal, states, "state of drives and supplies")?;
    seen.expect("seen", rows, places.len())?;
    if let Some(&index) = places.iter().find(|&&place| place >= states) {
        let what = "the list of measured states".to_owned();
        return Err(Error::Reference { what, target: "state of drives and supplies", index, count: states });
    }
    if rows > 0 {
        let mut first = motion.position.row(0).to_vec();
        first.extend_from_slice(motion.velocity.row(0));
        first.extend_from_slice(internal);
        description.check_values(theta)?;
        check_starts(setting, &first)?;
    }
    let job = Driven { setting, motion, inputs, internal, places, seen };
    // Most questions are for a few parameters: lanes that nobody needs would be most of the work.
    let (pair, jacobian) = match setting.sensitivities.len() {
        1 | 2 => differentiate_by::<_, 2>(&job, theta, setting.sensitivities, |pass, place| pass.first[place])?,
        _ => differentiate(&job, theta, setting.sensitivities, |pass, place| pass.first[place])?,
    };
    Ok(Along { outputs: pair.first, states: pair.second, jacobian })
}

struct Driven<'a> {
    setting: Setting<'a>,
    motion: JointMotion<'a>,
    inputs: Table<'a>,
    internal: &'a [f64],
    places: &'a [usize],
    seen: Table<'a>,
}

impl Job for Driven<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.setting.description.check_values(&values)?;
        Way::<S>::new(self, theta)?.run(self.setting.interrupt)
    }
}

/// Drives on their way along a motion.
struct Way<'a, S> {
    description: &'a Description,
    motion: JointMotion<'a>,
    inputs: Table<'a>,
    /// States of drives and supplies that were measured, and their values.
    places: &'a [usize],
    seen: Table<'a>,
    stepping: Stepping,
    sensors: Vec<Sensor<S>>,
    of_joints: Vec<Option<Sensor<S>>>,
    of_states: Vec<Option<Sensor<S>>>,
    ode: Answer<S>,
    integrator: Integrator<S>,
    /// States of drives and supplies, time since the last sample.
    state: Vec<S>,
    required: Vec<S>,
    truth: Vec<S>,
    states: Vec<S>,
}

impl<'a, S: Scalar> Way<'a, S> {
    fn new(job: &Driven<'a>, theta: &[S]) -> Result<Self> {
        let Driven { setting, motion, inputs, internal, places, seen } = *job;
        let description = setting.description;
        let lifted: Vec<_> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let (joints, rows) = (description.n_joints(), motion.position.rows());
        let ode = Answer {
            values: Buffers::new(Build::dynamics(&description, theta)?),
            duals: Buffers::new(Build::dynamics(&description, &lifted)?),
            ends: vec![[[S::zero(); 3]; 2]; joints],
            lifted: vec![[[Dual::default(); 3]; 2]; joints],
            seeds: vec![Dual::default(); internal.len() + 1],
            interval: setting.stepping.time_step,
        };
        let state: Vec<S> = internal.iter().map(|&value| S::from_f64(value)).chain([S::zero()]).collect();
        Ok(Self {
            description,
            motion,
            inputs,
            places,
            seen,
            stepping: setting.stepping,
            sensors: description.sensors(theta),
            of_joints: position_sensors(description, theta),
            of_states: state_sensors(description, theta, places),
            integrator: Integrator::new(setting.stepping.method, state.len()),
            ode,
            state,
            required: vec![S::zero(); joints],
            truth: vec![S::zero(); rows * (description.n_outputs() + joints)],
            states: vec![S::zero(); rows * description.n_states()],
        })
    }

    /// The true motion of the joints at a sample.
    fn at(&self, k: usize) -> Vec<State<S>> {
        let one = |(joint, sensor): (usize, &Option<Sensor<S>>)| {
            self.motion.behind(self.stepping.time_step, k, joint, sensor.as_ref())
        };
        self.of_joints.iter().enumerate().map(one).collect()
    }

    fn run(mut self, interrupt: Interrupt<'_>) -> Result<Pair<S>> {
        let rows = self.motion.position.rows();
        let mut now = if rows > 0 { self.at(0) } else { Vec::new() };
        for row in 0..rows {
            let next = self.at((row + 1).min(rows - 1));
            for ((ends, &now), &next) in self.ode.ends.iter_mut().zip(&now).zip(&next) {
                *ends = [now, next];
            }
            now = next;
            self.hold(row);
            self.sample(row)?;
            if row + 1 < rows {
                let (stepping, Self { integrator, ode, state, .. }) = (self.stepping, &mut self);
                let pieces = (stepping.time_step, stepping.substeps);
                let first = 2 * now.len();
                integrator.advance(ode, state, pieces, interrupt).map_err(|halt| {
                    let halt = match halt {
                        Halt::Stuck(stuck) => Halt::Stuck(Stuck { state: first + stuck.state, ..stuck }),
                        Halt::Interrupted => halt,
                    };
                    halted(self.description, stepping, row, halt, self.before(row + 1))
                })?;
            }
        }
        let (layout, width) = (self.description.layout(), self.width());
        let mut outputs = self.truth.clone();
        for sensor in &self.sensors {
            let column = sensor.channel.column(layout);
            for row in 0..rows {
                let truth = |sample: usize| self.truth[sample * width + column];
                outputs[row * width + column] = sensor.read(row, self.stepping.time_step, truth);
            }
        }
        Ok(Pair { first: outputs, second: self.states })
    }

    /// Numbers of a sample: outputs and the efforts of the drives.
    fn width(&self) -> usize {
        self.description.n_outputs() + self.required.len()
    }

    /// Holds what every input amounts to over the interval that begins at sample `k`.
    fn hold(&mut self, k: usize) {
        for number in 0..self.inputs.columns() {
            let command = |sample: usize| S::from_f64(self.inputs.at(sample, number));
            let input = self.ode.values.dynamics.input(number, k, self.stepping.time_step, command);
            self.ode.values.dynamics.hold(number, input);
            self.ode.duals.dynamics.hold(number, Dual::constant(input));
        }
    }

    /// Records what is seen and needed at a sample.
    fn sample(&mut self, row: usize) -> Result<()> {
        if let Some(time) = self.state.last_mut() {
            *time = S::zero();
        }
        let (width, dim, joints) = (self.width(), self.description.n_states(), self.required.len());
        let layout = self.description.layout();
        let Self { ode, required, truth, states, .. } = self;
        let buffers = &mut ode.values;
        buffers.evaluate(&self.state, &ode.ends, ode.interval);
        let (outputs, applied) = truth[row * width..(row + 1) * width].split_at_mut(width - joints);
        let Buffers { dynamics, x, rate, .. } = buffers;
        dynamics.observe_motion(x, outputs);
        for (rate, [now, _]) in rate[joints..].iter_mut().zip(&ode.ends) {
            *rate = now[2];
        }
        dynamics.observe_efforts(x, rate, outputs);
        for (actuator, channels) in outputs[layout.actuators()..layout.lines()].chunks_exact_mut(2).enumerate() {
            channels[0] = S::from_f64(self.inputs.at(row, actuator));
        }
        dynamics.inverse_dynamics(&x[..joints], &x[joints..2 * joints], &rate[joints..2 * joints], required);
        for (channels, &effort) in outputs.chunks_exact_mut(4).zip(&*required) {
            channels[3] = effort;
        }
        let state = &mut states[row * dim..(row + 1) * dim];
        state.copy_from_slice(x);
        let wrong = |number: &S| !number.is_finite();
        for (column, (&place, sensor)) in self.places.iter().zip(&self.of_states).enumerate() {
            let reading = |sample| S::from_f64(self.seen.at(sample, column));
            x[2 * joints + place] = match sensor {
                Some(sensor) => sensor.undo(row, self.seen.rows() - 1, self.stepping.time_step, reading),
                None => reading(row),
            };
        }
        if !self.places.is_empty() {
            dynamics.drive(x, rate);
        }
        applied.fill(S::zero());
        dynamics.add_drives(applied);
        let place = state.iter().position(wrong).map(|place| names::state_name(self.description, place));
        let place = place.or_else(|| outputs.iter().position(wrong).map(|c| names::output_name(self.description, c)));
        place.map_or(Ok(()), |name| Err(self.diverged(&name, row)))
    }

    /// Values of the samples before `row`: outputs and states.
    fn before(&self, row: usize) -> (Vec<f64>, Vec<f64>) {
        let (outputs, width) = (self.description.n_outputs(), self.width());
        let rows = self.truth[..row * width].chunks_exact(width);
        let states = &self.states[..row * self.description.n_states()];
        (rows.flat_map(|row| row[..outputs].iter().map(Scalar::re)).collect(), states.iter().map(Scalar::re).collect())
    }

    fn diverged(&self, name: &str, row: usize) -> Error {
        let (outputs, states) = self.before(row);
        Error::Diverged(Box::new(Diverged {
            what: format!("the {name}"),
            event: Diverged::NOT_FINITE.to_owned(),
            time: row as f64 * self.stepping.time_step,
            sample_index: row,
            method: self.stepping.method.to_string(),
            step: self.stepping.step(),
            repair: "use the integrator adaptive, and check the motion for jumps",
            outputs,
            states,
        }))
    }
}

/// Drives and supplies of a machine whose joints follow a motion, with time as the last state.
struct Answer<S> {
    values: Buffers<S>,
    duals: Buffers<Dual<S, LANES>>,
    /// Motion of each joint at the sample before and after.
    ends: Vec<[State<S>; 2]>,
    /// The same, and a state, in dual numbers.
    lifted: Vec<[State<Dual<S, LANES>>; 2]>,
    seeds: Vec<Dual<S, LANES>>,
    /// Time between samples, s.
    interval: f64,
}

struct Buffers<S> {
    dynamics: Dynamics<S>,
    /// State of the whole machine, and its rate.
    x: Vec<S>,
    rate: Vec<S>,
}

impl<S: Scalar> Buffers<S> {
    fn new(dynamics: Dynamics<S>) -> Self {
        let [x, rate] = [0; 2].map(|_| vec![S::zero(); dynamics.dim()]);
        Self { dynamics, x, rate }
    }

    /// State of the machine and rates of its drives, at state `s` of these on the way between `ends`.
    fn evaluate(&mut self, s: &[S], ends: &[[State<S>; 2]], interval: f64) {
        let Self { dynamics, x, rate } = self;
        let (joints, count) = (ends.len(), s.len() - 1);
        for (joint, ends) in ends.iter().enumerate() {
            let [q, v, _] = between(ends, s[count], interval);
            (x[joint], x[joints + joint]) = (q, v);
        }
        x[2 * joints..].copy_from_slice(&s[..count]);
        dynamics.drive(x, rate);
    }
}

impl<S: Scalar> Ode<S> for Answer<S> {
    fn dim(&self) -> usize {
        self.values.x.len() - 2 * self.ends.len() + 1
    }

    fn coordinates(&self) -> usize {
        0
    }

    fn rhs(&mut self, s: &[S], dsdt: &mut [S]) {
        self.values.evaluate(s, &self.ends, self.interval);
        let count = s.len() - 1;
        dsdt[..count].copy_from_slice(&self.values.rate[2 * self.ends.len()..]);
        dsdt[count] = S::one();
    }

    /// Exact, by dual numbers.
    fn jacobian(&mut self, s: &[S], jacobian: &mut [S]) {
        let dim = s.len();
        jacobian.fill(S::zero());
        for (lifted, ends) in self.lifted.iter_mut().zip(&self.ends) {
            *lifted = ends.map(|end| end.map(Dual::constant));
        }
        for first in (0..dim).step_by(LANES) {
            for (column, (state, &value)) in self.seeds.iter_mut().zip(s).enumerate() {
                // A column before `first` wraps around to a lane that does not exist, which gives a constant.
                *state = Dual::variable(value, column.wrapping_sub(first));
            }
            self.duals.evaluate(&self.seeds, &self.lifted, self.interval);
            let rates = &self.duals.rate[2 * self.ends.len()..];
            for (row, rate) in jacobian.chunks_exact_mut(dim).zip(rates) {
                for (entry, &slope) in row[first..].iter_mut().zip(&rate.gradient) {
                    *entry = slope;
                }
            }
        }
    }

    /// The dual numbers of the Jacobian carry the rates along.
    fn linearise(&mut self, s: &[S], jacobian: &mut [S], rates: &mut [S]) {
        self.jacobian(s, jacobian);
        for (rate, dual) in rates.iter_mut().zip(&self.duals.rate[2 * self.ends.len()..]) {
            *rate = dual.value;
        }
        rates[s.len() - 1] = S::one();
    }

    fn prepare(&mut self, s: &[S], matrix: &mut [S], rates: &mut [S]) {
        self.linearise(s, matrix, rates);
    }

    fn scales(&self, scales: &mut [f64]) {
        let count = scales.len() - 1;
        self.values.dynamics.drive_scales(&mut scales[..count]);
        scales[count] = self.interval;
    }
}
