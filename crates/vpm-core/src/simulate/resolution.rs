//! Which vibrations of a machine its steps do not resolve, and which dry friction.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::names::site;
use super::{Stepping, check_state};
use crate::description::{Description, EffectEntry};
use crate::error::Result;
use crate::integrator::resolution::{Resolution, Steps, Taken, bends, sticks};
use crate::ode::Ode;
use crate::system::System;
use crate::table::Table;

/// Dry friction that steps do not resolve.
#[derive(Clone, Debug, PartialEq)]
pub struct Unstuck {
    /// Where it acts, in words.
    pub site: String,
    /// Its slope at rest, times the step, over the inertia that it moves; of what bends before it slides its stiffness, times the square of
    /// the step.
    pub turn: f64,
}

/// Dry friction of a place as steps meet it: see [`sticks`] and [`bends`].
#[derive(Default)]
struct Met {
    slope: f64,
    stiffness: f64,
    damping: f64,
    taken: Taken,
}

/// Resolution of the machine's vibrations by these steps about `state` in a run of `duration` (s).
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
    let mut system: System<f64> = description.system_to_step_from(theta, &mut state)?;
    let dim = description.n_states();
    let (mut jacobian, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim]);
    system.without_dry_friction(&state, &mut jacobian);
    system.scales(&mut sizes);
    let (method, step) = (stepping.method, stepping.step());
    let implicit = method.is_additive() || description.n_elastic() > 0;
    Resolution::new(&jacobian, &sizes, Steps { method, step, duration, implicit })
}

/// Dry friction that steps do not resolve: it never brings what it brakes to rest. The machine is at rest where `state`
/// is, under `commands`.
///
/// Law: [`sticks`] and [`bends`], with the resistance at rest less that of fast motion and the stiffness of what remembers, and the inertia
/// `1 / (s^T M^-1 s)` that moves along the coordinate `s^T q` of the friction: all of them are entries of the derivative of the rates by the
/// state. Friction that follows the load has that of its drive there; drives in sampled time have none.
pub fn unstuck(
    description: &Description,
    theta: &[f64],
    state: &[f64],
    commands: &[f64],
    stepping: Stepping,
) -> Result<Vec<Unstuck>> {
    check_state("state", description, state)?;
    Table::vector("commands", commands, description.n_inputs(), "actuator and logged supply")?;
    let mut system: System<f64> = description.system(theta)?;
    for (number, &command) in commands.iter().enumerate() {
        let sampled = description.actuators.get(number).is_some_and(|actuator| actuator.drive.is_sampled());
        let held = system.input(number, 0, stepping.time_step, |_| command);
        system.hold(number, if sampled { 0.0 } else { held });
    }
    let (n, mut rest) = (description.n_coordinates(), state.to_vec());
    rest[n..2 * n].fill(0.0);
    let dynamics = system.dynamics();
    dynamics.rhs(&rest, &mut vec![0.0; rest.len()]);
    let rubbing = dynamics.rubbing(&rest[..n]);
    let mass = DMatrix::from_row_slice(n, n, dynamics.mass_matrix(&rest[..n]));
    let Some(factors) = Cholesky::new(mass) else { return Ok(Vec::new()) };
    let (step, mut found): (f64, Vec<(String, Met)>) = (stepping.step(), Vec::new());
    for (site, friction) in rubbing_sites(description).zip(rubbing) {
        let along = DVector::from_vec(friction.along);
        let reach = step * along.dot(&factors.solve(&along));
        let place = found.iter().position(|(other, _)| *other == site).unwrap_or(found.len());
        if place == found.len() {
            found.push((site, Met::default()));
        }
        let met = &mut found[place].1;
        met.slope += friction.slope * reach;
        met.stiffness += friction.stiffness * reach * step;
        met.damping += friction.damping * reach;
        met.taken = friction.taken;
    }
    let method = stepping.method;
    let rests = |met: &Met| sticks(method, met.slope, met.taken) && bends(method, [met.stiffness, met.damping]);
    let left = found.into_iter().filter(|(_, met)| !rests(met));
    Ok(left.map(|(site, met)| Unstuck { site, turn: met.slope + met.stiffness }).collect())
}

/// Sites of all friction whose resolution is checked, in the order of [`crate::system::Dynamics::rubbing`].
fn rubbing_sites(description: &Description) -> impl Iterator<Item = String> {
    let effects = description.effects.iter().filter(|entry| matches!(entry, EffectEntry::Joint { .. }));
    let seats = effects.filter_map(EffectEntry::seat).chain(description.remembering());
    let actuators = description.actuators.iter().map(|actuator| format!("actuator `{}`", actuator.name));
    seats.map(|seat| site(description, seat)).chain(actuators)
}
