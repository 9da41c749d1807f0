//! Closed linkages and chains of screws.

mod assembly;
mod hyq_leg;
mod karl;
mod screws;
