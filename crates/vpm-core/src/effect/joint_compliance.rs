//! A gear, shaft or belt that winds up.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Compliance between the drive and the link, as a joint of its own whose coordinate is the wind-up, link side minus motor side.
    ///
    /// Law: `tau = -stiffness q - damping v`, tau in N or N m, q in m or rad, v in m/s or rad/s.
    /// It has the potential `1/2 stiffness q^2` but for the damping.
    /// Source: Spong 1987, "Modeling and Control of Elastic Joint Robots", J. Dyn. Sys. Meas. Control 109, equation (2), with a damper beside
    /// the spring. Checked: the frequency of two masses with a spring between them.
    JointCompliance {
        /// Effort per wind-up, N/m or N m/rad.
        stiffness: Any,
        /// Effort per rate of it, N s/m or N m s/rad.
        damping: Any,
    }
}

impl<S: Scalar> Law<S> for JointCompliance<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        -(self.stiffness * q)
    }

    #[inline]
    fn damping(&self) -> Option<S> {
        Some(self.damping)
    }

    #[inline]
    fn potential(&self, q: S) -> S {
        self.stiffness * q * q * 0.5
    }
}
