//! Exact derivatives of a graph, as more graph.

use super::operation::{Function, Node, Operation};
use super::record::Graph;

/// The derivatives of some outputs by some inputs: only those that are not zero for every input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Derivative {
    /// Row (output) and column (place among the inputs asked for) of each entry, row by row.
    pub places: Vec<(usize, usize)>,
    /// The number of each entry in the graph.
    pub entries: Vec<Node>,
}

/// By what is differentiated.
#[derive(Clone, Copy)]
enum Variables<'a> {
    /// Inputs, by their numbers.
    Inputs(&'a [u32]),
    /// Numbers of the graph, whatever they are made of; what is frozen moves with what it is.
    Numbers(&'a [Node]),
}

impl Variables<'_> {
    /// Place of a number among the variables of a derivative.
    fn place(self, node: Node, operation: Operation) -> Option<usize> {
        match (self, operation) {
            (Self::Inputs(inputs), Operation::Input(number)) => inputs.iter().position(|&input| input == number),
            (Self::Inputs(_), _) => None,
            (Self::Numbers(numbers), _) => numbers.iter().position(|&number| number == node),
        }
    }
}

/// Derivatives of one number: column and number, columns ascending.
type Gradient = Vec<(u32, Node)>;

impl Graph {
    /// Appends the derivatives of `outputs` by the inputs with these numbers.
    ///
    /// Law: forward accumulation of sparse gradients, each partial derivative once (Griewank & Walther 2008, section 3.2 and
    /// chapter 7). A choice differentiates the branch that holds.
    pub fn derive(&mut self, outputs: &[Node], inputs: &[u32]) -> Derivative {
        self.derive_within(outputs, inputs, usize::MAX).unwrap_or_default()
    }

    /// As [`Graph::derive_within`], by numbers of the graph as if they were inputs; what is frozen moves with what it is.
    pub fn derive_by_within(&mut self, outputs: &[Node], variables: &[Node], most: usize) -> Option<Derivative> {
        self.derive_to(outputs, Variables::Numbers(variables), most)
    }

    /// As [`Graph::derive`]; none as soon as the graph has more than `most` operations.
    pub fn derive_within(&mut self, outputs: &[Node], inputs: &[u32], most: usize) -> Option<Derivative> {
        self.derive_to(outputs, Variables::Inputs(inputs), most)
    }

    fn derive_to(&mut self, outputs: &[Node], variables: Variables<'_>, most: usize) -> Option<Derivative> {
        let count = outputs.iter().max().map_or(0, |&most| most as usize + 1);
        let needed = self.needed(outputs, count);
        let mut gradients: Vec<Gradient> = Vec::with_capacity(count);
        for (node, needed) in (0..).zip(needed) {
            let gradient = if needed { self.gradient(node, &gradients, variables) } else { Gradient::new() };
            gradients.push(gradient);
            if self.operations().len() > most {
                return None;
            }
        }
        let mut derivative = Derivative::default();
        for (row, &output) in outputs.iter().enumerate() {
            for &(column, entry) in &gradients[output as usize] {
                if self.known_value(entry) != Some(0.0) {
                    derivative.places.push((row, column as usize));
                    derivative.entries.push(entry);
                }
            }
        }
        Some(derivative)
    }

    fn needed(&self, outputs: &[Node], count: usize) -> Vec<bool> {
        let mut needed = vec![false; count];
        outputs.iter().for_each(|&output| needed[output as usize] = true);
        for node in (0..count).rev() {
            if needed[node] {
                self.operations()[node].arguments(self.calls(), |argument| needed[argument as usize] = true);
            }
        }
        needed
    }

