//! An effort that repeats along the way: cogging of a motor, a gear's tooth error, a screw's pitch error.

use std::f64::consts::TAU;

use serde::Deserialize;

use super::Domain;
use crate::scalar::Scalar;

/// Torque ripple of a joint: one harmonic of the coordinate.
///
/// Law: with `phi = 2 pi q / period`, `tau = -(cosine cos(phi) + sine sin(phi))`, tau, `cosine` and `sine` in N or N m, q and
/// `period` in m or rad. It has the potential `period/(2 pi) (cosine sin(phi) - sine cos(phi))`.
/// Source: Fourier form of cogging, as in Holtz & Springob 1996, "Identification and compensation of torque ripple in high-precision
/// permanent magnet motor drives", IEEE Trans. Industrial Electronics 43(2). Checked: the period must not be zero.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueRipple<P> {
    /// Distance after which the ripple repeats, m or rad.
    pub period: P,
    /// Load in phase with cos, N or N m.
    pub cosine: P,
    /// Load in phase with sin, N or N m.
    pub sine: P,
}

impl<P> TorqueRipple<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> TorqueRipple<T> {
        TorqueRipple { period: f(&self.period), cosine: f(&self.cosine), sine: f(&self.sine) }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        vec![(&self.period, Domain::NonZero), (&self.cosine, Domain::Any), (&self.sine, Domain::Any)]
    }
}

impl<S: Scalar> TorqueRipple<S> {
    /// Effort on the joint at coordinate `q`.
    #[inline]
    pub fn effort(&self, q: S) -> S {
        let (sine, cosine) = (q * TAU / self.period).sin_cos();
        -(self.cosine * cosine + self.sine * sine)
    }

    /// Potential energy at coordinate `q`, in J, zero on average over a period.
    #[inline]
    pub fn potential(&self, q: S) -> S {
        let (sine, cosine) = (q * TAU / self.period).sin_cos();
        self.period / TAU * (self.cosine * sine - self.sine * cosine)
    }
}
