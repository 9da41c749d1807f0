//! Joints that follow a given motion, and what answers to it: beams, and joints that nobody drives.

use super::buffers::Buffers;
use super::observer::Held;
use super::quintic::State;
use super::{Run, Setting, Stepping, check_structure, halted, names};
use crate::description::Description;
use crate::error::{Diverged, Error, Result};
use crate::integrator::{Halt, Integrator, Stuck};
use crate::motion::{JointMotion, StrainRates, position_sensors};
use crate::ode::Ode;
use crate::scalar::{Dual, Scalar};
use crate::sensitivity::{Interrupt, Job, Pair, differentiate};
use crate::sensor::Sensor;
use crate::statics::settled;
use crate::system::Build;
use crate::table::Table;

/// Size of a coordinate, rad or m, that a step control counts as small; rates have 1.
const COORDINATE_SCALE: f64 = 1e-2;
/// Derivatives taken in one sweep.
const LANES: usize = 8;

/// Joints follow `motion`, readings of the model's position sensors, but for `passive` ones, whose columns mean nothing; these and the
/// beams move freely.
///
/// Law: `M_ff a_f = (effects - bias - K q - D v)_f - M_fj a_j`, j the joints that follow and f the free coordinates. Between samples the
/// joints follow the polynomial of degree 5 with position, velocity and acceleration of both. The free coordinates begin at rest under
/// gravity. The outputs `effort` of the joints are the efforts that the motion needs, with those of the effects taken off; the actuators
/// do nothing. Checked: a motion simulated from efforts gives those efforts back, with all joints or some of them following.
pub fn prescribed(setting: Setting<'_>, motion: JointMotion<'_>, passive: &[usize]) -> Result<Run> {
    observed(setting, motion, passive, None)
}

/// As [`prescribed`], with beams held to what their gauges showed.
///
/// Law: a force `c C^T (e' - C v)` more on the elastic coordinates, `C v` being the rate of strain at a gauge, `e'` the measured one and
/// `c` its gain: a damper between the beam and the measured one, which takes the energy out of whatever they differ by and nothing where
/// they agree (a natural observer: M. Demetriou, *Systems & Control Letters* 51, 2004). A damped error no longer rings with the noise
/// of the motion. Checked: a free motion gives its own efforts back, with gauges that hold.
pub fn observed(
    setting: Setting<'_>,
    motion: JointMotion<'_>,
    passive: &[usize],
    strains: Option<StrainRates<'_>>,
) -> Result<Run> {
    let (rows, joints) = (motion.position.rows(), setting.description.n_joints());
    for (name, table) in
        [("position", motion.position), ("velocity", motion.velocity), ("acceleration", motion.acceleration)]
    {
        table.expect(name, rows, joints)?;
    }
    if let Some(StrainRates { rate, gain }) = strains {
        rate.expect("strain_rate", rows, setting.description.gauges.len())?;
        Table::new("strain_gain", gain, 1, gain.len())?.expect("strain_gain", 1, setting.description.gauges.len())?;
    }
    if let Some(joint) = setting.description.remembering().next() {
        return Err(Error::Memory { joint: setting.description.bodies[joint].joint.name.clone() });
    }
    let mut passive = passive.to_vec();
    passive.sort_unstable();
    passive.dedup();
    if let Some(&index) = passive.iter().find(|&&joint| joint >= joints) {
        let what = "the list of passive joints".to_owned();
        return Err(Error::Reference { what, target: "joint", index, count: joints });
    }
    if rows > 0 {
        let mut state = motion.position.row(0).to_vec();
        state.resize(setting.description.n_states(), 0.0);
        let driven: Vec<usize> = (0..joints).filter(|joint| !passive.contains(joint)).collect();
        check_structure(setting.description, setting.theta, setting.stepping, &state, &driven)?;
    }
    let job = Guided { setting, motion, passive: &passive, strains };
    let output = |pass: &Pair<_>, place: usize| pass.first[place];
    let (pair, jacobian) = differentiate(&job, setting.theta, setting.sensitivities, output)?;
    Ok(Run { outputs: pair.first, states: pair.second, jacobian })
}

