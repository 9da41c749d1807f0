//! A Rosenbrock method for mechanisms whose stiff forces are linear.

use super::cholesky::Cholesky;
use super::dynamics::Motion;
use crate::scalar::Scalar;

/// A mechanism `M(x) a = force(x, v, t)` whose stiff forces are linear.
pub trait Mechanism<S, const ALL: usize> {
    /// Mass matrix (lower triangle) and total force at time `t` (s), of which the linear part is that at `linear`.
    fn evaluate(&mut self, motion: &Motion<S, ALL>, linear: &Motion<S, ALL>, t: f64) -> ([[S; ALL]; ALL], [S; ALL]);
}

/// The diagonal coefficient: 1 - 1/sqrt(2), which makes the method L-stable.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// Second order and L-stable in fixed steps, on second-order equations: what has to be factorised is symmetric and half the size.
///
/// Law (ROS2): `(1 - g h A) k1 = f(y)`, `(1 - g h A) k2 = f(y + h k1) - 2 k1`, `y+ = y + 3/2 h k1 + 1/2 h k2` with
/// `A = [0, 1; -M^-1 K, -M^-1 D]`. The order is 2 whatever A is, so leaving the derivatives of M and of the velocity terms out of it
/// costs stability only where those are stiff. Eliminating the coordinates leaves `M + g h D + (g h)^2 K`.
/// Source: Verwer, Spee, Blom & Hundsdorfer 1999, SIAM J. Sci. Comput. 20(4), equation 3.3. Checked: order 2, against a converged
/// reference and against an explicit method.
#[derive(Clone, Debug)]
pub struct Rosenbrock<const ALL: usize> {
    step: f64,
    /// `g h K`.
    stiffness: [[f64; ALL]; ALL],
    /// `g h D + (g h)^2 K`.
    shift: [[f64; ALL]; ALL],
}

impl<const ALL: usize> Rosenbrock<ALL> {
    /// The method for a mechanism with the stiff forces `-K x - D v`, in steps of `step` (s).
    pub fn new([stiffness, damping]: [[[f64; ALL]; ALL]; 2], step: f64) -> Self {
        let reach = GAMMA * step;
        let shift =
            std::array::from_fn(|i| std::array::from_fn(|j| reach * damping[i][j] + reach * reach * stiffness[i][j]));
        Self { step, stiffness: stiffness.map(|row| row.map(|entry| entry * reach)), shift }
    }

    /// Moves the state on by one step from time `t` (s).
    pub fn step<S: Scalar>(&self, mechanism: &mut impl Mechanism<S, ALL>, motion: &mut Motion<S, ALL>, t: f64) {
        let h = self.step;
        let (mass, force) = mechanism.evaluate(motion, motion, t);
        let mut shifted = mass;
        for (row, extra) in shifted.iter_mut().zip(&self.shift) {
            for (entry, &extra) in row.iter_mut().zip(extra) {
                *entry = *entry + extra;
            }
        }
        let left = Cholesky::new(&shifted);
        let (x1, v1) = self.stage(&left, &motion.velocity, force);
        let next = Motion { position: ahead(&motion.position, &x1, h), velocity: ahead(&motion.velocity, &v1, h) };
        let (next_mass, force) = mechanism.evaluate(&next, &next, t + h);
        let mut rest = Cholesky::new(&next_mass).solve(&force);
        for (rest, &v1) in rest.iter_mut().zip(&v1) {
            *rest -= v1 * 2.0;
        }
        let (x2, v2) = self.stage(&left, &ahead(&next.velocity, &x1, -2.0), symmetric_product(&mass, &rest));
        for k in 0..ALL {
            motion.position[k] += (x1[k] * 3.0 + x2[k]) * (0.5 * h);
            motion.velocity[k] += (v1[k] * 3.0 + v2[k]) * (0.5 * h);
        }
    }

    /// Solves `(1 - g h A) k = (rate, M^-1 force)`.
    #[inline]
    fn stage<S: Scalar>(&self, left: &Cholesky<S, ALL>, rate: &[S; ALL], mut force: [S; ALL]) -> ([S; ALL], [S; ALL]) {
        for (force, row) in force.iter_mut().zip(&self.stiffness) {
            for (&rate, &entry) in rate.iter().zip(row) {
                *force -= rate * entry;
            }
        }
        let velocity = left.solve(&force);
        (ahead(rate, &velocity, GAMMA * self.step), velocity)
    }
}

#[inline]
fn ahead<S: Scalar, const ALL: usize>(from: &[S; ALL], along: &[S; ALL], by: f64) -> [S; ALL] {
    std::array::from_fn(|k| from[k] + along[k] * by)
}

/// `A x`, reading the lower triangle.
#[inline]
fn symmetric_product<S: Scalar, const ALL: usize>(matrix: &[[S; ALL]; ALL], x: &[S; ALL]) -> [S; ALL] {
    let mut product = [S::zero(); ALL];
    for i in 0..ALL {
        for j in 0..i {
            product[i] += matrix[i][j] * x[j];
            product[j] += matrix[i][j] * x[i];
        }
        product[i] += matrix[i][i] * x[i];
    }
    product
}
