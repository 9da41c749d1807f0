//! Every claim about the core that needs no process of its own, as one program: one file for each, by subject.
//!
//! `cargo test --test all NAME` runs those whose path holds the name, such as `beam::levels` or `karl`.
//! The allocations that some of them count are those of their own thread.

#![cfg(test)]

mod actuator;
mod algebra;
mod beam;
mod common;
mod contact;
mod controller;
mod dynamics;
mod effect;
mod hydraulic;
mod integrator;
mod layers;
mod machine;
mod narx;
mod recording;
mod simulate;
mod validation;
