//! Slender flexible links: one beam, several bases, two kinematics.
//!
//! The axis of a beam is z of its root frame, `mu` in `[0, L]` the arc length. Its small deflection is the screw
//! `s = [theta; v]`, its strain the screw `e = s' + [0; k x theta]`, its wrench `W = K e` with
//! `K = diag(EJx, EJy, GJ, ax GA, ay GA, EA)`, its inertia per length `rho diag(Jx, Jy, J, A, A, A)`.
//!
//! [`Beam`] is the beam of a machine, over the number type of its parameters: the same sums for every level, only the map from
//! coordinates to sections differs: strain integrated along the axis, of Bezier control points or strain coordinates; interpolated
//! deflection; rigid segments with springs.
//! [`strain`] integrates the pose along the axis, exact at any deflection. [`witness`] holds the beams that only tests use, to check
//! those of machines.
//!
//! Sources: Selig & Ding 2009, "A screw theory of Timoshenko beams", J. Appl. Mech. 76(3) 031003, for screws and their
//! derivative; Simo & Vu-Quoc 1986, "On the dynamics of flexible beams under large overall motions", J. Appl. Mech. 53, for
//! the geometrically exact beam.

pub mod basis;
mod check;
mod composite;
mod construct;
mod damping;
mod deflection;
pub mod eigen;
mod entry;
mod fields;
mod flexible;
mod gauge;
mod lumped;
mod motion;
mod profile;
pub mod quadrature;
mod reduced;
mod rest;
pub mod section;
mod segment;
pub mod shape;
pub mod strain;
pub mod witness;

pub use basis::Basis;
pub use composite::{Laminate, Layer, Moduli};
pub use entry::{BeamEntry, Component, DampingEntry, Level, SectionEntry};
pub use flexible::Beam;
pub use gauge::Gauge;
pub use motion::{SectionMotion, Sections};
pub use reduced::{Field as ReducedField, Reduced, Solid};
pub use rest::RestEntry;
pub use section::{Material, Section};
pub(crate) use segment::Segment;
pub use shape::{Properties, Shape};
pub(crate) use strain::{Slices, Sums};

use crate::error::{Error, Result};
use crate::scalar::Scalar;

/// Checks that a number of the beam's description is positive and finite.
pub(crate) fn positive<S: Scalar>(path: &str, value: S) -> Result<S> {
    if !value.inspect().is_finite() {
        return Err(Error::NonFinite { path: path.to_owned(), value: value.inspect() });
    }
    if value.inspect() <= 0.0 {
        return Err(Error::Domain { path: path.to_owned(), condition: "be positive", value: value.inspect() });
    }
    Ok(value)
}

/// Checks that a number of the beam's description is finite and not negative.
pub(crate) fn not_negative<S: Scalar>(path: &str, value: S) -> Result<S> {
    if !value.inspect().is_finite() {
        return Err(Error::NonFinite { path: path.to_owned(), value: value.inspect() });
    }
    if value.inspect() < 0.0 {
        return Err(Error::Domain { path: path.to_owned(), condition: "be zero or positive", value: value.inspect() });
    }
    Ok(value)
}

/// Checks how many numbers an array of a beam holds.
pub(crate) fn dimension(what: &str, expected: usize, found: usize, each: &str) -> Result<()> {
    if expected == found {
        return Ok(());
    }
    Err(Error::Dimension { what: what.to_owned(), expected, found, each: each.to_owned() })
}
