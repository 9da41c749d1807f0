//! Drives, alone and in machines.

mod along;
mod chain;
mod dc_motor;
mod drives;
mod empirical_force;
mod flexible;
mod line_laws;
mod sampled;
mod table;
