//! A mass carried by a body.

use serde::Deserialize;

use super::Domain;

/// Payload of a body: a point mass fixed to it, which adds to the body's inertia.
///
/// Law: mass `m` in kg at `position` r in m (body frame, origin at the joint frame) adds the spatial inertia
/// `[[m (r.r 1 - r r^T), m r x], [-m r x, m 1]]`.
/// Source: Featherstone 2008, "Rigid Body Dynamics Algorithms", equation 2.63. Checked: any finite value is accepted here; the body's
/// total mass must be positive, which the model checks.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Payload<P> {
    /// Mass carried, kg.
    pub mass: P,
    /// Where it is fixed, in the body frame, m.
    pub position: [P; 3],
}

impl<P> Payload<P> {
    /// The same payload over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Payload<T> {
        Payload { mass: f(&self.mass), position: self.position.each_ref().map(f) }
    }

    /// Parameters of a payload and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let [x, y, z] = &self.position;
        [&self.mass, x, y, z].map(|parameter| (parameter, Domain::Any)).to_vec()
    }
}
