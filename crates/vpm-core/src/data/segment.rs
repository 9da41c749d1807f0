//! Buffers of the articulated bodies along beams.

use crate::beam::{Sections, Segment, Slices, Sums};
use crate::model::{Elastic, Model};
use crate::scalar::Scalar;
use crate::spatial::{ArticulatedInertia, Twist, Wrench};

/// A segment of a beam as felt at its begin: `F = I A + sum U_k c_k'' + p`, `U_k . A + sum m_kj c_j'' + b_k = tau_k`.
#[derive(Clone, Debug)]
pub(crate) struct SegmentSlot<S> {
    /// Its sections relative to its begin.
    pub(crate) sections: Sections<S>,
    /// Sums over its slices, where there are any.
    pub(crate) sums: Sums<S>,
    /// Its coordinates c and their rates.
    pub(crate) coordinates: Vec<S>,
    pub(crate) rates: Vec<S>,
    /// V of its begin.
    pub(crate) velocity: Twist<S>,
    /// Velocity-dependent acceleration of its end relative to its begin.
    pub(crate) drift: Twist<S>,
    /// I, of the segment with everything beyond.
    pub(crate) inertia: ArticulatedInertia<S>,
    /// p.
    pub(crate) wrench: Wrench<S>,
    /// U, one for each coordinate; of an eliminated one, as it was when its turn came.
    pub(crate) columns: Vec<Wrench<S>>,
    /// m, row by row, of which the lower triangle counts.
    pub(crate) matrix: Vec<S>,
    /// b; of an eliminated coordinate, the effort that is left over for it.
    pub(crate) efforts: Vec<S>,
    /// Inverse pivots of the eliminated coordinates.
    pub(crate) inverses: Vec<S>,
    /// A of its begin.
    pub(crate) acceleration: Twist<S>,
    /// c''.
    pub(crate) accelerations: Vec<S>,
}

impl<S: Scalar> SegmentSlot<S> {
    fn new(segment: &Segment, slices: Option<&Slices<S>>) -> Self {
        let zeros = |count: usize| vec![S::zero(); count];
        let n = segment.len();
        Self {
            sections: segment.buffers(),
            sums: slices.map_or_else(Sums::default, Slices::sums),
            coordinates: zeros(n),
            rates: zeros(n),
            velocity: Twist::zero(),
            drift: Twist::zero(),
            inertia: ArticulatedInertia::default(),
            wrench: Wrench::zero(),
            columns: vec![Wrench::zero(); n],
            matrix: zeros(n * n),
            efforts: zeros(n),
            inverses: zeros(n),
            acceleration: Twist::zero(),
            accelerations: zeros(n),
        }
    }
}

/// Buffers for the segments of all beams that bend.
pub(super) fn segments<S: Scalar>(model: &Model<S>) -> Vec<Vec<SegmentSlot<S>>> {
    let of = |elastic: &Elastic<S>| match elastic.frame {
        Some(_) if model.is_segmented() => {
            let segments = elastic.beam.segments().iter().enumerate();
            segments.map(|(k, segment)| SegmentSlot::new(segment, elastic.segment_slices.get(k))).collect()
        }
        _ => Vec::new(),
    };
    model.beams().iter().map(of).collect()
}
