//! Where an effect of a joint or a transmission sits.

use crate::scalar::Scalar;
use crate::transmission::Ratio;

/// The coordinate on which an effect acts: that of one joint, the sum of two, or the angle of a shaft.
///
/// A joint with wind-up or play is two in the core, motor side and deflection, about one axis. What sits on the motor side sees the first
/// coordinate alone. What sits on the link side sees their sum, `q + d`, and by virtual work its effort acts on both. What sits on a shaft
/// sees `sum r_i q_i`, and its effort tau acts on each joint as `r_i tau`.
#[derive(Clone, Debug, PartialEq)]
pub enum Seat<P> {
    /// A joint.
    Joint {
        /// Its number.
        joint: usize,
        /// Number of the joint of its deflection, for what sits on the link side.
        behind: Option<usize>,
    },
    /// The shaft of a transmission.
    Shaft {
        /// Its number among the transmissions.
        transmission: usize,
        /// Ratio of each joint that moves with it.
        ratios: Vec<Ratio<P>>,
    },
}

/// A seat without its ratios: seats at the same place are the same seat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Place {
    Joint(usize, Option<usize>),
    Shaft(usize),
}

impl<P> Seat<P> {
    /// The same seat over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Seat<T> {
        match self {
            Self::Joint { joint, behind } => Seat::Joint { joint: *joint, behind: *behind },
            Self::Shaft { transmission, ratios } => {
                Seat::Shaft { transmission: *transmission, ratios: ratios.iter().map(|ratio| ratio.map(f)).collect() }
            }
        }
    }

    /// The place of the seat, without the ratios of its shaft.
    #[inline]
    pub(crate) fn place(&self) -> Place {
        match self {
            Self::Joint { joint, behind } => Place::Joint(*joint, *behind),
            Self::Shaft { transmission, .. } => Place::Shaft(*transmission),
        }
    }

    /// Joint whose coordinate alone is that of a seat, if there is one.
    #[inline]
    pub(crate) fn alone(&self) -> Option<usize> {
        match self {
            Self::Joint { joint, behind: None } => Some(*joint),
            _ => None,
        }
    }

    /// Joint of a seat, on either side; none of a shaft.
    #[inline]
    pub(crate) fn joint(&self) -> Option<usize> {
        match self {
            Self::Joint { joint, .. } => Some(*joint),
            Self::Shaft { .. } => None,
        }
    }

    /// Joints that move a seat.
    pub fn joints(&self) -> Vec<usize> {
        match self {
            Self::Joint { joint, behind } => [*joint].into_iter().chain(*behind).collect(),
            Self::Shaft { ratios, .. } => ratios.iter().map(|ratio| ratio.joint).collect(),
        }
    }
}

impl<S: Scalar> Seat<S> {
    /// The coordinate or rate of this seat, from the `numbers` of all joints.
    #[inline]
    pub fn of(&self, numbers: &[S]) -> S {
        self.sum(|joint| numbers[joint])
    }

    /// The coordinate or rate of this seat, where `number` gives that of a joint.
    #[inline]
    pub fn sum(&self, number: impl Fn(usize) -> S) -> S {
        match self {
            Self::Joint { joint, behind: None } => number(*joint),
            Self::Joint { joint, behind: Some(behind) } => number(*joint) + number(*behind),
            Self::Shaft { ratios, .. } => ratios.iter().map(|entry| entry.ratio * number(entry.joint)).sum(),
        }
    }

    /// The effort of the actuators on the joint of this seat, from their `efforts` on all joints; zero on a shaft.
    #[inline]
    pub(crate) fn load(&self, efforts: &[S]) -> S {
        self.joint().map_or_else(S::zero, |joint| efforts[joint])
    }

    /// Adds an `effort` on a seat to those on the joints.
    #[inline]
    pub fn push(&self, efforts: &mut [S], effort: S) {
        match self {
            Self::Joint { joint, behind } => {
                efforts[*joint] += effort;
                behind.iter().for_each(|&behind| efforts[behind] += effort);
            }
            Self::Shaft { ratios, .. } => ratios.iter().for_each(|entry| efforts[entry.joint] += entry.ratio * effort),
        }
    }

    /// Hands out each joint with its coordinate's share in that of the seat.
    #[inline]
    pub(crate) fn for_each(&self, mut visit: impl FnMut(usize, S)) {
        match self {
            Self::Joint { joint, behind } => {
                visit(*joint, S::one());
                behind.iter().for_each(|&behind| visit(behind, S::one()));
            }
            Self::Shaft { ratios, .. } => ratios.iter().for_each(|entry| visit(entry.joint, entry.ratio)),
        }
    }
}

/// The coordinate of one joint.
impl<P> From<usize> for Seat<P> {
    fn from(joint: usize) -> Self {
        Self::Joint { joint, behind: None }
    }
}
