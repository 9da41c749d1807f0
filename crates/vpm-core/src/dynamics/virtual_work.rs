//! Equations of motion by virtual work over the Jacobians of single bodies, for trees and closed linkages alike.

use std::array::from_fn;

use crate::scalar::{Dual, Scalar};
use crate::spatial::{Symmetric3, Twist, Vector3, Wrench};

/// A number with its time derivative.
pub type Rate<S> = Dual<S, 1>;

/// A body whose motion is a linear function of the rates of `B` (dependent) coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Carried<S, const B: usize> {
    /// Mass in kg.
    pub mass: S,
    /// Rotational inertia about the centre of mass, in world axes, in kg m^2.
    pub inertia: Symmetric3<S>,
    /// Column b: angular velocity and velocity of the centre of mass per unit rate of coordinate b, in world axes, each
    /// entry with its time derivative along the motion.
    pub jacobian: [Twist<Rate<S>>; B],
}

/// The terms of `tau = M a + V + G`, for `N` independent coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms<S, const N: usize> {
    /// M(q), positive definite, in kg, kg m or kg m^2.
    pub mass_matrix: [[S; N]; N],
    /// V(q, v): Coriolis and centrifugal efforts.
    pub velocity: [S; N],
    /// G(q): efforts that carry the weight, the gradient of the potential energy.
    pub gravity: [S; N],
}

impl<S: Scalar, const N: usize> Terms<S, N> {
    /// Efforts `M a` that accelerate, by virtual work.
    pub fn inertia(&self, a: &[S; N]) -> [S; N] {
        from_fn(|i| (0..N).map(|j| self.mass_matrix[i][j] * a[j]).sum())
    }

    /// Efforts `M a + V + G` for accelerations `a`, by virtual work. Source: D'Imperio 2016, eq 2.104, with all signs
    /// as written here.
    pub fn effort(&self, a: &[S; N]) -> [S; N] {
        let inertia = self.inertia(a);
        from_fn(|i| inertia[i] + self.velocity[i] + self.gravity[i])
    }
}

/// Terms of the equation of motion by virtual work, summed over bodies.
///
/// Law: with `K = J Psi` the Jacobian for the independent rates `v`, `M = sum K^T m K`,
/// `V = sum K^T (m K_dot + gamma K) v`, `G = -sum K^T (0; m g)`, `m = diag(I, m 1)`, `gamma = diag([w]x I, 0)`, and
/// `K_dot = J_dot Psi + J Psi_dot`. `psi[b]` is the gradient of coordinate b, with its time derivative.
/// Source: D'Imperio 2016, "Modelling and simulation techniques for advanced robotic systems", eqs 2.98 to 2.107, whose
/// M, V and G have the opposite signs. Allocates nothing.
/// Checked: against the recursive algorithms on trees in space, also with dependent coordinates; on a closed linkage
/// against Lagrange's equations and the balances of every body.
pub fn virtual_work<S: Scalar, const B: usize, const N: usize>(
    bodies: &[Carried<S, B>],
    psi: &[[Rate<S>; N]; B],
    v: &[S; N],
    gravity: [f64; 3],
) -> Terms<S, N> {
    let zero = [S::zero(); N];
    let mut terms = Terms { mass_matrix: [zero; N], velocity: zero, gravity: zero };
    let gravity = Vector3::from_f64(gravity);
    for body in bodies {
        let columns: [(Twist<S>, Twist<S>); N] = from_fn(|n| split(&independent(&body.jacobian, psi, n)));
        let sum = |part: &dyn Fn(usize) -> Twist<S>| (0..N).fold(Twist::zero(), |sum, n| sum + part(n) * v[n]);
        let (motion, bias) = (sum(&|n| columns[n].0), sum(&|n| columns[n].1));
        let momentum = |twist: Twist<S>| Wrench::new(body.inertia * twist.angular, twist.linear * body.mass);
        let spin = motion.angular.cross(body.inertia * motion.angular);
        let bias_wrench = momentum(bias) + Wrench::new(spin, Vector3::zero());
        let weight = Wrench::new(Vector3::zero(), gravity * body.mass);
        for (i, (column, _)) in columns.iter().enumerate() {
            for (entry, (other, _)) in terms.mass_matrix[i].iter_mut().zip(&columns) {
                *entry += column.power(momentum(*other));
            }
            terms.velocity[i] += column.power(bias_wrench);
            terms.gravity[i] -= column.power(weight);
        }
    }
    terms
}

/// Virtual work of a wrench `(moment, force)` on a body: efforts `Psi^T J^T w` of independent coordinates.
///
/// Source: D'Imperio 2016, eq 2.108, with the wrench in the order of all others. On the side of `tau` in the equation
/// of motion.
pub fn effort_of_wrench<S: Scalar, const B: usize, const N: usize>(
    jacobian: &[Twist<Rate<S>>; B],
    psi: &[[Rate<S>; N]; B],
    wrench: Wrench<S>,
) -> [S; N] {
    from_fn(|n| split(&independent(jacobian, psi, n)).0.power(wrench))
}

/// Column n of `J Psi` for virtual work.
fn independent<S: Scalar, const B: usize, const N: usize>(
    jacobian: &[Twist<Rate<S>>; B],
    psi: &[[Rate<S>; N]; B],
    n: usize,
) -> Twist<Rate<S>> {
    jacobian.iter().zip(psi).fold(Twist::zero(), |sum, (column, row)| sum + *column * row[n])
}

/// Twist and its time derivative for virtual work.
fn split<S: Scalar>(twist: &Twist<Rate<S>>) -> (Twist<S>, Twist<S>) {
    let part = |pick: fn(Rate<S>) -> S| {
        let [a, b] = [twist.angular, twist.linear].map(|v| Vector3::new(pick(v.x), pick(v.y), pick(v.z)));
        Twist::new(a, b)
    };
    (part(|number| number.value), part(|number| number.gradient[0]))
}
