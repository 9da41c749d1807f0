//! A pure delay acting on a sampled signal.

use std::ops::RangeInclusive;

use crate::scalar::Scalar;

/// A delay counted in samples: a whole number and the fraction beyond it.
///
/// Law: with `time = (n + f) time_step` and 0 <= f < 1, what arrives is `(1 - f) x[k-n] + f x[k-n-1]`. For a signal held between
/// samples that is the exact mean over the interval that begins at sample k; for a smooth one it is linear interpolation. It is
/// continuous in the delay, and differentiable except where the delay is a whole number of samples. Beyond the ends of the record
/// the signal keeps its first or last value.
/// Source: the fractional delay by linear interpolation, Laakso et al. 1996, "Splitting the unit delay", IEEE Signal Processing
/// Magazine 13(1), section 3. Checked by the caller: time >= 0, time_step > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleDelay<S> {
    whole: usize,
    fraction: S,
}

impl<S: Scalar> SampleDelay<S> {
    /// The delay `time` (s) for samples `time_step` (s) apart.
    pub fn new(time: S, time_step: f64) -> Self {
        let samples = time / time_step;
        let whole = samples.re().floor().max(0.0);
        // The cast saturates: a delay longer than any record never lets anything but the first value arrive.
        Self { whole: whole as usize, fraction: samples - whole }
    }

    /// What arrives at sample `k` of a signal given sample by sample.
    #[inline]
    pub fn delayed(&self, k: usize, at: impl Fn(usize) -> S) -> S {
        let newer = k.saturating_sub(self.whole);
        at(newer) * (S::one() - self.fraction) + at(newer.saturating_sub(1)) * self.fraction
    }

    /// Samples up to `k` of which a delay lets something arrive after it.
    #[inline]
    pub fn arriving(&self, k: usize) -> RangeInclusive<usize> {
        k.saturating_sub(self.whole)..=k
    }

    /// The inverse view: the sample that arrives this delay after sample `k`, in a record whose last sample is `last`.
    #[inline]
    pub fn advanced(&self, k: usize, last: usize, at: impl Fn(usize) -> S) -> S {
        let older = k.saturating_add(self.whole).min(last);
        let newer = k.saturating_add(self.whole).saturating_add(1).min(last);
        at(older) * (S::one() - self.fraction) + at(newer) * self.fraction
    }
}
