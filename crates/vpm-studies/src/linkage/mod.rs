//! Closed linkages: assembly, velocities, accelerations, singularities, and the machines built from them.
//!
//! Equation numbers are those of D'Imperio 2016, "Modelling and simulation techniques for advanced robotic systems",
//! chapter 2 ("the thesis"), with the corrections named where they matter. Angles are in rad, lengths in m.

mod alignment;
mod constraint;
pub mod karl;
pub mod leg;
mod line_actuator;
mod newton;
mod stroke;

pub use alignment::{Alignment, Perpendicular};
pub use constraint::{ClosedLinkage, LinkageMotion, acceleration, velocity};
pub use line_actuator::{ActuatorBody, Line, LineActuator, PointMotion};
pub use newton::{Newton, Solution};
pub use stroke::{Slider, StrokeGeometry, StrokeLinkage};
