//! Machines recorded as graphs of operations, and choices by value.

mod c_source;
mod choices;
mod code;
mod machines;
mod native;
mod zero_parameters;
