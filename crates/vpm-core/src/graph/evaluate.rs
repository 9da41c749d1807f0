//! Programs worked out operation by operation, without compilation: in numbers of any type, or for many inputs at once.

use std::sync::Arc;

use super::operation::{Call, Function, Node, Operation};
use super::program::Program;
use crate::scalar::Scalar;

/// How many inputs a block takes at once.
pub const LANES: usize = 8;

/// What a program can be worked out in.
pub trait Number: Copy {
    /// Evaluates a constant.
    fn constant(value: f64) -> Self;
    /// Evaluates a + b.
    fn plus(self, other: Self) -> Self;
    /// Evaluates a - b.
    fn minus(self, other: Self) -> Self;
    /// Evaluates a b.
    fn times(self, other: Self) -> Self;
    /// Evaluates a / b.
    fn over(self, other: Self) -> Self;
    /// Evaluates a function of the number.
    fn apply(self, function: Function) -> Self;
    /// Evaluates a choice: `yes` where the first number is less than the second, else `no`.
    fn choose(pair: [&Self; 2], yes: &Self, no: &Self) -> Self;
    /// Evaluates the search of a call, where `at` tells its arguments.
    fn found(call: &Call, at: impl Fn(Node) -> Self) -> Self;
}

impl<S: Scalar> Number for S {
    #[inline]
    fn constant(value: f64) -> Self {
        Self::from_f64(value)
    }
    #[inline]
    fn plus(self, other: Self) -> Self {
        self + other
    }
    #[inline]
    fn minus(self, other: Self) -> Self {
        self - other
    }
    #[inline]
    fn times(self, other: Self) -> Self {
        self * other
    }
    #[inline]
    fn over(self, other: Self) -> Self {
        self / other
    }
    #[inline]
    fn apply(self, function: Function) -> Self {
        function.of(self)
    }
    #[inline]
    fn choose([a, b]: [&Self; 2], yes: &Self, no: &Self) -> Self {
        // Where it is known which, the other is not touched: numbers with derivatives are long.
        match a.known_less(*b) {
            Some(less) => *if less { yes } else { no },
            None => a.select_less(*b, *yes, *no),
        }
    }
    #[inline]
    fn found(call: &Call, at: impl Fn(Node) -> Self) -> Self {
        Self::from_f64(call.value(|place| at(place).re()))
    }
}

/// Numbers of [`LANES`] samples, states or candidates.
#[derive(Clone, Copy, Debug)]
pub struct Lanes([f64; LANES]);

impl Lanes {
    #[inline]
    fn both(self, other: Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|lane| combine(self.0[lane], other.0[lane])))
    }
}

impl Number for Lanes {
    #[inline]
    fn constant(value: f64) -> Self {
        Self([value; LANES])
    }
    #[inline]
    fn plus(self, other: Self) -> Self {
        self.both(other, |a, b| a + b)
    }
    #[inline]
    fn minus(self, other: Self) -> Self {
        self.both(other, |a, b| a - b)
    }
    #[inline]
    fn times(self, other: Self) -> Self {
        self.both(other, |a, b| a * b)
    }
    #[inline]
    fn over(self, other: Self) -> Self {
        self.both(other, |a, b| a / b)
    }
    #[inline]
    fn apply(self, function: Function) -> Self {
        match function {
            // These two the compiler turns into vector instructions.
            Function::Negative => Self(self.0.map(|x| -x)),
            Function::Root => Self(self.0.map(f64::sqrt)),
            _ => Self(self.0.map(|x| function.of(x))),
        }
    }
    #[inline]
    fn choose([a, b]: [&Self; 2], yes: &Self, no: &Self) -> Self {
        Self(std::array::from_fn(|lane| if a.0[lane] < b.0[lane] { yes.0[lane] } else { no.0[lane] }))
    }
    #[inline]
    fn found(call: &Call, at: impl Fn(Node) -> Self) -> Self {
        Self(std::array::from_fn(|lane| call.value(|place| at(place).0[lane])))
    }
}

/// One operation with the places of its numbers in the working memory.
#[derive(Clone, Copy, Debug)]
struct Step {
    operation: Operation,
    to: u32,
}

/// The order of a program's operations in a working memory. A number's place is used again once nothing needs it any more, so that the
/// memory stays in the cache.
#[derive(Debug, Default)]
pub(super) struct Layout {
    steps: Vec<Step>,
    calls: Vec<Call>,
    constants: Vec<(u32, f64)>,
    inputs: Vec<(u32, u32)>,
    outputs: Vec<u32>,
    /// How many numbers the memory holds.
    places: u32,
}

