//! Which number stands in a register and which in memory, decided before the code is made.
//!
//! Law: with a known future, the number to give up its register is the one needed last (Belady 1966, "A study of replacement
//! algorithms for a virtual-storage computer", IBM Systems J. 5). The code generator then has nothing left to spill: its time
//! stays linear in the size of the program.

use super::super::operation::{Node, Operation};
use super::super::program::Program;
use super::task::{Kind, Task, tasks};
use crate::scalar::ARGUMENTS;

/// Numbers kept in registers: of the sixteen of x86-64, those that stay free serve the arguments that come from memory.
const REGISTERS: usize = 13;
/// Registers that a sine with its cosine needs for itself.
const WITHIN_SINE: usize = 7;

/// Where a number is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// In the register of this number.
    Register(Node),
    /// A constant.
    Constant(f64),
    /// Input k.
    Input(u32),
    /// Output k, which stands already.
    Output(u32),
    /// Place k of the work array.
    Work(u32),
}

/// One step of the code.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// A task with the places of its arguments; the results go into registers.
    Do { task: Task, arguments: [Place; 4] },
    /// A number goes to memory.
    Store { from: Place, to: Place },
}

/// Steps in pieces, each to become one function: nothing stays in registers from one to the next.
#[derive(Debug, Default)]
pub(super) struct Plan {
    pub pieces: Vec<Vec<Step>>,
    /// Length of the work array; the first [`ARGUMENTS`] of it are for calls of searches, if there are any.
    pub work: usize,
}

impl Plan {
    /// Plans `program` in pieces of at most `longest` tasks.
    pub fn new(program: &Program, longest: usize) -> Self {
        let tasks = tasks(program);
        let mut planner = Planner::new(program, &tasks);
        for (number, task) in tasks.iter().enumerate() {
            if number % longest == 0 && number > 0 {
                planner.cut();
            }
            planner.take(number, task);
        }
        planner.pass_outputs(program);
        planner.cut();
        planner.plan
    }
}

/// The outputs that are one number, and where that number is needed.
#[derive(Clone, Default)]
struct Fate {
    outputs: Vec<u32>,
    /// The tasks that need it, the last one first.
    uses: Vec<usize>,
    /// Where it stands in memory, if it does.
    stored: Option<Place>,
}

struct Planner {
    plan: Plan,
    steps: Vec<Step>,
    fates: Vec<Fate>,
    registers: Vec<Node>,
    free: Vec<u32>,
}

impl Planner {
    fn new(program: &Program, tasks: &[Task]) -> Self {
        let mut fates = vec![Fate::default(); program.operations().len()];
        for (number, task) in tasks.iter().enumerate().rev() {
            task.arguments().for_each(|argument| fates[argument as usize].uses.push(number));
        }
        for (place, &output) in program.outputs().iter().enumerate() {
            fates[output as usize].outputs.push(place as u32);
        }
        for (fate, operation) in fates.iter_mut().zip(program.operations()) {
            fate.stored = match *operation {
                Operation::Constant(bits) => Some(Place::Constant(f64::from_bits(bits))),
                Operation::Input(number) => Some(Place::Input(number)),
                _ => None,
            };
        }
        // The arguments of a search stand first, in the order that it takes them in.
        let plan = Plan { work: if program.calls().is_empty() { 0 } else { ARGUMENTS }, ..Plan::default() };
        Self { plan, steps: Vec::new(), fates, registers: Vec::new(), free: Vec::new() }
    }

    fn take(&mut self, number: usize, task: &Task) {
        let mut arguments = [Place::Constant(0.0); 4];
        for (place, argument) in arguments.iter_mut().zip(task.arguments()) {
            *place = self.place(argument);
        }
        for argument in task.arguments() {
            self.fates[argument as usize].uses.pop_if(|next| *next == number);
        }
        let fates = &self.fates;
        self.registers.retain(|&node| !fates[node as usize].uses.is_empty());
        self.leave(match task.kind {
            Kind::Call(_) | Kind::Search(_) => 0,
            Kind::SineCosine => REGISTERS - WITHIN_SINE,
            _ => REGISTERS - 1,
        });
        self.steps.push(Step::Do { task: *task, arguments });
        self.release(task);
        for node in task.made() {
            self.receive(node);
        }
    }

    fn place(&self, node: Node) -> Place {
        let held = self.registers.contains(&node);
        self.fates[node as usize].stored.filter(|_| !held).unwrap_or(Place::Register(node))
    }

    /// Plans to give registers up until at most `count` are taken.
    fn leave(&mut self, count: usize) {
        while self.registers.len() > count {
            let next = |&(_, &node): &(usize, &Node)| self.fates[node as usize].uses.last().copied();
            let Some((at, &node)) = self.registers.iter().enumerate().max_by_key(next) else { return };
            self.registers.swap_remove(at);
            if self.fates[node as usize].stored.is_none() {
                let place = Place::Work(self.free.pop().unwrap_or_else(|| {
                    self.plan.work += 1;
                    self.plan.work as u32 - 1
                }));
                self.store(node, place);
            }
        }
    }

    fn store(&mut self, node: Node, to: Place) {
        self.steps.push(Step::Store { from: Place::Register(node), to });
        self.fates[node as usize].stored = Some(to);
    }

    /// Plans to free the places of arguments that nothing needs any more.
    fn release(&mut self, task: &Task) {
        for argument in task.arguments() {
            let fate = &mut self.fates[argument as usize];
            if let Some(Place::Work(place)) = fate.stored.filter(|_| fate.uses.is_empty()) {
                fate.stored = None;
                self.free.push(place);
            }
        }
    }

    /// Plans the place of a number that has just been made: an output goes to its place at once.
    fn receive(&mut self, node: Node) {
        for output in std::mem::take(&mut self.fates[node as usize].outputs) {
            self.store(node, Place::Output(output));
        }
        if !self.fates[node as usize].uses.is_empty() {
            self.registers.push(node);
        }
    }

    /// Plans outputs that are constants or inputs.
    fn pass_outputs(&mut self, program: &Program) {
        for &node in program.outputs() {
            for output in std::mem::take(&mut self.fates[node as usize].outputs) {
                self.steps.push(Step::Store { from: self.place(node), to: Place::Output(output) });
            }
        }
    }

    fn cut(&mut self) {
        self.leave(0);
        self.plan.pieces.push(std::mem::take(&mut self.steps));
    }
}