struct Guided<'a> {
    setting: Setting<'a>,
    motion: JointMotion<'a>,
    passive: &'a [usize],
    strains: Option<StrainRates<'a>>,
}

impl Job for Guided<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.setting.description.check_values(&values)?;
        Guide::new(self, theta)?.run(self.setting.interrupt)
    }
}

/// A guided machine on its way.
struct Guide<'a, S> {
    description: &'a Description,
    motion: JointMotion<'a>,
    passive: &'a [usize],
    strains: Option<StrainRates<'a>>,
    stepping: Stepping,
    sensors: Vec<Sensor<S>>,
    of_joints: Vec<Option<Sensor<S>>>,
    ode: Free<S>,
    integrator: Integrator<S>,
    /// Free coordinates, their rates, time since the last sample.
    state: Vec<S>,
    truth: Vec<S>,
    states: Vec<S>,
}

impl<'a, S: Scalar> Guide<'a, S> {
    fn new(job: &Guided<'a>, theta: &[S]) -> Result<Self> {
        let (description, motion) = (job.setting.description, job.motion);
        let dynamics = Build::dynamics(&description, theta)?;
        let of_joints = position_sensors(description, theta);
        let lifted: Vec<_> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let joints = dynamics.joints();
        let held = Held::all(description, &dynamics.model, job.strains, theta);
        let duals = held.iter().map(Held::lifted).collect();
        let ode = Free {
            values: Buffers::new(dynamics, job.passive, held),
            duals: Buffers::new(Build::dynamics(&description, &lifted)?, job.passive, duals),
            ends: vec![[[S::zero(); 3]; 2]; joints],
            interval: job.setting.stepping.time_step,
            ready: false,
        };
        let dim = ode.dim();
        let mut guide = Self {
            description,
            motion,
            passive: job.passive,
            strains: job.strains,
            stepping: job.setting.stepping,
            sensors: description.sensors(theta),
            of_joints,
            integrator: Integrator::new(job.setting.stepping.method, dim),
            ode,
            state: vec![S::zero(); dim],
            truth: vec![S::zero(); motion.position.rows() * description.n_outputs()],
            states: vec![S::zero(); motion.position.rows() * description.n_states()],
        };
        guide.begin(theta)?;
        Ok(guide)
    }

    /// Puts the free coordinates to rest with the joints where the motion begins.
    fn begin(&mut self, theta: &[S]) -> Result<()> {
        if self.motion.position.rows() == 0 {
            return Ok(());
        }
        let mut joints: Vec<S> = self.at(0).iter().map(|[position, ..]| *position).collect();
        for &joint in self.passive {
            joints[joint] = S::zero();
        }
        let Buffers { dynamics, free, .. } = &mut self.ode.values;
        let q = settled(self.description, dynamics, theta, &joints, self.passive)?;
        for (entry, &place) in self.state.iter_mut().zip(&*free) {
            *entry = q[place];
        }
        Ok(())
    }

    /// The true motion of the joints at a sample.
    fn at(&self, k: usize) -> Vec<State<S>> {
        let one = |(joint, sensor): (usize, &Option<Sensor<S>>)| {
            self.motion.behind(self.stepping.time_step, k, joint, sensor.as_ref())
        };
        self.of_joints.iter().enumerate().map(one).collect()
    }

