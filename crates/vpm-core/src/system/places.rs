//! Where the states of drives and supplies stand.

use super::Dynamics;
use crate::actuator::hydraulic::Source;
use crate::actuator::{Actuator, Drive};
use crate::scalar::Scalar;

/// Where the states of an actuator stand among those of drives and supplies.
#[derive(Clone, Copy)]
pub(super) struct Place<S> {
    pub(super) first: usize,
    pub(super) count: usize,
    /// States of the supply that it draws from.
    pub(super) supply: [Option<Fed<S>>; 2],
}

/// A state of a supply.
#[derive(Clone, Copy)]
pub(super) struct Fed<S> {
    pub(super) at: usize,
    /// What a unit of it adds to the pressure at the valves.
    pub(super) sign: f64,
    /// How its rate changes with the flow that is drawn.
    pub(super) by_flow: S,
    /// How its rate changes with itself at the same flow.
    pub(super) by_itself: S,
}

impl<S> Place<S> {
    /// Whether the actuator has a flow.
    pub(super) fn draws<T>(&self, actuator: &Actuator<T>) -> bool {
        matches!(actuator.drive, Drive::Hydraulic(_))
    }
}

/// Where the states of every actuator stand.
pub(super) fn places<S: Scalar>(machine: &Dynamics<S>) -> impl Iterator<Item = Place<S>> {
    let mut next = 0;
    machine.actuators.iter().map(move |actuator| {
        let (first, count) = (next, actuator.n_states());
        next += count;
        let supply = match &actuator.drive {
            Drive::Hydraulic(law) => fed(machine, law.supply),
            _ => [None; 2],
        };
        Place { first, count, supply }
    })
}

/// States of the supplies.
pub(super) fn all_fed<S: Scalar>(machine: &Dynamics<S>) -> impl Iterator<Item = Fed<S>> {
    (0..machine.supplies.len()).flat_map(|number| fed(machine, number).into_iter().flatten())
}

/// States of supply `number`: its pressure if it sags, then what is lost on the way to the valves.
fn fed<S: Scalar>(machine: &Dynamics<S>, number: usize) -> [Option<Fed<S>>; 2] {
    let (supply, after) = (&machine.supplies[number], &machine.supplies[number..]);
    let first = machine.internal - after.iter().map(|supply| supply.states().count()).sum::<usize>();
    let sagging = match &supply.source {
        Source::Sagging(law) => Some(Fed {
            at: first,
            sign: 1.0,
            by_flow: -law.capacitance.recip(),
            by_itself: -(law.resistance * law.capacitance).recip(),
        }),
        Source::Constant | Source::Logged => None,
    };
    let drop = supply.drop.as_ref().map(|law| Fed {
        at: first + usize::from(sagging.is_some()),
        sign: -1.0,
        by_flow: law.resistance / law.time_constant,
        by_itself: -law.time_constant.recip(),
    });
    [sagging, drop]
}
