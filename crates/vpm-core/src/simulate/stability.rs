//! Whether the steps of a method that is explicit in part are short enough for the links, drives, contacts and bushings of a machine.

use super::Stepping;
use super::names::{coordinate, state_name};
use crate::description::Description;
use crate::error::Result;
use crate::integrator::growth::{Rates, check_rates, check_steps};
use crate::integrator::stability::{LinearSystem, check};
use crate::integrator::{Integrator, Method};
use crate::ode::Ode;
use crate::scalar::Dual;
use crate::sensitivity::LANES;
use crate::system::System;

/// Checks the stability of steps for links, drives, contacts and bushings from `state`. The error has the mode and the
/// largest stable step.
///
/// Judged with the drives where they stand in that state; what friction, end stops, opening valves and contacts that
/// are open add later is left to the run.
pub(crate) fn check_step(description: &Description, theta: &[f64], stepping: Stepping, state: &[f64]) -> Result<()> {
    if stepping.method.is_additive() {
        let what = "the split step of the integrators additive and crank_nicolson";
        description.refuse_loops(what, "use rosenbrock, or linearly_implicit")?;
        return check_additive(description, theta, stepping, state);
    }
    if stepping.method == Method::SemiImplicit && description.n_elastic() > 0 {
        let what = "the stiffness of flexible links that the integrator semi_implicit takes implicitly";
        description.refuse_loops(what, "use linearly_implicit, or rosenbrock")?;
    }
    if description.actuators.iter().all(|actuator| actuator.is_direct()) {
        return check_structure(description, theta, stepping, state, &[]);
    }
    let explicit = matches!(stepping.method, Method::Rk4 | Method::SemiImplicit);
    if !explicit || state.iter().any(|number| !number.is_finite()) {
        return Ok(());
    }
    let mut state = state.to_vec();
    let mut system: System<f64> = description.system_to_step_from(theta, &mut state)?;
    let (n, dim) = (description.n_coordinates(), description.n_states());
    let (mut jacobian, mut elastic, mut sizes) = (vec![0.0; dim * dim], vec![0.0; 2 * n * n], vec![0.0; dim]);
    system.without_friction(&state, &mut jacobian);
    system.scales(&mut sizes);
    let elasticity = system.elasticity(&state, &mut elastic).then_some(&*elastic);
    let names: Vec<String> = (0..dim).map(|place| state_name(description, place)).collect();
    let rates = Rates { jacobian: &jacobian, coordinates: n, elasticity, sizes: &sizes, names: &names };
    check_rates(stepping.method, stepping.step(), &rates)
}

/// Checks the stability of additive steps by the derivative of the step itself. Contacts, bushings and drives are
/// explicit in them. Else as [`check_step`].
fn check_additive(description: &Description, theta: &[f64], stepping: Stepping, state: &[f64]) -> Result<()> {
    let direct = description.actuators.iter().all(|actuator| actuator.is_direct());
    let free = description.contacts.is_empty() && description.bushings.is_empty();
    if direct && free || state.iter().any(|number| !number.is_finite()) {
        return Ok(());
    }
    let lifted: Vec<Dual<f64, LANES>> = theta.iter().map(|&value| Dual::constant(value)).collect();
    let mut start: Vec<_> = state.iter().map(|&value| Dual::constant(value)).collect();
    let mut duals: System<Dual<f64, LANES>> = description.system_to_step_from(&lifted, &mut start)?;
    let mut state = state.to_vec();
    let mut system: System<f64> = description.system_to_step_from(theta, &mut state)?;
    let dim = description.n_states();
    let (mut jacobian, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim]);
    system.jacobian(&state, &mut jacobian);
    system.scales(&mut sizes);
    let mut integrator = Integrator::new(stepping.method, dim);
    let states = if stepping.method == Method::CrankNicolson { 2 } else { 1 };
    let derivative = |step: f64| {
        let whole = states * dim;
        let mut matrix = vec![0.0; whole * whole];
        for first in (0..whole).step_by(LANES) {
            // A column before `first` wraps around to a lane that does not exist, which gives a constant.
            let seed = |(column, &value): (usize, &f64)| Dual::variable(value, column.wrapping_sub(first));
            let mut all: Vec<_> = state.iter().cycle().take(whole).enumerate().map(seed).collect();
            let (x, before) = all.split_at_mut(dim);
            integrator.reset();
            integrator.follow(before, x, step);
            integrator.step(&mut duals, x, step);
            for (row, x) in matrix.chunks_exact_mut(whole).zip(x) {
                row[first..].iter_mut().zip(&x.gradient).for_each(|(entry, &slope)| *entry = slope);
            }
        }
        // The state before is then the one where the step began.
        (dim..whole).for_each(|row| matrix[row * whole + row - dim] = 1.0);
        matrix
    };
    let names: Vec<String> = (0..dim).map(|place| state_name(description, place)).collect();
    let rates = Rates {
        jacobian: &jacobian,
        coordinates: description.n_coordinates(),
        elasticity: None,
        sizes: &sizes,
        names: &names,
    };
    check_steps(stepping.method, stepping.step(), &rates, derivative)
}

