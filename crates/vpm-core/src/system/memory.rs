//! Effects that remember: where their states stand, and how they move.

use crate::effect::{Hysteresis, Seat};
use crate::scalar::Scalar;

/// Hystereses of joints with their memories, which follow the states of drives and supplies.
#[derive(Clone, Debug)]
pub struct Memories<S> {
    /// Laws, each with its seat.
    laws: Vec<(Seat, Hysteresis<S>)>,
    /// Memory of each.
    values: Vec<S>,
    /// What stands for the fading of each in an iteration matrix.
    chords: Vec<Option<S>>,
}

impl<S: Scalar> Memories<S> {
    /// Relaxed ones.
    pub(crate) fn new(laws: Vec<(Seat, Hysteresis<S>)>) -> Self {
        let (values, chords) = (vec![S::zero(); laws.len()], vec![None; laws.len()]);
        Self { laws, values, chords }
    }

    /// How many there are.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.laws.len()
    }

    /// Laws with their seats and memories.
    #[inline]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Seat, &Hysteresis<S>, S)> {
        self.laws.iter().zip(&self.values).map(|((seat, law), &value)| (*seat, law, value))
    }

    /// Takes over the memories.
    #[inline]
    pub(crate) fn hold(&mut self, values: &[S]) {
        self.values.copy_from_slice(values);
    }

    /// Takes over the memories and writes their rates at the joints' velocities `v`.
    #[inline]
    pub(super) fn rates(&mut self, values: &[S], v: &[S], rates: &mut [S]) {
        self.hold(values);
        let laws = self.laws.iter().zip(&self.chords);
        for (((seat, law), chord), (rate, &z)) in laws.zip(rates.iter_mut().zip(values)) {
            *rate = match *chord {
                Some(fading) => seat.of(v) / law.displacement - fading * z,
                None => law.rate(seat.of(v), z),
            };
        }
    }

    /// Adds the efforts on the joints.
    #[inline]
    pub(super) fn add_efforts(&self, total: &mut [S]) {
        for (seat, law, z) in self.iter() {
            seat.push(total, law.effort(z));
        }
    }

    /// Moves the memories on along ways of the joints, exactly.
    pub(crate) fn travel(&mut self, way: impl Fn(usize) -> S) {
        for ((seat, law), value) in self.laws.iter().zip(&mut self.values) {
            *value = law.advance(*value, seat.sum(&way));
        }
    }

    /// Writes the mean rates of the memories over a `step` at the velocities `v`, from `values`.
    pub(super) fn mean_rates(&self, values: &[S], v: &[S], step: f64, rates: &mut [S]) {
        for (((seat, law), &z), rate) in self.laws.iter().zip(values).zip(rates) {
            *rate = (law.advance(z, seat.of(v) * step) - z) / step;
        }
    }

    /// Fading of each at the velocities `v`, to stand for it in an iteration matrix.
    pub(super) fn fadings(&self, values: &[S], v: &[S], fadings: &mut [Option<S>]) {
        for (((seat, law), &z), fading) in self.laws.iter().zip(values).zip(fadings) {
            *fading = Some(law.fading(seat.of(v), z));
        }
    }

    /// Replaces the fadings, or takes the laws as they are.
    pub(super) fn replace(&mut self, fadings: impl Iterator<Item = Option<S>>) {
        for (chord, fading) in self.chords.iter_mut().zip(fadings) {
            *chord = fading;
        }
    }
}
