//! Machines from descriptions: parts, reactions, single evaluations, linear models.

pub(crate) mod balls;
mod flexible;
mod imus;
mod linearize;
mod load_cells;
mod parts;
mod passive_joints;
mod prepared;
mod transmissions;
