//! Programs worked out for many inputs at once, without compilation.

use super::operation::{Function, Node, Operation};
use super::program::Program;

/// How many inputs are taken at once.
pub const LANES: usize = 8;

type Lanes = [f64; LANES];

/// One operation with the places of its numbers in the working memory.
#[derive(Clone, Copy, Debug)]
struct Step {
    operation: Operation,
    to: u32,
}

/// A program with the working memory to run it over [`LANES`] samples, states or candidates in each pass.
///
/// A number's place is used again once nothing needs it any more, so that the memory stays in the cache.
#[derive(Clone, Debug)]
pub struct Evaluator {
    steps: Vec<Step>,
    constants: Vec<(u32, f64)>,
    inputs: Vec<(u32, u32)>,
    outputs: Vec<u32>,
    n_inputs: usize,
    memory: Vec<Lanes>,
}

impl Evaluator {
    /// Prepares `program`.
    pub fn new(program: &Program) -> Self {
        let operations = program.operations();
        let last = last_uses(program);
        let (mut places, mut free, mut count) = (vec![0_u32; operations.len()], Vec::new(), 0);
        let mut evaluator = Self {
            steps: Vec::new(),
            constants: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            n_inputs: program.n_inputs(),
            memory: Vec::new(),
        };
        for (node, operation) in operations.iter().enumerate() {
            // What is written before the pass begins keeps its place to the end.
            let made = !matches!(operation, Operation::Constant(_) | Operation::Input(_));
            let place = if made { free.pop() } else { None };
            let place = place.unwrap_or_else(|| {
                count += 1;
                count - 1
            });
            places[node] = place;
            match *operation {
                Operation::Constant(bits) => evaluator.constants.push((place, f64::from_bits(bits))),
                Operation::Input(number) => evaluator.inputs.push((place, number)),
                _ => {
                    let operation = operation.renamed(|argument| places[argument as usize]);
                    evaluator.steps.push(Step { operation, to: place });
                }
            }
            let mut ended = Vec::new();
            operation.arguments(|argument| {
                let fixed = matches!(operations[argument as usize], Operation::Constant(_) | Operation::Input(_));
                if last[argument as usize] == node && !fixed && !ended.contains(&argument) {
                    ended.push(argument);
                }
            });
            free.extend(ended.into_iter().map(|argument| places[argument as usize]));
        }
        evaluator.outputs = program.outputs().iter().map(|&output| places[output as usize]).collect();
        evaluator.memory = vec![[0.0; LANES]; count as usize];
        for &(place, value) in &evaluator.constants {
            evaluator.memory[place as usize] = [value; LANES];
        }
        evaluator
    }

    /// How many numbers come out.
    pub fn n_outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Outputs (row by row, one row for each sample) at `inputs` (likewise). Rows that are not full on either side are left out.
    pub fn run(&mut self, inputs: &[f64], outputs: &mut [f64]) {
        let (wide, out) = (self.n_inputs.max(1), self.n_outputs().max(1));
        for (inputs, outputs) in inputs.chunks(wide * LANES).zip(outputs.chunks_mut(out * LANES)) {
            let rows = inputs.len() / wide;
            for &(place, number) in &self.inputs {
                let lanes = &mut self.memory[place as usize];
                for (lane, value) in lanes.iter_mut().enumerate() {
                    // Lanes beyond the last row repeat it.
                    *value = inputs[lane.min(rows.saturating_sub(1)) * wide + number as usize];
                }
            }
            self.pass();
            for (lane, row) in outputs.chunks_exact_mut(out).enumerate().take(rows) {
                for (value, &place) in row.iter_mut().zip(&self.outputs) {
                    *value = self.memory[place as usize][lane];
                }
            }
        }
    }

    fn pass(&mut self) {
        let memory = &mut self.memory;
        for step in &self.steps {
            let at = |place: Node| memory[place as usize];
            let value = match step.operation {
                Operation::Add(a, b) => both(at(a), at(b), |a, b| a + b),
                Operation::Subtract(a, b) => both(at(a), at(b), |a, b| a - b),
                Operation::Multiply(a, b) => both(at(a), at(b), |a, b| a * b),
                Operation::Divide(a, b) => both(at(a), at(b), |a, b| a / b),
                Operation::Apply(Function::Negative, a) => at(a).map(|x| -x),
                Operation::Apply(Function::Root, a) => at(a).map(f64::sqrt),
                Operation::Apply(function, a) => at(a).map(|x| function.value(x)),
                Operation::Select([a, b, yes, no]) => {
                    let (a, b, yes, no) = (at(a), at(b), at(yes), at(no));
                    std::array::from_fn(|lane| if a[lane] < b[lane] { yes[lane] } else { no[lane] })
                }
                // These stand in the memory already.
                Operation::Constant(_) | Operation::Input(_) => continue,
            };
            memory[step.to as usize] = value;
        }
    }
}

#[inline]
fn both(a: Lanes, b: Lanes, combine: impl Fn(f64, f64) -> f64) -> Lanes {
    std::array::from_fn(|lane| combine(a[lane], b[lane]))
}

/// The operation that needs each number last; those that come out are needed to the end.
fn last_uses(program: &Program) -> Vec<usize> {
    let operations = program.operations();
    let mut last = vec![0; operations.len()];
    for (node, operation) in operations.iter().enumerate() {
        operation.arguments(|argument| last[argument as usize] = node);
    }
    program.outputs().iter().for_each(|&output| last[output as usize] = usize::MAX);
    last
}
