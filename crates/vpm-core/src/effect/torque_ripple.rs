//! An effort that repeats along the way: cogging of a motor, a gear's tooth error, a screw's pitch error.

use std::f64::consts::TAU;

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Torque ripple of a joint: one harmonic of the coordinate.
    ///
    /// Law: with `phi = 2 pi q / period`, `tau = -(cosine cos(phi) + sine sin(phi))`, tau, `cosine` and `sine` in N or N m, q and
    /// `period` in m or rad. It has the potential `period/(2 pi) (cosine sin(phi) - sine cos(phi))`.
    /// Source: Fourier form of cogging, as in Holtz & Springob 1996, "Identification and compensation of torque ripple in high-precision
    /// permanent magnet motor drives", IEEE Trans. Industrial Electronics 43(2). Checked: the period must not be zero.
    TorqueRipple {
        /// Distance after which the ripple repeats, m or rad.
        period: NonZero,
        /// Load in phase with cos, N or N m.
        cosine: Any,
        /// Load in phase with sin, N or N m.
        sine: Any,
    }
}

impl<S: Scalar> Law<S> for TorqueRipple<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        let (sine, cosine) = (q * TAU / self.period).sin_cos();
        -(self.cosine * cosine + self.sine * sine)
    }

    #[inline]
    fn damping(&self) -> Option<S> {
        Some(S::zero())
    }

    /// Potential of a torque ripple: zero on average over a period.
    #[inline]
    fn potential(&self, q: S) -> S {
        let (sine, cosine) = (q * TAU / self.period).sin_cos();
        self.period / TAU * (self.cosine * sine - self.sine * cosine)
    }
}
