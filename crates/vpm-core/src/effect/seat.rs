//! Where an effect of a joint sits: before or behind a compliance or backlash there.

use std::iter;

use crate::scalar::Scalar;

/// The coordinate on which an effect acts, that of one joint or the sum of two.
///
/// A joint with wind-up or play is two in the core, motor side and deflection, about one axis. What sits on the motor side sees the first
/// coordinate alone. What sits on the link side sees their sum, `q + d`, and by virtual work its effort acts on both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Seat {
    /// Number of the joint.
    pub joint: usize,
    /// Number of the joint of its deflection, for what sits on the link side.
    pub behind: Option<usize>,
}

impl Seat {
    /// The joints whose coordinates add up to its own.
    #[inline]
    pub fn joints(self) -> impl Iterator<Item = usize> + Clone {
        iter::once(self.joint).chain(self.behind)
    }

    /// Its coordinate or rate of the joints' `numbers`.
    #[inline]
    pub fn of<S: Scalar>(self, numbers: &[S]) -> S {
        self.sum(|joint| numbers[joint])
    }

    /// The same of numbers that are given joint by joint.
    #[inline]
    pub fn sum<S: Scalar>(self, number: impl Fn(usize) -> S) -> S {
        let own = number(self.joint);
        self.behind.map_or(own, |behind| own + number(behind))
    }

    /// Adds an `effort` on it to those on the joints.
    #[inline]
    pub fn push<S: Scalar>(self, efforts: &mut [S], effort: S) {
        efforts[self.joint] += effort;
        if let Some(behind) = self.behind {
            efforts[behind] += effort;
        }
    }
}

/// The coordinate of one joint.
impl From<usize> for Seat {
    fn from(joint: usize) -> Self {
        Self { joint, behind: None }
    }
}
