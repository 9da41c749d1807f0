//! A machine's functions as graphs of operations.

use std::sync::Arc;

use super::additive::{Split, Stage};
use super::guided::{Guidance, Guided, Part};
use super::{Build, Dynamics, step, stiff};
use crate::ball::LEAST;
use crate::contact::ContactFriction;
use crate::effect::{JointEffect, MemoryChords, Seat};
use crate::error::{Error, Result};
use crate::graph::{Decision, Graph, Node, Program, Recorded, input, record};
use crate::scalar::Scalar;
use crate::sensor::Sensor;

/// Operations from which on a matrix is worked out along directions instead of entry by entry.
const MOST: usize = 200_000;

/// Where the inputs of a recorded machine's programs stand: state, inputs of drives and supplies, the implicit state and the reach of an
/// additive step with the rates where the stage before ended, parameters. The length of a whole step takes the place of the reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Places {
    /// Number of coordinates.
    pub coordinates: usize,
    /// Length of the state, which comes first.
    pub states: usize,
    /// Number of inputs, see [`super::System::input`].
    pub inputs: usize,
    /// Number of parameters.
    pub parameters: usize,
}

impl Places {
    /// Place of the implicit state of an additive step among the inputs of a recorded program.
    pub fn implicit(&self) -> usize {
        self.states + self.inputs
    }

    /// Place of the accelerations among the inputs of a recorded program, where a motion is given.
    pub fn accelerations(&self) -> usize {
        self.implicit()
    }

    /// Place of an additive step's reach, s, among the inputs of a recorded program.
    pub fn reach(&self) -> usize {
        self.implicit() + self.states
    }

    /// Place of the rates after the stage before among the inputs of a recorded program.
    pub fn before(&self) -> usize {
        self.reach() + 1
    }

    /// Place of the first parameter among the inputs of a recorded program.
    pub fn first_parameter(&self) -> usize {
        self.before() + self.coordinates
    }

    /// Number of inputs of a recorded program.
    pub fn count(&self) -> usize {
        self.first_parameter() + self.parameters
    }
}

/// What a program of a machine gives.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// dx/dt.
    Rates,
    /// dx/dt, then all true outputs in the order of [`crate::sensor::Layout`]; the command of an actuator is what enters its lag.
    Sample,
    /// As [`Kind::Sample`], but the inputs are commands that stand for long, which delays pass unchanged, and the outputs what sensors show.
    Readings,
    /// All outputs of which those stand that the state alone decides, see [`Kind::Sample`].
    Motion,
    /// As [`Kind::Motion`], and the forces of the actuators: what controllers read.
    Feedback,
    /// dx/dt, then the entries of its derivatives by the states.
    Linearised,
    /// dx/dt, then the entries of the matrix that an implicit step puts in the place of the derivatives, see
    /// [`crate::ode::Ode::iteration_matrix`].
    Prepared,
    /// As [`Kind::Linearised`], without the friction of joints and seals.
    Frictionless,
    /// As [`Kind::Linearised`], without friction of joints and seals that is not linear.
    LinearFriction,
    /// What constant stiffness and damping of beams do, see [`crate::ode::Ode::elasticity`].
    Elasticity,
    /// The rates of a stage of an additive step, see [`crate::ode::Ode::additive_rates`].
    Additive,
    /// The state after a linearly implicit step, then whether it is exact: one, or zero where the elimination would have to exchange rows.
    Step,
    /// As [`Kind::Step`], but its derivatives are those of a step with a constant matrix: they have the order of the step.
    StepOfConstantMatrix,
    /// Coordinates and rates brought to where all loops are closed, these coordinates held, then the largest gap that is left and how many
    /// equations count, see `Loops::close`.
    Closed(Vec<u32>),
    /// Lever arms of all lines, line by line.
    Levers,
    /// Efforts that the accelerations need, those of the effects taken off.
    Required,
    /// The same as [`Kind::Required`], but without what contacts and bushings do.
    RequiredOfTree,
    /// Accelerations under efforts, which stand in their place, with all effects.
    Accelerations,
    /// The mass matrix, row by row.
    MassMatrix,
    /// Pose of a marker in the world as a homogeneous matrix, row by row.
    MarkerPose(u32),
    /// Jacobian of a marker, see [`Dynamics::jacobian`].
    MarkerJacobian(u32),
    /// Kinetic and potential energy.
    Energy,
    /// What the coordinates miss at rest, then the entries of its derivatives by them; the only input is the share of the weight.
    Unbalance,
    /// A function of a machine some of whose joints follow a motion, of the state of what answers to it.
    Guided(Arc<Guidance>, Part),
    /// All that another kind gives, then the entries of the derivatives of that by the inputs at these places, each named once.
    Derived(Box<Self>, Vec<u32>),
}

