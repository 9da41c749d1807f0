//! Nonlinear difference equations with inputs (NARX): polynomials of lagged outputs and inputs.
//!
//! `y[k] = sum_i theta_i prod_j x_ij`, each factor `x` a lagged output `y[k-d]`, d >= 1, or a lagged input `u[k-d]`, d >= 0. A model
//! that was found from records is judged in two ways that must not be mixed up: [`Narx::predict_one_step`] looks back on **measured**
//! outputs, [`Narx::simulate_free_run`] on its **own**.
//!
//! Source: S. Billings, "Nonlinear System Identification", Wiley 2013, chapters 2 and 3; S. Chen, S. Billings, W. Luo, "Orthogonal least
//! squares methods and their application to non-linear system identification", Int. J. Control 50 (1989) 1873-1896.

mod design;
mod free_run;
mod maxwell;
mod model;
mod program;
mod record;
mod select;
mod stepper;
mod structure;

pub use design::fit;
pub use maxwell::{MaxwellNarx, MaxwellScheme, MaxwellState, Surface};
pub use model::Narx;
pub use record::Record;
pub use select::{Selection, Stop, select};
pub use stepper::Stepper;
pub use structure::{Factor, Lags, Structure, Term, candidates};
