//! Statics of a clamped chain of elements.

use nalgebra::{DMatrix, DVector};

use super::{ELEMENT, NODE, TwoNode};
use crate::algebra::dense;
use crate::beam::{Section, dimension};
use crate::error::{Error, Result};
use crate::scalar::Dual;

/// Unknowns of a node: its coordinates, and the multiplier that holds its Euler parameters at length 1.
const UNKNOWNS: usize = NODE + 1;
/// Newton steps before the search counts as lost.
const STEPS: usize = 60;

/// A dead load on the last node, in the axes of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeLoad {
    /// Force in N.
    pub force: [f64; 3],
    /// Moment in N m.
    pub moment: [f64; 3],
}

/// Equal elements in a row along z of the world, the first node clamped in the origin.
#[derive(Clone, Debug)]
pub struct TwoNodeChain {
    element: TwoNode,
    count: usize,
}

impl TwoNodeChain {
    /// Chain of `count` two-node elements: a beam of that section and `length` (m).
    pub fn new(section: &Section, length: f64, count: usize) -> Result<Self> {
        if count == 0 {
            let condition = "be at least 1".to_owned();
            let repair = "cut the beam into one element or more";
            return Err(Error::Setting { setting: "the number of elements of a chain", condition, value: 0.0, repair });
        }
        Ok(Self { element: TwoNode::new(section, length / count as f64)?, count })
    }

    /// Coordinates of all nodes of the straight chain but the clamped one, node after node.
    pub fn straight(&self) -> Vec<f64> {
        (1..=self.count).flat_map(|k| [0.0, 0.0, k as f64 * self.element.length(), 1.0, 0.0, 0.0, 0.0]).collect()
    }

    /// Static equilibrium of the chain under `load` on the last node; `start` begins the search.
    ///
    /// Law: `dU/dx - Q + l dg/dx = 0`, `g = (|parameters|^2 - 1) / 2 = 0`, by Newton's method with the exact Jacobian from nested dual
    /// numbers. A moment m does `Q = 2 E^T m` on Euler parameters, as the spin is `2 E` times their rates (Nikravesh 1988,
    /// "Computer-Aided Analysis of Mechanical Systems", section 6.4). Checked: converged to rounding.
    /// A large load is best reached in a few stages, each starting from the one before.
    pub fn equilibrium(&self, start: &[f64], load: &NodeLoad) -> Result<Vec<f64>> {
        dimension("the start of an equilibrium", self.count * NODE, start.len(), "coordinate of a node")?;
        let mut unknowns: Vec<f64> = Vec::with_capacity(self.count * UNKNOWNS);
        for node in start.chunks_exact(NODE) {
            unknowns.extend_from_slice(node);
            unknowns.push(0.0);
        }
        for _ in 0..STEPS {
            let (residual, jacobian) = self.unbalance(&unknowns, load);
            let step = dense::solve(&jacobian, &residual);
            let Some(step) = step else { break };
            for (entry, step) in unknowns.iter_mut().zip(&step) {
                *entry -= step;
            }
            let moved = step.as_slice().chunks(UNKNOWNS).flat_map(|node| &node[..NODE]);
            if moved.fold(0.0_f64, |most, entry| most.max(entry.abs())) < 1e-11 {
                return Ok(unknowns.chunks(UNKNOWNS).flat_map(|node| &node[..NODE]).copied().collect());
            }
        }
        let value = self.unbalance(&unknowns, load).0.amax();
        let condition = "vanish within 60 Newton steps".to_owned();
        let repair = "raise the load in stages, each starting from the equilibrium before";
        Err(Error::Setting { setting: "the unbalanced load of the chain", condition, value, repair })
    }

    fn unbalance(&self, unknowns: &[f64], load: &NodeLoad) -> (DVector<f64>, DMatrix<f64>) {
        let n = unknowns.len();
        let (mut residual, mut jacobian) = (DVector::zeros(n), DMatrix::zeros(n, n));
        for k in 0..self.count {
            self.add_element(k, unknowns, &mut residual, &mut jacobian);
        }
        for (k, node) in unknowns.chunks_exact(UNKNOWNS).enumerate() {
            let (first, multiplier) = (k * UNKNOWNS, k * UNKNOWNS + NODE);
            for (i, &parameter) in node.iter().enumerate().take(NODE).skip(3) {
                residual[first + i] += node[NODE] * parameter;
                jacobian[(first + i, first + i)] += node[NODE];
                jacobian[(first + i, multiplier)] = parameter;
                jacobian[(multiplier, first + i)] = parameter;
                residual[multiplier] += 0.5 * parameter * parameter;
            }
            residual[multiplier] -= 0.5;
        }
        add_load(n - UNKNOWNS, unknowns, load, &mut residual, &mut jacobian);
        (residual, jacobian)
    }

    /// Adds what element `k` of the chain contributes; its first node is the clamp for k = 0.
    fn add_element(&self, k: usize, unknowns: &[f64], residual: &mut DVector<f64>, jacobian: &mut DMatrix<f64>) {
        const CLAMP: [f64; NODE] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        // Where each coordinate of the element stands among the unknowns.
        let place = |i: usize| (k + i / NODE).checked_sub(1).map(|node| node * UNKNOWNS + i % NODE);
        let x: [Dual<f64, ELEMENT>; ELEMENT] =
            std::array::from_fn(|i| Dual::variable(place(i).map_or(CLAMP[i % NODE], |at| unknowns[at]), i));
        for (i, force) in self.element.forces(&x).iter().enumerate() {
            let Some(row) = place(i) else { continue };
            residual[row] += force.value;
            for (j, slope) in force.gradient.iter().enumerate() {
                if let Some(column) = place(j) {
                    jacobian[(row, column)] += slope;
                }
            }
        }
    }
}

/// Subtracts the load on the chain's node whose unknowns begin at `first`.
fn add_load(first: usize, unknowns: &[f64], load: &NodeLoad, residual: &mut DVector<f64>, jacobian: &mut DMatrix<f64>) {
    for (k, force) in load.force.iter().enumerate() {
        residual[first + k] -= force;
    }
    let parameters = [3, 4, 5, 6].map(|k| unknowns[first + k]);
    for (i, effect) in moment_on(parameters, load.moment).iter().enumerate() {
        residual[first + 3 + i] -= effect;
    }
    // The effect is linear in the parameters, so its derivative is what it is on the unit ones.
    for j in 0..4 {
        let unit: [f64; 4] = std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 });
        for (i, slope) in moment_on(unit, load.moment).iter().enumerate() {
            jacobian[(first + 3 + i, first + 3 + j)] -= slope;
        }
    }
}

/// Moment on the Euler parameters of a chain's node: `2 E^T m`.
fn moment_on([a, b, c, d]: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 4] {
    [-(b * x + c * y + d * z), a * x + (y * d - z * c), a * y + (z * b - x * d), a * z + (x * c - y * b)]
        .map(|entry| 2.0 * entry)
}
