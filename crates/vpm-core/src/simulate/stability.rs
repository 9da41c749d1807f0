//! Whether the steps of an explicit method are short enough for the flexible links of a machine.

use super::Stepping;
use super::names::coordinate;
use crate::description::Description;
use crate::error::Result;
use crate::integrator::Method;
use crate::integrator::stability::{LinearSystem, check};
use crate::ode::Ode;
use crate::scalar::Scalar;
use crate::system::System;

/// Complains, with the mode and the largest stable step, if the flexible links cannot be stepped so from `state`.
///
/// Judged at the mass matrix of that state and the constant stiffness and damping of the beams; friction and springs of joints, whose
/// slopes change with the state, are left to the run itself.
pub(crate) fn check_step(description: &Description, theta: &[f64], stepping: Stepping, state: &[f64]) -> Result<()> {
    let explicit = matches!(stepping.method, Method::Rk4 | Method::SemiImplicit);
    if !explicit || description.n_elastic() == 0 {
        return Ok(());
    }
    let mut system: System<f64> = description.system(theta)?;
    let n = description.n_coordinates();
    let implicit = stepping.method == Method::SemiImplicit && system.elasticity(state, &mut vec![0.0; 2 * n * n]);
    if implicit || state.iter().any(|number| !number.is_finite()) {
        return Ok(());
    }
    let dynamics = system.dynamics();
    dynamics.terms(&state[..n], &vec![0.0; n]);
    let (mut stiffness, mut damping) = (vec![0.0; n * n], vec![0.0; n * n]);
    for beam in dynamics.model.beams() {
        let (first, len) = (beam.coordinate, beam.beam.len());
        for (whole, own) in [(&mut stiffness, beam.beam.stiffness()), (&mut damping, beam.beam.damping())] {
            for (row, entries) in own.chunks_exact(len.max(1)).enumerate() {
                let place = (first + row) * n + first;
                whole[place..place + len].iter_mut().zip(entries).for_each(|(entry, own)| *entry = own.re());
            }
        }
    }
    let names: Vec<String> = (0..n).map(|place| coordinate(description, place)).collect();
    let (mass, names) = (dynamics.data.mass_matrix(), &names);
    check(stepping.method, stepping.step(), &LinearSystem { mass, stiffness: &stiffness, damping: &damping, names })
}
