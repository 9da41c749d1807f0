//! Equilibrium of flexible trees at large deflections.

use nalgebra::{DMatrix, DVector};

use super::tree::FlexibleTree;
use crate::algebra::dense;
use crate::beam::dimension;
use crate::error::{Error, Result};
use crate::scalar::{Dual, Scalar, seed};

/// Derivatives taken in one sweep.
const LANES: usize = 8;
/// Newton steps before the search counts as lost.
const STEPS: usize = 60;

/// A dead load on the tip of a link, in the axes of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipLoad {
    /// Number of the link.
    pub link: usize,
    /// Force in N.
    pub force: [f64; 3],
    /// Moment in N m.
    pub moment: [f64; 3],
}

impl FlexibleTree {
    /// Static equilibrium of a flexible tree under gravity and `loads`, joints held as in `start`. `start` also begins
    /// the search.
    ///
    /// Law: `bias(q, 0) + K q = 0` by Newton's method with exact derivatives (dual numbers). Checked: converged to rounding.
    /// A large load is best reached in a few stages, each starting from the one before.
    pub fn equilibrium(&self, start: &[f64], loads: &[TipLoad]) -> Result<Vec<f64>> {
        dimension("the start of an equilibrium", self.len(), start.len(), "coordinate")?;
        let mut q = start.to_vec();
        for _ in 0..STEPS {
            let (residual, tangent) = self.unbalance(&q, loads);
            let step = dense::solve(&tangent, &residual);
            let Some(step) = step else { break };
            for (entry, step) in q.iter_mut().zip(step.iter()) {
                *entry -= step;
            }
            let size = q.iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
            if step.amax() < 1e-11 * size {
                return Ok(q);
            }
        }
        let value = self.unbalance(&q, loads).0.amax();
        let condition = "vanish within 60 Newton steps".to_owned();
        let repair = "raise the load in stages, each starting from the equilibrium before";
        Err(Error::Setting { setting: "the unbalanced load of the tree", condition, value, repair })
    }

    /// Static residual of a flexible tree and its derivative; the rows of the joints only hold them.
    fn unbalance(&self, q: &[f64], loads: &[TipLoad]) -> (DVector<f64>, DMatrix<f64>) {
        let n = self.len();
        let mut workspace = self.workspace::<Dual<f64, LANES>>();
        let rest = vec![Dual::zero(); n];
        let mut tangent = DMatrix::from_row_slice(n, n, self.stiffness());
        let mut residual = &tangent * DVector::from_column_slice(q);
        let all: Vec<usize> = (0..n).collect();
        for (pass, lanes) in all.chunks(LANES).enumerate() {
            self.terms(&seed(q, lanes), &rest, loads, &mut workspace);
            for (i, bias) in workspace.bias.iter().enumerate() {
                residual[i] += if pass == 0 { bias.value } else { 0.0 };
                for (&j, slope) in lanes.iter().zip(bias.gradient) {
                    tangent[(i, j)] += slope;
                }
            }
        }
        for joint in (0..self.links.len()).filter_map(|link| self.joint_coordinate(link)) {
            residual[joint] = 0.0;
            tangent.row_mut(joint).fill(0.0);
            tangent[(joint, joint)] = 1.0;
        }
        (residual, tangent)
    }
}
