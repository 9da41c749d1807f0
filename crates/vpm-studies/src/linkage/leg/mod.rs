//! The HyQ leg: seven rigid bodies on a vertical slider, driven by two cylinders, its foot sliding on the ground.
//!
//! Frame 0 has its origin on the ground below the hip, y up. The hip axis A slides along x = 0, the foot C along y = 0;
//! the upper leg points along `(sin q1, -cos q1)`, the lower leg along `(sin(q1+q2), -cos(q1+q2))`, so that q2 < 0
//! bends the knee. Equation of motion: `tau = M(q) a + V(q, v) + G(q)`. A cylinder force is positive when it extends.
//! Three derivations ([`Leg::terms`], [`Leg::lagrange`], [`Leg::newton_euler`]) share only the places of the points.
//! Source: section 2.4.2 of the thesis.
//!
//! ```
//! use vpm_studies::linkage::leg::{DutyCycle, HyqData, Leg, LegParameters, ShareStudy};
//!
//! let leg = Leg::new(LegParameters::hyq(HyqData::Cad, 0.341))?;
//! let (q, v, a) = ([0.35, -1.4], [2.0, -3.0], [4.0, -5.0]);
//! let torques = leg.terms(q, v).effort(&a);
//! println!("{:?} N in the cylinders", leg.cylinder_forces(q, torques));
//! println!("{} N on the foot", leg.newton_euler(q, v, a)?.ground);
//! println!("{:?} of the effort", leg.shares(&ShareStudy::of(DutyCycle::MEDIUM))?);
//! # Ok::<(), vpm_studies::Error>(())
//! ```

mod jacobian;
mod lagrange;
mod newton_euler;
mod parameters;
mod places;
mod shares;

use crate::algebra::solve;
use crate::error::{LinkageError, Result};
use vpm_core::dynamics::Terms;

pub use newton_euler::Reactions;
pub use parameters::{Attachment, HyqData, Leg, LegBody, LegParameters};
pub use places::{Place, Points};
pub use shares::{DutyCycle, ShareDefinition, ShareStudy, Shares};

/// The seven bodies, in the order of all lists of bodies.
pub const BODIES: [&str; 7] = ["slider", "upper leg", "lower leg", "hip barrel", "hip rod", "knee barrel", "knee rod"];

impl Leg {
    /// Joint accelerations of the leg (rad/s^2) for joint torques (N m) at `q` (rad) and `v` (rad/s).
    pub fn acceleration(&self, q: [f64; 2], v: [f64; 2], torques: [f64; 2]) -> Result<[f64; 2]> {
        let Terms { mass_matrix, velocity, gravity } = self.terms(q, v);
        let right = std::array::from_fn(|k| torques[k] - velocity[k] - gravity[k]);
        Ok(solve(mass_matrix, right).map_err(|pivot| self.singular(q, pivot))?)
    }

    /// Cylinder forces of the leg (N, positive when extending) for joint torques (N m): `F = tau / (ds/dq)`.
    pub fn cylinder_forces(&self, q: [f64; 2], torques: [f64; 2]) -> [f64; 2] {
        let levers = self.levers(q);
        std::array::from_fn(|k| torques[k] / levers[k])
    }

    fn singular(&self, q: [f64; 2], pivot: f64) -> LinkageError {
        LinkageError::Singular { linkage: "leg".to_owned(), coordinates: q.to_vec(), pivot }
    }
}
