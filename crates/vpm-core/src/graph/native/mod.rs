//! A program as machine code, made in the process in which it runs.
//!
//! A program has no branches: every number has its one place in the order. The code therefore is one block, cut into functions of
//! bounded length that hand numbers on in memory.

mod code;
mod emit;
mod plan;
mod task;
mod trigonometry;

use super::operation::Operation;
use super::program::Program;
use crate::error::{Error, Result};
use code::Code;
use plan::Plan;

/// The largest program that is compiled, in operations: an operation takes about 10 us to compile, however large the program is, so
/// that no program takes more than about 0.3 s.
pub const LARGEST: usize = 30_000;
/// Operations in one function. Longer functions take more time to compile for each operation and run no faster.
const PIECE: usize = 1_000;

/// Why a program has no machine code: it can be worked out by the [`Evaluator`](super::Evaluator) all the same.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unavailable {
    /// The processor is not one that code can be made for.
    #[error("no machine code can be made for this processor: {message}; the equations are evaluated directly instead")]
    Processor {
        /// What is missing.
        message: String,
    },
    /// The program is too large.
    #[error(
        "a program of {size} operations is too large to compile, at most {LARGEST} are; the equations are evaluated directly instead"
    )]
    Size {
        /// Its operations.
        size: usize,
    },
    /// The code could not be made or its memory not be made executable.
    #[error("no machine code could be made: {message}; the equations are evaluated directly instead")]
    Failed {
        /// What the code generator says.
        message: String,
    },
}

/// How many numbers each number of a program stands for.
#[derive(Clone, Copy)]
enum Lanes {
    One = 1,
    Two = 2,
}

/// A program as machine code. Threads may share it, each with a [`Work`] of its own.
pub struct Native {
    code: Code,
}

/// The numbers that wait in memory during one call.
#[derive(Clone, Debug)]
pub struct Work(Box<[f64]>);

impl Native {
    /// Compiles `program` to native machine code.
    ///
    /// # Errors
    /// [`Unavailable`], with the reason.
    pub fn compile(program: &Program) -> std::result::Result<Self, Unavailable> {
        Self::of(program, Lanes::One)
    }

    /// Compiles `program` to native machine code that works it out twice at a time, in the two lanes of vectors: number
    /// k of an array is entry 2 k for the one and entry 2 k + 1 for the other.
    ///
    /// # Errors
    /// [`Unavailable`], with the reason.
    pub fn compile_pairs(program: &Program) -> std::result::Result<Self, Unavailable> {
        Self::of(program, Lanes::Two)
    }

    fn of(program: &Program, lanes: Lanes) -> std::result::Result<Self, Unavailable> {
        let size = program.size();
        if size > LARGEST {
            return Err(Unavailable::Size { size });
        }
        let known =
            |operation: &Operation| !matches!(operation, Operation::Input(k) if *k as usize >= program.n_inputs());
        if !program.operations().iter().all(known) {
            return Err(Unavailable::Failed { message: "the program asks for an input that it has not".into() });
        }
        let plan = Plan::new(program, PIECE);
        let lengths = [program.n_inputs(), program.outputs().len()];
        Ok(Self { code: Code::new(&plan, program.operations().len(), lengths, lanes)? })
    }

    /// Number of inputs of native code, lanes counted.
    pub fn n_inputs(&self) -> usize {
        self.code.inputs
    }

    /// Number of outputs of native code, lanes counted.
    pub fn n_outputs(&self) -> usize {
        self.code.outputs
    }

    /// Working memory that one caller of native code needs.
    pub fn work(&self) -> Work {
        Work(vec![0.0; self.code.work].into())
    }

    /// Calls native code for the outputs at `inputs`. Allocates nothing.
    ///
    /// # Errors
    /// [`Error::Dimension`] if an array has the wrong length.
    pub fn call(&self, inputs: &[f64], outputs: &mut [f64], work: &mut Work) -> Result<()> {
        if self.code.run(inputs, outputs, &mut work.0) {
            return Ok(());
        }
        let lengths = [
            ("inputs", self.n_inputs(), inputs.len(), "input"),
            ("outputs", self.n_outputs(), outputs.len(), "output"),
            ("the working memory", self.code.work, work.0.len(), "number that waits"),
        ];
        let wrong = lengths.into_iter().find(|(_, expected, found, _)| expected != found);
        wrong.map_or(Ok(()), |(what, expected, found, each)| {
            Err(Error::Dimension { what: what.into(), expected, found, each: each.into() })
        })
    }
}

impl std::fmt::Debug for Native {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Native")
            .field("inputs", &self.n_inputs())
            .field("outputs", &self.n_outputs())
            .finish_non_exhaustive()
    }
}
