//! Linear algebra.

mod dense;
