//! The algorithms: number types, spatial algebra, dynamics of rigid and flexible trees.

mod articulated;
mod articulated_cost;
mod articulated_machine;
mod closed_form;
mod conservation;
mod cross_check;
mod dual;
mod flexible_tree;
mod no_alloc;
mod omissions;
mod slices;
mod spatial;
mod velocity_terms;
mod virtual_work;