    fn gradient(&mut self, node: Node, known: &[Gradient], variables: Variables<'_>) -> Gradient {
        let of = |argument: Node| known[argument as usize].as_slice();
        let operation = self.operations()[node as usize];
        if let Some(place) = variables.place(node, operation) {
            return vec![(place as u32, self.constant(1.0))];
        }
        match operation {
            Operation::Apply(Function::Frozen, a) if matches!(variables, Variables::Numbers(_)) => of(a).to_vec(),
            // What a search finds is a constant to what refines it.
            Operation::Constant(_)
            | Operation::Input(_)
            | Operation::Apply(Function::Frozen, _)
            | Operation::Search(_) => Gradient::new(),
            Operation::Add(a, b) => join(of(a), of(b), |da, db| match (da, db) {
                (Some(da), Some(db)) => self.add(da, db),
                (one, other) => one.or(other).unwrap_or_default(),
            }),
            Operation::Subtract(a, b) => join(of(a), of(b), |da, db| match (da, db) {
                (Some(da), Some(db)) => self.subtract(da, db),
                (None, Some(db)) => self.negative(db),
                (da, None) => da.unwrap_or_default(),
            }),
            Operation::Multiply(a, b) => join(of(a), of(b), |da, db| {
                let left = da.map(|da| self.multiply(da, b));
                let right = db.map(|db| self.multiply(a, db));
                match (left, right) {
                    (Some(left), Some(right)) => self.add(left, right),
                    (one, other) => one.or(other).unwrap_or_default(),
                }
            }),
            Operation::Divide(a, b) => {
                let one = self.constant(1.0);
                let inverse = self.divide(one, b);
                join(of(a), of(b), |da, db| {
                    let carried = db.map(|db| self.multiply(node, db));
                    let change = match (da, carried) {
                        (Some(da), Some(carried)) => self.subtract(da, carried),
                        (None, Some(carried)) => self.negative(carried),
                        (da, None) => da.unwrap_or_default(),
                    };
                    self.multiply(change, inverse)
                })
            }
            Operation::Apply(function, a) => {
                if of(a).is_empty() {
                    return Gradient::new();
                }
                let slope = self.slope(function, a, node);
                of(a).iter().map(|&(column, entry)| (column, self.multiply(entry, slope))).collect()
            }
            Operation::Select([a, b, yes, no]) => join(of(yes), of(no), |yes, no| {
                let zero = self.constant(0.0);
                self.select([a, b, yes.unwrap_or(zero), no.unwrap_or(zero)])
            }),
        }
    }

    /// Derivative f'(a) of a function, where f(a) is number `value`.
    fn slope(&mut self, function: Function, a: Node, value: Node) -> Node {
        let one = self.constant(1.0);
        match function {
            Function::Frozen => self.constant(0.0),
            Function::Negative => self.constant(-1.0),
            Function::Root => {
                let half = self.constant(0.5);
                self.divide(half, value)
            }
            Function::Exp => value,
            Function::ExpM1 => self.add(value, one),
            Function::Ln => self.divide(one, a),
            Function::Sine => self.apply(Function::Cosine, a),
            Function::Cosine => {
                let sine = self.apply(Function::Sine, a);
                self.negative(sine)
            }
            Function::Tanh => {
                let square = self.multiply(value, value);
                self.subtract(one, square)
            }
            Function::Atan => {
                let square = self.multiply(a, a);
                let sum = self.add(one, square);
                self.divide(one, sum)
            }
        }
    }
}

/// Joins two gradients of derivatives, column by column: each column that either has.
fn join(
    left: &[(u32, Node)],
    right: &[(u32, Node)],
    mut combine: impl FnMut(Option<Node>, Option<Node>) -> Node,
) -> Gradient {
    let (mut left, mut right) = (left.iter().copied().peekable(), right.iter().copied().peekable());
    let mut joined = Gradient::new();
    loop {
        let (own, other) = (left.peek().map(|entry| entry.0), right.peek().map(|entry| entry.0));
        let Some(column) = own.into_iter().chain(other).min() else { return joined };
        let one = left.next_if(|entry| entry.0 == column).map(|entry| entry.1);
        let two = right.next_if(|entry| entry.0 == column).map(|entry| entry.1);
        joined.push((column, combine(one, two)));
    }
}