impl Kind {
    /// Whether this kind is a whole step.
    fn is_step(&self) -> bool {
        matches!(self, Self::Step | Self::StepOfConstantMatrix)
    }

    /// Places of the inputs of such a recorded program, from those of a free machine at `places`.
    fn places(&self, places: Places) -> Places {
        match self {
            Self::Unbalance => Places { states: places.coordinates, inputs: 2, ..places },
            Self::Guided(guidance, _) => guidance.places(places),
            Self::Derived(kind, _) => kind.places(places),
            _ => places,
        }
    }
}

/// A program of a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The program.
    pub program: Program,
    /// Where its inputs stand.
    pub places: Places,
    /// Row and column of each of its last outputs, if they are the entries of a matrix, those that are not zero everywhere.
    pub entries: Vec<(usize, usize)>,
    /// Instead of the entries what is to be differentiated, where these would be too many operations.
    pub directions: Option<Program>,
    /// Whether it holds for the parameters of the recording only: then a part was built by their values.
    pub of_values: bool,
}

/// A function of a machine as numbers of a graph.
pub(crate) struct Recording {
    pub(crate) graph: Graph,
    pub(crate) values: Vec<Node>,
    matrix: Option<Matrix>,
}

/// Numbers of a graph that are a function of a machine.
struct Outputs {
    values: Vec<Recorded>,
    matrix: Option<Matrix>,
}

/// A matrix of a machine.
pub(super) enum Matrix {
    /// The derivative of these numbers by the inputs at these places.
    Of(Vec<Recorded>, Vec<u32>),
    /// These numbers, row by row, of so many columns.
    Entries(Vec<Recorded>, usize),
}

impl Matrix {
    /// Recorded derivative of `numbers` by the `dim` states.
    pub(super) fn by_states(numbers: Vec<Recorded>, dim: usize) -> Self {
        Self::Of(numbers, (0..dim as u32).collect())
    }
}

impl Recording {
    /// Records a machine's function that `build` makes with the checked parameters `theta`. Those at the places `free`
    /// are its inputs, in this order, all others constants.
    ///
    /// # Errors
    /// [`Error::Unrecorded`] where a law decides by the value of a state: the graph would hold for that state alone.
    pub(crate) fn new(
        build: impl Build<Error = Error>,
        places: Places,
        (theta, free): (&[f64], &[usize]),
        kind: &Kind,
    ) -> Result<Self> {
        let first = places.first_parameter();
        let (outputs, graph) = record(first as u32, || {
            let mut parameters: Vec<_> = theta.iter().map(|&value| Recorded::from(value)).collect();
            for (place, &parameter) in free.iter().enumerate() {
                parameters[parameter] = input(first + place, theta[parameter]);
            }
            outputs(build, places, &parameters, kind)
        });
        let Outputs { values, matrix } = outputs?;
        match graph.decisions().iter().find(|decision| !decision.of_parameters) {
            Some(decision) => Err(unrecordable(decision)),
            None => Ok(Self { graph, values: nodes(&values), matrix }),
        }
    }
}

