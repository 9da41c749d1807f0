//! A machine's equations as a graph of operations: recorded once, then differentiated, split, evaluated and compiled.
//!
//! The laws are written over [`Scalar`](crate::scalar::Scalar). Run over [`Recorded`], they leave a graph of additions,
//! multiplications, a few functions and searches, in which everything that is zero, one or constant for this machine has vanished. A
//! [`Program`] is the part of the graph that some outputs need, in the order in which it can be worked out.
//!
//! Sources: Griewank & Walther 2008, "Evaluating Derivatives", chapters 2 and 6 (graphs, forward derivatives); Andersson et al.
//! 2019, "CasADi", Math. Prog. Comp. 11 (expression graphs that become code).

mod derive;
mod evaluate;
mod known;
mod native;
mod operation;
mod program;
mod record;
mod source;

pub use derive::Derivative;
pub use evaluate::{Evaluator, LANES, Lanes};
pub use native::{LARGEST, Native, Unavailable, Work};
pub use operation::{Call, Function, Node, Operation};
pub use program::{Program, Stages};
pub use record::{Decision, Graph, Recorded, derivatives, input, record, slopes, slopes_within};
pub use source::{Block, Source, literal};
