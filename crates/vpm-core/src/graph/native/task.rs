//! What the processor is to do: a program's operations with products fused into sums, sines paired with cosines, and searches after
//! their arguments.

use std::collections::HashMap;

use super::super::operation::{Call, Function, Node, Operation};
use super::super::program::Program;
use crate::scalar::{ARGUMENTS, Search};

/// No number.
pub(super) const NONE: Node = Node::MAX;

/// What a task does with its arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Add,
    Subtract,
    Multiply,
    Divide,
    /// a b + c, rounded once.
    ProductPlus,
    /// a b - c, rounded once.
    ProductMinus,
    /// c - a b, rounded once.
    MinusProduct,
    Negative,
    Root,
    /// Sine and cosine of one argument.
    SineCosine,
    /// A function that is called.
    Call(Function),
    /// a < b ? c : d.
    Select,
    /// To the place of this argument of the search that comes next; makes no number.
    Argument(u32),
    /// A search that is called with the arguments before it.
    Search(&'static Search),
}

/// One task: its results are numbers of the program.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task {
    pub kind: Kind,
    arguments: [Node; 4],
    results: [Node; 2],
}

impl Task {
    fn new(kind: Kind, arguments: &[Node], result: Node) -> Self {
        let mut task = Self { kind, arguments: [NONE; 4], results: [result, NONE] };
        task.arguments.iter_mut().zip(arguments).for_each(|(to, &from)| *to = from);
        task
    }

    /// Arguments of a task: the numbers that it needs.
    pub fn arguments(&self) -> impl Iterator<Item = Node> + Clone + use<> {
        self.arguments.into_iter().take_while(|&node| node != NONE)
    }

    /// Results of a task in their places: sine, then cosine; `NONE` where nobody asked.
    pub fn results(&self) -> [Node; 2] {
        self.results
    }

    /// Numbers that a task makes.
    pub fn made(&self) -> impl Iterator<Item = Node> + use<> {
        self.results.into_iter().filter(|&node| node != NONE)
    }
}

/// The tasks of a program, in its order.
pub(super) fn tasks(program: &Program) -> Vec<Task> {
    let operations = program.operations();
    let (fused, pairs) = (fused(program), pairs(operations));
    let mut tasks = Vec::with_capacity(operations.len());
    for (node, operation) in operations.iter().enumerate() {
        let result = node as Node;
        let task = |kind, arguments: &[Node]| Task::new(kind, arguments, result);
        let made = match *operation {
            Operation::Constant(_) | Operation::Input(_) => continue,
            Operation::Multiply(..) if fused[node].absorbed => continue,
            Operation::Multiply(a, b) => task(Kind::Multiply, &[a, b]),
            Operation::Add(a, b) => match product(operations, fused[node].product) {
                Some([x, y]) => task(Kind::ProductPlus, &[x, y, if fused[node].product == b { a } else { b }]),
                None => task(Kind::Add, &[a, b]),
            },
            Operation::Subtract(a, b) => match product(operations, fused[node].product) {
                Some([x, y]) if fused[node].product == b => task(Kind::MinusProduct, &[x, y, a]),
                Some([x, y]) => task(Kind::ProductMinus, &[x, y, b]),
                None => task(Kind::Subtract, &[a, b]),
            },
            Operation::Divide(a, b) => task(Kind::Divide, &[a, b]),
            Operation::Apply(Function::Negative, a) => task(Kind::Negative, &[a]),
            Operation::Apply(Function::Root, a) => task(Kind::Root, &[a]),
            Operation::Apply(Function::Sine | Function::Cosine, a) => {
                let results = pairs.get(&a).copied().unwrap_or([NONE; 2]);
                // The pair stands where the first of the two stood.
                if results.into_iter().any(|other| other < result) {
                    continue;
                }
                Task { results, ..task(Kind::SineCosine, &[a]) }
            }
            Operation::Apply(function, a) => task(Kind::Call(function), &[a]),
            Operation::Select(nodes) => task(Kind::Select, &nodes),
            Operation::Search(call) => {
                let Call { search, arguments } = &program.calls()[call as usize];
                let arguments = arguments.iter().take(ARGUMENTS).zip(0..);
                tasks.extend(arguments.map(|(&from, place)| Task::new(Kind::Argument(place), &[from], NONE)));
                task(Kind::Search(search), &[])
            }
        };
        tasks.push(made);
    }
    tasks
}

/// What of fusing concerns one number.
#[derive(Clone, Copy)]
struct Fusing {
    /// The product that this sum takes in.
    product: Node,
    /// Whether a sum takes in this product.
    absorbed: bool,
}

/// Fuses a product into the only sum or difference that needs it, as one task. Of two such products it is the later
/// one.
fn fused(program: &Program) -> Vec<Fusing> {
    let operations = program.operations();
    let mut uses = vec![0_u32; operations.len()];
    let calls = program.calls();
    operations.iter().for_each(|operation| operation.arguments(calls, |argument| uses[argument as usize] += 1));
    program.outputs().iter().for_each(|&output| uses[output as usize] += 1);
    let mut fused = vec![Fusing { product: NONE, absorbed: false }; operations.len()];
    for (node, operation) in operations.iter().enumerate() {
        let (Operation::Add(a, b) | Operation::Subtract(a, b)) = *operation else { continue };
        let fits = |&factor: &Node| uses[factor as usize] == 1 && product(operations, factor).is_some();
        if let Some(factor) = [a, b].into_iter().filter(fits).max() {
            fused[node].product = factor;
            fused[factor as usize].absorbed = true;
        }
    }
    fused
}

fn product(operations: &[Operation], node: Node) -> Option<[Node; 2]> {
    match operations.get(node as usize) {
        Some(&Operation::Multiply(a, b)) => Some([a, b]),
        _ => None,
    }
}

/// Pairs the sine and the cosine of each argument that has both, as one task.
fn pairs(operations: &[Operation]) -> HashMap<Node, [Node; 2]> {
    let mut pairs = HashMap::new();
    for (node, operation) in operations.iter().enumerate() {
        if let Operation::Apply(function @ (Function::Sine | Function::Cosine), argument) = *operation {
            pairs.entry(argument).or_insert([NONE; 2])[usize::from(function == Function::Cosine)] = node as Node;
        }
    }
    pairs
}
