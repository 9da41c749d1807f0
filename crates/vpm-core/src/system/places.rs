//! Where the states of drives and supplies stand.

use super::Dynamics;
use crate::actuator::hydraulic::Supply;
use crate::actuator::{Actuator, Drive};
use crate::scalar::Scalar;

/// Where the states of an actuator stand among those of drives and supplies.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) first: usize,
    pub(super) count: usize,
    /// State of the supply that it draws from.
    pub(super) supply: Option<usize>,
}

impl Place {
    /// Whether the actuator has a flow.
    pub(super) fn draws<S>(self, actuator: &Actuator<S>) -> bool {
        matches!(actuator.drive, Drive::Hydraulic(_))
    }
}

/// Where the states of every actuator stand.
pub(super) fn places<S: Scalar>(machine: &Dynamics<S>) -> impl Iterator<Item = Place> {
    let mut next = 0;
    machine.actuators.iter().map(move |actuator| {
        let (first, count) = (next, actuator.n_states());
        next += count;
        let supply = match &actuator.drive {
            Drive::Hydraulic(law) => pressure(machine, law.supply),
            _ => None,
        };
        Place { first, count, supply }
    })
}

/// Places of the states of the supplies.
pub(super) fn pressures<S: Scalar>(machine: &Dynamics<S>) -> impl Iterator<Item = usize> {
    (0..machine.supplies.len()).filter_map(|number| pressure(machine, number))
}

/// Place of the state of supply `number`, if it has one.
fn pressure<S: Scalar>(machine: &Dynamics<S>, number: usize) -> Option<usize> {
    let sagging = |supplies: &[Supply<S>]| supplies.iter().filter(|supply| supply.is_sagging()).count();
    let after = sagging(&machine.supplies[number..]);
    machine.supplies[number].is_sagging().then(|| machine.internal - after)
}
