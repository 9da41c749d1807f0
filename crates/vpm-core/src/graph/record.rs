//! The number that records what is done with it.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};
use std::panic::Location;

use super::derive::Derivative;
use super::known::Known;
use super::operation::{Call, Function, Node, Operation};
use super::program::Program;
use crate::scalar::{Scalar, Search};

/// Operations in the order in which they were recorded, each once: equal operations are merged, constants folded.
///
/// Beside each operation stands its value at the inputs' reference values, for what a law asks of numbers while a machine is built.
#[derive(Clone, Debug)]
pub struct Graph {
    operations: Vec<Operation>,
    calls: Vec<Call>,
    values: Vec<f64>,
    known: Known,
    /// Whether each number follows from parameters alone, which are the inputs from here on.
    of_parameters: Vec<bool>,
    first_parameter: u32,
    decisions: Vec<Decision>,
}

/// A place where a law decided by the value of a number instead of by [`Scalar::if_less`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decision {
    /// Where in the source.
    pub location: &'static Location<'static>,
    /// Whether the number follows from parameters alone: then the graph holds for these parameters, otherwise for one state only.
    pub of_parameters: bool,
}

impl Decision {
    /// Recorded place of a decision: file, from the folder of the sources on, and line.
    pub fn place(&self) -> String {
        let file = self.location.file();
        format!("{}, line {}", file.rsplit_once("src/").map_or(file, |(_, file)| file), self.location.line())
    }
}

impl Default for Graph {
    fn default() -> Self {
        Self::new(0)
    }
}

impl Graph {
    /// Empty graph to record into, whose inputs from `first_parameter` on are parameters.
    pub fn new(first_parameter: u32) -> Self {
        let mut graph = Self {
            operations: Vec::new(),
            calls: Vec::new(),
            values: Vec::new(),
            known: Known::default(),
            of_parameters: Vec::new(),
            first_parameter,
            decisions: Vec::new(),
        };
        // Zero is number 0, the default of a recorded number.
        graph.constant(0.0);
        graph
    }

    /// Recorded graph of a program, and the numbers of it that come out.
    pub fn of(program: &Program) -> (Self, Vec<Node>) {
        let mut graph = Self::default();
        let mut places: Vec<Node> = Vec::with_capacity(program.operations().len());
        for operation in program.operations() {
            let mut calls = std::mem::take(&mut graph.calls);
            let operation = operation.renamed((program.calls(), &mut calls), |argument| places[argument as usize]);
            graph.calls = calls;
            places.push(graph.make(operation));
        }
        let outputs = program.outputs().iter().map(|&output| places[output as usize]).collect();
        (graph, outputs)
    }

    /// Recorded operations; arguments stand before what is made of them.
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// Recorded calls that operations refer to, each once.
    pub fn calls(&self) -> &[Call] {
        &self.calls
    }

    /// Recorded decisions by values, each place once.
    pub fn decisions(&self) -> &[Decision] {
        &self.decisions
    }

