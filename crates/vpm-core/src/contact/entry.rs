//! A contact of a machine: which point of it meets which plane.

use serde::Deserialize;

use super::{Contact, ContactFriction, NormalContact, Plane};
use crate::effect::Domain;
use crate::error::{ConnectionError, Error, Result};
use crate::mount::{Marker, Mount, check_finite};
use crate::scalar::Scalar;
use crate::spatial::Vector3;

/// A point of a machine against a plane at rest in the world, over any parameter type.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactEntry<P> {
    /// Name, unique in the model.
    pub name: String,
    /// What the point is fixed to.
    pub on: Mount,
    /// The point in the mount's frame, m.
    pub point: [f64; 3],
    /// The plane.
    pub plane: PlaneEntry,
    /// Force along the normal.
    pub normal: NormalContact<P>,
    /// Force in the plane; a smooth plane has none.
    #[serde(default = "none")]
    pub friction: Option<ContactFriction<P>>,
}

/// A plane at rest in the world.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneEntry {
    /// A point of it, m.
    pub point: [f64; 3],
    /// Its normal, of any length but zero, towards the free side.
    pub normal: [f64; 3],
}

/// Contact entry without friction (the derive would ask for `P: Default`).
fn none<T>() -> Option<T> {
    None
}

impl<P> ContactEntry<P> {
    /// Law of a contact entry over another number type.
    pub fn law<T>(&self, f: &mut impl FnMut(&P) -> T) -> Contact<T> {
        Contact { normal: self.normal.map(f), friction: self.friction.as_ref().map(|law| law.map(f)) }
    }

    /// Parameters of a contact entry and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut domains = self.normal.domains();
        domains.extend(self.friction.iter().flat_map(ContactFriction::domains));
        domains
    }

    /// Point of a contact entry as a frame to keep track of.
    pub fn marker(&self) -> Marker {
        let rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        Marker { name: self.name.clone(), on: self.on, translation: self.point, rotation }
    }

    /// Plane of a contact entry, if it is one.
    pub fn plane<S: Scalar>(&self) -> Result<Plane<S>> {
        let PlaneEntry { point, normal } = self.plane;
        check_finite(&self.name, "plane.point", &point)?;
        Plane::new(Vector3::from_f64(point), Vector3::from_f64(normal)).map_err(|error| match error {
            Error::Domain { condition, value, .. } => {
                Error::Domain { path: format!("{}.plane.normal", self.name), condition, value }
            }
            Error::NonFinite { value, .. } => Error::NonFinite { path: format!("{}.plane.normal", self.name), value },
            other => other,
        })
    }
}

impl ContactEntry<usize> {
    /// Checks whether a contact entry's law has a meaning with the parameters `theta`, beyond the domain of each.
    pub fn check(&self, theta: &[f64]) -> Result<()> {
        let Some(friction) = &self.friction else { return Ok(()) };
        let (static_velocity, dynamic_velocity) = (theta[friction.static_velocity], theta[friction.dynamic_velocity]);
        if dynamic_velocity > static_velocity {
            return Ok(());
        }
        let contact = self.name.clone();
        Err(ConnectionError::Velocities { contact, static_velocity, dynamic_velocity }.into())
    }
}
