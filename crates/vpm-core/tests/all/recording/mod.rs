//! Machines recorded as graphs of operations, choices by value, and searches.

mod c_source;
mod choices;
mod code;
mod machines;
mod native;
mod searches;
mod steps;
mod zero_parameters;
