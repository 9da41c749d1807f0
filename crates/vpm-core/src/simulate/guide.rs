//! Runs along a motion: the answer of what does not follow it, sample by sample.

use super::bounds::repair_along;
use super::{Bounds, Run, Setting, halted, lost, names, trouble_in_words};
use crate::ball::Ball;
use crate::error::{Diverged, Error, Result};
use crate::integrator::{Halt, Integrator, Stuck};
use crate::motion::{JointMotion, StrainRates, position_sensors, state_sensors, strain_sensors};
use crate::ode::Ode;
use crate::scalar::Scalar;
use crate::sensitivity::{Interrupt, Job, Pair, differentiate, differentiate_by};
use crate::sensor::Sensor;
use crate::statics::settled;
use crate::system::{Following, Guidance, Trouble, code_pays};
use crate::table::Table;

/// A motion and what answers to it, all checked.
pub(super) struct Guide<'a> {
    pub(super) setting: Setting<'a>,
    pub(super) motion: JointMotion<'a>,
    /// Number of the first sample of the motion in its record, for messages.
    pub(super) first: usize,
    /// Joints that do not follow, ascending.
    pub(super) passive: &'a [usize],
    pub(super) strains: Option<StrainRates<'a>>,
    /// How far from rest free coordinates begin: coordinates, then rates, of all; nothing for a beginning at rest.
    pub(super) departure: &'a [f64],
    /// Without them drives and supplies do nothing.
    pub(super) drives: Option<Drives<'a>>,
}

/// Drives and supplies that answer to a motion.
#[derive(Clone, Copy)]
pub(super) struct Drives<'a> {
    pub(super) inputs: Table<'a>,
    /// Their states at the first sample.
    pub(super) internal: &'a [f64],
    /// Which of their states were measured, and the readings.
    pub(super) places: &'a [usize],
    pub(super) seen: Table<'a>,
}

impl Guide<'_> {
    /// Runs a guided motion: outputs of each sample, efforts of answering drives, states and derivatives.
    pub(super) fn run(&self) -> Result<Run> {
        let Setting { theta, sensitivities, .. } = self.setting;
        // Most questions are for a few parameters: lanes that nobody needs would be most of the work.
        let (pair, jacobian) = match sensitivities.len() {
            1 | 2 => differentiate_by::<_, 2>(self, theta, sensitivities, None)?,
            _ => differentiate(self, theta, sensitivities)?,
        };
        Ok(Run { outputs: pair.first, states: pair.second, jacobian })
    }

    fn rows(&self) -> usize {
        self.motion.position.rows()
    }

    fn guidance(&self) -> Guidance {
        let description = self.setting.description;
        let gains = self.strains.map_or(&[][..], |strains| strains.gain).iter().enumerate();
        let bends =
            |gauge: usize| description.elastic().get(description.gauges[gauge].beam).is_some_and(|&len| len > 0);
        Guidance {
            joints: (0..description.n_joints()).filter(|joint| !self.passive.contains(joint)).collect(),
            gauges: gains.filter(|&(gauge, gain)| *gain > 0.0 && bends(gauge)).map(|(gauge, _)| gauge).collect(),
            drives: self.drives.is_some(),
            memories: description.remembering().count(),
        }
    }
}

impl Job for Guide<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.setting.description.check_values(&values)?;
        Way::<S>::new(self, theta)?.run(self.setting.interrupt)
    }
}

/// A machine on its way along a motion.
struct Way<'a, S> {
    guide: &'a Guide<'a>,
    guidance: Guidance,
    sensors: Vec<Sensor<S>>,
    of_joints: Vec<Option<Sensor<S>>>,
    of_gauges: Vec<Option<Sensor<S>>>,
    of_states: Vec<Option<Sensor<S>>>,
    machine: Following<S>,
    bounds: Bounds,
    integrator: Integrator<S>,
    /// State of what answers.
    state: Vec<S>,
    /// The same with measured states in the place of its own.
    measured: Vec<S>,
    /// State of the machine, outputs and efforts of the drives at a sample.
    seen: Vec<S>,
    /// See [`Guidance::given`].
    given: Vec<S>,
    truth: Vec<S>,
    states: Vec<S>,
}

