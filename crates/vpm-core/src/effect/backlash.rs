//! Play of a gear or a coupling, as a joint of its own.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
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
    Backlash {
        /// Free way from contact to contact, m or rad.
        gap: NonNegative,
        /// Effort per way beyond the play, N/m or N m/rad.
        stiffness: Any,
        /// Effort per velocity within the play and beyond, N s/m or N m s/rad.
        damping: Any,
        /// Effort per velocity of a closed contact, N s/m or N m s/rad.
        contact_damping: Any,
        /// Way over which a contact closes, m or rad.
        width: Positive,
    }
}

impl<S: Scalar> Law<S> for Backlash<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        let half = self.gap * 0.5;
        -(self.stiffness * (q + (self.distance(q - half) - self.distance(q + half)) * 0.5))
    }

    #[inline]
    fn resistance(&self, q: S, _: S) -> S {
        let (before, beyond) = (q - self.gap * 0.5, q + self.gap * 0.5);
        let corners = before / self.distance(before) - beyond / self.distance(beyond);
        self.damping + self.contact_damping * (corners * 0.5 + 1.0)
    }

    /// Potential of a backlash: zero in its middle.
    #[inline]
    fn potential(&self, q: S) -> S {
        let half = self.gap * 0.5;
        let corners = (self.area(q - half) - self.area(q + half)) * 0.5 + self.area(half);
        self.stiffness * (q * q * 0.5 + corners)
    }
}

impl<S: Scalar> Backlash<S> {
    /// Rounded absolute value in the law of a backlash.
    #[inline]
    fn distance(&self, way: S) -> S {
        (way * way + self.width * self.width).sqrt()
    }

    /// Integral of the backlash's rounded absolute value from zero.
    #[inline]
    fn area(&self, way: S) -> S {
        let (size, distance) = (way.abs(), self.distance(way));
        let area = (size * distance + self.width * self.width * ((size + distance) / self.width).ln()) * 0.5;
        way.if_negative(|| -area, || area)
    }
}
