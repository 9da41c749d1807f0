//! A spring that gets stiffer, or softer, on its way.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Cubic spring of a joint: an effort that pulls back with the cube of the way, as of a rubber bush, a bent hose or a membrane.
    ///
    /// Law: `tau = -stiffness (q - rest)^3`, tau in N or N m, q and `rest` in m or rad, `stiffness` in N/m^3 or N m/rad^3.
    /// It has the potential `1/4 stiffness (q - rest)^4`.
    /// Source: Duffing's equation, Nayfeh & Mook 1979, "Nonlinear Oscillations", section 4.1. Checked: the period of free oscillation,
    /// `7.4163 / (amplitude sqrt(stiffness / mass))`.
    CubicSpring {
        /// Effort per cube of the way, N/m^3 or N m/rad^3.
        stiffness: Any,
        /// Coordinate without effort, m or rad.
        rest: Any,
    }
}

impl<S: Scalar> Law<S> for CubicSpring<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        let way = q - self.rest;
        -(self.stiffness * way * way * way)
    }

    #[inline]
    fn damping(&self) -> Option<S> {
        Some(S::zero())
    }

    #[inline]
    fn potential(&self, q: S) -> S {
        let square = (q - self.rest) * (q - self.rest);
        self.stiffness * square * square * 0.25
    }
}
