//! A point that meets a plane.

use serde::Deserialize;

use super::{ContactFriction, NormalContact};
use crate::effect::Domain;
use crate::error::{Error, Result};
use crate::scalar::Scalar;
use crate::spatial::Vector3;

/// A plane at rest in the world; the free side is the one that its normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<S> {
    point: Vector3<S>,
    normal: Vector3<S>,
}

impl<S: Scalar> Plane<S> {
    /// The plane through `point` (m) with a normal of any length but zero, both in world axes.
    pub fn new(point: Vector3<S>, normal: Vector3<S>) -> Result<Self> {
        if let Some(entry) = normal.to_array().into_iter().find(|entry| !entry.is_finite()) {
            return Err(Error::NonFinite { path: "plane.normal".to_owned(), value: entry.inspect() });
        }
        // Scaled by the largest entry first, so that the square neither overflows nor vanishes.
        let largest = normal.to_array().map(S::abs).into_iter().fold(S::zero(), S::max);
        if largest.inspect() < f64::MIN_POSITIVE {
            let (path, condition) = ("plane.normal".to_owned(), "have a length, such as [0, 0, 1]");
            return Err(Error::Domain { path, condition, value: largest.inspect() });
        }
        let scaled = normal * largest.recip();
        Ok(Self { point, normal: scaled * scaled.dot(scaled).sqrt().recip() })
    }

    /// Unit normal of a contact plane, towards the free side.
    #[inline]
    pub fn normal(&self) -> Vector3<S> {
        self.normal
    }

    /// How deep a place (m) lies below the plane, in m; negative on the free side.
    #[inline]
    pub fn depth(&self, place: Vector3<S>) -> S {
        (self.point - place).dot(self.normal)
    }
}

/// Contact of a point with a plane.
///
/// Law: with the unit normal n of the plane through p, a point at r with velocity v has depth `d = n . (p - r)`, `d' = -n . v` and slides
/// with `v_t = v - n (n . v)`; the force on it is `n F_n(d, d') + F_t(v_t, F_n)` ([`NormalContact`], [`ContactFriction`]) in world axes, and
/// the plane takes the opposite. Source: section 3.4.1 of the thesis, eqs 3.41 and 3.42. Checked: drops, power balance, turned planes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact<P> {
    /// Force along the normal.
    pub normal: NormalContact<P>,
    /// Force in the plane; a smooth plane has none.
    #[serde(default = "none")]
    pub friction: Option<ContactFriction<P>>,
}

/// Contact with a plane without friction (the derive would ask for `P: Default`).
fn none<T>() -> Option<T> {
    None
}

impl<P> Contact<P> {
    /// Contact with a plane over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Contact<T> {
        Contact { normal: self.normal.map(f), friction: self.friction.as_ref().map(|law| law.map(f)) }
    }

    /// Parameters of a contact with a plane and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut domains = self.normal.domains();
        domains.extend(self.friction.iter().flat_map(ContactFriction::domains));
        domains
    }
}

impl<S: Scalar> Contact<S> {
    /// Force in N on a point at `place` (m) with `velocity` (m/s), all in world axes. For a plane that moves, `velocity` is the one against
    /// the plane.
    #[inline]
    pub fn force(&self, plane: &Plane<S>, place: Vector3<S>, velocity: Vector3<S>) -> Vector3<S> {
        self.force_with(plane, place, velocity, ContactFriction::resistance)
    }

    /// Force of a contact with a plane as [`Contact::force`], with a given friction `resistance` in N s/m. It gets the
    /// square of the sliding speed (m^2/s^2) and the normal force (N).
    #[inline]
    pub(crate) fn force_with(
        &self,
        plane: &Plane<S>,
        place: Vector3<S>,
        velocity: Vector3<S>,
        resistance: impl Fn(&ContactFriction<S>, S, S) -> S,
    ) -> Vector3<S> {
        let leaving = plane.normal.dot(velocity);
        let normal = self.normal.force(plane.depth(place), -leaving);
        let pushed = plane.normal * normal;
        let Some(friction) = &self.friction else {
            return pushed;
        };
        let sliding = velocity - plane.normal * leaving;
        pushed - sliding * resistance(friction, sliding.dot(sliding), normal)
    }
}
