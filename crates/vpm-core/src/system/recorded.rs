//! A whole machine as a graph of operations.

use super::additive::{Split, Stage};
use super::{Build, Dynamics, stiff};
use crate::contact::ContactFriction;
use crate::effect::JointEffect;
use crate::error::{Error, Result};
use crate::graph::{Decision, Graph, Node, Program, Recorded, input, record};

/// Where the inputs of a recorded machine's programs stand: state, inputs of drives and supplies, the implicit state and the reach of an
/// additive step with the rates where the stage before ended, parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Places {
    /// Number of coordinates.
    pub coordinates: usize,
    /// Length of the state, which comes first.
    pub states: usize,
    /// Number of inputs, see [`Dynamics::input`].
    pub inputs: usize,
    /// Number of parameters.
    pub parameters: usize,
}

impl Places {
    /// The implicit state of an additive step.
    pub fn implicit(&self) -> usize {
        self.states + self.inputs
    }

    /// The reach of an additive step, s.
    pub fn reach(&self) -> usize {
        self.implicit() + self.states
    }

    /// The rates of the coordinates where the stage before ended.
    pub fn before(&self) -> usize {
        self.reach() + 1
    }

    /// The first parameter.
    pub fn first_parameter(&self) -> usize {
        self.before() + self.coordinates
    }

    /// How many numbers go into a program.
    pub fn count(&self) -> usize {
        self.first_parameter() + self.parameters
    }
}

/// What a program of a machine gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// dx/dt.
    Rates,
    /// dx/dt, then all true outputs in the order of [`crate::sensor::Layout`]; the command of an actuator is what enters its lag.
    Sample,
    /// dx/dt, then the entries of its derivatives by the states.
    Linearised,
    /// dx/dt, then the entries of the matrix that an implicit step puts in the place of the derivatives, see
    /// [`crate::ode::Ode::iteration_matrix`].
    Prepared,
    /// The rates of a stage of an additive step, see [`crate::ode::Ode::additive_rates`].
    Additive,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Rates, Self::Sample, Self::Linearised, Self::Prepared, Self::Additive];
}

/// The functions of a machine, recorded: programs over state, inputs and parameters.
///
/// Checked: all programs against the direct evaluation of the same laws, derivatives against dual numbers.
#[derive(Clone, Debug)]
pub struct Recording {
    graph: Graph,
    places: Places,
    functions: Functions,
}

/// What of a machine comes out of its graph.
#[derive(Clone, Debug)]
struct Functions {
    rates: Vec<Node>,
    outputs: Vec<Node>,
    /// Rates whose derivatives are an iteration matrix, or that matrix.
    stiff: Stiff,
    /// Rates of a stage of an additive step.
    additive: Vec<Node>,
}

#[derive(Clone, Debug)]
enum Stiff {
    /// Rates with chords in the place of friction laws.
    Chords(Vec<Node>),
    /// The matrix of a machine of which beams are all that is stiff, row by row.
    Beams(Vec<Node>),
}

/// A program, and where in a matrix its last outputs stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The program.
    pub program: Program,
    /// Row and column of each entry of the matrix that is not zero everywhere.
    pub entries: Vec<(usize, usize)>,
}

impl Recording {
    /// Records the machine that `build` makes; `theta` are the parameters, checked, for which its parts are built.
    ///
    /// # Errors
    /// [`Error::Unrecorded`] where a law decides by the value of a state: the graph would hold for that state alone.
    pub fn new(build: impl Build<Error = Error>, places: Places, theta: &[f64]) -> Result<Self> {
        let (functions, graph) = record(places.first_parameter() as u32, || functions(build, places, theta));
        let recording = Self { graph, places, functions: functions? };
        match recording.graph.decisions().iter().find(|decision| !decision.of_parameters) {
            Some(decision) => Err(unrecordable(decision)),
            None => Ok(recording),
        }
    }

    /// Whether the graph holds for the parameters of the recording only: then a part was built by their values.
    pub fn is_of_values(&self) -> bool {
        !self.graph.decisions().is_empty()
    }

    /// Where the inputs of programs stand.
    pub fn places(&self) -> Places {
        self.places
    }

    /// The program of that kind.
    pub fn program(&mut self, kind: Kind) -> Placed {
        let Functions { rates, outputs, stiff, additive } = &self.functions;
        let (dim, states) = (self.places.states, 0..self.places.states as u32);
        let mut entries = Vec::new();
        let mut nodes = rates.clone();
        match (kind, stiff) {
            (Kind::Rates, _) => {}
            (Kind::Sample, _) => nodes.extend(outputs),
            (Kind::Additive, _) => nodes.clone_from(additive),
            (Kind::Prepared, Stiff::Beams(matrix)) => {
                for (place, &entry) in matrix.iter().enumerate() {
                    if self.graph.known_value(entry) != Some(0.0) {
                        entries.push((place / dim, place % dim));
                        nodes.push(entry);
                    }
                }
            }
            (Kind::Linearised, _) | (Kind::Prepared, Stiff::Chords(_)) => {
                let differentiated = match stiff {
                    Stiff::Chords(chords) if kind == Kind::Prepared => chords,
                    _ => rates,
                };
                let derivative = self.graph.derive(differentiated, &states.collect::<Vec<_>>());
                entries = derivative.places;
                nodes.extend(derivative.entries);
            }
        }
        Placed { program: Program::new(&self.graph, &nodes, self.places.count()), entries }
    }
}

