//! Beams that only tests use, to check the beams of machines; no machine needs them.
//!
//! [`linear`] checks small deflections and natural frequencies, [`two_node`] large deflections in absolute coordinates, and
//! [`strain_tree`] the mass matrix, the loads and the motion of links in a tree. The first two share with machines only sections, shape
//! functions and quadrature; [`strain_tree`] also shares the pose along the axis of [`super::strain`], which has tests of its own.

pub mod linear;
pub mod strain_tree;
pub mod two_node;
