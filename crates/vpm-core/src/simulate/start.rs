//! Whether a machine can be in the state that it starts from.

use crate::description::{Description, piston_outside};
use crate::error::Result;
use crate::system::Dynamics;

/// Complains about a piston that starts outside of its stroke.
pub(crate) fn check_pistons(
    description: &Description,
    theta: &[f64],
    dynamics: &mut Dynamics<f64>,
    state: &[f64],
) -> Result<()> {
    match dynamics.piston_outside(&state[..description.n_coordinates()]) {
        Some(found) => Err(piston_outside(description, theta, found)),
        None => Ok(()),
    }
}
