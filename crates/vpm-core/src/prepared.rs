//! A machine with fixed parameters and all its buffers, for many fast evaluations: what a controller asks at every sample.

use crate::description::Description;
use crate::dynamics;
use crate::error::{Error, Result};
use crate::system::{Build, Dynamics, add_effects};

/// The dynamics of a machine, ready to be evaluated again and again without allocation.
///
/// Every method takes one number per coordinate and complains about any other length; numbers that are not finite give results
/// that are not finite.
#[derive(Clone, Debug)]
pub struct Prepared {
    dynamics: Dynamics<f64>,
    effects: Vec<f64>,
}

impl Prepared {
    /// The machine with the parameters `theta`.
    pub fn new(description: &Description, theta: &[f64]) -> Result<Self> {
        description.check_values(theta)?;
        let dynamics = Build::dynamics(&description, theta)?;
        Ok(Self { dynamics, effects: vec![0.0; description.n_coordinates()] })
    }

    /// Number of coordinates.
    #[inline]
    pub fn coordinates(&self) -> usize {
        self.effects.len()
    }

    /// Efforts (N or N m) that the actuators have to put on the joints for accelerations `a` at coordinates `q` and rates `v`.
    ///
    /// Law: `M(q) a + h(q, v) - effects(q, v)`; frictions, springs, loads and payloads are carried as well. Inverse of
    /// [`Prepared::forward_dynamics`].
    #[inline]
    pub fn inverse_dynamics(&mut self, q: &[f64], v: &[f64], a: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q), ("velocity", v), ("acceleration", a)])?;
        let Self { dynamics: Dynamics { model, data, effects, .. }, effects: required } = self;
        required.fill(0.0);
        add_effects(effects, q, v, required);
        for (required, &rigid) in required.iter_mut().zip(dynamics::rnea(model, data, q, v, a)) {
            *required = rigid - *required;
        }
        Ok(required)
    }

    /// Accelerations (m/s^2 or rad/s^2) that efforts `tau` (N or N m) of the actuators on the joints give, with all effects.
    #[inline]
    pub fn forward_dynamics(&mut self, q: &[f64], v: &[f64], tau: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q), ("velocity", v), ("effort", tau)])?;
        Ok(self.dynamics.accelerations(q, v, tau))
    }

    /// Mass matrix with payloads, n x n (kg, kg m or kg m^2), symmetric.
    #[inline]
    pub fn mass_matrix(&mut self, q: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q)])?;
        Ok(dynamics::crba(&self.dynamics.model, &mut self.dynamics.data, q))
    }

    /// Kinetic and potential energy in J: of bodies in gravity, and of the effects that have a potential.
    ///
    /// Checked: with efforts of the actuators and frictions accounted for, the sum is conserved along a simulated run.
    #[inline]
    pub fn energy(&mut self, q: &[f64], v: &[f64]) -> Result<(f64, f64)> {
        self.expect([("position", q), ("velocity", v)])?;
        let Dynamics { model, data, effects, .. } = &mut self.dynamics;
        let total = dynamics::energy(model, data, q, v);
        let stored: f64 = effects.iter().map(|(joint, effect)| effect.potential(q[*joint])).sum();
        Ok((total.kinetic, total.potential + stored))
    }

    #[inline]
    fn expect<const N: usize>(&self, vectors: [(&str, &[f64]); N]) -> Result<()> {
        for (name, vector) in vectors {
            if vector.len() != self.coordinates() {
                return Err(wrong_length(name, self.coordinates(), vector.len()));
            }
        }
        Ok(())
    }
}

#[cold]
fn wrong_length(name: &str, expected: usize, found: usize) -> Error {
    Error::Dimension { what: name.to_owned(), expected, found, each: "coordinate".to_owned() }
}
