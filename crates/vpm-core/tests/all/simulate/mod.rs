//! Whole records: simulation, sensitivities, timing.

mod inverse;
mod live;
mod no_alloc;
mod records;
mod sensitivities;
mod timing;
