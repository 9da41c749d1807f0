//! Whether a machine can be in the state that it starts from.

use super::names::state_name;
use crate::description::{Description, piston_outside};
use crate::error::{DriveError, Result};
use crate::system::Dynamics;

/// Complains about a piston that starts outside of its stroke, and about a state of a drive or an effect that its law never leads to.
pub(crate) fn check_start(
    description: &Description,
    theta: &[f64],
    dynamics: &mut Dynamics<f64>,
    state: &[f64],
) -> Result<()> {
    if let Some(found) = dynamics.piston_outside(&state[..description.n_coordinates()]) {
        return Err(piston_outside(description, theta, found));
    }
    let first = 2 * description.n_coordinates();
    let Some((number, reach)) = dynamics.out_of_reach(&state[first..]) else { return Ok(()) };
    let name = state_name(description, first + number);
    Err(DriveError::Start { state: name, value: state[first + number], reach }.into())
}