impl Placed {
    /// Records a machine's function that `build` makes; `theta` are the checked parameters of its parts.
    ///
    /// Checked: all programs against the direct evaluation of the same laws, derivatives against dual numbers.
    ///
    /// # Errors
    /// [`Error::Unrecorded`] where a law decides by the value of a state.
    pub fn new(build: impl Build<Error = Error>, places: Places, theta: &[f64], kind: &Kind) -> Result<Self> {
        let places = kind.places(places);
        let free: Vec<usize> = (0..theta.len()).collect();
        let Recording { mut graph, values: mut nodes, matrix } = Recording::new(build, places, (theta, &free), kind)?;
        // Whole steps, and rates of rigid trees, come with their derivatives.
        let derived = match kind {
            Kind::Derived(kind, _) => kind.is_step() || (**kind == Kind::Rates && matrix.is_some()),
            _ => false,
        };
        let (mut entries, mut directions) = (Vec::new(), None);
        match matrix {
            None => {}
            Some(Matrix::Entries(numbers, columns)) => {
                let known =
                    numbers.iter().enumerate().filter(|(_, entry)| graph.known_value(entry.node()) != Some(0.0));
                for (place, entry) in known {
                    entries.push((place / columns, place % columns));
                    nodes.push(entry.node());
                }
            }
            Some(Matrix::Of(numbers, by)) => {
                let numbers = self::nodes(&numbers);
                match graph.derive_within(&numbers, &by, MOST) {
                    Some(derivative) => {
                        entries = derivative.places;
                        nodes.extend(derivative.entries);
                    }
                    None => directions = Some(Program::of_directions(&graph, &numbers, places.count())),
                }
            }
        }
        let program = Program::new(&graph, &nodes, places.count());
        let placed = Self { program, places, entries, directions, of_values: !graph.decisions().is_empty() };
        Ok(match kind {
            Kind::Derived(kind, by) if !derived => placed.derived(by),
            _ => placed,
        })
    }

    /// Recorded function with the derivatives by the inputs at these places, unless these are too many. All outputs
    /// come first, then the entries of the derivatives.
    fn derived(self, by: &[u32]) -> Self {
        if self.directions.is_some() {
            return self;
        }
        let (mut graph, mut nodes) = Graph::of(&self.program);
        let Some(derivative) = graph.derive_within(&nodes, by, MOST) else {
            return Self { directions: Some(self.program.clone()), ..self };
        };
        nodes.extend(derivative.entries);
        Self { program: Program::new(&graph, &nodes, self.places.count()), entries: derivative.places, ..self }
    }
}

