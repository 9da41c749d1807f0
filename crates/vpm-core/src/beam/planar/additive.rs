//! An additive Runge-Kutta method for mechanisms whose stiff forces are linear.

use super::cholesky::Cholesky;
use super::dynamics::Motion;
use super::rosenbrock::Mechanism;
use crate::scalar::Scalar;

const STAGES: usize = 6;

/// The diagonal coefficient of the implicit table, after its explicit first stage.
const GAMMA: f64 = 0.25;

/// Times of the stages.
const PLACES: [f64; STAGES] = [0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0];

/// What the mass matrix and the velocity terms see.
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
