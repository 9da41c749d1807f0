//! Flexible links.

mod bezier_basis;
mod bezier_large;
mod composite;
mod curved;
mod first_order;
mod levels;
mod linear;
mod map;
mod motion;
mod parameters;
mod reduced;
mod section;
mod strain;
mod tree;
mod two_link;
mod two_node;
mod witness;

/// Roots of `cos x cosh x = -1`: the frequencies of a clamped beam are `(x / length)^2 sqrt(E I / (rho A))`.
const ROOTS: [f64; 4] = [1.875_104_068_711_961_1, 4.694_091_132_974_175, 7.854_757_438_237_613, 10.995_540_734_875_467];