impl Layout {
    pub(super) fn new(program: &Program) -> Self {
        let operations = program.operations();
        let last = last_uses(program);
        let (mut places, mut free, mut layout) = (vec![0_u32; operations.len()], Vec::new(), Self::default());
        for (node, operation) in operations.iter().enumerate() {
            // What is written before the pass begins keeps its place to the end.
            let made = !matches!(operation, Operation::Constant(_) | Operation::Input(_));
            let place = if made { free.pop() } else { None };
            let place = place.unwrap_or_else(|| {
                layout.places += 1;
                layout.places - 1
            });
            places[node] = place;
            match *operation {
                Operation::Constant(bits) => layout.constants.push((place, f64::from_bits(bits))),
                Operation::Input(number) => layout.inputs.push((place, number)),
                _ => {
                    let beside = (program.calls(), &mut layout.calls);
                    let operation = operation.renamed(beside, |argument| places[argument as usize]);
                    layout.steps.push(Step { operation, to: place });
                }
            }
            let mut ended = Vec::new();
            operation.arguments(program.calls(), |argument| {
                let fixed = matches!(operations[argument as usize], Operation::Constant(_) | Operation::Input(_));
                if last[argument as usize] == node && !fixed && !ended.contains(&argument) {
                    ended.push(argument);
                }
            });
            free.extend(ended.into_iter().map(|argument| places[argument as usize]));
        }
        layout.outputs = program.outputs().iter().map(|&output| places[output as usize]).collect();
        layout
    }
}

/// A program with the working memory to run it in numbers `T`.
#[derive(Clone, Debug)]
pub struct Evaluator<T> {
    layout: Arc<Layout>,
    /// Inputs that are not held, with their places.
    inputs: Vec<(u32, u32)>,
    n_inputs: usize,
    memory: Vec<T>,
}

impl<T: Number> Evaluator<T> {
    /// Prepares `program` for evaluation.
    pub fn new(program: &Program) -> Self {
        let layout = program.layout();
        let mut memory = vec![T::constant(0.0); layout.places as usize];
        layout.constants.iter().for_each(|&(place, value)| memory[place as usize] = T::constant(value));
        Self { inputs: layout.inputs.clone(), n_inputs: program.n_inputs(), memory, layout }
    }

    /// Number of outputs of an evaluated program.
    pub fn n_outputs(&self) -> usize {
        self.layout.outputs.len()
    }

    /// Evaluates all outputs at `inputs`.
    pub fn evaluate(&mut self, inputs: &[T], outputs: &mut [T]) {
        for &(place, number) in &self.inputs {
            self.memory[place as usize] = inputs[number as usize];
        }
        self.pass();
        for (output, &place) in outputs.iter_mut().zip(&self.layout.outputs) {
            *output = self.memory[place as usize];
        }
    }

    fn pass(&mut self) {
        let (memory, calls) = (&mut self.memory, &self.layout.calls);
        for step in &self.layout.steps {
            let (at, to) = (|place: Node| memory[place as usize], step.to as usize);
            // Each kind writes by itself: a common place for what they make would be one more way through memory.
            match step.operation {
                Operation::Add(a, b) => memory[to] = at(a).plus(at(b)),
                Operation::Subtract(a, b) => memory[to] = at(a).minus(at(b)),
                Operation::Multiply(a, b) => memory[to] = at(a).times(at(b)),
                Operation::Divide(a, b) => memory[to] = at(a).over(at(b)),
                Operation::Apply(function, a) => memory[to] = at(a).apply(function),
                Operation::Select(nodes) => {
                    let [a, b, yes, no] = nodes.map(|place| &memory[place as usize]);
                    memory[to] = T::choose([a, b], yes, no);
                }
                Operation::Search(call) => memory[to] = T::found(&calls[call as usize], at),
                // These stand in the memory already.
                Operation::Constant(_) | Operation::Input(_) => {}
            }
        }
    }
}

impl Evaluator<Lanes> {
    /// Holds inputs from place `first` on at these values for all evaluations: rows of inputs end before them.
    pub fn hold(&mut self, first: usize, values: &[f64]) {
        let Self { inputs, memory, .. } = self;
        inputs.retain(|&(place, number)| match (number as usize).checked_sub(first) {
            Some(held) => {
                memory[place as usize] = Lanes::constant(values[held]);
                false
            }
            None => true,
        });
        self.n_inputs = first;
    }

    /// Evaluates outputs for many samples, one row each, at `inputs` (likewise). Rows that are not full on either side
    /// are left out.
    pub fn run(&mut self, inputs: &[f64], outputs: &mut [f64]) {
        let (wide, out) = (self.n_inputs.max(1), self.n_outputs().max(1));
        for (inputs, outputs) in inputs.chunks(wide * LANES).zip(outputs.chunks_mut(out * LANES)) {
            let rows = inputs.len() / wide;
            for &(place, number) in &self.inputs {
                let Lanes(lanes) = &mut self.memory[place as usize];
                for (lane, value) in lanes.iter_mut().enumerate() {
                    // Lanes beyond the last row repeat it.
                    *value = inputs[lane.min(rows.saturating_sub(1)) * wide + number as usize];
                }
            }
            self.pass();
            for (lane, row) in outputs.chunks_exact_mut(out).enumerate().take(rows) {
                for (value, &place) in row.iter_mut().zip(&self.layout.outputs) {
                    *value = self.memory[place as usize].0[lane];
                }
            }
        }
    }
}

/// Last operation of an evaluation that needs each number; outputs are needed to the end.
fn last_uses(program: &Program) -> Vec<usize> {
    let operations = program.operations();
    let mut last = vec![0; operations.len()];
    for (node, operation) in operations.iter().enumerate() {
        operation.arguments(program.calls(), |argument| last[argument as usize] = node);
    }
    program.outputs().iter().for_each(|&output| last[output as usize] = usize::MAX);
    last
}
