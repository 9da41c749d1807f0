//! A Rosenbrock method of fourth order.

use super::stage::Stage;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// Stages of a step.
const STAGES: usize = 6;

/// The coefficients of a stiffly accurate Rosenbrock method in the form that needs no product with the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// The diagonal coefficient g.
    pub gamma: f64,
    /// `a_ij`: how far stage i stands from the start of the step along the increment of stage j.
    pub distance: [[f64; STAGES]; STAGES],
    /// `c_ij`: how much of the increment of stage j enters that of stage i.
    pub coupling: [[f64; STAGES]; STAGES],
}

/// Rodas4P2: six stages, order 4, L-stable, stiffly accurate, and of order 2 if the Jacobian is not exact.
///
/// Source: Steinebach 2020, "Improvement of Rosenbrock-Wanner method RODASP", in: Progress in Differential-Algebraic Equations II,
/// Springer, pages 165-184. The last row of the distances is the one before it, with a one: stage 6 stands where stage 5 leads to.
pub const RODAS4P2: Tableau = Tableau {
    gamma: 0.25,
    distance: [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.906_377_755_268_814, -0.189_707_390_391_685, 0.0, 0.0, 0.0, 0.0],
        [3.758_617_027_739_064, 1.161_741_776_019_525, -0.849_258_085_312_803, 0.0, 0.0, 0.0],
        [7.089_566_927_282_776, 4.573_591_406_461_604, -8.423_496_976_860_259, -0.959_280_113_459_775, 0.0, 0.0],
        [7.089_566_927_282_776, 4.573_591_406_461_604, -8.423_496_976_860_259, -0.959_280_113_459_775, 1.0, 0.0],
    ],
    coupling: [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-12.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-6.354_581_592_719_008, 0.338_972_550_544_623, 0.0, 0.0, 0.0, 0.0],
        [-8.575_016_317_114_033, -7.606_483_992_117_508, 12.224_997_650_124_82, 0.0, 0.0, 0.0],
        [-5.888_975_457_523_102, -8.157_396_617_841_82, 24.805_546_872_612_922, 12.790_401_512_796_98, 0.0, 0.0],
        [
            -4.408_651_676_063_871,
            -6.692_003_137_674_639,
            24.625_568_527_593_117,
            16.627_521_966_636_085,
            -5.714_285_714_285_718,
            0.0,
        ],
    ],
};

/// Fourth order and L-stable: for stiff systems that have to be exact, in bounded work (one Jacobian, one factorisation, six
/// right-hand sides and solves a step, no iteration).
///
/// Law: `(1 - g h J) u_i = g h f(x + sum a_ij u_j) + g sum c_ij u_j` with the exact `J = df/dx`, and `x+ = x + sum a_6j u_j + u_6`,
/// with the coefficients [`RODAS4P2`]. Source: Hairer & Wanner 1996, "Solving Ordinary Differential Equations II", section IV.7,
/// equation 7.25, and the source of the table. Of the family of RODAS this member is made for fast components that follow slow ones
/// (Prothero & Robinson's problem), as the stiff coordinates of a beam do, and for Jacobians that are not quite exact.
/// Checked: its order conditions and stability function; order 4 on a pendulum and on the stiff oscillator of van der Pol; order 3
/// in the stiff limit of Prothero & Robinson's problem, with an error that shrinks as the stiffness grows.
/// Dry friction far sharper than the step is better left to [`super::LinearlyImplicit`], which sees chords in the place of tangents.
#[derive(Clone, Debug)]
pub struct Rosenbrock<S> {
    left: Stage<S>,
    /// Rates where the step begins.
    rates: Vec<S>,
    stage: Vec<S>,
    /// The increments `u_i`, one stage after the other.
    increments: Vec<S>,
}

impl<S: Scalar> Rosenbrock<S> {
    /// Buffers of the Rosenbrock method for systems of `dim` states.
    pub fn new(dim: usize) -> Self {
        Self {
            left: Stage::new(dim),
            rates: vec![S::zero(); dim],
            stage: vec![S::zero(); dim],
            increments: vec![S::zero(); STAGES * dim],
        }
    }

    /// Moves `x` on by a Rosenbrock step (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        self.linearise(ode, x);
        self.attempt(ode, x, step);
        self.accept(x);
    }

    /// Rates and Jacobian at `x`, where a Rosenbrock step begins.
    pub(super) fn linearise(&mut self, ode: &mut impl Ode<S>, x: &[S]) {
        ode.linearise(x, self.left.matrix(), &mut self.rates);
    }

    /// Stages of a Rosenbrock step from the `x` of the last [`Self::linearise`]; x stays where it is.
    pub(super) fn attempt(&mut self, ode: &mut impl Ode<S>, x: &[S], step: f64) {
        let dim = x.len();
        self.left.factorise(ode.coordinates(), RODAS4P2.gamma * step);
        let Self { left, rates, stage, increments } = self;
        for (i, (distance, coupling)) in RODAS4P2.distance.iter().zip(&RODAS4P2.coupling).enumerate() {
            let (known, rest) = increments.split_at_mut(i * dim);
            let increment = &mut rest[..dim];
            if i == 0 {
                increment.copy_from_slice(rates);
            } else {
                if i < STAGES - 1 {
                    stage.copy_from_slice(x);
                    for_size!(i, N => add::<S, N>(stage, 1.0, known, distance), 1 2 3 4);
                } else {
                    add::<S, 1>(stage, 1.0, &known[known.len() - dim..], &[1.0; STAGES]);
                }
                ode.rhs(stage, increment);
            }
            let coupling = coupling.map(|weight| weight * RODAS4P2.gamma);
            for_size!(i, N => add::<S, N>(increment, RODAS4P2.gamma * step, known, &coupling), 1 2 3 4 5);
            left.solve(ode, increment);
        }
    }

    /// Moves `x` to the end of the Rosenbrock step that was computed last.
    pub(super) fn accept(&self, x: &mut [S]) {
        // The last stage stands at x + sum a_6j u_j already.
        for ((state, &stage), &increment) in x.iter_mut().zip(&self.stage).zip(self.last_increment()) {
            *state = stage + increment;
        }
    }

    /// Last Rosenbrock increment: difference to the companion of third order, `x + sum a_6j u_j`.
    pub(super) fn last_increment(&self) -> &[S] {
        &self.increments[(STAGES - 1) * self.stage.len()..]
    }
}

/// Scales `total` and adds the first N `known` Rosenbrock increments with their `weights`.
fn add<S: Scalar, const N: usize>(total: &mut [S], scale: f64, known: &[S], weights: &[f64; STAGES]) {
    let dim = total.len();
    let known: [&[S]; N] = std::array::from_fn(|stage| &known[stage * dim..(stage + 1) * dim]);
    for (k, total) in total.iter_mut().enumerate() {
        let mut sum = *total * scale;
        for (increment, &weight) in known.iter().zip(weights) {
            sum += increment[k] * weight;
        }
        *total = sum;
    }
}
