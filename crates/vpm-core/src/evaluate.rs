//! A machine in a single state: accelerations, mass matrix, energy, rest, vibrations, Jacobians.

use crate::ball::check_angles;
use crate::description::Description;
use crate::error::{Error, Result};
use crate::statics::{self, Statics};
use crate::system::{Build, Dynamics, LoopState};
use crate::table::Table;

/// Evaluates accelerations of all coordinates under `effort` (N or N m) on the joints, with all effects.
pub fn accelerations(
    description: &Description,
    theta: &[f64],
    position: &[f64],
    velocity: &[f64],
    effort: &[f64],
) -> Result<Vec<f64>> {
    Table::vector("effort", effort, description.n_joints(), "joint")?;
    let mut dynamics = prepare(description, theta, [("position", position), ("velocity", velocity)])?;
    check_angles(&description.balls, position)?;
    Ok(dynamics.accelerations(position, velocity, effort).to_vec())
}

/// Evaluates the mass matrix with payloads, n x n over all coordinates.
pub fn mass_matrix(description: &Description, theta: &[f64], position: &[f64]) -> Result<Vec<f64>> {
    Ok(prepare(description, theta, [("position", position)])?.mass_matrix(position).to_vec())
}

/// Evaluates kinetic and potential energy in J. The potential is that of gravity, of the beams, and of the effects that
/// have one.
///
/// Checked: with efforts of the actuators and frictions accounted for, the sum is conserved along a simulated run.
pub fn energy(description: &Description, theta: &[f64], position: &[f64], velocity: &[f64]) -> Result<(f64, f64)> {
    let mut dynamics = prepare(description, theta, [("position", position), ("velocity", velocity)])?;
    let total = dynamics.energy(position, velocity);
    Ok((total.kinetic, total.potential))
}

/// Evaluates the equilibrium under gravity with the joints held at `position`, and the holding efforts. `position` has
/// one per joint; the result has all coordinates.
pub fn equilibrium(description: &Description, theta: &[f64], position: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
    let mut statics = held(description, theta, position)?;
    let rest = statics.settle(position)?;
    let efforts = statics.holding_efforts(&rest);
    if let Some((body, &value)) = description.bodies.iter().zip(&efforts).find(|(_, effort)| !effort.is_finite()) {
        return Err(Error::NoHold { joint: body.joint.name.clone(), value });
    }
    Ok((rest.coordinates, efforts))
}

/// Evaluates the efforts that hold all coordinates at rest at `position`, and their derivative by them, n x n row by
/// row. Springs along lines carry their part.
pub fn load_at_rest(description: &Description, theta: &[f64], position: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
    Table::vector("position", position, description.n_coordinates(), "coordinate")?;
    description.check_values(theta)?;
    statics::load(description, theta, position)
}

/// Evaluates states of drives and supplies of a machine that has stood at `position` without commands. `position` has
/// all coordinates. The result follows coordinates and rates in a state.
///
/// Law: lags, currents and spools 0; visco-elastic elements settled at their length; chambers without net force, `A pa = alpha A pb` and
/// `pa + pb = ps + pt`; sagging supplies at their pressure.
pub fn internal_state(description: &Description, theta: &[f64], position: &[f64]) -> Result<Vec<f64>> {
    let mut dynamics = prepare(description, theta, [("position", position)])?;
    let mut states = vec![0.0; description.n_states() - 2 * description.n_coordinates()];
    dynamics.settle_drives(position, &mut states);
    Ok(states)
}

/// Evaluates memories of effects at every sample of a path of the joints, relaxed at the first. Samples are `time_step`
/// (s) apart; `position` is N x joints, m or rad, row by row.
pub fn memories(description: &Description, theta: &[f64], position: Table<'_>, time_step: f64) -> Result<Vec<f64>> {
    position.expect("position", position.rows(), description.n_joints())?;
    description.check_values(theta)?;
    let mut dynamics = Build::dynamics(&description, theta)?;
    let memories = &mut dynamics.memories;
    let mut values = vec![0.0; position.rows() * memories.len()];
    for (k, row) in values.chunks_exact_mut(memories.len().max(1)).enumerate() {
        if k > 0 {
            memories.travel(time_step, |joint| position.at(k, joint) - position.at(k - 1, joint));
        }
        row.copy_from_slice(memories.values());
    }
    Ok(values)
}

