//! What a law that differences and integrates remembers between samples.

use crate::scalar::Scalar;

/// The last samples of a measurement and of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ControlMemory<S> {
    started: bool,
    /// y[k-1] and y[k-2].
    pub(super) measured: [S; 2],
    /// e[k-1].
    pub(super) error: S,
    /// ∫e dt.
    pub(super) integral: S,
}

impl<S: Scalar> ControlMemory<S> {
    /// Begins a controller's memory: before the first sample everything stood as it stands now.
    #[inline]
    pub(super) fn begin(&mut self, reference: S, y: S) {
        if !self.started {
            *self = Self { started: true, measured: [y; 2], error: reference - y, integral: S::zero() };
        }
    }

    /// Keeps the sample in a controller's memory for the next one.
    #[inline]
    pub(super) fn keep(&mut self, reference: S, y: S) {
        self.measured = [y, self.measured[0]];
        self.error = reference - y;
    }
}
