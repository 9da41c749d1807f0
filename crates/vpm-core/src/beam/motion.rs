//! How the sections of a beam move relative to its root.

use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist};

/// Pose and motion of a section G relative to the root R.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SectionMotion<S> {
    /// `X_RG`; z of G is the tangent of the axis in shear-rigid beams, and the normal of the section in all.
    pub pose: Pose<S>,
    /// Twist of G relative to R, in the axes of G.
    pub twist: Twist<S>,
    /// Time derivative of the components of `twist` at zero coordinate accelerations.
    pub acceleration: Twist<S>,
}

/// The motion of all sections of a beam, written by `Beam::motion`; made by `Beam::sections`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sections<S> {
    /// One entry per station, root to tip.
    pub at: Vec<SectionMotion<S>>,
    /// Twist of a section per unit rate of a coordinate, in the section's axes: entry `station * len + coordinate`.
    pub columns: Vec<Twist<S>>,
    /// Room for partial sums.
    pub(super) scratch: Vec<S>,
}

impl<S: Scalar> Sections<S> {
    /// Room for the motion of so many stations and coordinates.
    pub(super) fn new(stations: usize, coordinates: usize, scratch: usize) -> Self {
        let still = SectionMotion { pose: Pose::identity(), twist: Twist::zero(), acceleration: Twist::zero() };
        Self {
            at: vec![still; stations],
            columns: vec![Twist::zero(); stations * coordinates],
            scratch: vec![S::zero(); scratch],
        }
    }

    /// Begins the motion of section `station` where the section before it stands, the first one at the root.
    pub(super) fn begin(&mut self, station: usize, n: usize) -> SectionMotion<S> {
        if station == 0 {
            self.columns[..n].fill(Twist::zero());
            return SectionMotion { pose: Pose::identity(), twist: Twist::zero(), acceleration: Twist::zero() };
        }
        self.columns.copy_within((station - 1) * n..station * n, station * n);
        self.at[station - 1]
    }
}

impl<S: Scalar> SectionMotion<S> {
    /// Advances a section's motion to a frame at `across`. It moves relative to this one with `twist` and, at constant
    /// rates, `acceleration`.
    ///
    /// Law: `V = Ad V + v`, `A = Ad A + V x v + dv/dt`, Ad the transport into the new frame (Featherstone 2008, section 3.5).
    #[inline]
    pub(super) fn advance(&mut self, across: &Pose<S>, twist: Twist<S>, acceleration: Twist<S>) {
        self.pose = self.pose * *across;
        self.twist = across.inverse_twist(self.twist) + twist;
        self.acceleration = across.inverse_twist(self.acceleration) + self.twist.cross(twist) + acceleration;
    }
}
