//! Equilibrium at large deflections.

use super::chain::PlanarChain;
use super::dynamics::{Load, Motion};
use crate::error::{Error, Result};
use crate::scalar::{Dual, Scalar};
use nalgebra::{DMatrix, DVector};

/// Newton steps before the search counts as lost.
const STEPS: usize = 60;

impl<const LINKS: usize, const EACH: usize, const ALL: usize> PlanarChain<LINKS, EACH, ALL> {
    /// Coordinates at rest under gravity and `load`, hubs held at the absolute angles in `start`, which also begins the search.
    ///
    /// Law: `bias(x, 0) + K x = 0` by Newton's method with exact derivatives (dual numbers). Checked: converged to rounding.
    /// A large load is best reached in a few stages, each starting from the one before.
    pub fn equilibrium(&self, start: &[f64; ALL], load: &Load) -> Result<[f64; ALL]> {
        let mut x = *start;
        for _ in 0..STEPS {
            let (residual, tangent) = self.unbalance(&x, load);
            let step = tangent.lu().solve(&residual).filter(|step| step.iter().all(|entry| entry.is_finite()));
            let Some(step) = step else { break };
            for (entry, step) in x.iter_mut().zip(step.iter()) {
                *entry -= step;
            }
            let size = x.iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
            if step.amax() < 1e-12 * size {
                return Ok(x);
            }
        }
        let value = self.unbalance(&x, load).0.amax();
        let condition = "vanish within 60 Newton steps".to_owned();
        let repair = "raise the load in stages, each starting from the equilibrium before";
        Err(Error::Setting { setting: "the unbalanced load of the chain", condition, value, repair })
    }

    /// Residual and its derivative; the rows of the hubs only hold them.
    fn unbalance(&self, x: &[f64; ALL], load: &Load) -> (DVector<f64>, DMatrix<f64>) {
        let mut workspace = self.workspace::<Dual<f64, ALL>>();
        let position = std::array::from_fn(|k| Dual::variable(x[k], k));
        let motion = Motion { position, velocity: [Dual::zero(); ALL] };
        let bias = self.terms(&motion, load, &mut workspace).bias;
        let [stiffness, _] = self.elasticity();
        let mut residual =
            DVector::from_fn(ALL, |i, _| bias[i].value + stiffness[i].iter().zip(x).map(|(k, x)| k * x).sum::<f64>());
        let mut tangent = DMatrix::from_fn(ALL, ALL, |i, j| bias[i].gradient[j] + stiffness[i][j]);
        for hub in (0..ALL).step_by(EACH) {
            residual[hub] = 0.0;
            tangent.row_mut(hub).fill(0.0);
            tangent[(hub, hub)] = 1.0;
        }
        (residual, tangent)
    }
}
