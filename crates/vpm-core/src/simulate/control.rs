//! Controllers at work: what they see at a sample, what they hold until their next one, and when it arrives.

use super::Setting;
use crate::actuator::{Drive, Target};
use crate::controller::{ControlLaw, ControlMemory, Differences, Stroke, samples_between};
use crate::delay::SampleDelay;
use crate::description::{ControllerEntry, Description};
use crate::error::Result;
use crate::scalar::Scalar;
use crate::sensor::{Channel, Sensor};
use crate::system::{Kind, System};
use crate::table::Table;

/// The controllers of a machine, with all that they remember.
pub(super) struct Control<S> {
    loops: Vec<Loop<S>>,
    /// What the controllers put out, before their delays: one number per input, row by row.
    drafts: Vec<S>,
    inputs: usize,
    machine: Machine<S>,
}

/// A controller with its memory.
struct Loop<S> {
    law: ControlLaw<S>,
    ports: Vec<Port>,
    /// Samples of the record from one of the controller to its next, and the time in s that they take.
    every: usize,
    period: f64,
    delay: Option<SampleDelay<S>>,
    memory: ControlMemory<S>,
    /// Rates of the reference of each port.
    differences: Vec<Differences<S>>,
}

/// Where a controller meets one of its actuators: columns among the outputs, and the way from the actuator to the joint.
#[derive(Clone, Copy)]
struct Port {
    actuator: usize,
    position: usize,
    rate: usize,
    force: usize,
    stroke_rate: usize,
    joint: usize,
    /// The line of the actuator, if it is on one.
    line: Option<usize>,
}

/// The machine as the controllers see it.
struct Machine<S> {
    /// Coordinates, then their rates.
    state: Vec<S>,
    acceleration: Vec<S>,
    efforts: Vec<S>,
    /// Lever arms of the lines, line by line.
    levers: Vec<S>,
}

impl<S: Scalar> Control<S> {
    /// The controllers of a loop over `rows` samples with `inputs` references each.
    pub(super) fn new(setting: &Setting<'_>, theta: &[S], rows: usize, inputs: usize) -> Result<Self> {
        let description = setting.description;
        let entries = &description.controllers;
        let loops = entries.iter().map(|entry| Loop::new(entry, description, theta, setting.stepping.time_step));
        let (n, zeros) = (description.n_coordinates(), |count: usize| vec![S::zero(); count]);
        let machine = Machine {
            state: zeros(2 * n),
            acceleration: zeros(n),
            efforts: zeros(n),
            levers: zeros(description.n_wires() * n),
        };
        Ok(Self { loops: loops.collect::<Result<_>>()?, drafts: zeros(rows * inputs), inputs, machine })
    }

    /// Forgets everything that controllers remember.
    pub(super) fn restart(&mut self) {
        for control in &mut self.loops {
            control.memory = ControlMemory::default();
            control.differences.fill(Differences::default());
        }
    }

    /// Whether a controller that is due at sample `row` measures a force, which has to be there before its command is.
    pub(super) fn feels(&self, row: usize) -> bool {
        self.loops.iter().any(|control| control.due(row) && matches!(control.law, ControlLaw::ForceLoop(_)))
    }

    /// What the controllers ask of the machine at their samples.
    pub(super) fn questions(&self) -> impl Iterator<Item = Kind> + use<S> {
        let any = |asks: fn(&Loop<S>) -> bool| self.loops.iter().any(asks);
        let forces = any(|control| matches!(control.law, ControlLaw::ForceLoop(_)));
        let efforts = any(|control| matches!(control.law, ControlLaw::ComputedTorque(_)));
        let levers = any(Loop::needs_machine) && !self.machine.levers.is_empty();
        let asked = [(forces, Kind::Feedback), (efforts, Kind::RequiredOfTree), (levers, Kind::Levers)];
        asked.into_iter().filter_map(|(asked, kind)| asked.then_some(kind))
    }

    /// Lets the controllers that are due at sample `row` command, and the others hold; `state` gives what no sensor is made for.
    pub(super) fn sample(
        &mut self,
        row: usize,
        references: Table<'_>,
        (system, state): (&mut System<S>, &[S]),
        see: impl Fn(usize) -> S,
    ) {
        let Self { loops, drafts, inputs, machine } = self;
        let (past, now) = drafts.split_at_mut(row * *inputs);
        let held = &past[past.len().saturating_sub(*inputs)..];
        if loops.iter().any(|control| control.due(row) && control.needs_machine()) {
            machine.look(state, system, &see);
        }
        for control in loops {
            if control.due(row) {
                control.command(references.row(row), system, machine, &see, now);
            } else {
                for port in &control.ports {
                    now[port.actuator] = held[port.actuator];
                }
            }
        }
    }

    /// Calls `put` with each actuator and the control command that arrives there at sample `row`.
    pub(super) fn arrive(&self, row: usize, mut put: impl FnMut(usize, S)) {
        for control in &self.loops {
            for &Port { actuator, .. } in &control.ports {
                let draft = |sample: usize| self.drafts[sample * self.inputs + actuator];
                put(actuator, control.delay.map_or_else(|| draft(row), |delay| delay.delayed(row, draft)));
            }
        }
    }
}

