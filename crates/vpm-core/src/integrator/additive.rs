//! An additive Runge-Kutta method for machines whose stiff forces are linear.

use super::split::Split;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// Stages of a step.
const STAGES: usize = 6;

/// The diagonal coefficient of the implicit table, after its explicit first stage.
const GAMMA: f64 = 0.25;

/// What the mass matrix, the velocity terms and all forces that are not stiff see.
const EXPLICIT: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [0.5, 0.0, 0.0, 0.0, 0.0, 0.0],
    [13861.0 / 62500.0, 6889.0 / 62500.0, 0.0, 0.0, 0.0, 0.0],
    [
        -116923316275.0 / 2393684061468.0,
        -2731218467317.0 / 15368042101831.0,
        9408046702089.0 / 11113171139209.0,
        0.0,
        0.0,
        0.0,
    ],
    [
        -451086348788.0 / 2902428689909.0,
        -2682348792572.0 / 7519795681897.0,
        12662868775082.0 / 11960479115383.0,
        3355817975965.0 / 11060851509271.0,
        0.0,
        0.0,
    ],
    [
        647845179188.0 / 3216320057751.0,
        73281519250.0 / 8382639484533.0,
        552539513391.0 / 3454668386233.0,
        3354512671639.0 / 8306763924573.0,
        4040.0 / 17871.0,
        0.0,
    ],
];

/// What the stiff forces see; the last row is the step itself.
const IMPLICIT: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [0.25, GAMMA, 0.0, 0.0, 0.0, 0.0],
    [8611.0 / 62500.0, -1743.0 / 31250.0, GAMMA, 0.0, 0.0, 0.0],
    [5012029.0 / 34652500.0, -654441.0 / 2922500.0, 174375.0 / 388108.0, GAMMA, 0.0, 0.0],
    [
        15267082809.0 / 155376265600.0,
        -71443401.0 / 120774400.0,
        730878875.0 / 902184768.0,
        2285395.0 / 8070912.0,
        GAMMA,
        0.0,
    ],
    [82889.0 / 524892.0, 0.0, 15625.0 / 83664.0, 69875.0 / 102672.0, -2260.0 / 8211.0, GAMMA],
];

/// Fourth order in fixed steps, L-stable for what a system takes implicitly in [`Ode::additive_rates`], explicit in all else: no
/// Jacobian, and where the system solves its own equations no matrix of its whole state.
///
/// Law (ARK4(3)6L\[2\]SA, used semi-implicitly): six stages `k_i = F(x + h sum a^E_ij k_j, x + h sum a^I_ij k_j)` with `F(x, x) = f(x)`,
/// of which stage i itself enters the second argument alone, by a quarter of the step, and `x+ = x + h sum b_i k_i`. Both tables have
/// the same weights b and places, so that the order is 4 whichever argument stands where.
/// Source: Kennedy & Carpenter 2003, Appl. Numer. Math. 44, for the tables; Boscarino, Filbet & Russo 2016, J. Sci. Comput. 68, for
/// the semi-implicit use. Where a fast component follows a slow motion the order may fall to 2, that of the stages.
/// Checked: order 4 on flexible arms with friction and lagging drives, both ways of solving against each other, the stability function
/// of the implicit table, steps far above the explicit limit.
#[derive(Clone, Debug)]
pub struct Additive<S> {
    split: Split<S>,
    /// Rates of the stages, one stage after the other.
    slopes: Vec<S>,
}

impl<S: Scalar> Additive<S> {
    /// Buffers of the additive method for systems of `dim` states.
    pub fn new(dim: usize) -> Self {
        Self { split: Split::new(dim), slopes: vec![S::zero(); STAGES * dim] }
    }

    /// Moves `x` on by an additive step (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        let dim = x.len();
        ode.additive_rates(x, x, 0.0, &mut self.slopes[..dim]);
        for stage in 1..STAGES {
            let known = &self.slopes[..stage * dim];
            ahead(&mut self.split.explicit, x, known, &EXPLICIT[stage], step);
            ahead(&mut self.split.implicit, x, known, &IMPLICIT[stage], step);
            self.split.rates(ode, GAMMA * step, &mut self.slopes[stage * dim..(stage + 1) * dim]);
        }
        let slopes = self.slopes.chunks_exact(dim.max(1));
        for (slope, &weight) in slopes.zip(&IMPLICIT[STAGES - 1]) {
            x.iter_mut().zip(slope).for_each(|(state, &slope)| *state += slope * (weight * step));
        }
    }
}

/// Puts `place` an additive step of `step` (s) along the weighted `slopes` from `x`.
#[inline]
fn ahead<S: Scalar>(place: &mut [S], x: &[S], slopes: &[S], weights: &[f64; STAGES], step: f64) {
    place.copy_from_slice(x);
    for (slope, &weight) in slopes.chunks_exact(x.len().max(1)).zip(weights) {
        place.iter_mut().zip(slope).for_each(|(state, &slope)| *state += slope * (weight * step));
    }
}
