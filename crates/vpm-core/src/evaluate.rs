//! A machine in a single state: accelerations, mass matrix, energy.

use crate::description::Description;
use crate::dynamics;
use crate::error::Result;
use crate::system::{Build, Dynamics};
use crate::table::Table;

/// Accelerations (m/s^2 or rad/s^2) under `effort` (N or N m) on the joints, with all effects.
pub fn accelerations(
    description: &Description,
    theta: &[f64],
    position: &[f64],
    velocity: &[f64],
    effort: &[f64],
) -> Result<Vec<f64>> {
    let mut dynamics =
        prepare(description, theta, [("position", position), ("velocity", velocity), ("effort", effort)])?;
    Ok(dynamics.accelerations(position, velocity, effort).to_vec())
}

/// Mass matrix with payloads, n x n (kg, kg m or kg m^2).
pub fn mass_matrix(description: &Description, theta: &[f64], position: &[f64]) -> Result<Vec<f64>> {
    let Dynamics { model, mut data, .. } = prepare(description, theta, [("position", position)])?;
    Ok(dynamics::crba(&model, &mut data, position).to_vec())
}

/// Kinetic and potential energy in J. The potential is that of the bodies in gravity and of the effects that have one.
///
/// Checked: with efforts of the actuators and frictions accounted for, the sum is conserved along a simulated run.
pub fn energy(description: &Description, theta: &[f64], position: &[f64], velocity: &[f64]) -> Result<(f64, f64)> {
    let Dynamics { model, mut data, effects, .. } =
        prepare(description, theta, [("position", position), ("velocity", velocity)])?;
    let total = dynamics::energy(&model, &mut data, position, velocity);
    let stored: f64 = effects.iter().map(|(joint, effect)| effect.potential(position[*joint])).sum();
    Ok((total.kinetic, total.potential + stored))
}

fn prepare<const N: usize>(
    description: &Description,
    theta: &[f64],
    joint_vectors: [(&str, &[f64]); N],
) -> Result<Dynamics<f64>> {
    for (name, vector) in joint_vectors {
        Table::vector(name, vector, description.n_joints(), "joint")?;
    }
    description.check_values(theta)?;
    Build::dynamics(&description, theta)
}
