//! Derivatives of the rates of a rigid tree, by those of the balance of its efforts.

use super::Dynamics;
use crate::dynamics::{crba, rnea};
use crate::graph::{Recorded, slopes, slopes_within};
use crate::scalar::Scalar;

impl Dynamics<Recorded> {
    /// Slopes of the `rates` at `x`, as [`Dynamics::rhs`] left them just now, by some `variables`: row, column and number of each. None
    /// where the machine is no rigid tree, or where the recording has more than `most` operations.
    ///
    /// Law: of `M a + h = u` they are `da = M^-1 (du - dM a - dh)`, the last two those of inverse dynamics at constant accelerations:
    /// far fewer operations than derivatives of each operation of the accelerations. Source: Carpentier & Mansard 2018, "Analytical
    /// derivatives of rigid body dynamics algorithms", Robotics: Science and Systems XIV. Checked: against dual numbers.
    pub(super) fn slopes_of_rates(
        &self,
        x: &[Recorded],
        rates: &[Recorded],
        variables: &[Recorded],
        most: usize,
    ) -> Option<Vec<((usize, usize), Recorded)>> {
        let (n, count) = (self.coordinates(), variables.len());
        let accelerations: Vec<_> = rates[n..2 * n].iter().map(|rate| rate.frozen()).collect();
        // An acceleration that is a number by which there are slopes cannot be held apart from it.
        let same = accelerations.iter().any(|number| variables.contains(number));
        if !self.model.is_recursive() || self.loops.is_some() || same {
            return None;
        }
        let (q, v) = x[..2 * n].split_at(n);
        let (model, mut data) = (&self.model, self.data.clone());
        let needed = rnea(model, &mut data, q, v, &accelerations);
        let missing: Vec<_> = self.loads.iter().zip(needed).map(|(&load, &needed)| load - needed).collect();
        let mut changes = vec![Recorded::default(); n * count];
        // As variables, though nobody asks for their columns, the accelerations stand by themselves.
        for ((row, column), slope) in slopes_within(&missing, &[variables, &accelerations].concat(), most)? {
            if column < count {
                changes[column * n + row] = slope;
            }
        }
        crba(model, &mut data, q);
        data.factorise();
        let zero = Recorded::default();
        let others = [&rates[..n], &vec![zero; n], &rates[2 * n..]].concat();
        let mut found = slopes(&others, variables);
        for (column, change) in changes.chunks_exact_mut(n.max(1)).enumerate() {
            if change.iter().any(|&entry| entry != zero) {
                data.solve(change);
                found.extend(change.iter().enumerate().map(|(row, &slope)| ((n + row, column), slope)));
            }
        }
        Some(found)
    }
}
