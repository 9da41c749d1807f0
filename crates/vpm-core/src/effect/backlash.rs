//! Play of a gear or a coupling, as a joint of its own.

use serde::Deserialize;

use super::Domain;
use crate::scalar::Scalar;

/// Backlash: a spring with a dead band, for a joint that models the play itself.
///
/// Law: `tau = -stiffness f(q) - (damping + contact_damping df/dq) v`, tau in N or N m, q in m or rad, v in m/s or rad/s, where f is the
/// way beyond the play, `f(q) = q + 1/2 sqrt((q - gap/2)^2 + width^2) - 1/2 sqrt((q + gap/2)^2 + width^2)`: zero in the middle of the
/// play, `q -+ gap/2` far outside, with corners rounded over `width` so that it has derivatives of every order. Grease and bearings
/// resist within the play as well, so `damping` acts always; what an impact loses in the teeth acts only in contact, where
/// df/dq is 1. Without damping it has a potential.
/// Source: Nordin & Gutman 2002, "Controlling mechanical systems with backlash - a survey", Automatica 38(10), section 2 (dead-zone
/// model, with the damping of its shaft in contact); rounding by the hyperbola of which the sharp corner is the asymptote. Checked: its
/// slope lies between 0 and `stiffness`, so that an implicit step which sees it stays stable; without a gap it is a linear spring;
/// released in the middle of its play it keeps its speed up to the contact.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash<P> {
    /// Free way from contact to contact, m or rad.
    pub gap: P,
    /// Effort per way beyond the play, N/m or N m/rad.
    pub stiffness: P,
    /// Effort per velocity within the play and beyond, N s/m or N m s/rad.
    pub damping: P,
    /// Effort per velocity of a closed contact, N s/m or N m s/rad.
    pub contact_damping: P,
    /// Way over which a contact closes, m or rad.
    pub width: P,
}

impl<P> Backlash<P> {
    /// The same law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Backlash<T> {
        let Self { gap, stiffness, damping, contact_damping, width } = self;
        Backlash {
            gap: f(gap),
            stiffness: f(stiffness),
            damping: f(damping),
            contact_damping: f(contact_damping),
            width: f(width),
        }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let Self { gap, stiffness, damping, contact_damping, width } = self;
        vec![
            (gap, Domain::NonNegative),
            (stiffness, Domain::Any),
            (damping, Domain::Any),
            (contact_damping, Domain::Any),
            (width, Domain::Positive),
        ]
    }
}

impl<S: Scalar> Backlash<S> {
    /// Effort on the joint at coordinate `q` and velocity `v`.
    #[inline]
    pub fn effort(&self, q: S, v: S) -> S {
        self.effort_at_rest(q) - self.resistance(q) * v
    }

    /// Effort of the contacts at coordinate `q`.
    #[inline]
    pub fn effort_at_rest(&self, q: S) -> S {
        let half = self.gap * 0.5;
        -(self.stiffness * (q + (self.distance(q - half) - self.distance(q + half)) * 0.5))
    }

    /// Resistance to the velocity at coordinate `q`.
    #[inline]
    pub fn resistance(&self, q: S) -> S {
        let (before, beyond) = (q - self.gap * 0.5, q + self.gap * 0.5);
        let corners = before / self.distance(before) - beyond / self.distance(beyond);
        self.damping + self.contact_damping * (corners * 0.5 + 1.0)
    }

    /// Potential energy at coordinate `q` in J, zero in the middle of the play.
    #[inline]
    pub fn potential(&self, q: S) -> S {
        let half = self.gap * 0.5;
        let corners = (self.area(q - half) - self.area(q + half)) * 0.5 + self.area(half);
        self.stiffness * (q * q * 0.5 + corners)
    }

    /// Rounded absolute value.
    #[inline]
    fn distance(&self, way: S) -> S {
        (way * way + self.width * self.width).sqrt()
    }

    /// Integral of the rounded absolute value from zero.
    #[inline]
    fn area(&self, way: S) -> S {
        let (size, distance) = (way.abs(), self.distance(way));
        let area = (size * distance + self.width * self.width * ((size + distance) / self.width).ln()) * 0.5;
        way.if_negative(|| -area, || area)
    }
}
