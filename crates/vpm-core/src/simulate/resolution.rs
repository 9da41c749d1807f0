//! Which vibrations of a machine its steps damp.

use super::{Stepping, check_state};
use crate::description::Description;
use crate::error::Result;
use crate::integrator::Method;
use crate::integrator::resolution::{Resolution, Steps};
use crate::ode::Ode;
use crate::system::System;

/// What these steps damp of the machine's vibrations about `state` in a run of `duration` (s).
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