fn outputs(build: impl Build<Error = Error>, places: Places, parameters: &[Recorded], kind: &Kind) -> Result<Outputs> {
    let inputs = |first: usize, count: usize| (first..first + count).map(|place| input(place, 0.0)).collect::<Vec<_>>();
    let mut dynamics: Dynamics<Recorded> = build.dynamics(parameters)?;
    let x = inputs(0, places.states);
    for number in 0..places.inputs.min(dynamics.n_held()) {
        dynamics.hold(number, input(places.states + number, 0.0));
    }
    let zeros = |count: usize| vec![Recorded::default(); count];
    let (n, dim) = (places.coordinates, places.states);
    let motion = (&x[..n], &x[n..dim.min(2 * n)]);
    let mut rates = zeros(dim);
    let (values, matrix) = match kind {
        Kind::Rates => {
            dynamics.rhs(&x, &mut rates);
            (rates, None)
        }
        Kind::Sample => {
            let mut seen = zeros(dynamics.layout().count());
            dynamics.rhs(&x, &mut rates);
            dynamics.observe(&x, &rates, &mut seen);
            rates.extend(seen);
            (rates, None)
        }
        Kind::Readings => {
            let shown = dynamics.readings(&x, &mut rates, &build.sensors(parameters));
            rates.extend(shown);
            (rates, None)
        }
        Kind::Motion => {
            let mut seen = zeros(dynamics.layout().count());
            dynamics.observe_motion(&x, &mut seen);
            (seen, None)
        }
        Kind::Feedback => {
            let mut seen = zeros(dynamics.layout().count());
            dynamics.rhs(&x, &mut rates);
            dynamics.observe_motion(&x, &mut seen);
            dynamics.observe_forces(&mut seen);
            (seen, None)
        }
        Kind::Linearised => {
            dynamics.rhs(&x, &mut rates);
            (rates.clone(), Some(Matrix::by_states(rates, dim)))
        }
        Kind::Prepared => {
            dynamics.rhs(&x, &mut rates);
            let matrix = dynamics.prepared(&x);
            (rates, Some(matrix))
        }
        Kind::Frictionless => (rates, Some(dynamics.resisted(&x, |_| Recorded::default()))),
        Kind::LinearFriction => {
            (rates, Some(dynamics.resisted(&x, |effect| effect.law().damping().unwrap_or_default())))
        }
        Kind::Elasticity => {
            let (mut block, mut column) = (zeros(2 * n * n), zeros(n));
            dynamics.terms(motion.0, motion.1);
            dynamics.data.factorise();
            stiff::elasticity(&dynamics, &mut block, 2 * n, &mut column);
            (rates, Some(Matrix::Entries(block, 2 * n)))
        }
        Kind::Closed(held) => {
            let mut state = x[..2 * n].to_vec();
            let found = dynamics.close(&mut state, held);
            state.extend(found);
            (state, None)
        }
        Kind::Additive => (dynamics.additive(&x, places), None),
        Kind::Step | Kind::StepOfConstantMatrix => (step::linearly_implicit(&mut dynamics, places), None),
        Kind::Derived(kind, by) if kind.is_step() => {
            let constant = **kind == Kind::StepOfConstantMatrix;
            let (values, matrix) = step::linearly_implicit_derived(&mut dynamics, places, by, constant);
            (values, Some(matrix))
        }
        Kind::Derived(kind, by) if **kind == Kind::Rates => {
            dynamics.rhs(&x, &mut rates);
            let variables: Vec<_> = by.iter().map(|&place| input(place as usize, 0.0)).collect();
            let matrix = dynamics.slopes_of_rates(&x, &rates, &variables, MOST).map(|slopes| {
                let mut matrix = zeros(dim * by.len());
                for ((row, column), slope) in slopes {
                    matrix[row * by.len() + column] = slope;
                }
                Matrix::Entries(matrix, by.len())
            });
            (rates, matrix)
        }
        Kind::Derived(kind, _) => return outputs(build, places, parameters, kind),
        Kind::Required
        | Kind::RequiredOfTree
        | Kind::Accelerations
        | Kind::MassMatrix
        | Kind::Levers
        | Kind::MarkerPose(_)
        | Kind::MarkerJacobian(_)
        | Kind::Energy => {
            let (third, mut numbers) = (inputs(places.accelerations(), n), zeros(kind.width(&dynamics)));
            dynamics.answer(kind, &x, &third, &mut numbers);
            (numbers, None)
        }
        Kind::Unbalance => {
            let loads = dynamics.unbalance(&x, [0, 1].map(|share| input(places.states + share, 0.0)));
            (loads.clone(), Some(Matrix::by_states(loads, dim)))
        }
        Kind::Guided(guidance, part) => {
            let mut guided = Guided::new(dynamics, guidance);
            (0..places.inputs).for_each(|number| guided.hold(number, input(dim + number, 0.0)));
            guided.recorded(*part, &x)
        }
    };
    Ok(Outputs { values, matrix })
}

impl Dynamics<Recorded> {
    /// Recorded readings of `sensors` at `x` under constant commands; writes the rates.
    fn readings(&mut self, x: &[Recorded], rates: &mut [Recorded], sensors: &[Sensor<Recorded>]) -> Vec<Recorded> {
        let (layout, commands) = (self.layout(), self.inputs.clone());
        for (number, &command) in (0..self.actuators.len()).zip(&commands) {
            self.hold(number, self.actuators[number].enter(command));
        }
        let mut outputs = vec![Recorded::default(); layout.count()];
        self.rhs(x, rates);
        for ball in &self.balls {
            // No number where the angles are no coordinates.
            let square = ball.of(x)[1].cos().powi(2);
            for rate in &mut *rates {
                *rate = square.if_less((LEAST * LEAST).into(), || (square - LEAST * LEAST).sqrt(), || *rate);
            }
        }
        self.observe(x, rates, &mut outputs);
        for (channels, command) in outputs[layout.actuators()..layout.lines()].chunks_exact_mut(2).zip(commands) {
            channels[0] = command;
        }
        for sensor in sensors {
            let reading = &mut outputs[sensor.channel.column(layout)];
            *reading = sensor.show(*reading);
        }
        outputs
    }