/// Evaluates natural frequencies in Hz with the joints locked at `position` (one per joint). They are about rest under
/// gravity, slowest first; negative for growth instead of vibration.
///
/// Checked: against the closed form of a clamped beam.
pub fn natural_frequencies(description: &Description, theta: &[f64], position: &[f64]) -> Result<Vec<f64>> {
    let mut statics = held(description, theta, position)?;
    let rest = statics.settle(position)?;
    statics.natural_frequencies(&rest)
}

/// Evaluates the largest slope of each beam's axis in rad for each state (N x states). It has a value where kinematics
/// are right for small slopes only, and is not a number where they are exact.
pub fn slopes(description: &Description, theta: &[f64], states: Table<'_>) -> Result<Vec<f64>> {
    states.expect("states", states.rows(), description.n_states())?;
    let dynamics = prepare(description, theta, [])?;
    let beams: Vec<_> = (0..dynamics.model.n_beams()).filter_map(|number| dynamics.model.beam(number)).collect();
    let rows = (0..states.rows()).map(|row| &states.numbers()[row * states.columns()..]);
    let slope = |state: &[f64]| -> Vec<f64> {
        let of_beam = beams.iter().map(|(beam, first)| beam.slope(&state[*first..first + beam.len()]));
        of_beam.map(|slope| slope.unwrap_or(f64::NAN)).collect()
    };
    Ok(rows.flat_map(slope).collect())
}

/// Jacobian of a marker, 6 x n row by row: angular velocity, then velocity of its origin, in world axes, per unit rate of each
/// coordinate.
pub fn marker_jacobian(description: &Description, theta: &[f64], position: &[f64], marker: usize) -> Result<Vec<f64>> {
    let count = description.markers.len();
    if marker >= count {
        let what = "the request for a Jacobian".to_owned();
        return Err(Error::Reference { what, target: "marker", index: marker, count });
    }
    let mut dynamics = prepare(description, theta, [("position", position)])?;
    let mut jacobian = vec![0.0; 6 * position.len()];
    dynamics.jacobian(position, marker, &mut jacobian);
    Ok(jacobian)
}

/// Poses of all markers along a motion of all coordinates (N x coordinates), row by row: of each marker its origin in the world (m), then
/// its axes there, row by row.
pub fn marker_poses(description: &Description, theta: &[f64], positions: Table<'_>) -> Result<Vec<f64>> {
    positions.expect("positions", positions.rows(), description.n_coordinates())?;
    let mut dynamics = prepare(description, theta, [])?;
    let width = 12 * description.markers.len();
    let mut values = vec![0.0; positions.rows() * width];
    for (k, row) in values.chunks_exact_mut(width.max(1)).enumerate() {
        dynamics.marker_poses(&positions.numbers()[k * positions.columns()..][..positions.columns()], row);
    }
    Ok(values)
}

/// Where the closed loops of a machine are at `position` and `velocity` of all coordinates.
pub fn loops(description: &Description, theta: &[f64], position: &[f64], velocity: &[f64]) -> Result<LoopState<f64>> {
    let mut dynamics = prepare(description, theta, [("position", position), ("velocity", velocity)])?;
    Ok(dynamics.loops_at(position, velocity))
}

fn held(description: &Description, theta: &[f64], position: &[f64]) -> Result<Statics> {
    Table::vector("position", position, description.n_joints(), "joint")?;
    description.check_values(theta)?;
    Statics::new(description, theta, &[], true)
}

fn prepare<const N: usize>(
    description: &Description,
    theta: &[f64],
    vectors: [(&str, &[f64]); N],
) -> Result<Dynamics<f64>> {
    for (name, vector) in vectors {
        Table::vector(name, vector, description.n_coordinates(), "coordinate")?;
    }
    description.check_values(theta)?;
    Build::dynamics(&description, theta)
}
