//! An additive Runge-Kutta method for mechanisms whose stiff forces are linear.

use super::cholesky::Cholesky;
use super::dynamics::Motion;
use super::rosenbrock::Mechanism;
use crate::integrator::additive::{EXPLICIT, GAMMA, IMPLICIT, PLACES, STAGES};
use crate::scalar::Scalar;

/// Fourth order in fixed steps on second-order equations; L-stable for the linear forces, explicit in all others.
///
/// Law (ARK4(3)6L\[2\]SA, used semi-implicitly): `M(x_E) a = force(x_E, v_E) - K x_I - D v_I` in six stages, where the
/// explicit table makes `(x_E, v_E)` and the implicit one `(x_I, v_I)`, whose own derivative counts by 1/4 of the step. Both
/// tables have the same weights, so the order is that of the additive method whichever argument stands where. Each stage
/// factorises `M + h/4 D + (h/4)^2 K` once. Where a fast component follows a slow motion the order may fall to 2, that of the stages.
/// Source: Kennedy & Carpenter 2003, Appl. Numer. Math. 44, for the tables; Boscarino, Filbet & Russo 2016, J. Sci. Comput. 68, for
/// the semi-implicit use. Checked: order 4 with and without servos, and errors against converged motions.
#[derive(Clone, Debug)]
pub struct Additive<const ALL: usize> {
    step: f64,
    /// `h/4 D + (h/4)^2 K`.
    shift: [[f64; ALL]; ALL],
}

impl<const ALL: usize> Additive<ALL> {
    /// The method for a mechanism with the stiff forces `-K x - D v`, in steps of `step` (s).
    pub fn new([stiffness, damping]: [[[f64; ALL]; ALL]; 2], step: f64) -> Self {
        let reach = GAMMA * step;
        let shift =
            std::array::from_fn(|i| std::array::from_fn(|j| reach * damping[i][j] + reach * reach * stiffness[i][j]));
        Self { step, shift }
    }

    /// Moves the state on by one step from time `t` (s).
    pub fn step<S: Scalar>(&self, mechanism: &mut impl Mechanism<S, ALL>, motion: &mut Motion<S, ALL>, t: f64) {
        let h = self.step;
        let (mass, force) = mechanism.evaluate(motion, motion, t);
        let mut slopes = [Motion { position: [S::zero(); ALL], velocity: [S::zero(); ALL] }; STAGES];
        slopes[0] = Motion { position: motion.velocity, velocity: Cholesky::new(&mass).solve(&force) };
        for stage in 1..STAGES {
            let (known, rest) = slopes.split_at_mut(stage);
            let seen = ahead(motion, known, &EXPLICIT[stage], h);
            let mut start = ahead(motion, known, &IMPLICIT[stage], h);
            // The linear forces act where the stage would end without acceleration; the shift adds what this one changes.
            for (place, &rate) in start.position.iter_mut().zip(&start.velocity) {
                *place += rate * (GAMMA * h);
            }
            let (mut mass, force) = mechanism.evaluate(&seen, &start, t + PLACES[stage] * h);
            for (row, shift) in mass.iter_mut().zip(&self.shift) {
                for (entry, &shift) in row.iter_mut().zip(shift) {
                    *entry = *entry + shift;
                }
            }
            let rate = Cholesky::new(&mass).solve(&force);
            let position = std::array::from_fn(|k| start.velocity[k] + rate[k] * (GAMMA * h));
            rest[0] = Motion { position, velocity: rate };
        }
        *motion = ahead(motion, &slopes, &IMPLICIT[STAGES - 1], h);
    }
}

/// `motion` and a step of `h` (s) along the weighted `slopes`.
#[inline]
fn ahead<S: Scalar, const ALL: usize>(
    motion: &Motion<S, ALL>,
    slopes: &[Motion<S, ALL>],
    weights: &[f64; STAGES],
    h: f64,
) -> Motion<S, ALL> {
    let mut sum = *motion;
    for (slope, weight) in slopes.iter().zip(weights) {
        let weight = h * weight;
        for k in 0..ALL {
            sum.position[k] += slope.position[k] * weight;
            sum.velocity[k] += slope.velocity[k] * weight;
        }
    }
    sum
}