    /// Recorded rates of a stage of an additive step whose explicit state is `x`.
    fn additive(&mut self, x: &[Recorded], places: Places) -> Vec<Recorded> {
        let implicit: Vec<Recorded> = (0..x.len()).map(|k| input(places.implicit() + k, 0.0)).collect();
        let reach = input(places.reach(), 0.0);
        let mut rates = vec![Recorded::default(); x.len()];
        let before: Vec<Recorded> = (0..places.coordinates).map(|k| input(places.before() + k, 0.0)).collect();
        let mut split = Split::new(self);
        split.depart(&before);
        self.additive_rates(Stage { explicit: x, implicit: &implicit, reach }, &mut rates, &mut split);
        rates
    }

    /// Recorded iteration matrix at the state of the last [`Dynamics::rhs`], with chords for friction laws. Of a
    /// machine of which beams are all that is stiff, it is the matrix itself.
    pub(super) fn prepared(&mut self, x: &[Recorded]) -> Matrix {
        let (n, dim) = (self.coordinates(), x.len());
        let (q, v) = x[..2 * n].split_at(n);
        let mut memories = vec![None; self.memories.len()];
        self.memories.write_chords(&x[self.first_memory()..], v, &mut memories);
        let mut resistances = vec![Recorded::default(); self.effects.len()];
        self.write_resistances(q, v, &mut resistances);
        if self.is_stiff_by_beams_alone() {
            let (mut matrix, mut column) = (vec![Recorded::default(); dim * dim], vec![Recorded::default(); n]);
            stiff::iteration_matrix(self, x, &mut matrix, (&resistances, &memories), &mut column);
            return Matrix::Entries(matrix, dim);
        }
        let mut seals = vec![None; self.seals.len()];
        self.drive_chords(q, v, &mut seals);
        self.chords(x, &resistances, &seals, &memories)
    }

    /// Recorded derivative of the rates at `x` with this resistance of each effect in place of friction.
    fn resisted(&mut self, x: &[Recorded], resistance: impl Fn(&JointEffect<Recorded>) -> Recorded) -> Matrix {
        let zero = Recorded::default();
        let resistances: Vec<_> = self.effects.iter().map(|(_, effect)| resistance(effect)).collect();
        let (seals, memories) = (vec![Some(zero); self.seals.len()], self.memories.frictionless());
        self.chords(x, &resistances, &seals, &memories)
    }

    /// Recorded derivative of the rates at `x` with constant resistances and chords of contacts. The constants stand
    /// for the resistance of effects, `seals` and memories.
    fn chords(
        &mut self,
        x: &[Recorded],
        resistances: &[Recorded],
        seals: &[Option<Recorded>],
        memories: &[Option<MemoryChords<Recorded>>],
    ) -> Matrix {
        self.seals = seals.iter().map(|seal| seal.map(Recorded::frozen)).collect();
        self.memories.replace(memories.iter().map(|law| law.map(|law| law.map(Recorded::frozen))));
        let resistances: Vec<_> = resistances.iter().map(|resistance| resistance.frozen()).collect();
        let chords = |effects: &[(Seat<Recorded>, JointEffect<Recorded>)],
                      [q, v, _]: [&[Recorded]; 3],
                      total: &mut [Recorded]| {
            for ((seat, effect), &resistance) in effects.iter().zip(&resistances) {
                seat.push(total, effect.law().effort_at_rest(seat.of(q)) - resistance * seat.of(v));
            }
        };
        let resistance =
            |law: &ContactFriction<Recorded>, square: Recorded, normal| law.chord(square.frozen()).frozen() * normal;
        let mut rates = vec![Recorded::default(); x.len()];
        self.rhs_with(x, &mut rates, (chords, resistance));
        Matrix::by_states(rates, x.len())
    }
}

fn nodes(numbers: &[Recorded]) -> Vec<Node> {
    numbers.iter().map(|number| number.node()).collect()
}

fn unrecordable(decision: &Decision) -> Error {
    let what = "a state or an input, so that no formula holds everywhere; leave out the effect or the drive that it belongs to".to_owned();
    Error::Unrecorded { place: decision.place(), what }
}
