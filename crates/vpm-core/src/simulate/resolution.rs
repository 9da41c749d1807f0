//! Which vibrations of a machine its steps do not resolve, and which dry friction.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::names::site;
use super::{Stepping, check_state};
use crate::description::{Description, EffectEntry};
use crate::error::Result;
use crate::integrator::Method;
use crate::integrator::resolution::{Resolution, Steps, sticks};
use crate::ode::Ode;
use crate::system::System;

/// Dry friction that steps do not resolve.
#[derive(Clone, Debug, PartialEq)]
pub struct Unstuck {
    /// Where it acts, in words.
    pub site: String,
    /// Its slope at rest, times the step, over the inertia that it moves.
    pub turn: f64,
}

/// What these steps make of the machine's vibrations about `state` in a run of `duration` (s).
///
/// Linear damping counts, dry friction does not: it stops at a part of what vibrates.
pub fn resolution(
    description: &Description,
    theta: &[f64],
    state: &[f64],
    stepping: Stepping,
    duration: f64,
) -> Result<Resolution> {
    check_state("state", description, state)?;
    let mut state = state.to_vec();
    let mut system: System<f64> = description.stepped_from(theta, &mut state)?;
    let dim = description.n_states();
    let (mut jacobian, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim]);
    system.without_dry_friction(&state, &mut jacobian);
    system.scales(&mut sizes);
    let (method, step) = (stepping.method, stepping.step());
    let implicit = method == Method::Additive || description.n_elastic() > 0;
    Resolution::new(&jacobian, &sizes, Steps { method, step, duration, implicit })
}

/// Where dry friction of joints and shafts does not bring what it brakes to rest in these steps, with the machine in `state`.
///
/// Law: [`sticks`], with the resistance at rest less that of fast motion, and the inertia `1 / (s^T M^-1 s)` that moves along the
/// coordinate `s^T q` of the friction. Friction of drives and seals, and friction that remembers, do not count.
pub fn unstuck(description: &Description, theta: &[f64], state: &[f64], stepping: Stepping) -> Result<Vec<Unstuck>> {
    check_state("state", description, state)?;
    let mut system: System<f64> = description.system(theta)?;
    let (n, joints) = (description.n_coordinates(), description.n_joints());
    let dynamics = system.dynamics();
    // What follows the load asks for the efforts there.
    dynamics.rhs(state, &mut vec![0.0; state.len()]);
    let mass = DMatrix::from_row_slice(n, n, dynamics.mass_matrix(&state[..n]));
    let Some(factors) = Cholesky::new(mass) else { return Ok(Vec::new()) };
    let seats = description.effects.iter().filter(|entry| matches!(entry, EffectEntry::Joint { .. }));
    let mut found: Vec<Unstuck> = Vec::new();
    for (seat, (place, slope)) in seats.filter_map(EffectEntry::seat).zip(dynamics.dry_slopes(&state[..n])) {
        let mut along = DVector::zeros(n);
        place.push(&mut along.as_mut_slice()[..joints], 1.0);
        let (site, turn) = (site(description, seat), slope * stepping.step() * along.dot(&factors.solve(&along)));
        match found.iter_mut().find(|other| other.site == site) {
            Some(other) => other.turn += turn,
            None => found.push(Unstuck { site, turn }),
        }
    }
    found.retain(|friction| !sticks(stepping.method, friction.turn));
    Ok(found)
}