    /// Value of a recorded constant.
    pub fn known_value(&self, node: Node) -> Option<f64> {
        match self.operations[node as usize] {
            Operation::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Records a constant.
    pub fn constant(&mut self, value: f64) -> Node {
        // Both zeros are one number.
        let value = if value == 0.0 { 0.0 } else { value };
        self.make(Operation::Constant(value.to_bits()))
    }

    /// Records input `number`, at its reference `value`.
    pub fn input(&mut self, number: u32, value: f64) -> Node {
        self.push(Operation::Input(number), value)
    }

    /// Records `operation` if it is new, and returns its number; an input has the value `input`.
    fn push(&mut self, operation: Operation, input: f64) -> Node {
        let node = self.known.place(&operation, &self.operations);
        if (node as usize) < self.operations.len() {
            return node;
        }
        let mut of_parameters = !matches!(operation, Operation::Input(number) if number < self.first_parameter);
        operation.arguments(&self.calls, |argument| of_parameters &= self.of_parameters[argument as usize]);
        let value = operation.value(&self.calls, |node| self.values[node as usize], |_| input);
        self.operations.push(operation);
        self.values.push(value);
        self.of_parameters.push(of_parameters);
        node
    }

    fn make(&mut self, operation: Operation) -> Node {
        self.push(operation, f64::NAN)
    }

    /// Records a + b.
    pub fn add(&mut self, a: Node, b: Node) -> Node {
        match (self.known_value(a), self.known_value(b)) {
            (Some(x), Some(y)) => return self.constant(x + y),
            (Some(0.0), None) => return b,
            (None, Some(0.0)) => return a,
            _ => {}
        }
        match (self.operations[a as usize], self.operations[b as usize]) {
            (_, Operation::Apply(Function::Negative, b)) => self.subtract(a, b),
            (Operation::Apply(Function::Negative, a), _) => self.subtract(b, a),
            _ => self.make(Operation::Add(a.min(b), a.max(b))),
        }
    }

    /// Records a - b.
    pub fn subtract(&mut self, a: Node, b: Node) -> Node {
        if a == b {
            return self.constant(0.0);
        }
        match (self.known_value(a), self.known_value(b)) {
            (Some(x), Some(y)) => return self.constant(x - y),
            (Some(0.0), None) => return self.negative(b),
            (None, Some(0.0)) => return a,
            _ => {}
        }
        match self.operations[b as usize] {
            Operation::Apply(Function::Negative, b) => self.add(a, b),
            _ => self.make(Operation::Subtract(a, b)),
        }
    }

    /// Records the negative of a number: -a.
    pub fn negative(&mut self, a: Node) -> Node {
        match self.operations[a as usize] {
            Operation::Constant(bits) => self.constant(-f64::from_bits(bits)),
            Operation::Apply(Function::Negative, b) => b,
            Operation::Subtract(b, c) => self.make(Operation::Subtract(c, b)),
            _ => self.make(Operation::Apply(Function::Negative, a)),
        }
    }

    /// Records a b.
    pub fn multiply(&mut self, a: Node, b: Node) -> Node {
        match (self.known_value(a), self.known_value(b)) {
            (Some(x), Some(y)) => return self.constant(x * y),
            (Some(x), None) => return self.scale(x, a, b),
            (None, Some(y)) => return self.scale(y, b, a),
            (None, None) => {}
        }
        let (left, left_turned) = self.without_sign(a);
        let (right, right_turned) = self.without_sign(b);
        let product = self.make(Operation::Multiply(left.min(right), left.max(right)));
        if left_turned == right_turned { product } else { self.negative(product) }
    }

    /// Records the product with the constant `factor`, which is number `constant`.
    fn scale(&mut self, factor: f64, constant: Node, b: Node) -> Node {
        if factor == 0.0 {
            return self.constant(0.0);
        }
        if factor == 1.0 {
            return b;
        }
        if factor == -1.0 {
            return self.negative(b);
        }
        let (b, turned) = self.without_sign(b);
        let constant = if turned { self.constant(-factor) } else { constant };
        self.make(Operation::Multiply(constant.min(b), constant.max(b)))
    }

    fn without_sign(&self, a: Node) -> (Node, bool) {
        match self.operations[a as usize] {
            Operation::Apply(Function::Negative, b) => (b, true),
            _ => (a, false),
        }
    }

    /// Records a / b; by a constant as a product with its inverse.
    pub fn divide(&mut self, a: Node, b: Node) -> Node {
        match (self.known_value(a), self.known_value(b)) {
            (Some(x), Some(y)) => self.constant(x / y),
            (Some(0.0), None) => a,
            (None, Some(y)) => {
                let inverse = self.constant(y.recip());
                self.multiply(a, inverse)
            }
            _ => self.make(Operation::Divide(a, b)),
        }
    }

    /// Records a function of a number.
    pub fn apply(&mut self, function: Function, a: Node) -> Node {
        match (function, self.known_value(a)) {
            (Function::Negative, _) => self.negative(a),
            (_, Some(x)) => self.constant(function.of(x)),
            _ => self.make(Operation::Apply(function, a)),
        }
    }

    /// Records a choice: `yes` where a < b, else `no`.
    pub fn select(&mut self, [a, b, yes, no]: [Node; 4]) -> Node {
        if yes == no {
            return yes;
        }
        match (self.known_value(a), self.known_value(b)) {
            (Some(x), Some(y)) => {
                if x < y {
                    yes
                } else {
                    no
                }
            }
            _ => self.make(Operation::Select([a, b, yes, no])),
        }
    }

    /// Records a search with the numbers of the call.
    pub fn search(&mut self, call: Call) -> Node {
        if call.arguments.iter().all(|&argument| self.known_value(argument).is_some()) {
            let found = call.value(|node| self.values[node as usize]);
            return self.constant(found);
        }
        // A machine has a few of them.
        let place = self.calls.iter().position(|known| *known == call).unwrap_or_else(|| {
            self.calls.push(call);
            self.calls.len() - 1
        });
        self.make(Operation::Search(place as u32))
    }

    /// Records that a law decides by a number's value at the reference inputs.
    fn decide(&mut self, node: Node, location: &'static Location<'static>) -> f64 {
        if self.known_value(node).is_none() {
            let decision = Decision { location, of_parameters: self.of_parameters[node as usize] };
            if !self.decisions.contains(&decision) {
                self.decisions.push(decision);
            }
        }
        self.values[node as usize]
    }
}

thread_local! {
    static GRAPH: RefCell<Graph> = RefCell::new(Graph::default());
}

/// Runs `work` over numbers that record what is done with them; gives what it returns, and the graph. The inputs from
/// `first_parameter` on are parameters.
///
/// One recording at a time on each thread: numbers of one recording mean nothing in another.
pub fn record<R>(first_parameter: u32, work: impl FnOnce() -> R) -> (R, Graph) {
    GRAPH.with(|graph| graph.replace(Graph::new(first_parameter)));
    let result = work();
    (result, GRAPH.with(RefCell::take))
}

/// Input `number` of the recording under way, at its reference `value`.
pub fn input(number: usize, value: f64) -> Recorded {
    Recorded(on(|graph| graph.input(number as u32, value)))
}

/// The derivatives of `numbers` of the recording under way by the inputs at these places, those that are not zero: row (number), column
/// (place among the inputs), and the derivative.
pub fn derivatives(numbers: &[Recorded], by: &[u32]) -> Vec<((usize, usize), Recorded)> {
    let nodes: Vec<Node> = numbers.iter().map(|number| number.0).collect();
    entries_of(on(|graph| graph.derive(&nodes, by)))
}

/// The derivatives of `numbers` of the recording under way by `variables`, themselves numbers of it, as if they were inputs: likewise.
/// Numbers that are frozen move with what they are.
pub fn slopes(numbers: &[Recorded], variables: &[Recorded]) -> Vec<((usize, usize), Recorded)> {
    slopes_within(numbers, variables, usize::MAX).unwrap_or_default()
}

/// As [`slopes`]; none as soon as the recording has more than `most` operations.
pub fn slopes_within(
    numbers: &[Recorded],
    variables: &[Recorded],
    most: usize,
) -> Option<Vec<((usize, usize), Recorded)>> {
    let nodes = |numbers: &[Recorded]| numbers.iter().map(|number| number.0).collect::<Vec<_>>();
    on(|graph| graph.derive_by_within(&nodes(numbers), &nodes(variables), most)).map(entries_of)
}

fn entries_of(derivative: Derivative) -> Vec<((usize, usize), Recorded)> {
    derivative.places.into_iter().zip(derivative.entries.into_iter().map(Recorded)).collect()
}

fn on<R>(work: impl FnOnce(&mut Graph) -> R) -> R {
    GRAPH.with(|graph| work(&mut graph.borrow_mut()))
}

/// A number that stands for the operation that makes it.
///
/// Two are equal if they are the same operation of the same numbers. The order asks the reference values, and the recording
/// remembers that it was asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded(Node);

impl Recorded {
    /// Place of a recorded number in the graph.
    pub fn node(self) -> Node {
        self.0
    }

    fn apply(self, function: Function) -> Self {
        Self(on(|graph| graph.apply(function, self.0)))
    }
}

impl From<f64> for Recorded {
    fn from(value: f64) -> Self {
        Self(on(|graph| graph.constant(value)))
    }
}

impl PartialOrd for Recorded {
    #[track_caller]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let location = Location::caller();
        on(|graph| graph.decide(self.0, location).partial_cmp(&graph.decide(other.0, location)))
    }
}

impl Sum for Recorded {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::default(), |sum, number| sum + number)
    }
}

