//! Dry friction of a gear, in proportion to what it transmits.

use super::{Law, law, tanh_ratio, within_largest};
use crate::scalar::Scalar;

law! {
    /// Load-dependent friction of a joint: a Coulomb level in proportion to the load, as of gears, screws and seals. It takes one share of
    /// the load where the actuators drive the joint and another where the joint drives them.
    ///
    /// Law: with u the effort of the actuators on the joint and `s = tanh(v / transition_velocity)`,
    /// `tau = -|u| s (driving + driven + (driving - driven) s sign(u)) / 2`: far above the transition velocity `driving |u|` against the
    /// motion where `u v > 0`, `driven |u|` where `u v < 0`. Each share within 0.95; u stands for the effort that the gear transmits, which
    /// differs from it by the inertia and the friction before the gear. Forces of lines do not count.
    /// Source: Hamon, Gautier, Garrec & Janot 2010, "Dynamic modeling and identification of joint drive with load-dependent friction
    /// model", IEEE/ASME AIM (one friction for each sign of the power); Duclusaud, Passault, Padois & Ly 2024, "Extended friction models for
    /// the physics simulation of servo actuators", arXiv:2410.08650. Checked: the four quadrants; inverse and forward dynamics.
    LoadDependentFriction {
        /// Share of the load that is lost where the actuators drive.
        driving: Any,
        /// Share of the load by which the motion is braked where the joint drives the actuators.
        driven: Any,
        /// Velocity over which the direction changes, m/s or rad/s.
        transition_velocity: Positive,
    }
}

impl<S: Scalar> Law<S> for LoadDependentFriction<S> {
    #[inline]
    fn follows_load(&self) -> bool {
        true
    }

    #[inline]
    fn share_of_load(&self, _: S, v: S, u: S) -> S {
        let direction = (v / self.transition_velocity).tanh();
        within_largest(self.level(direction, u) * direction)
    }

    #[inline]
    fn resistance_per_load(&self, v: S, u: S) -> S {
        let ratio = v / self.transition_velocity;
        self.level(ratio.tanh(), u) * tanh_ratio(ratio) / self.transition_velocity
    }
}

impl<S: Scalar> LoadDependentFriction<S> {
    /// Level of load-dependent friction, which multiplies the direction.
    #[inline]
    fn level(&self, direction: S, u: S) -> S {
        let along = u.if_negative(|| -direction, || direction);
        (self.driving + self.driven + (self.driving - self.driven) * along) * 0.5
    }
}
