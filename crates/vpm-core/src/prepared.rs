//! A machine with fixed parameters and all its buffers, for many fast evaluations: what a controller asks at every sample.

use crate::data::Composite;
use crate::description::Description;
use crate::dynamics::{self, flexible, for_each_column, frames, poses};
use crate::error::{Error, Result};
use crate::spatial::Vector3;
use crate::system::{Build, Dynamics, add_effects};

/// The dynamics of a machine, ready to be evaluated again and again without allocation.
///
/// Every method takes one number per coordinate and complains about any other length; numbers that are not finite give results
/// that are not finite.
#[derive(Clone, Debug)]
pub struct Prepared {
    dynamics: Dynamics<f64>,
    required: Vec<f64>,
    /// What the effects carry on each joint.
    carried: Vec<f64>,
    jacobian: Vec<f64>,
}

impl Prepared {
    /// The machine with the parameters `theta`.
    pub fn new(description: &Description, theta: &[f64]) -> Result<Self> {
        description.check_values(theta)?;
        let dynamics = Build::dynamics(&description, theta)?;
        let (required, carried) = (vec![0.0; description.n_coordinates()], vec![0.0; description.n_joints()]);
        let jacobian = vec![0.0; 6 * required.len()];
        Ok(Self { dynamics, required, carried, jacobian })
    }

    /// Number of coordinates.
    #[inline]
    pub fn coordinates(&self) -> usize {
        self.required.len()
    }

    /// Efforts (N or N m) that the actuators have to put on the joints for accelerations `a` at coordinates `q` and rates `v`.
    ///
    /// Law: `M(q) a + h(q, v) - effects(q, v)`; frictions, springs, loads and payloads are carried as well. Inverse of
    /// [`Prepared::forward_dynamics`].
    #[inline]
    pub fn inverse_dynamics(&mut self, q: &[f64], v: &[f64], a: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q), ("velocity", v), ("acceleration", a)])?;
        let Self { dynamics: Dynamics { model, data, effects, .. }, required, carried, .. } = self;
        carried.fill(0.0);
        add_effects(effects, q, v, carried);
        if model.is_recursive() {
            required.copy_from_slice(dynamics::rnea(model, data, q, v, a));
        } else {
            flexible::terms(model, data, q, v);
            flexible::required(model, data, (q, v), a, required);
        }
        for (required, &carried) in required.iter_mut().zip(&*carried) {
            *required -= carried;
        }
        Ok(required)
    }

    /// Accelerations (m/s^2 or rad/s^2) of all coordinates that efforts `tau` (N or N m) of the actuators give, one per joint, with all
    /// effects.
    #[inline]
    pub fn forward_dynamics(&mut self, q: &[f64], v: &[f64], tau: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q), ("velocity", v)])?;
        if tau.len() != self.carried.len() {
            return Err(wrong_length("effort", "joint", self.carried.len(), tau.len()));
        }
        Ok(self.dynamics.accelerations(q, v, tau))
    }

    /// Mass matrix with payloads, n x n (kg, kg m or kg m^2), symmetric.
    #[inline]
    pub fn mass_matrix(&mut self, q: &[f64]) -> Result<&[f64]> {
        self.expect([("position", q)])?;
        let Self { dynamics: Dynamics { model, data, .. }, required, .. } = self;
        if model.is_recursive() {
            return Ok(dynamics::crba(model, data, q));
        }
        required.fill(0.0);
        flexible::terms(model, data, q, required);
        Ok(data.mass_matrix())
    }

    /// Jacobian of marker `number`, 6 x n row by row: angular velocity and velocity of its origin per unit rate of each coordinate, in
    /// world axes.
    pub fn jacobian(&mut self, q: &[f64], number: usize) -> Result<&[f64]> {
        self.expect([("position", q)])?;
        let Self { dynamics: Dynamics { model, data, .. }, required, jacobian, .. } = self;
        let Some(place) = model.markers().get(number) else {
            let (what, count) = ("the Jacobian".to_owned(), model.markers().len());
            return Err(Error::Reference { what, target: "marker", index: number, count });
        };
        required.fill(0.0);
        frames(model, data, q, required);
        poses(model, data);
        let Composite { frames, sections, .. } = &data.composite;
        let origin = frames[place.frame].pose.point(Vector3::from_f64(place.pose.translation.to_array()));
        let n = q.len();
        jacobian.fill(0.0);
        for_each_column(model, frames, sections, place.frame, |coordinate, column| {
            let moved = column.linear + column.angular.cross(origin);
            let entries = column.angular.to_array().into_iter().chain(moved.to_array());
            for (row, entry) in entries.enumerate() {
                jacobian[row * n + coordinate] = entry;
            }
        });
        Ok(jacobian)
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
                return Err(wrong_length(name, "coordinate", self.coordinates(), vector.len()));
            }
        }
        Ok(())
    }
}

#[cold]
fn wrong_length(name: &str, each: &str, expected: usize, found: usize) -> Error {
    Error::Dimension { what: name.to_owned(), expected, found, each: each.to_owned() }
}