impl Neg for Recorded {
    type Output = Self;
    fn neg(self) -> Self {
        Self(on(|graph| graph.negative(self.0)))
    }
}

macro_rules! binary {
    ($operator:ident, $method:ident, $assign:ident, $assigned:ident, $make:ident) => {
        impl $operator for Recorded {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(on(|graph| graph.$make(self.0, other.0)))
            }
        }
        impl $operator<f64> for Recorded {
            type Output = Self;
            fn $method(self, other: f64) -> Self {
                Self(on(|graph| {
                    let other = graph.constant(other);
                    graph.$make(self.0, other)
                }))
            }
        }
        impl $assign for Recorded {
            fn $assigned(&mut self, other: Self) {
                self.0 = on(|graph| graph.$make(self.0, other.0));
            }
        }
    };
}
binary!(Add, add, AddAssign, add_assign, add);
binary!(Sub, sub, SubAssign, sub_assign, subtract);
binary!(Mul, mul, MulAssign, mul_assign, multiply);
binary!(Div, div, DivAssign, div_assign, divide);

impl Scalar for Recorded {
    #[track_caller]
    fn re(&self) -> f64 {
        let location = Location::caller();
        on(|graph| graph.decide(self.0, location))
    }
    fn inspect(&self) -> f64 {
        on(|graph| graph.values[self.0 as usize])
    }
    fn known_less(self, other: Self) -> Option<bool> {
        on(|graph| Some(graph.known_value(self.0)? < graph.known_value(other.0)?))
    }
    fn select_less(self, other: Self, yes: Self, no: Self) -> Self {
        Self(on(|graph| graph.select([self.0, other.0, yes.0, no.0])))
    }
    fn frozen(self) -> Self {
        self.apply(Function::Frozen)
    }
    fn is_finite(self) -> bool {
        self.inspect().is_finite()
    }
    fn sqrt(self) -> Self {
        self.apply(Function::Root)
    }
    fn exp(self) -> Self {
        self.apply(Function::Exp)
    }
    fn exp_m1(self) -> Self {
        self.apply(Function::ExpM1)
    }
    fn ln(self) -> Self {
        self.apply(Function::Ln)
    }
    fn sin_cos(self) -> (Self, Self) {
        (self.apply(Function::Sine), self.apply(Function::Cosine))
    }
    fn tanh(self) -> Self {
        self.apply(Function::Tanh)
    }
    fn atan(self) -> Self {
        self.apply(Function::Atan)
    }
    fn powi(self, exponent: i32) -> Self {
        let (mut power, mut base, mut left) = (Self::one(), self, exponent.unsigned_abs());
        while left > 0 {
            if left % 2 == 1 {
                power *= base;
            }
            base *= base;
            left /= 2;
        }
        if exponent < 0 { power.recip() } else { power }
    }
    fn search(search: &'static Search, arguments: impl Iterator<Item = Self>) -> Self {
        // They stand before the graph is asked, which they may ask themselves.
        let arguments = arguments.map(Self::node).collect();
        Self(on(|graph| graph.search(Call { search, arguments })))
    }
}