/// Checks the stability of steps for flexible links, contacts and bushings from `state`. The error has the mode and the
/// largest stable step. The joints `driven` follow a motion of their own.
///
/// Judged at the mass matrix of that state, the constant stiffness and damping of the beams, and those of contacts and bushings where
/// they are; friction and springs of joints, whose slopes change with the state, are left to the run itself, and so is a contact that is
/// open at the start.
pub(crate) fn check_structure(
    description: &Description,
    theta: &[f64],
    stepping: Stepping,
    state: &[f64],
    driven: &[usize],
) -> Result<()> {
    let explicit = matches!(stepping.method, Method::Rk4 | Method::SemiImplicit);
    let connected = !description.contacts.is_empty() || !description.bushings.is_empty();
    if !explicit || description.n_elastic() == 0 && !connected || state.iter().any(|number| !number.is_finite()) {
        return Ok(());
    }
    let mut state = state.to_vec();
    let mut system: System<f64> = description.system_to_step_from(theta, &mut state)?;
    let n = description.n_coordinates();
    let implicit = stepping.method == Method::SemiImplicit && system.elasticity(&state, &mut vec![0.0; 2 * n * n]);
    if implicit && !connected {
        return Ok(()); // beams are taken implicitly
    }
    let dynamics = system.dynamics();
    dynamics.terms(&state[..n], &state[n..2 * n]);
    let (mut stiffness, mut damping) = (vec![0.0; n * n], vec![0.0; n * n]);
    dynamics.add_slopes(&mut stiffness, &mut damping);
    for elastic in dynamics.model.beams().iter().filter(|_| !implicit) {
        let (first, len) = (elastic.coordinate, elastic.beam.len());
        for (whole, own) in [(&mut stiffness, elastic.beam.stiffness()), (&mut damping, elastic.beam.damping())] {
            for (row, entries) in own.chunks_exact(len.max(1)).enumerate() {
                let place = (first + row) * n + first;
                whole[place..place + len].iter_mut().zip(entries).for_each(|(sum, entry)| *sum += entry);
            }
        }
    }
    let free: Vec<usize> = (0..n).filter(|place| !driven.contains(place)).collect();
    let moving = |matrix: &[f64]| -> Vec<f64> {
        free.iter().flat_map(|row| free.iter().map(move |column| matrix[row * n + column])).collect()
    };
    let names: Vec<String> = free.iter().map(|&place| coordinate(description, place)).collect();
    let [mass, stiffness, damping] = [dynamics.data.mass_matrix(), &stiffness, &damping].map(moving);
    let system = LinearSystem { mass: &mass, stiffness: &stiffness, damping: &damping, names: &names };
    check(stepping.method, stepping.step(), &system)
}