    fn run(mut self, interrupt: Interrupt<'_>) -> Result<Pair<S>> {
        let (rows, layout) = (self.motion.position.rows(), self.description.layout());
        let mut now = if rows > 0 { self.at(0) } else { Vec::new() };
        for row in 0..rows {
            let next = self.at((row + 1).min(rows - 1));
            for ((ends, &now), &next) in self.ode.ends.iter_mut().zip(&now).zip(&next) {
                *ends = [now, next];
            }
            now = next;
            if let Some(strains) = self.strains {
                for held in &mut self.ode.values.held {
                    held.move_on(strains, [row, (row + 1).min(rows - 1)], self.stepping.time_step);
                }
            }
            self.sample(row)?;
            if row + 1 < rows {
                self.advance(row, interrupt)?;
            }
        }
        let mut outputs = self.truth.clone();
        for sensor in &self.sensors {
            let column = sensor.channel.column(layout);
            let truth = |sample: usize| self.truth[sample * layout.count() + column];
            for row in 0..rows {
                outputs[row * layout.count() + column] = sensor.read(row, self.stepping.time_step, truth);
            }
        }
        Ok(Pair { first: outputs, second: self.states })
    }

    /// Carries the free coordinates from one sample to the next.
    fn advance(&mut self, row: usize, interrupt: Interrupt<'_>) -> Result<()> {
        let (stepping, Self { integrator, ode, state, .. }) = (self.stepping, &mut *self);
        let pieces = (stepping.time_step, stepping.substeps);
        integrator.advance(ode, state, pieces, interrupt).map_err(|halt| {
            let halt = match halt {
                Halt::Stuck(stuck) => Halt::Stuck(Stuck { state: self.ode.place(stuck.state), ..stuck }),
                Halt::Interrupted => halt,
            };
            halted(self.description, stepping, row, halt, self.before(row + 1))
        })
    }

    /// Values of the samples before `row`: outputs and states.
    fn before(&self, row: usize) -> (Vec<f64>, Vec<f64>) {
        let values = |numbers: &[S], width: usize| numbers[..row * width].iter().map(Scalar::re).collect();
        (values(&self.truth, self.description.n_outputs()), values(&self.states, self.description.n_states()))
    }

    /// Records what is seen and needed at a sample.
    fn sample(&mut self, row: usize) -> Result<()> {
        if let Some(time) = self.state.last_mut() {
            *time = S::zero();
        }
        let (width, dim) = (self.description.n_outputs(), self.description.n_states());
        self.ode.depart(&self.state);
        let buffers = &mut self.ode.values;
        let n = buffers.q.len();
        let state = &mut self.states[row * dim..(row + 1) * dim];
        state[..n].copy_from_slice(&buffers.q);
        state[n..2 * n].copy_from_slice(&buffers.v);
        let outputs = &mut self.truth[row * width..(row + 1) * width];
        buffers.require();
        let Buffers { dynamics, q, v, a, load, .. } = buffers;
        dynamics.observe_motion(state, outputs);
        for ((channels, &a), &effort) in outputs.chunks_exact_mut(4).zip(&*a).zip(&*load).take(self.of_joints.len()) {
            channels[2] = a;
            channels[3] = effort;
        }
        dynamics.observe_reactions([q, v, a], outputs);
        let wrong = |number: &S| !number.is_finite();
        let place = state.iter().position(wrong).map(|place| names::state_name(self.description, place));
        let place = place.or_else(|| outputs.iter().position(wrong).map(|c| names::output_name(self.description, c)));
        place.map_or(Ok(()), |name| Err(self.diverged(&name, row)))
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
            repair: "use more substeps or the integrator linearly_implicit, and check the motion for jumps",
            outputs,
            states,
        }))
    }
}

/// The free coordinates of a machine whose other joints follow a motion, with time as the last state.
struct Free<S> {
    values: Buffers<S>,
    duals: Buffers<Dual<S, LANES>>,
    /// Motion of each joint at the sample before and after.
    ends: Vec<[State<S>; 2]>,
    /// Time between samples, s.
    interval: f64,
    /// Whether `values` are those of the state in which the next step begins.
    ready: bool,
}

impl<S: Scalar> Free<S> {
    /// Evaluates at `x`, where the next step begins.
    fn depart(&mut self, x: &[S]) {
        self.evaluate(x);
        self.ready = true;
    }

    /// Evaluates at `x`.
    fn evaluate(&mut self, x: &[S]) {
        self.ready = false;
        self.values.evaluate(x, &self.ends, self.interval);
    }

