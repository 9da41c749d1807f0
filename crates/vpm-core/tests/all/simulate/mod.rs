//! Whole records: simulation, sensitivities, timing.

mod courses;
mod holds;
mod inverse;
mod live;
mod no_alloc;
mod observer;
mod records;
mod sensitivities;
mod timing;

pub use sensitivities::check;
