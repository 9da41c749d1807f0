//! Dry friction that changes along the way.

use std::f64::consts::TAU;

use super::{Law, law, tanh_ratio};
use crate::scalar::Scalar;

law! {
    /// Position-dependent friction of a joint: by what a Coulomb level rises and falls over a period, as of a bent shaft or a worn screw.
    ///
    /// Law: with `phi = 2 pi q / period`, `tau = -(cosine cos(phi) + sine sin(phi)) tanh(v / transition_velocity)`, tau, `cosine` and
    /// `sine` in N or N m, q and `period` in m or rad, velocities in m/s or rad/s. Beside Coulomb friction the sum is not negative where
    /// that is at least `sqrt(cosine^2 + sine^2)`.
    /// Source: Armstrong-Hélouvry 1991, "Control of Machines with Friction" (friction as a function of position, by its Fourier
    /// components), first component. Checked: work over whole periods in both directions.
    PositionDependentFriction {
        /// Way after which the level repeats, m or rad.
        period: NonZero,
        /// Level in phase with cos, N or N m.
        cosine: Any,
        /// Level in phase with sin, N or N m.
        sine: Any,
        /// Velocity over which the direction changes, m/s or rad/s.
        transition_velocity: Positive,
    }
}

impl<S: Scalar> Law<S> for PositionDependentFriction<S> {
    #[inline]
    fn effort(&self, q: S, v: S) -> S {
        -(self.level(q) * (v / self.transition_velocity).tanh())
    }

    #[inline]
    fn resistance(&self, q: S, v: S) -> S {
        self.level(q) * tanh_ratio(v / self.transition_velocity) / self.transition_velocity
    }
}

impl<S: Scalar> PositionDependentFriction<S> {
    #[inline]
    fn level(&self, q: S) -> S {
        let (sine, cosine) = (q * TAU / self.period).sin_cos();
        self.cosine * cosine + self.sine * sine
    }
}
