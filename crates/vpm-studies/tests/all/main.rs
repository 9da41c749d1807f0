//! Every claim about the studies, as one program: one file for each, by subject.

#![cfg(test)]

mod algebra;
mod assembly;
mod drop;
mod free_leg;
mod hyq_leg;
mod karl;
mod leg_as_tree;
mod no_alloc;
mod screws;
#[path = "../../../vpm-core/tests/all/common/values.rs"]
mod values;
