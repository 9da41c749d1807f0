//! The first bending mode of a link that is described as rigid, lumped at its root.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Hinge at the root of a link, as a joint of its own whose coordinate is the angle that the link lags behind.
    ///
    /// Law: `tau = -stiffness (q + time v)`, tau in N m, q in rad, v in rad/s: a pseudo-rigid link with damping in proportion to stiffness.
    /// It has the potential `1/2 stiffness q^2` but for the damping.
    /// Source: Howell 2001, "Compliant Mechanisms", chapter 5 (a bent beam as a rigid one on a torsion spring); Kelvin-Voigt damping.
    /// Checked: the frequency of a rigid link on its spring.
    LinkFlexibility {
        /// Moment at the root per angle, N m/rad.
        stiffness: Any,
        /// Damping per stiffness, s.
        time: Any,
    }
}

impl<S: Scalar> Law<S> for LinkFlexibility<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        -(self.stiffness * q)
    }

    #[inline]
    fn damping(&self) -> Option<S> {
        Some(self.stiffness * self.time)
    }

    #[inline]
    fn potential(&self, q: S) -> S {
        self.stiffness * q * q * 0.5
    }
}
