//! Drag of a stirred fluid.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Quadratic drag of a joint: the resistance of air or oil that is stirred, proportional to the square of the speed.
    ///
    /// Law: `tau = -drag |v| v`, tau in N or N m, v in m/s or rad/s, `drag` in N s^2/m^2 or N m s^2/rad^2.
    /// Source: the drag equation at high Reynolds number, Batchelor 1967, "An Introduction to Fluid Dynamics", section 5.11.
    /// Checked: the closed form of free motion, `v0 / (1 + drag v0 t / m)`.
    QuadraticDrag {
        /// Resistance per velocity squared, N s^2/m^2 or N m s^2/rad^2.
        drag: Any,
    }
}

impl<S: Scalar> Law<S> for QuadraticDrag<S> {
    #[inline]
    fn resistance(&self, _: S, v: S) -> S {
        self.drag * v.abs()
    }
}
