//! A torque constant that changes along the turn of a motor.

use std::f64::consts::TAU;

use super::{Law, law, within_largest};
use crate::scalar::Scalar;

law! {
    /// Current ripple of a joint: one harmonic of the coordinate, in proportion to the effort of the actuators on it, as of windings whose
    /// field is no sine.
    ///
    /// Law: with u the effort of the actuators on the joint and `phi = 2 pi q / period`, `tau = -u (cosine cos(phi) + sine sin(phi))`, the
    /// bracket within 0.95, tau and u in N or N m, q and `period` in m or rad. Forces of lines do not count.
    /// Source: Holtz & Springob 1996, "Identification and compensation of torque ripple in high-precision permanent magnet motor drives",
    /// IEEE Trans. Industrial Electronics 43(2), the ripple of mutual torque. Checked: work of a constant effort over whole periods;
    /// inverse and forward dynamics.
    CurrentRipple {
        /// Distance after which the ripple repeats, m or rad.
        period: NonZero,
        /// Share of the effort that is lost in phase with cos.
        cosine: Any,
        /// Share of the effort that is lost in phase with sin.
        sine: Any,
    }
}

impl<S: Scalar> Law<S> for CurrentRipple<S> {
    #[inline]
    fn follows_load(&self) -> bool {
        true
    }

    #[inline]
    fn share_of_load(&self, q: S, _: S, u: S) -> S {
        let (sine, cosine) = (q * TAU / self.period).sin_cos();
        let share = within_largest(self.cosine * cosine + self.sine * sine);
        u.if_negative(|| -share, || share)
    }
}
