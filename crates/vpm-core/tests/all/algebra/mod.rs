//! Linear algebra.

mod dense;
mod filter;