fn functions(build: impl Build<Error = Error>, places: Places, theta: &[f64]) -> Result<Functions> {
    let first = places.first_parameter();
    let theta: Vec<Recorded> = theta.iter().enumerate().map(|(k, &value)| input(first + k, value)).collect();
    let mut dynamics: Dynamics<Recorded> = build.dynamics(&theta)?;
    let zeros = |count: usize| vec![Recorded::default(); count];
    let x: Vec<Recorded> = (0..places.states).map(|k| input(k, 0.0)).collect();
    for number in 0..places.inputs {
        dynamics.hold(number, input(places.states + number, 0.0));
    }
    let (mut rates, mut outputs) = (zeros(places.states), zeros(dynamics.layout().count()));
    dynamics.rhs(&x, &mut rates);
    dynamics.observe(&x, &rates, &mut outputs);
    let stiff = dynamics.stiff(&x);
    let additive = dynamics.additive(&x, places);
    Ok(Functions { rates: nodes(&rates), outputs: nodes(&outputs), stiff, additive })
}

impl Dynamics<Recorded> {
    /// The rates of a stage of an additive step whose explicit state is `x`.
    fn additive(&mut self, x: &[Recorded], places: Places) -> Vec<Node> {
        let implicit: Vec<Recorded> = (0..x.len()).map(|k| input(places.implicit() + k, 0.0)).collect();
        let reach = input(places.reach(), 0.0);
        let mut rates = vec![Recorded::default(); x.len()];
        let before: Vec<Recorded> = (0..places.coordinates).map(|k| input(places.before() + k, 0.0)).collect();
        let mut split = Split::new(self);
        split.depart(&before);
        self.additive_rates(Stage { explicit: x, implicit: &implicit, reach }, &mut rates, &mut split);
        nodes(&rates)
    }

    /// What of the machine an iteration matrix is made of, at the state of the last [`Dynamics::rhs`].
    fn stiff(&mut self, x: &[Recorded]) -> Stiff {
        let (n, dim) = (self.coordinates(), x.len());
        let (q, v) = x[..2 * n].split_at(n);
        let mut fadings = vec![None; self.memories.len()];
        self.memories.fadings(&x[self.first_memory()..], v, &mut fadings);
        let mut resistances = vec![Recorded::default(); self.joints()];
        self.write_resistances(q, v, &mut resistances);
        if self.is_stiff_by_beams_alone() {
            let (mut matrix, mut column) = (vec![Recorded::default(); dim * dim], vec![Recorded::default(); n]);
            stiff::iteration_matrix(self, x, &mut matrix, (&resistances, &fadings), &mut column);
            return Stiff::Beams(nodes(&matrix));
        }
        let mut seals = vec![None; self.seals.len()];
        self.seal_chords(q, v, &mut seals);
        self.seals = seals.into_iter().map(|seal| seal.map(Recorded::frozen)).collect();
        self.memories.replace(fadings.into_iter().map(|fading| fading.map(Recorded::frozen)));
        let resistances: Vec<_> = resistances.into_iter().map(Recorded::frozen).collect();
        let chords =
            |effects: &[(usize, JointEffect<Recorded>)], [q, v, _]: [&[Recorded]; 3], total: &mut [Recorded]| {
                for (joint, effect) in effects {
                    total[*joint] += effect.effort_at_rest(q[*joint]);
                }
                for ((total, &v), &resistance) in total.iter_mut().zip(v).zip(&resistances) {
                    *total -= resistance * v;
                }
            };
        let resistance =
            |law: &ContactFriction<Recorded>, square: Recorded, normal| law.chord(square.frozen()).frozen() * normal;
        let mut rates = vec![Recorded::default(); dim];
        self.rhs_with(x, &mut rates, (chords, resistance));
        self.seals.fill(None);
        self.memories.replace(std::iter::repeat(None));
        Stiff::Chords(nodes(&rates))
    }
}

fn nodes(numbers: &[Recorded]) -> Vec<Node> {
    numbers.iter().map(|number| number.node()).collect()
}

fn unrecordable(decision: &Decision) -> Error {
    let what = "a state or an input, so that no formula holds everywhere".to_owned();
    Error::Unrecorded { place: decision.place(), what }
}
