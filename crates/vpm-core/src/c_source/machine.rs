//! What the source of a machine is made of: programs for its functions, patterns of its derivatives, prepared constants.

use crate::description::Description;
use crate::error::{Error, Result};
use crate::graph::{Block, Evaluator, Graph, Node, Program, Source};
use crate::system::{Kind, Places, Recording};

/// Rows, columns and places of the entries of a matrix, column by column.
pub(super) struct Pattern {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) places: Vec<(usize, usize)>,
}

/// The derivatives of rates or outputs by states, inputs and parameters.
pub(super) struct Derivatives {
    pub(super) patterns: [Pattern; 3],
    entries: Vec<Node>,
}

/// Ball joints: which coordinates are their angles.
pub(super) struct Balls {
    /// Number of coordinates of the machine.
    pub(super) coordinates: usize,
    /// How many of them turn freely in a step; they come first.
    pub(super) free: usize,
    /// The coordinates of each angle of each: one as a rule, more where effects divide it.
    pub(super) angles: Vec<[Vec<usize>; 3]>,
}

impl Balls {
    fn new(description: &Description) -> Self {
        let (free, watched): (Vec<_>, Vec<_>) =
            description.balls.iter().partition(|ball| description.hindrance(ball).is_none());
        let angles = free.iter().chain(&watched).map(|ball| ball.angles.clone()).collect();
        Self { coordinates: description.n_coordinates(), free: free.len(), angles }
    }
}

/// A machine's functions in C, with what belongs to them.
pub(super) struct Machine {
    pub(super) nx: usize,
    pub(super) nu: usize,
    pub(super) ny: usize,
    pub(super) np: usize,
    /// Prepared constants at the default parameters: the parameters themselves, then what follows from them.
    pub(super) constants: Vec<f64>,
    pub(super) rates: Derivatives,
    pub(super) outputs: Derivatives,
    /// Prepares, then gives rates, outputs, rates with their derivatives, outputs with theirs.
    pub(super) functions: [Source; 5],
    pub(super) balls: Balls,
}

impl Pattern {
    /// Number of entries of a machine's derivative pattern.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }
}

impl Derivatives {
    fn new(graph: &mut Graph, numbers: &[Node], places: Places, nu: usize) -> Self {
        let widths = [places.states, nu, places.parameters];
        let before = places.states + nu;
        let inputs: Vec<u32> =
            (0..before).chain(places.first_parameter()..places.count()).map(|place| place as u32).collect();
        let derivative = graph.derive(numbers, &inputs);
        let mut order: Vec<_> = (0..derivative.entries.len()).collect();
        order.sort_by_key(|&entry| (derivative.places[entry].1, derivative.places[entry].0));
        let mut first = 0;
        let patterns = widths.map(|columns| {
            let range = first..first + columns;
            let own = order.iter().map(|&entry| derivative.places[entry]).filter(|(_, column)| range.contains(column));
            let places = own.map(|(row, column)| (row, column - first)).collect();
            first += columns;
            Pattern { rows: numbers.len(), columns, places }
        });
        Self { patterns, entries: order.iter().map(|&entry| derivative.entries[entry]).collect() }
    }

    fn blocks<'a>(&self, names: [&'a str; 3]) -> [Block<'a>; 3] {
        let [x, u, p] = &self.patterns;
        [(names[0], x.len()), (names[1], u.len()), (names[2], p.len())]
    }
}

impl Machine {
    pub(super) fn new(description: &Description, theta: &[f64], free: &[usize], name: &str) -> Result<Self> {
        let (places, Recording { mut graph, values, .. }) = recorded(description, theta, free)?;
        let Places { states: nx, parameters: np, .. } = places;
        let (nu, balls) = (description.n_inputs(), Balls::new(description));
        let (rates, outputs) = values.split_at(nx);
        let of_rates = Derivatives::new(&mut graph, rates, places, nu);
        let of_outputs = Derivatives::new(&mut graph, outputs, places, nu);
        let all = [&values, &of_rates.entries, &of_outputs.entries].map(Vec::as_slice).concat();
        let stages = Program::new(&graph, &all, places.count()).split(|input| input >= places.first_parameter());
        let mut point = vec![0.0; places.first_parameter()];
        point.extend(free.iter().map(|&place| theta[place]));
        let passed = stages.seldom.outputs().len();
        let mut constants = vec![0.0; passed];
        Evaluator::new(&stages.seldom).run(&point, &mut constants);
        constants.splice(0..0, point.drain(places.first_parameter()..));
        let (ny, entries) = (outputs.len(), of_rates.entries.len());
        let turned = (if balls.angles.is_empty() { "" } else { "q" }, 4 * balls.free);
        // Between inputs and parameters stands what additive steps take.
        let steps = ("", places.first_parameter() - places.implicit());
        let arguments = [("x", nx), ("u", nu), turned, steps, ("c", np + passed)];
        let often = |what: &str, numbers: Vec<usize>, blocks: &[Block<'_>]| {
            stages.often.part(numbers).to_c(&format!("{name}_run_{what}"), &arguments, blocks)
        };
        let (dx, y) = (("dx", nx), ("y", ny));
        let [dx_x, dx_u, dx_p] = of_rates.blocks(["dx_x", "dx_u", "dx_p"]);
        let [y_x, y_u, y_p] = of_outputs.blocks(["y_x", "y_u", "y_p"]);
        let first = nx + ny;
        let functions = [
            stages.seldom.to_c(
                &format!("{name}_run_prepare"),
                &[("", places.first_parameter()), ("p", np)],
                &[("c", passed)],
            ),
            often("rates", (0..nx).collect(), &[dx]),
            often("outputs", (nx..first).collect(), &[y]),
            often("rates_jacobian", (0..nx).chain(first..first + entries).collect(), &[dx, dx_x, dx_u, dx_p]),
            often("outputs_jacobian", (nx..first).chain(first + entries..all.len()).collect(), &[y, y_x, y_u, y_p]),
        ];
        Ok(Self { nx, nu, ny, np, constants, rates: of_rates, outputs: of_outputs, functions, balls })
    }

    /// Number of values that the functions of a machine's source hand on.
    pub(super) fn work(&self) -> usize {
        self.functions.iter().map(|function| function.work).max().unwrap_or(0)
    }
}

/// Recorded rates and outputs of the machine for its source, as numbers of a graph. They are over states, inputs,
/// orientations of ball joints and the parameters at the places `free`.
fn recorded(description: &Description, theta: &[f64], free: &[usize]) -> Result<(Places, Recording)> {
    let recorded = |free: &[usize]| description.recorded_turned((theta, free), &Kind::Readings);
    let (places, recording) = recorded(free)?;
    let Some(decision) = recording.graph.decisions().first() else { return Ok((places, recording)) };
    let decides = |&&one: &&usize| recorded(&[one]).is_ok_and(|(_, own)| !own.graph.decisions().is_empty());
    let name = |&one: &usize| format!("`{}`", description.parameter_names[one]);
    let names: Vec<_> = free.iter().filter(decides).map(name).collect();
    let what = format!("a parameter; take {} out of the parameters that stay free", names.join(", "));
    Err(Error::Unrecorded { place: decision.place(), what })
}
