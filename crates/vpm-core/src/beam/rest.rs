//! The shape of a beam that nothing loads: curvature and twist along its axis.

use serde::{Deserialize, Serialize};

use super::quadrature::gauss;
use super::strain::exponential;
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist, Vector3};

/// Turn, rad, of a step along the axis at most, or the root of what its curvature changes by times its length if that is more: the error
/// of a step goes with its fifth power.
const STEP: f64 = 0.005;

/// Curvature at one place of a beam at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RestEntry {
    /// Arc length from the root in m.
    pub at: f64,
    /// Curvature about x and y and twist about z, in 1/m.
    pub curvature: [f64; 3],
}

/// The curvature along the axis, from one place on; linear between its entries, constant beyond them.
#[derive(Clone, Debug, Default)]
pub(super) struct Rest {
    entries: Vec<RestEntry>,
}

impl Rest {
    /// The rest shape of these entries, whose places ascend; a straight beam has none.
    pub fn new(entries: &[RestEntry]) -> Self {
        Self { entries: entries.to_vec() }
    }

    /// Whether the axis at rest is straight and not twisted.
    pub fn is_straight(&self) -> bool {
        self.entries.is_empty()
    }

    /// Shape at rest with arc lengths that count from `begin`.
    pub fn from(&self, begin: f64) -> Self {
        let moved = |entry: &RestEntry| RestEntry { at: entry.at - begin, curvature: entry.curvature };
        Self { entries: self.entries.iter().map(moved).collect() }
    }

    /// Breaks of the shape at rest: places between which it is smooth.
    pub fn breaks(&self) -> impl Iterator<Item = f64> {
        self.entries.iter().map(|entry| entry.at)
    }

    fn at(&self, mu: f64) -> [f64; 3] {
        let after = self.entries.iter().position(|entry| entry.at > mu).unwrap_or(self.entries.len());
        match (after.checked_sub(1).and_then(|k| self.entries.get(k)), self.entries.get(after)) {
            (Some(before), Some(next)) => {
                let part = (mu - before.at) / (next.at - before.at);
                std::array::from_fn(|k| before.curvature[k] * (1.0 - part) + next.curvature[k] * part)
            }
            (Some(only), None) | (None, Some(only)) => only.curvature,
            (None, None) => [0.0; 3],
        }
    }

    /// Integral of the rest strain between two places with no break inside, and its first moment about the middle per size.
    pub fn moments(&self, begin: f64, end: f64) -> [Twist<f64>; 2] {
        let (middle, size) = (0.5 * (begin + end), end - begin);
        let mut sums = [[0.0; 3]; 2];
        for at in gauss(2, -0.5, 0.5) {
            for (k, entry) in self.at(middle + size * at.place).into_iter().enumerate() {
                sums[0][k] += at.weight * size * entry;
                sums[1][k] += at.weight * size * at.place * entry;
            }
        }
        sums.map(|turn| Twist::new(Vector3::from(turn), Vector3::zero()))
    }

    /// Pose at rest of `end` in the axes at `begin`, which lies before or behind it.
    ///
    /// Law: fourth-order Magnus steps with exact moments, as along a beam that bends; constant curvature is exact in one step.
    pub fn across(&self, begin: f64, end: f64) -> Pose<f64> {
        if end < begin {
            return self.across(end, begin).inverse();
        }
        let mut pose = Pose::identity();
        let mut cuts: Vec<f64> = self.breaks().filter(|&at| at > begin && at < end).collect();
        cuts.push(end);
        let mut here = begin;
        for cut in cuts {
            // The change of curvature times the length is twelve times the first moment.
            let [turn, change] = self.moments(here, cut).map(|moment| moment.angular.dot(moment.angular).sqrt());
            let steps = (turn.max((12.0 * change).sqrt()) / STEP).ceil().max(1.0);
            let first = here;
            for step in 1..=steps as usize {
                let next = first + (cut - first) * step as f64 / steps;
                let [mut whole, moment] = self.moments(here, next);
                whole.linear.z += next - here;
                pose = pose * exponential(whole + whole.cross(moment));
                here = next;
            }
        }
        pose
    }
}

/// What holds for kinematics that measure a deflection from a straight axis.
pub(super) const STRAIGHT: &str =
    "be straight and untwisted at levels that interpolate the deflection: modal, deflection, hermite";

/// Pose at rest without derivatives, lifted to any number type.
pub(super) fn lift<S: Scalar>(pose: &Pose<f64>) -> Pose<S> {
    Pose::from_f64(*pose)
}
