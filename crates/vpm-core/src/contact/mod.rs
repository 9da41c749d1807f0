//! Contact of points with planes: the normal force, the friction, and both together in space.
//!
//! A contact is a law without memory: the place and the velocity of a point now give the force on it now. Each law is a plain struct
//! over its number type `P`, as the effects are: with `P = usize` a description, with `P: Scalar` the law itself.
//!
//! ```
//! use vpm_core::contact::{Contact, ContactFriction, NormalContact, Plane};
//! use vpm_core::spatial::Vector3;
//!
//! // The foot of the thesis in SI: 2855 N/mm^1.1, and 1 N s/mm from a depth of 0.1 mm on.
//! let normal = NormalContact { stiffness: 2855.0 * 1000_f64.powf(1.1), exponent: 1.1, damping: 1000.0, damping_depth: 1e-4 };
//! let friction =
//!     ContactFriction { static_coefficient: 0.7, static_velocity: 0.1, dynamic_coefficient: 0.55, dynamic_velocity: 1.0 };
//! let foot = Contact { normal, friction: Some(friction) };
//! let ground = Plane::new(Vector3::zero(), Vector3::new(0.0, 1.0, 0.0))?;
//! let force = foot.force(&ground, Vector3::new(0.0, -1e-4, 0.0), Vector3::new(2.0, 0.0, 0.0));
//! assert!((force.y - 226.78).abs() < 0.01 && (force.x + 0.55 * force.y).abs() < 1e-9);
//! # Ok::<(), vpm_core::Error>(())
//! ```

mod entry;
mod friction;
mod normal;
mod plane;

pub use entry::{ContactEntry, PlaneEntry};
pub use friction::ContactFriction;
pub use normal::NormalContact;
pub use plane::{Contact, Plane};

use crate::scalar::Scalar;

/// Cubic step for contacts from 0 at t = 0 to 1 at t = 1, level outside: `3 t^2 - 2 t^3`. Its slope is continuous.
#[inline]
fn step<S: Scalar>(t: S) -> S {
    let rising = || S::one().if_less(t, S::one, || t * t * (-(t * 2.0) + 3.0));
    t.if_negative(S::zero, rising)
}
