//! Contacts, bushings and load cells of a description: their checks, and what the machine makes of them.

use serde::Deserialize;

use super::Description;
use crate::closure::LoopEntry;
use crate::effect::Domain;
use crate::error::{ConnectionError, Result};
use crate::model::{Model, Omissions};
use crate::mount::Marker;
use crate::scalar::Scalar;
use crate::system::{Build, Connections, Dynamics, LoopState, Loops};

/// How far (m, m/s, or as the cosine of an angle) a state may leave loops open: what numbers in files are rounded to.
const TORN: f64 = 1e-6;

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
    /// Frames of connections: points of the contacts, then A and B of each bushing and of each loop.
    pub(super) fn attachments(&self) -> Vec<Marker> {
        let points = self.contacts.iter().map(|contact| contact.marker());
        let bushings = self.bushings.iter().flat_map(|bushing| bushing.markers());
        points.chain(bushings).chain(self.loops.iter().flat_map(|closure| closure.markers())).collect()
    }

    /// Closed loops as connections, on the frames of `model`.
    pub(super) fn closures<S: Scalar>(&self, model: &Model<S>) -> Result<Option<Loops<S>>> {
        let Some(first) = self.loops.first() else { return Ok(None) };
        if self.drop_velocity_terms || self.omissions != Omissions::default() {
            return Err(ConnectionError::LoopWithoutTerms { closure: first.name.clone() }.into());
        }
        let ends = model.attachments().len() - 2 * self.loops.len();
        Loops::new(model, &self.loops, &model.attachments()[ends..]).map(Some)
    }

    /// Checks whether a state (coordinates and rates first) leaves the connections of all loops closed.
    pub(crate) fn check_closed(&self, state: &[f64]) -> Result<()> {
        if self.loops.is_empty() || state.iter().any(|number| !number.is_finite()) {
            return Ok(());
        }
        let mut dynamics: Dynamics<f64> = Build::dynamics(&self, &self.parameters)?;
        let (q, v) = state[..2 * self.n_coordinates()].split_at(self.n_coordinates());
        let LoopState { gap, jacobian, .. } = dynamics.loops_at(q, v);
        let mut rates = jacobian.chunks_exact(q.len().max(1)).map(|row| -> (f64, f64) {
            let entries = row.iter().zip(v).map(|(entry, v)| entry * v);
            entries.fold((0.0, 0.0), |(sum, size), entry| (sum + entry, size + entry.abs()))
        });
        let mut gaps = gap.into_iter();
        for closure in &self.loops {
            let count = closure.joint.equations();
            let gap = gaps.by_ref().take(count).fold(0.0, |most: f64, gap| most.max(gap.abs()));
            let torn = rates.by_ref().take(count).find(|(rate, size)| rate.abs() > TORN * size.max(1.0));
            if gap > TORN {
                return Err(ConnectionError::LoopOpen { closure: closure.name.clone(), gap }.into());
            }
            if let Some((rate, _)) = torn {
                return Err(ConnectionError::LoopTorn { closure: closure.name.clone(), rate: rate.abs() }.into());
            }
        }
        Ok(())
    }

    /// Refuses connections by closed loops where `what` is asked for, which is not known of them.
    pub(crate) fn refuse_loops(&self, what: &'static str, repair: &'static str) -> Result<()> {
        let refused = |closure: &LoopEntry| {
            Err(ConnectionError::LoopRefused { closure: closure.name.clone(), what, repair }.into())
        };
        self.loops.first().map_or(Ok(()), refused)
    }

    /// Contacts, bushings and load cells with the parameters `theta`, on the frames of `model`.
    pub(super) fn connections<S: Scalar>(&self, theta: &[S], model: &Model<S>) -> Result<Connections<S>> {
        if self.contacts.is_empty() && self.bushings.is_empty() && self.load_cells.is_empty() && self.imus.is_empty() {
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

/// Parameters of the connections and where each is defined.
pub(super) fn domains(description: &Description) -> impl Iterator<Item = (&usize, Domain)> {
    let contacts = description.contacts.iter().flat_map(|contact| contact.domains());
    contacts.chain(description.bushings.iter().flat_map(|bushing| bushing.domains()))
}

/// Places in the parameter vector that connections use, and by what.
pub(super) fn used(description: &Description) -> impl Iterator<Item = (String, usize)> {
    let contacts = description.contacts.iter().flat_map(|contact| {
        contact.domains().into_iter().map(|(&index, _)| (format!("contact `{}`", contact.name), index))
    });
    contacts.chain(description.bushings.iter().flat_map(|bushing| {
        bushing.domains().into_iter().map(|(&index, _)| (format!("bushing `{}`", bushing.name), index))
    }))
}
