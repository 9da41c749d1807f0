//! Robot dynamics, rigid and flexible, and its physical effects, written once over a number type that can carry exact derivatives.
//!
//! Frames are capital letters and cancel: `X_WB = X_WP * X_PB`. Spatial vectors are `[angular; linear]`. All numbers
//! are SI. Coordinate `k` is the motion of joint `k`, which carries body `k`; parents come before children.

pub mod actuator;
pub mod algebra;
pub mod ball;
pub mod batch;
pub mod beam;
pub mod body;
pub mod bushing;
pub mod c_source;
pub mod closure;
pub mod compiled;
pub mod contact;
pub mod controller;
pub mod data;
pub mod delay;
pub mod description;
pub mod dynamics;
pub mod effect;
pub mod error;
pub mod evaluate;
pub mod filter;
pub mod graph;
pub mod integrator;
pub mod inverse;
pub mod joint;
pub mod line;
pub mod linearize;
pub mod live;
pub mod model;
pub mod motion;
pub mod mount;
pub mod narx;
pub mod ode;
pub mod prepared;
pub mod realtime;
pub mod samples;
pub mod scalar;
pub mod sensitivity;
pub mod sensor;
pub mod simulate;
pub mod spatial;
mod statics;
pub mod system;
pub mod table;
pub mod timing;
pub mod transmission;

pub use error::{Error, Result};
pub use scalar::{Dual, Scalar};