impl<S: Scalar> Loop<S> {
    fn new(entry: &ControllerEntry, description: &Description, theta: &[S], time_step: f64) -> Result<Self> {
        let every = samples_between("controller", &entry.name, entry.sample_time, time_step)?;
        let pairs = entry.actuators.iter().zip(&entry.measures);
        Ok(Self {
            law: entry.law.map(&mut |&index| theta[index]),
            ports: pairs.map(|(&actuator, &measured)| Port::new(actuator, measured, description)).collect(),
            every,
            period: every as f64 * time_step,
            delay: entry.delay.map(|delay| SampleDelay::new(S::from_f64(delay), time_step)),
            memory: ControlMemory::default(),
            differences: vec![Differences::default(); entry.measures.len()],
        })
    }

    #[inline]
    fn due(&self, row: usize) -> bool {
        row.is_multiple_of(self.every)
    }

    fn needs_machine(&self) -> bool {
        match self.law {
            ControlLaw::ComputedTorque(_) => true,
            ControlLaw::ForceLoop(_) => self.ports.iter().any(|port| port.line.is_some()),
            _ => false,
        }
    }

    /// Writes the commands of a control loop's actuators into `commands`.
    fn command(
        &mut self,
        references: &[f64],
        system: &mut System<S>,
        machine: &mut Machine<S>,
        see: &impl Fn(usize) -> S,
        commands: &mut [S],
    ) {
        let Self { law, ports, period, memory, differences, .. } = self;
        if let ControlLaw::ComputedTorque(law) = law {
            for (place, (port, differences)) in ports.iter().zip(differences).enumerate() {
                let reference = differences.next(S::from_f64(references[port.actuator]), *period);
                let Machine { state, acceleration, .. } = &mut *machine;
                let (position, rate) = state.split_at(acceleration.len());
                acceleration[port.joint] = law.acceleration(place, reference, position[port.joint], rate[port.joint]);
            }
            machine.invert(system);
            for (place, port) in ports.iter().enumerate() {
                // The checks let drives of no other kind come here.
                let Drive::Ideal(drive) = &system.actuators()[port.actuator].drive else { continue };
                commands[port.actuator] = law.limited(place, machine.efforts[port.joint] / drive.gain);
            }
            return;
        }
        for port in ports {
            let (reference, y) = (S::from_f64(references[port.actuator]), see(port.position));
            commands[port.actuator] = match law {
                ControlLaw::Cascade(law) => law.command(memory, reference, y, *period),
                ControlLaw::Pid(law) => law.command(memory, reference, y, *period),
                ControlLaw::Pd(law) => law.command(reference, y, see(port.rate)),
                ControlLaw::ForceLoop(law) => {
                    let arm = machine.arm(port);
                    let stroke = Stroke { arm, rate: see(port.stroke_rate), force: see(port.force) };
                    law.command(reference, y, see(port.rate), stroke)
                }
                ControlLaw::ComputedTorque(_) => S::zero(),
            };
        }
    }
}

impl Port {
    fn new(actuator: usize, measured: Channel, description: &Description) -> Self {
        let layout = description.layout();
        let (joint, rate) = match measured {
            Channel::Length { line } => (0, Channel::Rate { line }),
            Channel::Position { joint } => (joint, Channel::Velocity { joint }),
            // The checks let no other channel come here.
            other => (0, other),
        };
        let (line, stroke_rate) = match description.actuators[actuator].on {
            Target::Line(line) => (Some(line), Channel::Rate { line }),
            Target::Joint(joint) => (None, Channel::Velocity { joint }),
        };
        Self {
            actuator,
            position: measured.column(layout),
            rate: rate.column(layout),
            force: Channel::Force { actuator }.column(layout),
            stroke_rate: stroke_rate.column(layout),
            joint,
            line,
        }
    }
}

impl<S: Scalar> Machine<S> {
    /// Reads the joints for controllers; elastic coordinates have no sensor and count as they are.
    fn look(&mut self, state: &[S], system: &mut System<S>, see: &impl Fn(usize) -> S) {
        let layout = system.dynamics().layout();
        let motion = self.state.len();
        self.state.copy_from_slice(&state[..motion]);
        let (position, rate) = self.state.split_at_mut(motion / 2);
        for (joint, (position, rate)) in position.iter_mut().zip(&mut *rate).take(layout.joints).enumerate() {
            *position = see(Channel::Position { joint }.column(layout));
            *rate = see(Channel::Velocity { joint }.column(layout));
        }
        if system.dynamics().pulls() {
            system.levers(position, &mut self.levers);
        }
    }

    /// Efforts for the accelerations that were asked for; those that nobody asked for are zero, for the next controller too.
    fn invert(&mut self, system: &mut System<S>) {
        system.required_of_tree(&self.state, &self.acceleration, &mut self.efforts);
        self.acceleration.fill(S::zero());
    }

    /// Lever arm for controllers: growth of an actuator's length per motion of the joint measured with it.
    fn arm(&self, port: &Port) -> S {
        let coordinates = self.acceleration.len();
        port.line.map_or(S::one(), |line| self.levers[line * coordinates + port.joint])
    }
}

/// Reading that controllers get of an output at sample `row`: its sensor's, or the truth without a sensor. `truth`
/// holds the outputs of all samples until then, `width` each.
pub(super) fn reading<S: Scalar>(
    sensors: &[(usize, Sensor<S>)],
    (truth, width): (&[S], usize),
    (row, time_step): (usize, f64),
    column: usize,
) -> S {
    let truth = |sample: usize| truth[sample * width + column];
    match sensors.iter().find(|(own, _)| *own == column) {
        Some((_, sensor)) => sensor.read(row, time_step, truth),
        None => truth(row),
    }
}
