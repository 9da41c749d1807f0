//! Contacts, bushings and load cells of a description: their checks, and what the machine makes of them.

use serde::Deserialize;

use super::Description;
use crate::effect::Domain;
use crate::error::Result;
use crate::model::Model;
use crate::mount::Marker;
use crate::scalar::Scalar;
use crate::system::Connections;

/// A reading of the reaction wrench at a joint: what the parent's side exerts on the child at the joint's origin, in the child's axes.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadCell {
    /// Name, unique in the model.
    pub name: String,
    /// Number of the joint.
    pub joint: usize,
}

impl Description {
    /// The frames that contacts and bushings act on: points of the contacts, then A and B of each bushing.
    pub(super) fn attachments(&self) -> Vec<Marker> {
        let points = self.contacts.iter().map(|contact| contact.marker());
        points.chain(self.bushings.iter().flat_map(|bushing| bushing.markers())).collect()
    }

    /// Contacts, bushings and load cells with the parameters `theta`, on the frames of `model`.
    pub(super) fn connections<S: Scalar>(&self, theta: &[S], model: &Model<S>) -> Result<Connections<S>> {
        if self.contacts.is_empty() && self.bushings.is_empty() && self.load_cells.is_empty() {
            return Ok(Connections::default());
        }
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        self.contacts.iter().try_for_each(|contact| contact.check(&values))?;
        self.bushings.iter().try_for_each(|bushing| bushing.check(&values))?;
        let number = &mut |&index: &usize| theta[index];
        let contacts = self.contacts.iter().map(|entry| Ok((entry.name.as_str(), entry.plane()?, entry.law(number))));
        let contacts = contacts.collect::<Result<Vec<_>>>()?;
        let bushings = self.bushings.iter().map(|entry| (entry.name.as_str(), entry.law(number))).collect();
        let cells = self.load_cells.iter().map(|cell| cell.joint).collect();
        Connections::new(model, contacts, bushings, cells)
    }
}

/// The parameters and where each is defined.
pub(super) fn domains(description: &Description) -> impl Iterator<Item = (&usize, Domain)> {
    let contacts = description.contacts.iter().flat_map(|contact| contact.domains());
    contacts.chain(description.bushings.iter().flat_map(|bushing| bushing.domains()))
}

/// Every place in the parameter vector that is used, and by what.
pub(super) fn used(description: &Description) -> impl Iterator<Item = (String, usize)> {
    let contacts = description.contacts.iter().flat_map(|contact| {
        contact.domains().into_iter().map(|(&index, _)| (format!("contact `{}`", contact.name), index))
    });
    contacts.chain(description.bushings.iter().flat_map(|bushing| {
        bushing.domains().into_iter().map(|(&index, _)| (format!("bushing `{}`", bushing.name), index))
    }))
}
