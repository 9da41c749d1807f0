//! Flexible trees in motion, as an ordinary differential equation.

use super::sweep::TreeWorkspace;
use super::tree::FlexibleTree;
use crate::error::{Error, Result};
use crate::integrator::Lu;
use crate::ode::Ode;
use crate::scalar::{Dual, Scalar, seed};

/// Derivatives taken in one sweep.
const LANES: usize = 8;

/// A motion that a joint is made to follow.
pub trait Drive {
    /// Motion of a driven joint of a flexible tree: position (rad or m), rate and acceleration at time `t` (s).
    fn motion<S: Scalar>(&self, t: S) -> [S; 3];
}

/// A tree whose first joint may be driven, everything else free.
///
/// The state is `(q, v, t)`: free coordinates, their rates, and the time. Law: `M_ff a_f = -(bias + K q + D v)_f - M_fd a_d`, f the free
/// coordinates and d the driven one.
#[derive(Clone, Debug)]
pub struct TreeMotion<'a, D> {
    tree: &'a FlexibleTree,
    drive: Option<D>,
    free: Vec<usize>,
    values: Buffers<f64>,
    duals: Buffers<Dual<f64, LANES>>,
}

#[derive(Clone, Debug)]
struct Buffers<S> {
    workspace: TreeWorkspace<S>,
    q: Vec<S>,
    v: Vec<S>,
    rates: Vec<S>,
    load: Vec<S>,
    lu: Lu<S>,
}

impl<S: Scalar> Buffers<S> {
    fn new(tree: &FlexibleTree, free: usize) -> Self {
        let (n, zero) = (tree.len(), S::zero());
        let [q, v] = [vec![zero; n], vec![zero; n]];
        let rates = vec![zero; 2 * free + 1];
        Self { workspace: tree.workspace(), q, v, rates, load: vec![zero; free], lu: Lu::new(free) }
    }

    /// Motion of a flexible tree: writes the time derivative of `x`, and leaves the factors of `M_ff` in `lu`.
    fn evaluate<D: Drive>(&mut self, tree: &FlexibleTree, drive: Option<&D>, free: &[usize], x: &[S]) {
        let (count, n) = (free.len(), tree.len());
        let driven = drive.map(|drive| drive.motion(x[2 * count]));
        if let Some([position, rate, _]) = driven {
            (self.q[0], self.v[0]) = (position, rate);
        }
        for (k, &place) in free.iter().enumerate() {
            (self.q[place], self.v[place]) = (x[k], x[count + k]);
        }
        tree.terms(&self.q, &self.v, &[], &mut self.workspace);
        for (load, (matrix, &i)) in self.load.iter_mut().zip(self.lu.matrix().chunks_exact_mut(count).zip(free)) {
            let row = i * n..(i + 1) * n;
            let elastic =
                product(&tree.stiffness()[row.clone()], &self.q) + product(&tree.damping()[row.clone()], &self.v);
            let mass = &self.workspace.mass[row];
            *load = -self.workspace.bias[i] - elastic - driven.map_or(S::zero(), |[.., a]| mass[0] * a);
            for (entry, &j) in matrix.iter_mut().zip(free) {
                *entry = mass[j];
            }
        }
        self.lu.factorise();
        self.lu.solve(&mut self.load);
        let (coordinates, others) = self.rates.split_at_mut(count);
        coordinates.copy_from_slice(&x[count..2 * count]);
        others[..count].copy_from_slice(&self.load);
        others[count] = S::one();
    }
}

impl<'a, D: Drive> TreeMotion<'a, D> {
    /// The motion of `tree`, its first joint following `drive` if there is one. Checked: then link 0 has a joint.
    pub fn new(tree: &'a FlexibleTree, drive: Option<D>) -> Result<Self> {
        if drive.is_some() && tree.joint_coordinate(0).is_none() {
            let (target, count) = ("joint", 0);
            return Err(Error::Reference { what: "the drive of a flexible tree".to_owned(), target, index: 0, count });
        }
        let free: Vec<usize> = (usize::from(drive.is_some())..tree.len()).collect();
        let (values, duals) = (Buffers::new(tree, free.len()), Buffers::new(tree, free.len()));
        Ok(Self { tree, drive, free, values, duals })
    }

    /// Workspace of the flexible tree's last motion: tips, mass matrix, bias.
    pub fn workspace(&self) -> &TreeWorkspace<f64> {
        &self.values.workspace
    }

    /// Writes `[-M^-1 K, -M^-1 D]` of the flexible tree's last motion into rows of `width`.
    fn elastic(&mut self, rows: &mut [f64], width: usize) {
        let (count, all) = (self.free.len(), self.tree.len());
        for (block, stiff) in [(0, self.tree.stiffness()), (count, self.tree.damping())] {
            for (k, &j) in self.free.iter().enumerate() {
                for (load, &i) in self.values.load.iter_mut().zip(&self.free) {
                    *load = -stiff[i * all + j];
                }
                self.values.lu.solve(&mut self.values.load);
                for (row, &entry) in rows.chunks_mut(width).zip(&self.values.load) {
                    row[block + k] = entry;
                }
            }
        }
    }
}

impl<D: Drive> Ode<f64> for TreeMotion<'_, D> {
    fn dim(&self) -> usize {
        2 * self.free.len() + 1
    }

    fn coordinates(&self) -> usize {
        self.free.len()
    }

    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        self.values.evaluate(self.tree, self.drive.as_ref(), &self.free, x);
        dxdt.copy_from_slice(&self.values.rates);
    }

    /// Jacobian of a flexible tree's motion, exact by dual numbers.
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        let n = self.dim();
        let all: Vec<usize> = (0..n).collect();
        for lanes in all.chunks(LANES) {
            self.duals.evaluate(self.tree, self.drive.as_ref(), &self.free, &seed(x, lanes));
            for (row, rate) in jacobian.chunks_exact_mut(n).zip(&self.duals.rates) {
                for (&lane, &slope) in lanes.iter().zip(&rate.gradient) {
                    row[lane] = slope;
                }
            }
        }
    }

    /// Iteration matrix of a flexible tree's motion: `[0, 1; -M^-1 K, -M^-1 D]`. It is all that is stiff in a beam, for
    /// the price of one mass matrix.
    fn iteration_matrix(&mut self, x: &[f64], matrix: &mut [f64]) {
        let (n, count) = (self.dim(), self.free.len());
        self.values.evaluate(self.tree, self.drive.as_ref(), &self.free, x);
        matrix.fill(0.0);
        self.elastic(&mut matrix[count * n..], n);
        for k in 0..count {
            matrix[k * n + count + k] = 1.0;
        }
    }

    fn elasticity(&mut self, x: &[f64], block: &mut [f64]) -> bool {
        self.values.evaluate(self.tree, self.drive.as_ref(), &self.free, x);
        self.elastic(block, 2 * self.free.len());
        true
    }
}

fn product<S: Scalar>(row: &[f64], x: &[S]) -> S {
    row.iter().zip(x).map(|(&entry, &x)| x * entry).sum()
}
