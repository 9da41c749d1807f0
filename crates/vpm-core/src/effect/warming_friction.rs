//! Friction that a machine loses as it gets warm.

use super::{MemoryChords, MemoryLaw, law, tanh_ratio};
use crate::scalar::Scalar;

law! {
    /// Warming friction of a joint: what a cold one rubs more than a warm one, which fades over time as the grease gets thin.
    ///
    /// Law: `tau = -(1 - w) (coulomb tanh(v / transition_velocity) + viscous v)` and `dw/dt = (1 - w) / time_constant`, w = 0 at first,
    /// tau and `coulomb` in N or N m, `viscous` in N s/m or N m s/rad, `time_constant` in s, velocities in m/s or rad/s. The warmth w is
    /// a state that follows the time alone, not the power that the friction turns into heat.
    /// Source: the exponential course of friction after a cold start, Carvalho Bittencourt & Gunnarsson 2012, "Static friction in a robot
    /// joint - modeling and identification of load and temperature effects", J. Dyn. Sys. Meas. Control 134(5), with the first-order
    /// warming of a body under constant heating. Checked: the closed form of the decay; time alone counts.
    WarmingFriction {
        /// Cold less warm Coulomb friction, N or N m.
        coulomb: Any,
        /// Cold less warm viscous friction, N s/m or N m s/rad.
        viscous: Any,
        /// Time after which 63 % are gone, s.
        time_constant: Positive,
        /// Velocity over which the direction changes, m/s or rad/s.
        transition_velocity: Positive,
    }
}

impl<S: Scalar> MemoryLaw<S> for WarmingFriction<S> {
    #[inline]
    fn chords(&self, v: S, z: S) -> MemoryChords<S> {
        let dry = self.coulomb * tanh_ratio(v / self.transition_velocity) / self.transition_velocity;
        let (rate, zero) = (self.time_constant.recip(), S::zero());
        let resistance = (dry + self.viscous) * (S::one() - z);
        MemoryChords { push: zero, resistance, gain: zero, source: rate, fading: rate }
    }

    #[inline]
    fn advance(&self, z: S, _: S, time: S) -> S {
        z + (S::one() - z) * -(-(time / self.time_constant)).exp_m1()
    }
}
