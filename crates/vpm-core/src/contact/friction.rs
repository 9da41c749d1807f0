//! The force between two bodies that slide on each other.

use serde::Deserialize;

use super::step;
use crate::effect::Domain;
use crate::scalar::Scalar;
use crate::spatial::Vector2;

/// Friction of a contact: against the sliding velocity in the plane, in proportion to the normal force of the same instant.
///
/// Law: `F_t = -mu(|v|) F_n v / |v|`, forces in N, the sliding velocity v in the plane in m/s. mu rises from 0 at rest to mu_s at v_s by the
/// cubic step `3 t^2 - 2 t^3`, falls to mu_d at v_d by another, and stays there. The law is odd and has a continuous slope.
/// It has no memory: below v_s it holds by creeping. A load T < mu_s F_n is held at the speed where `mu(|v|) F_n = T`, which is below v_s
/// but not in proportion to T: a small load creeps at about `v_s sqrt(T / (3 mu_s F_n))`, since mu begins with slope zero.
/// Source: eq 3.42 of the thesis, with the sign and the momentary normal force in the place of the constant weight that is printed, right
/// only at rest. Checked: it opposes every motion, it is odd, and the creep of a held load.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactFriction<P> {
    /// mu_s, the largest friction per normal force.
    pub static_coefficient: P,
    /// v_s, speed at which it is reached, m/s.
    pub static_velocity: P,
    /// mu_d, friction per normal force when sliding.
    pub dynamic_coefficient: P,
    /// v_d, speed from which it holds, m/s; above v_s.
    pub dynamic_velocity: P,
}

impl<P> ContactFriction<P> {
    /// Contact friction over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> ContactFriction<T> {
        let Self { static_coefficient, static_velocity, dynamic_coefficient, dynamic_velocity } = self;
        ContactFriction {
            static_coefficient: f(static_coefficient),
            static_velocity: f(static_velocity),
            dynamic_coefficient: f(dynamic_coefficient),
            dynamic_velocity: f(dynamic_velocity),
        }
    }

    /// Parameters of contact friction and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let Self { static_coefficient, static_velocity, dynamic_coefficient, dynamic_velocity } = self;
        vec![
            (static_coefficient, Domain::NonNegative),
            (static_velocity, Domain::Positive),
            (dynamic_coefficient, Domain::NonNegative),
            (dynamic_velocity, Domain::Positive),
        ]
    }
}

impl<S: Scalar> ContactFriction<S> {
    /// Friction coefficient mu of a contact at a sliding speed of 0 or more (m/s). Without a way from v_s to v_d, mu
    /// falls at v_s at once.
    #[inline]
    pub fn coefficient(&self, speed: S) -> S {
        let rising = || self.static_coefficient * step(speed / self.static_velocity);
        let falling = || {
            let fallen = step((speed - self.static_velocity) / (self.dynamic_velocity - self.static_velocity));
            self.static_coefficient + (self.dynamic_coefficient - self.static_coefficient) * fallen
        };
        let beyond = || speed.if_less(self.dynamic_velocity, falling, || self.dynamic_coefficient);
        self.static_velocity.if_less(speed, beyond, rising)
    }

    /// Friction resistance r of a contact in N s/m under the normal force (N): `F_t = -r v`, zero at rest. The square
    /// of the sliding speed is `square` (m^2/s^2).
    #[inline]
    pub fn resistance(&self, square: S, normal: S) -> S {
        let moving = || {
            let speed = square.sqrt();
            self.coefficient(speed) * normal / speed
        };
        square.if_positive(moving, S::zero)
    }

    /// Friction resistance per normal force of a contact for an implicit step, in s/m. It is the chord from rest or the
    /// tangent, whichever is larger, at a sliding speed whose square is `square` (m^2/s^2).
    ///
    /// The tangent alone is negative where the friction falls, and flat beyond: a step that crosses rest would not see the friction turn
    /// around.
    #[inline]
    pub fn chord(&self, square: S) -> S {
        let moving = || {
            let speed = square.sqrt();
            let chord = self.coefficient(speed) / speed;
            let t = speed / self.static_velocity;
            let tangent = || self.static_coefficient * t * (-t + 1.0) * 6.0 / self.static_velocity;
            speed.if_less(self.static_velocity, || chord.max(tangent()), || chord)
        };
        square.if_positive(moving, S::zero)
    }

    /// Friction in N, in the plane, at the sliding velocity `v` (m/s) under the normal force (N).
    #[inline]
    pub fn force(&self, v: Vector2<S>, normal: S) -> Vector2<S> {
        v * -self.resistance(v.dot(v), normal)
    }
}
