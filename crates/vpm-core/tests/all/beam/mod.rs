//! Flexible links.

mod arm;
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
