//! Friction of bristles: pre-sliding, Stribeck's curve and break-away in one law.

use super::{MemoryChords, MemoryLaw, law};
use crate::scalar::Scalar;

law! {
    /// LuGre friction of a joint: bristles that bend before they slide, and slide easier the faster they go.
    ///
    /// Law: with the memory z, the mean deflection of the bristles by `displacement`, and `h = 1 + excess exp(-(v / stribeck_velocity)^2)`,
    /// `dz/dt = (v - |v| z / h) / displacement` and `tau = -coulomb z - damping displacement dz/dt`; tau and `coulomb` in N or N m,
    /// `displacement` in m or rad, `damping` in N s/m or N m s/rad, velocities in m/s or rad/s. In steady motion `tau = -coulomb h sign(v)`;
    /// about z = 0 it is a spring of stiffness `coulomb / displacement`. Viscous friction is an effect of its own.
    ///
    /// Bent bristles store `coulomb displacement z^2 / 2`; beside that it only takes energy where `damping |v| <= 4 coulomb h`.
    /// Source: Canudas de Wit, Olsson, Åström & Lischinsky 1995, "A new model for control of systems with friction", IEEE Trans. Automatic
    /// Control 40(3), equations (1) to (4), with sigma_0 = coulomb / displacement, sigma_1 = damping, F_s = coulomb (1 + excess).
    /// Checked: steady curve, stiffness of pre-sliding, Dahl's law where `excess` and `damping` vanish, energy.
    LugreFriction {
        /// Resistance in fast motion, N or N m.
        coulomb: Any,
        /// Way over which the bristles bend, m or rad.
        displacement: Positive,
        /// Resistance of the bristles to bending, N s/m or N m s/rad.
        damping: Any,
        /// By which share the resistance in slow motion is larger.
        excess: NonNegative,
        /// Speed at which this share has fallen to 37 %, m/s or rad/s.
        stribeck_velocity: Positive,
    }
}

impl<S: Scalar> MemoryLaw<S> for LugreFriction<S> {
    #[inline]
    fn chords(&self, v: S, _: S) -> MemoryChords<S> {
        let slip = v.abs() / self.level(v);
        let (push, resistance) = (self.coulomb - self.damping * slip, self.damping);
        let gain = self.displacement.recip();
        MemoryChords { push, resistance, gain, source: S::zero(), fading: slip * gain }
    }

    #[inline]
    fn advance(&self, z: S, way: S, time: S) -> S {
        let level = self.level(way / time);
        let slid = -(-(way.abs() / (self.displacement * level))).exp_m1();
        let end = way.if_negative(|| -level, || level);
        z + (end - z) * slid
    }

    #[inline]
    fn reach(&self) -> S {
        self.level(S::zero())
    }
}

impl<S: Scalar> LugreFriction<S> {
    /// Level of LuGre friction: resistance in steady motion over that in fast motion.
    #[inline]
    fn level(&self, v: S) -> S {
        let ratio = v / self.stribeck_velocity;
        self.excess * (-(ratio * ratio)).exp() + 1.0
    }
}