impl<'a, S: Scalar> Way<'a, S> {
    fn new(guide: &'a Guide<'a>, theta: &[S]) -> Result<Self> {
        let (Setting { description, stepping, .. }, guidance) = (guide.setting, guide.guidance());
        let machine = description.machine(theta, guide.setting.theta)?;
        let machine = Following::new(machine, guidance.clone(), (stepping.time_step, stepping.method))?;
        let zeros = |count: usize| vec![S::zero(); count];
        let seen = description.n_states() + description.n_outputs() + description.n_joints();
        let mut way = Self {
            guide,
            guidance,
            sensors: description.sensors(theta),
            of_joints: position_sensors(description, theta),
            of_gauges: strain_sensors(description, theta),
            of_states: state_sensors(description, theta, guide.drives.map_or(&[], |drives| drives.places)),
            integrator: Integrator::new(stepping.method, machine.dim()),
            state: zeros(machine.dim()),
            measured: zeros(machine.dim()),
            bounds: Bounds::new(description, theta, machine.dynamics()),
            machine,
            seen: zeros(seen),
            given: Vec::new(),
            truth: Vec::new(),
            states: zeros(guide.rows() * description.n_states()),
        };
        way.truth = zeros(guide.rows() * way.width());
        if S::plain(&[]).is_some() && code_pays(guide.rows() * stepping.substeps * stepping.method.evaluations()) {
            // What has no code runs as it is.
            let _ = way.machine.compile(stepping.method);
        }
        if guide.rows() > 0 {
            way.begin(theta)?;
        }
        Ok(way)
    }

    /// Begins a guided motion: free coordinates at rest or away from it, and drives in their first states.
    fn begin(&mut self, theta: &[S]) -> Result<()> {
        let (description, count) = (self.guide.setting.description, self.machine.free().len());
        let mut joints = vec![S::zero(); description.n_joints()];
        self.guidance.joints.iter().for_each(|&joint| joints[joint] = self.joint(joint, 0)[0]);
        if count > 0 {
            let q = settled(description, theta, &joints, (self.guide.passive, self.guidance.drives))?;
            self.state.iter_mut().zip(self.machine.free()).for_each(|(entry, &place)| *entry = q[place]);
        }
        for (half, away) in self.guide.departure.chunks_exact(description.n_coordinates().max(1)).enumerate() {
            let begun = self.state[half * count..].iter_mut().zip(self.machine.free());
            begun.for_each(|(entry, &place)| *entry += S::from_f64(away[place]));
        }
        if let Some(Drives { internal, .. }) = self.guide.drives {
            let own = self.state[2 * count..].iter_mut().zip(internal);
            own.for_each(|(state, &value)| *state = S::from_f64(value));
        }
        Ok(())
    }

    /// Guided motion of a joint at a sample.
    fn joint(&self, joint: usize, k: usize) -> [S; 3] {
        self.guide.motion.behind(self.guide.setting.stepping.time_step, k, joint, self.of_joints[joint].as_ref())
    }

    fn run(mut self, interrupt: Interrupt<'_>) -> Result<Pair<S>> {
        let (rows, Setting { description, stepping, .. }) = (self.guide.rows(), self.guide.setting);
        for row in 0..rows {
            self.move_on(row);
            self.sample(row)?;
            if row + 1 < rows {
                let Self { integrator, machine, state, .. } = &mut self;
                let pieces = (stepping.time_step, stepping.substeps);
                integrator.advance(machine, state, pieces, interrupt).map_err(|halt| {
                    let halt = match halt {
                        Halt::Stuck(stuck) => Halt::Stuck(Stuck { state: self.machine.place(stuck.state), ..stuck }),
                        Halt::Interrupted => halt,
                    };
                    halted(description, stepping, self.guide.first + row, halt, self.before(row + 1))
                })?;
            }
        }
        let (layout, width) = (description.layout(), self.width());
        let mut outputs = self.truth.clone();
        for sensor in &self.sensors {
            let column = sensor.channel.column(layout);
            let truth = |sample: usize| self.truth[sample * width + column];
            for row in 0..rows {
                outputs[row * width + column] = sensor.read(row, stepping.time_step, truth);
            }
        }
        Ok(Pair { first: outputs, second: self.states.iter().map(Scalar::re).collect() })
    }

    /// Number of values of a guided sample: outputs and, where drives answer, their efforts.
    fn width(&self) -> usize {
        let description = self.guide.setting.description;
        description.n_outputs() + if self.guidance.drives { description.n_joints() } else { 0 }
    }

    /// Moves the guided motion on to the interval that begins at sample `k`.
    fn move_on(&mut self, k: usize) {
        let (samples, time_step) = ([k, (k + 1).min(self.guide.rows() - 1)], self.guide.setting.stepping.time_step);
        let mut given = std::mem::take(&mut self.given);
        given.clear();
        given.push(S::from_f64(time_step));
        for &joint in &self.guidance.joints {
            given.extend(samples.into_iter().flat_map(|sample| self.joint(joint, sample)));
        }
        if let Some(StrainRates { rate, gain }) = self.guide.strains {
            for &gauge in &self.guidance.gauges {
                let reading = |sample| S::from_f64(rate.at(sample, gauge));
                given.extend(samples.map(|sample| match &self.of_gauges[gauge] {
                    Some(sensor) => sensor.undo_rate(sample, rate.rows() - 1, time_step, reading),
                    None => reading(sample),
                }));
                given.push(S::from_f64(gain[gauge]));
            }
        }
        self.machine.give(&given);
        self.given = given;
        if let Some(Drives { inputs, .. }) = self.guide.drives {
            for number in 0..inputs.columns() {
                self.machine.command(number, k, |sample| S::from_f64(inputs.at(sample, number)));
            }
        }
    }

