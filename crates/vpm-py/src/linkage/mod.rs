//! Closed linkages: the classes `Karl` and `Leg`.

mod karl;
mod leg;

pub(crate) use karl::Karl;
pub(crate) use leg::{Leg, hyq_parameters};
