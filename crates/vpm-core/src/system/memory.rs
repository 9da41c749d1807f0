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
    /// Memories of these laws, all relaxed.
    pub(crate) fn new(laws: Vec<(Seat<S>, MemoryEffect<S>)>) -> Self {
        let (values, chords) = (vec![S::zero(); laws.len()], vec![None; laws.len()]);
        Self { laws, values, chords }
    }

    /// How many there are.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.laws.len()
    }

    /// Memories that are held.
    #[inline]
    pub(crate) fn values(&self) -> &[S] {
        &self.values
    }

    /// Each with its seat, its law and its memory.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&Seat<S>, &MemoryEffect<S>, S)> {
        self.laws.iter().zip(&self.values).map(|((seat, effect), &value)| (seat, effect, value))
    }

    /// How far from zero each law leads its memory at most.
    pub(super) fn reaches(&self) -> impl Iterator<Item = S> {
        self.laws.iter().map(|(_, effect)| effect.law().reach())
    }

    /// Where each of them is.
    pub(super) fn seats(&self) -> impl Iterator<Item = &Seat<S>> {
        self.laws.iter().map(|(seat, _)| seat)
    }

    /// Takes over the memories.
    #[inline]
    pub(crate) fn hold(&mut self, values: &[S]) {
        self.values.copy_from_slice(values);
    }

    /// Each law where it has come to, at the joints' velocities `v` and these memories, or what stands for it.
    #[inline]
    fn at(&self, v: &[S], values: &[S]) -> impl Iterator<Item = (&Seat<S>, MemoryChords<S>)> {
        let laws = self.laws.iter().zip(&self.chords).zip(values);
        laws.map(|(((seat, effect), chords), &z)| (seat, chords.unwrap_or_else(|| effect.law().chords(seat.of(v), z))))
    }

    /// What the laws at one seat do at the end of an implicit step over the time `reach`, from `values`, moving with `w` then: resistance,
    /// and effort at rest.
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

    /// Takes over the memories and writes their rates at the joints' velocities `v`.
    #[inline]
    pub(super) fn rates(&mut self, values: &[S], v: &[S], rates: &mut [S]) {
        self.hold(values);
        for (((seat, chords), &z), rate) in self.at(v, values).zip(values).zip(rates) {
            *rate = chords.rate(seat.of(v), z);
        }
    }

    /// Writes their rates at the end of an implicit step over the time `reach`, from `values`, where the joints move with `v` then.
    ///
    /// At the velocity by which the efforts were reckoned the fading is that of the turn before, to the error of the turns.
    pub(super) fn rates_at_end(&self, values: &[S], v: &[S], reach: S, rates: &mut [S]) {
        for (((seat, chords), &z), rate) in self.at(v, values).zip(values).zip(rates) {
            *rate = chords.rate(seat.of(v), z) / (chords.fading * reach + 1.0);
        }
    }

    /// Adds the efforts on the joints at their velocities `v`.
    #[inline]
    pub(super) fn add_efforts(&self, v: &[S], total: &mut [S]) {
        for ((seat, chords), &z) in self.at(v, &self.values).zip(&self.values) {
            seat.push(total, chords.effort(seat.of(v), z));
        }
    }

    /// Takes them off loads.
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

    /// Writes the mean rates of the memories over a `step` at the velocities `v`, from `values`.
    pub(super) fn mean_rates(&self, values: &[S], v: &[S], step: f64, rates: &mut [S]) {
        for (((seat, effect), &z), rate) in self.laws.iter().zip(values).zip(rates) {
            *rate = (effect.law().advance(z, seat.of(v) * step, S::from_f64(step)) - z) / step;
        }
    }

    /// Writes each law where it has come to, to stand for it in an iteration matrix.
    pub(super) fn write_chords(&self, values: &[S], v: &[S], chords: &mut [Option<MemoryChords<S>>]) {
        for ((_, own), entry) in self.at(v, values).zip(chords) {
            *entry = Some(own);
        }
    }

    /// The chords of the laws at rest, without what rubs.
    pub(super) fn frictionless(&self) -> Vec<Option<MemoryChords<S>>> {
        let at_rest = |(_, effect): &(Seat<S>, MemoryEffect<S>)| effect.law().chords(S::zero(), S::zero());
        self.laws.iter().map(|law| Some(at_rest(law).frictionless())).collect()
    }

    /// Lets these stand for the laws, or takes the laws as they are.
    pub(super) fn replace(&mut self, chords: impl Iterator<Item = Option<MemoryChords<S>>>) {
        for (own, chords) in self.chords.iter_mut().zip(chords) {
            *own = chords;
        }
    }
}
