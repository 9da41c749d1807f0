//! Machines recorded as graphs of operations, and choices by value.

mod choices;
mod code;
mod machines;
mod zero_parameters;