    /// Evaluates at `x` unless that is where the step begins and was done.
    fn begin(&mut self, x: &[S]) {
        if !std::mem::take(&mut self.ready) {
            self.evaluate(x);
        }
    }

    /// Where a state of the free coordinates stands among those of the machine.
    fn place(&self, state: usize) -> usize {
        let (free, n) = (&self.values.free, self.values.q.len());
        match free.get(state) {
            Some(&place) => place,
            None => n + free.get(state.wrapping_sub(free.len())).copied().unwrap_or_default(),
        }
    }

    /// Writes the iteration matrix from the last evaluation.
    fn stiff(&mut self, matrix: &mut [S]) {
        let (n, dim) = (self.values.free.len(), self.values.rates.len());
        matrix.fill(S::zero());
        for k in 0..n {
            matrix[k * dim + n + k] = S::one();
        }
        let lower = &mut matrix[n * dim..2 * n * dim];
        self.values.elasticity(lower, dim);
        self.values.joint_effects(lower, dim);
        self.values.drift(lower, dim, &self.ends, self.interval);
    }
}

impl<S: Scalar> Ode<S> for Free<S> {
    fn dim(&self) -> usize {
        self.values.rates.len()
    }

    fn coordinates(&self) -> usize {
        self.values.rates.len() / 2
    }

    fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        self.evaluate(x);
        dxdt.copy_from_slice(&self.values.rates);
    }

    /// Exact, by dual numbers.
    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        let dim = x.len();
        let Buffers { ends, .. } = &mut self.duals;
        for (lifted, ends) in ends.iter_mut().zip(&self.ends) {
            *lifted = ends.map(|end| end.map(Dual::constant));
        }
        Held::follow(&mut self.duals.held, &self.values.held);
        let (lifted, mut state) = (std::mem::take(&mut self.duals.ends), std::mem::take(&mut self.duals.state));
        for first in (0..dim).step_by(LANES) {
            for (column, (state, &value)) in state.iter_mut().zip(x).enumerate() {
                *state = Dual::variable(value, column.wrapping_sub(first));
            }
            self.duals.evaluate(&state, &lifted, self.interval);
            for (row, rate) in jacobian.chunks_exact_mut(dim).zip(&self.duals.rates) {
                for (entry, &slope) in row[first..].iter_mut().zip(&rate.gradient) {
                    *entry = slope;
                }
            }
        }
        (self.duals.ends, self.duals.state) = (lifted, state);
    }

    fn linearise(&mut self, x: &[S], jacobian: &mut [S], rates: &mut [S]) {
        self.begin(x);
        rates.copy_from_slice(&self.values.rates);
        self.jacobian(x, jacobian);
    }

    /// `[0, 1, 0; -M^-1 K, -M^-1 D, t]`: all that is stiff, for the price of one mass matrix, with the change in time of what drives it;
    /// with contacts and bushings the exact Jacobian.
    fn iteration_matrix(&mut self, x: &[S], matrix: &mut [S]) {
        if !self.values.dynamics.connections.is_free() {
            return self.jacobian(x, matrix);
        }
        self.evaluate(x);
        self.stiff(matrix);
    }

    fn prepare(&mut self, x: &[S], matrix: &mut [S], rates: &mut [S]) {
        self.begin(x);
        rates.copy_from_slice(&self.values.rates);
        if self.values.dynamics.connections.is_free() {
            self.stiff(matrix);
        } else {
            self.jacobian(x, matrix);
        }
    }

    fn elasticity(&mut self, x: &[S], block: &mut [S]) -> bool {
        let n = self.coordinates();
        block.fill(S::zero());
        self.evaluate(x);
        self.values.elasticity(block, 2 * n);
        n > 0
    }

    fn scales(&self, scales: &mut [f64]) {
        let n = self.coordinates();
        scales.fill(1.0);
        scales[..n].fill(COORDINATE_SCALE);
        scales[2 * n..].fill(self.interval);
    }
}
