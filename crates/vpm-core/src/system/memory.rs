//! Effects that remember: where their states stand, and how they move.

use crate::effect::{MemoryChords, MemoryEffect, Place, Seat};
use crate::scalar::Scalar;

/// Effects of joints that remember, with their memories, which follow the states of drives and supplies.
#[derive(Clone, Debug)]
pub struct Memories<S> {
    /// Effects, each with its seat.
    laws: Vec<(Seat<S>, MemoryEffect<S>)>,
    /// Memory of each.
    values: Vec<S>,
    /// What stands for each law in an iteration matrix.
    chords: Vec<Option<MemoryChords<S>>>,
}

impl<S: Scalar> Memories<S> {
    /// Memories of these effects' laws, all relaxed.
    pub(crate) fn new(laws: Vec<(Seat<S>, MemoryEffect<S>)>) -> Self {
        let (values, chords) = (vec![S::zero(); laws.len()], vec![None; laws.len()]);
        Self { laws, values, chords }
    }

    /// Number of memories.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.laws.len()
    }

    /// Values of the held memories.
    #[inline]
    pub(crate) fn values(&self) -> &[S] {
        &self.values
    }

    /// Iterates over memories: seat, law and value.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&Seat<S>, &MemoryEffect<S>, S)> {
        self.laws.iter().zip(&self.values).map(|((seat, effect), &value)| (seat, effect, value))
    }

    /// Largest magnitude of each memory by its law.
    pub(super) fn reaches(&self) -> impl Iterator<Item = S> {
        self.laws.iter().map(|(_, effect)| effect.law().reach())
    }

    /// Seats of the memories.
    pub(super) fn seats(&self) -> impl Iterator<Item = &Seat<S>> {
        self.laws.iter().map(|(seat, _)| seat)
    }

    /// Holds values of the memories.
    #[inline]
    pub(crate) fn hold(&mut self, values: &[S]) {
        self.values.copy_from_slice(values);
    }

    /// Laws with memory at the velocities `v` and memory values, or chords in their place.
    #[inline]
    fn at(&self, v: &[S], values: &[S]) -> impl Iterator<Item = (&Seat<S>, MemoryChords<S>)> {
        let laws = self.laws.iter().zip(&self.chords).zip(values);
        laws.map(|(((seat, effect), chords), &z)| (seat, chords.unwrap_or_else(|| effect.law().chords(seat.of(v), z))))
    }

    /// Resistance and effort of laws with memory at the end of an implicit step over the time `reach`. They start from
    /// `values` at one seat and move with `w` then; the effort is that at rest.
    #[inline]
    pub(super) fn at_end(&self, place: Place, w: S, values: &[S], reach: S) -> impl Iterator<Item = [S; 2]> {
        let own = self.laws.iter().zip(values).filter(move |((seat, _), _)| seat.place() == place);
        own.map(move |((_, effect), &z)| {
            let MemoryChords { push, gain, source, fading, .. } = effect.law().chords(w, z);
            let kept = (fading * reach + 1.0).recip();
            let end = (z + (gain * w + source) * reach) * kept;
            let resistance = effect.law().chords(w, end).resistance;
            [resistance + push * gain * kept * reach, -(push * (z + source * reach) * kept)]
        })
    }

    /// Rates of the memories at the joints' velocities `v`.
    #[inline]
    pub(super) fn rates(&mut self, values: &[S], v: &[S], rates: &mut [S]) {
        self.hold(values);
        for (((seat, chords), &z), rate) in self.at(v, values).zip(values).zip(rates) {
            *rate = chords.rate(seat.of(v), z);
        }
    }

    /// Rates of the memories at the end of an implicit step over the time `reach`. They start from `values`, and the
    /// joints move with `v` then.
    ///
    /// At the velocity by which the efforts were reckoned the fading is that of the turn before, to the error of the turns.
    pub(super) fn rates_at_end(&self, values: &[S], v: &[S], reach: S, rates: &mut [S]) {
        for (((seat, chords), &z), rate) in self.at(v, values).zip(values).zip(rates) {
            *rate = chords.rate(seat.of(v), z) / (chords.fading * reach + 1.0);
        }
    }

    /// Adds the efforts of effects with memory on the joints at velocities `v`.
    #[inline]
    pub(super) fn add_efforts(&self, v: &[S], total: &mut [S]) {
        for ((seat, chords), &z) in self.at(v, &self.values).zip(&self.values) {
            seat.push(total, chords.effort(seat.of(v), z));
        }
    }

    /// Subtracts the efforts of effects with memory from loads.
    pub(super) fn subtract_efforts(&self, v: &[S], loads: &mut [S]) {
        for ((seat, chords), &z) in self.at(v, &self.values).zip(&self.values) {
            seat.push(loads, -chords.effort(seat.of(v), z));
        }
    }

    /// Moves the memories on by a time in s along ways of the joints.
    pub(crate) fn travel(&mut self, time: f64, way: impl Fn(usize) -> S) {
        for ((seat, effect), value) in self.laws.iter().zip(&mut self.values) {
            *value = effect.law().advance(*value, seat.sum(&way), S::from_f64(time));
        }
    }

    /// Mean rates of the memories over a `step` at the velocities `v`, from `values`.
    pub(super) fn mean_rates(&self, values: &[S], v: &[S], step: f64, rates: &mut [S]) {
        for (((seat, effect), &z), rate) in self.laws.iter().zip(values).zip(rates) {
            *rate = (effect.law().advance(z, seat.of(v) * step, S::from_f64(step)) - z) / step;
        }
    }

    /// Writes the chords of laws with memory, for an iteration matrix.
    pub(super) fn write_chords(&self, values: &[S], v: &[S], chords: &mut [Option<MemoryChords<S>>]) {
        for ((_, own), entry) in self.at(v, values).zip(chords) {
            *entry = Some(own);
        }
    }

    /// Chords of laws with memory at rest, without friction.
    pub(super) fn frictionless(&self) -> Vec<Option<MemoryChords<S>>> {
        let at_rest = |(_, effect): &(Seat<S>, MemoryEffect<S>)| effect.law().chords(S::zero(), S::zero());
        self.laws.iter().map(|law| Some(at_rest(law).frictionless())).collect()
    }

    /// Replaces laws with memory by chords, or takes the laws again.
    pub(super) fn replace(&mut self, chords: impl Iterator<Item = Option<MemoryChords<S>>>) {
        for (own, chords) in self.chords.iter_mut().zip(chords) {
            *own = chords;
        }
    }
}
