//! Second derivation: Lagrange's equations of the energies.

use super::Leg;
use vpm_core::dynamics::Terms;
use vpm_core::scalar::{Dual, Scalar};
use vpm_core::spatial::Vector2;

/// A number with its first and second derivatives by (q1, q2, v1, v2).
type Second = Dual<Dual<f64, 4>, 4>;

impl Leg {
    /// Lagrange terms M (kg m^2), V and G (N m) of the leg at `q` (rad) and `v` (rad/s), from energies alone.
    ///
    /// Law: `M = d^2T/dv^2`, `V = (d^2T/dv dq) v - dT/dq`, `G = dU/dq`, exact by nested dual numbers. Source: eqs 2.54
    /// to 2.60, with `U = -sum m g . r` (2.56 corrected).
    pub fn lagrange(&self, q: [f64; 2], v: [f64; 2]) -> Terms<f64, 2> {
        let lift = |value: f64, lane: usize| Second::variable(Dual::variable(value, lane), lane);
        let (angles, rates) = ([lift(q[0], 0), lift(q[1], 1)], [lift(v[0], 2), lift(v[1], 3)]);
        let (kinetic, potential) = (self.kinetic_energy(angles, rates), self.potential_energy(angles));
        let mixed = |i: usize, j: usize| kinetic.gradient[i].gradient[j];
        Terms {
            mass_matrix: std::array::from_fn(|i| std::array::from_fn(|j| mixed(2 + i, 2 + j))),
            velocity: std::array::from_fn(|i| {
                (0..2).map(|j| mixed(2 + i, j) * v[j]).sum::<f64>() - kinetic.gradient[i].value
            }),
            gravity: std::array::from_fn(|i| potential.gradient[i].value),
        }
    }

    /// Kinetic energy of the leg in J for Lagrange: `1/2 sum (m |c_dot|^2 + I w^2)`. Rates of places come by dual
    /// numbers along `v`. Source: eq 2.55.
    pub fn kinetic_energy<S: Scalar>(&self, q: [S; 2], v: [S; 2]) -> S {
        let moving: [Dual<S, 1>; 2] = std::array::from_fn(|k| Dual { value: q[k], gradient: [v[k]] });
        let energy = |(place, (mass, inertia)): (super::Place<Dual<S, 1>>, (f64, f64))| {
            let ((_, velocity), (axis, turning)) = (split(place.center), split(place.axis));
            let spin = axis.cross(turning);
            velocity.dot(velocity) * (0.5 * mass) + spin * spin * (0.5 * inertia)
        };
        self.places(moving).into_iter().zip(self.masses()).map(energy).sum()
    }

    /// Potential energy of the leg in J for Lagrange, `sum m g y`. It is zero with all centres of mass at the height of
    /// the foot.
    pub fn potential_energy<S: Scalar>(&self, q: [S; 2]) -> S {
        let weights = self.masses().map(|(mass, _)| mass * self.parameters.gravity);
        self.places(q).into_iter().zip(weights).map(|(place, weight)| place.center.y * weight).sum()
    }
}

/// Vector and its time derivative for Lagrange's equations.
fn split<S: Scalar>(vector: Vector2<Dual<S, 1>>) -> (Vector2<S>, Vector2<S>) {
    (Vector2::new(vector.x.value, vector.y.value), Vector2::new(vector.x.gradient[0], vector.y.gradient[0]))
}
