//! The part of a graph that some outputs need, ready to be worked out in order.

use std::sync::{Arc, OnceLock};

use super::evaluate::Layout;
use super::operation::{Call, Function, Node, Operation};
use super::record::Graph;

/// Operations in order, arguments first, and the numbers that come out.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    operations: Vec<Operation>,
    calls: Vec<Call>,
    outputs: Vec<Node>,
    inputs: usize,
    layout: Kept,
}

/// How the operations are run, worked out when it is asked for first; no part of what the program is.
#[derive(Clone, Debug, Default)]
struct Kept(OnceLock<Arc<Layout>>);

impl PartialEq for Kept {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A program cut in two by how often its inputs change.
#[derive(Clone, Debug, PartialEq)]
pub struct Stages {
    /// Works out, from the inputs that change seldom, what of them the rest needs.
    pub seldom: Program,
    /// The rest: its inputs are those of the whole, then the outputs of `seldom`.
    pub often: Program,
}

/// What becomes of numbers that derivatives take for constants.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Frozen {
    /// They stay marked.
    Kept,
    /// They are what they are.
    Left,
}

impl Program {
    /// Program of what `outputs` need of `graph`, as a function of `inputs` numbers.
    ///
    /// Numbers are worked out as late as the order of the recording lets them, so that few stay alive at a time.
    pub fn new(graph: &Graph, outputs: &[Node], inputs: usize) -> Self {
        Self::of((graph.operations(), graph.calls()), outputs, inputs, Frozen::Left)
    }

    /// As [`Program::new`], for numbers that carry derivatives along directions, to which what is frozen is constant.
    pub fn of_directions(graph: &Graph, outputs: &[Node], inputs: usize) -> Self {
        Self::of((graph.operations(), graph.calls()), outputs, inputs, Frozen::Kept)
    }

    fn of((operations, calls): (&[Operation], &[Call]), outputs: &[Node], inputs: usize, frozen: Frozen) -> Self {
        const UNUSED: Node = Node::MAX;
        let mut places = vec![UNUSED; operations.len()];
        let mut program = Self {
            operations: Vec::new(),
            calls: Vec::new(),
            outputs: Vec::with_capacity(outputs.len()),
            inputs,
            layout: Kept::default(),
        };
        let mut open = Vec::new();
        for &output in outputs {
            open.push(output);
            // Depth first: a number is appended once all its arguments stand.
            while let Some(&node) = open.last() {
                if places[node as usize] != UNUSED {
                    open.pop();
                    continue;
                }
                let before = open.len();
                operations[node as usize].arguments(calls, |argument| {
                    if places[argument as usize] == UNUSED {
                        open.push(argument);
                    }
                });
                if open.len() > before {
                    continue;
                }
                open.pop();
                places[node as usize] = match operations[node as usize] {
                    Operation::Apply(Function::Frozen, argument) if frozen == Frozen::Left => places[argument as usize],
                    operation => {
                        let beside = (calls, &mut program.calls);
                        program.operations.push(operation.renamed(beside, |argument| places[argument as usize]));
                        program.operations.len() as Node - 1
                    }
                };
            }
            program.outputs.push(places[output as usize]);
        }
        program
    }

    /// The smaller program that gives only the outputs at these places, from the same inputs.
    #[must_use]
    pub fn part(&self, outputs: impl IntoIterator<Item = usize>) -> Self {
        let outputs: Vec<_> = outputs.into_iter().map(|place| self.outputs[place]).collect();
        Self::of((&self.operations, &self.calls), &outputs, self.inputs, Frozen::Kept)
    }

    /// Operations of the program.
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// Calls to which the program's operations refer.
    pub fn calls(&self) -> &[Call] {
        &self.calls
    }

    /// Numbers that the program puts out.
    pub fn outputs(&self) -> &[Node] {
        &self.outputs
    }

    /// Number of the program's inputs.
    pub fn n_inputs(&self) -> usize {
        self.inputs
    }

    /// Layout in which the program's operations are run.
    pub(super) fn layout(&self) -> Arc<Layout> {
        self.layout.0.get_or_init(|| Arc::new(Layout::new(self))).clone()
    }

    /// Number of operations in the program, constants and inputs not counted.
    pub fn size(&self) -> usize {
        self.operations
            .iter()
            .filter(|operation| !matches!(operation, Operation::Constant(_) | Operation::Input(_)))
            .count()
    }

    /// Splits the program by how often inputs change: `seldom` tells of an input whether it changes seldom.
    pub fn split(&self, seldom: impl Fn(usize) -> bool) -> Stages {
        let mut early = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let mut fixed = !matches!(operation, Operation::Input(number) if !seldom(*number as usize));
            operation.arguments(&self.calls, |argument| fixed &= early[argument as usize]);
            early.push(fixed);
        }
        let passed = self.passed(&early);
        let mut rest = self.operations.clone();
        for (place, &node) in passed.iter().enumerate() {
            rest[node as usize] = Operation::Input((self.inputs + place) as u32);
        }
        Stages {
            seldom: Self::of((&self.operations, &self.calls), &passed, self.inputs, Frozen::Kept),
            often: Self::of((&rest, &self.calls), &self.outputs, self.inputs + passed.len(), Frozen::Kept),
        }
    }

    /// Numbers passed from a program's early operations to the late ones or outputs. They are neither constants nor
    /// inputs.
    fn passed(&self, early: &[bool]) -> Vec<Node> {
        let mut wanted = vec![false; self.operations.len()];
        for (operation, _) in self.operations.iter().zip(early).filter(|&(_, &early)| !early) {
            operation.arguments(&self.calls, |argument| wanted[argument as usize] = true);
        }
        self.outputs.iter().for_each(|&output| wanted[output as usize] = true);
        let made = |node: usize| !matches!(self.operations[node], Operation::Constant(_) | Operation::Input(_));
        (0..self.operations.len())
            .filter(|&node| wanted[node] && early[node] && made(node))
            .map(|node| node as Node)
            .collect()
    }
}
