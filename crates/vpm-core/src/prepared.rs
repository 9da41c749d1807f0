//! A machine with fixed parameters and all its buffers, for many fast evaluations: what a controller asks at every sample.

use crate::ball::check_angles;
use crate::description::Description;
use crate::error::{Error, Result};
use crate::system::{Build, Dynamics};

/// The dynamics of a machine, ready to be evaluated again and again without allocation.
///
/// Every method takes one finite number per coordinate and complains about anything else.
#[derive(Clone, Debug)]
pub struct Prepared {
    dynamics: Dynamics<f64>,
    efforts: Vec<f64>,
    jacobian: Vec<f64>,
}

impl Prepared {
    /// Prepared machine with the parameters `theta`.
    pub fn new(description: &Description, theta: &[f64]) -> Result<Self> {
        description.check_values(theta)?;
        let n = description.n_coordinates();
        let dynamics = Build::dynamics(&description, theta)?;
        Ok(Self { dynamics, efforts: vec![0.0; n], jacobian: vec![0.0; 6 * n] })
    }

    /// Number of coordinates of a prepared machine.
    #[inline]
    pub fn coordinates(&self) -> usize {
        self.efforts.len()
    }

    /// Inverse dynamics of a prepared machine: efforts (N or N m) for accelerations `a` at `q` and `v`. They are on all
    /// coordinates, those of the effects taken off.
    ///
    /// Law: `M(q) a + h(q, v) + K q + D v - effects(q, v)`; frictions, springs, loads and payloads are carried as well. Inverse of
    /// [`Prepared::forward_dynamics`].
    #[inline]
    pub fn inverse_dynamics(&mut self, q: &[f64], v: &[f64], a: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q), ("velocity", v), ("acceleration", a)])?;
        self.dynamics.inverse_dynamics(q, v, a, &mut self.efforts);
        sound("effort", &self.efforts)
    }

    /// Forward dynamics of a prepared machine: accelerations (m/s^2 or rad/s^2) by efforts `tau` (N or N m). On all
    /// coordinates, with all effects.
    #[inline]
    pub fn forward_dynamics(&mut self, q: &[f64], v: &[f64], tau: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q), ("velocity", v), ("effort", tau)])?;
        check_angles(&self.dynamics.balls, q)?;
        sound("acceleration", self.dynamics.forward_dynamics(q, v, tau))
    }

    /// Mass matrix of a prepared machine with payloads, n x n (kg, kg m or kg m^2), symmetric.
    #[inline]
    pub fn mass_matrix(&mut self, q: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q)])?;
        sound("mass_matrix", self.dynamics.mass_matrix(q))
    }

    /// Kinetic and potential energy of a prepared machine in J. The potential is that of gravity, of the beams, and of
    /// the effects that have one.
    #[inline]
    pub fn energy(&mut self, q: &[f64], v: &[f64]) -> Result<(f64, f64)> {
        self.expect([("position", q), ("velocity", v)])?;
        let total = self.dynamics.energy(q, v);
        sound("energy", &[total.kinetic, total.potential])?;
        Ok((total.kinetic, total.potential))
    }

    /// Jacobian of marker `number` of a prepared machine, 6 x n row by row. Angular velocity and velocity of its origin
    /// per unit rate of each coordinate, in world axes.
    #[inline]
    pub fn jacobian(&mut self, q: &[f64], number: usize) -> Result<&[f64]> {
        self.expect([("position", q)])?;
        let count = self.dynamics.layout().markers;
        if number >= count {
            let what = "the request for a Jacobian".to_owned();
            return Err(Error::Reference { what, target: "marker", index: number, count });
        }
        self.dynamics.jacobian(q, number, &mut self.jacobian);
        sound("jacobian", &self.jacobian)
    }

    #[inline]
    fn expect<const N: usize>(&self, vectors: [(&str, &[f64]); N]) -> Result<()> {
        for (name, vector) in vectors {
            if vector.len() != self.coordinates() {
                return Err(wrong_length(name, self.coordinates(), vector.len()));
            }
            if let Some(place) = vector.iter().position(|number| !number.is_finite()) {
                return Err(not_finite(name, place, vector[place]));
            }
        }
        Ok(())
    }
}

/// Result of a prepared machine, unless finite numbers far beyond any machine have made an infinite one.
#[inline]
fn sound<'a>(name: &str, result: &'a [f64]) -> Result<&'a [f64]> {
    match result.iter().position(|number| !number.is_finite()) {
        Some(place) => Err(unsound(name, place, result[place])),
        None => Ok(result),
    }
}

#[cold]
fn unsound(name: &str, place: usize, value: f64) -> Error {
    Error::NonFinite { path: format!("{name}[{place}] at this state"), value }
}

#[cold]
fn not_finite(name: &str, place: usize, value: f64) -> Error {
    Error::NonFinite { path: format!("{name}[{place}]"), value }
}

#[cold]
fn wrong_length(name: &str, expected: usize, found: usize) -> Error {
    Error::Dimension { what: name.to_owned(), expected, found, each: "coordinate".to_owned() }
}
