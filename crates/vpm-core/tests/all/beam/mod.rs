//! Flexible links.

mod arm;
mod bezier_basis;
mod bezier_large;
mod first_order;
mod levels;
mod linear;
mod map;
mod motion;
mod parameters;
mod planar;
mod section;
mod strain;
mod tree;
mod two_link;
mod two_node;
mod witness;