    /// Records outputs and needed efforts at a sample of the guided motion.
    fn sample(&mut self, row: usize) -> Result<()> {
        if let Some(time) = self.state.last_mut() {
            *time = S::zero();
        }
        let (width, description) = (self.width(), self.guide.setting.description);
        let (dim, n_outputs, layout) = (description.n_states(), description.n_outputs(), description.layout());
        // Measured states decide the efforts of the drives and nothing else.
        let measured = self.measure(row);
        let Self { machine, seen, truth, states, .. } = self;
        let (outputs, applied) = truth[row * width..(row + 1) * width].split_at_mut(n_outputs);
        let efforts = dim + n_outputs..dim + n_outputs + applied.len();
        if measured {
            machine.sample(&self.measured, seen);
            applied.copy_from_slice(&seen[efforts.clone()]);
        }
        machine.sample(&self.state, seen);
        if !measured {
            applied.copy_from_slice(&seen[efforts]);
        }
        let state = &mut states[row * dim..(row + 1) * dim];
        state.copy_from_slice(&seen[..dim]);
        outputs.copy_from_slice(&seen[dim..dim + n_outputs]);
        if let Some(Drives { inputs, .. }) = self.guide.drives {
            let channels = outputs[layout.actuators()..layout.lines()].chunks_exact_mut(2).enumerate();
            channels.for_each(|(actuator, channels)| channels[0] = S::from_f64(inputs.at(row, actuator)));
        }
        self.watch(row)?;
        let state = &self.states[row * dim..(row + 1) * dim];
        let outputs = &self.truth[row * width..row * width + n_outputs];
        if let Some(place) = self.bounds.outside(state) {
            let complaint = self.bounds.complaint(description, place, state[place]);
            return Err(self.diverged(complaint, row));
        }
        let Some(column) = outputs.iter().position(|number| !number.is_finite()) else { return Ok(()) };
        let what = format!("the {}", names::output_name(description, column));
        Err(self.diverged((what, Diverged::NOT_FINITE.to_owned()), row))
    }

    /// Watches a ball joint that answers to the guided motion too near to the singularity of its angles.
    fn watch(&self, row: usize) -> Result<()> {
        let Setting { description, stepping, .. } = self.guide.setting;
        let (dim, n) = (description.n_states(), description.n_coordinates());
        let (q, rest) = self.states[row * dim..(row + 1) * dim].split_at(n);
        let answers = |ball: &Ball| ball.angles.iter().flatten().any(|place| self.machine.free().contains(place));
        for (number, ball) in description.balls.iter().enumerate().filter(|(_, ball)| answers(ball)) {
            let (angle, near) = ball.nearness(q, &rest[..n], Some(stepping.time_step));
            if near {
                let (what, event, repair) = trouble_in_words(description, Trouble::Singular(number, angle));
                return Err(lost(stepping, what, (event, repair), (row, self.guide.first), self.before(row)));
            }
        }
        Ok(())
    }

    /// Puts measured states of drives in the place of their own in a guided run; tells whether there are any.
    fn measure(&mut self, row: usize) -> bool {
        let Some(Drives { places, seen, .. }) = self.guide.drives else { return false };
        let (first, time_step) = (2 * self.machine.free().len(), self.guide.setting.stepping.time_step);
        self.measured.copy_from_slice(&self.state);
        for (column, (&place, sensor)) in places.iter().zip(&self.of_states).enumerate() {
            let reading = |sample| S::from_f64(seen.at(sample, column));
            self.measured[first + place] = match sensor {
                Some(sensor) => sensor.undo(row, seen.rows() - 1, time_step, reading),
                None => reading(row),
            };
        }
        !places.is_empty()
    }

    /// Values of a guided run's samples before `row`: outputs and states.
    fn before(&self, row: usize) -> (Vec<f64>, Vec<f64>) {
        let (description, width) = (self.guide.setting.description, self.width());
        let rows = self.truth[..row * width].chunks_exact(width.max(1));
        let outputs = rows.flat_map(|row| row[..description.n_outputs()].iter().map(Scalar::re)).collect();
        (outputs, self.states[..row * description.n_states()].iter().map(Scalar::re).collect())
    }

    fn diverged(&self, (what, event): (String, String), row: usize) -> Error {
        let Guide { setting: Setting { stepping, .. }, first, .. } = *self.guide;
        let event = (event, repair_along(stepping.method, self.guidance.drives));
        lost(stepping, what, event, (row, first), self.before(row))
    }
}
