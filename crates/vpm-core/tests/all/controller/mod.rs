//! Sampled controllers in their loops.

mod computed_torque;
mod loops;
mod sampled;
