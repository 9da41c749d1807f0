//! A linear spring in parallel with a joint.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Spring of a joint: an effort that pulls the coordinate back to its rest.
    ///
    /// Law: `tau = -stiffness (q - rest)`, tau in N or N m, q and `rest` in m or rad, `stiffness` in N/m or N m/rad.
    /// It has the potential `1/2 stiffness (q - rest)^2`.
    /// Source: Hooke's law. Checked: any finite value is accepted (a negative stiffness is an unstable equilibrium, as of a magnet).
    Spring {
        /// Effort per deflection, N/m or N m/rad.
        stiffness: Any,
        /// Coordinate without effort, m or rad.
        rest: Any,
    }
}

impl<S: Scalar> Law<S> for Spring<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        -(self.stiffness * (q - self.rest))
    }

    #[inline]
    fn damping(&self) -> Option<S> {
        Some(S::zero())
    }

    #[inline]
    fn potential(&self, q: S) -> S {
        let deflection = q - self.rest;
        self.stiffness * deflection * deflection * 0.5
    }
}
