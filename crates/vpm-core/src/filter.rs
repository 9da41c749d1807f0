//! Zero-phase filters of records: sections of second order, forward and then backward over time.
//!
//! Channels go side by side, for the sections of one channel wait for each other.

use std::num::NonZeroUsize;

use crate::error::{Error, Result};

/// Channels that are filtered side by side.
const LANES: usize = 8;
/// Samples of them that go through one section of a filter after another; they stay in the nearest cache.
const BLOCK: usize = 32;

/// A filter's section of second order, `(b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)`, in transposed direct form II.
#[derive(Clone, Copy, Debug)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
    /// State after a long time of one at the entry of the whole filter.
    rest: [f64; 2],
}

/// A filter that shifts no signal in time: it goes over a record and back.
///
/// Both ends of a record are continued by point reflection, and each pass begins at the rest state of its first sample
/// (A. Oppenheim and R. Schafer, *Discrete-Time Signal Processing*, section 6.3, for the sections).
#[derive(Clone, Debug)]
pub struct ZeroPhase {
    sections: Vec<Section>,
    padding: usize,
}

impl ZeroPhase {
    /// A filter of sections `[b0, b1, b2, a0, a1, a2]` that continues both ends of a record by `padding` samples.
    ///
    /// # Errors
    ///
    /// `a0` of a section is not one, or a section never comes to rest.
    pub fn new(coefficients: &[[f64; 6]], padding: usize) -> Result<Self> {
        let mut level = 1.0; // at the entry of each section, after a long time of one before the first
        let mut sections = Vec::with_capacity(coefficients.len());
        for (number, &[b0, b1, b2, a0, a1, a2]) in coefficients.iter().enumerate() {
            let gain = (b0 + b1 + b2) / (1.0 + a1 + a2);
            if a0 != 1.0 || !gain.is_finite() {
                let (path, value) = (format!("sections[{number}]"), if a0 == 1.0 { gain } else { a0 });
                return Err(Error::Domain {
                    path,
                    condition: "begin its denominator with one and come to rest",
                    value,
                });
            }
            let second = b2 - a2 * gain;
            let rest = [(b1 - a1 * gain + second) * level, second * level];
            sections.push(Section { b: [b0, b1, b2], a: [a1, a2], rest });
            level *= gain;
        }
        Ok(Self { sections, padding })
    }

    /// The first, and then every `every`-th sample of filtered `columns` that stand row by row in `record`.
    pub fn apply(&self, record: &[f64], columns: usize, every: NonZeroUsize) -> Vec<f64> {
        let rows = record.len() / columns.max(1);
        let mut kept = vec![0.0; rows.div_ceil(every.get()) * columns];
        if kept.is_empty() {
            return kept;
        }
        // What is zero all the time stays so: most parameters leave some efforts of a machine alone.
        let moving: Vec<usize> = (0..columns)
            .filter(|&column| record[column..].iter().step_by(columns).any(|&number| number != 0.0))
            .collect();
        let mut memory = Vec::new();
        for some in moving.chunks(LANES) {
            let signals = Signals { record, columns, some };
            match some.len() {
                1 => self.side_by_side::<1>(&signals, every.get(), &mut memory, &mut kept),
                2 => self.side_by_side::<2>(&signals, every.get(), &mut memory, &mut kept),
                3..=4 => self.side_by_side::<4>(&signals, every.get(), &mut memory, &mut kept),
                _ => self.side_by_side::<LANES>(&signals, every.get(), &mut memory, &mut kept),
            }
        }
        kept
    }

    /// Filters `some` columns of a record, `N` at most, and keeps every `every`-th sample.
    fn side_by_side<const N: usize>(
        &self,
        signals: &Signals<'_>,
        every: usize,
        memory: &mut Vec<f64>,
        kept: &mut [f64],
    ) {
        let rows = signals.record.len() / signals.columns;
        let reach = self.padding.min(rows - 1);
        memory.clear();
        memory.resize((rows + 2 * reach) * N, 0.0);
        let passed = memory.as_chunks_mut::<N>().0;
        let (first, last) = (signals.at::<N>(0), signals.at::<N>(rows - 1));
        for (place, row) in passed[..reach].iter_mut().enumerate() {
            *row = reflected(first, signals.at(reach - place));
        }
        for (place, row) in passed[reach..reach + rows].iter_mut().enumerate() {
            *row = signals.at(place);
        }
        for (place, row) in passed[reach + rows..].iter_mut().enumerate() {
            *row = reflected(last, signals.at(rows - 2 - place));
        }
        for _ in 0..2 {
            self.pass(passed);
            passed.reverse();
        }
        for (row, values) in passed[reach..reach + rows].iter().step_by(every).enumerate() {
            for (&column, &value) in signals.some.iter().zip(values) {
                kept[row * signals.columns + column] = value;
            }
        }
    }

    /// One pass of a filter over samples of `N` signals, in place.
    fn pass<const N: usize>(&self, samples: &mut [[f64; N]]) {
        let Some(&first) = samples.first() else { return };
        let mut states: Vec<[[f64; N]; 2]> =
            self.sections.iter().map(|section| section.rest.map(|rest| first.map(|value| rest * value))).collect();
        // One signal passes section by section, for each waits for the one before. Of several, sections stay in registers.
        let together = if N == 1 { 1 } else { BLOCK };
        for block in samples.chunks_mut(together) {
            for (section, state) in self.sections.iter().zip(&mut states) {
                section.pass(block, state);
            }
        }
    }
}

impl Section {
    /// One pass of a section over samples of `N` signals, in place.
    #[inline]
    fn pass<const N: usize>(&self, samples: &mut [[f64; N]], state: &mut [[f64; N]; 2]) {
        let ([b0, b1, b2], [a1, a2], [mut near, mut far]) = (self.b, self.a, *state);
        for sample in samples {
            for lane in 0..N {
                let x = sample[lane];
                let y = b0 * x + near[lane];
                near[lane] = b1 * x - a1 * y + far[lane];
                far[lane] = b2 * x - a2 * y;
                sample[lane] = y;
            }
        }
        *state = [near, far];
    }
}

/// Some columns of a record that are filtered side by side.
struct Signals<'a> {
    record: &'a [f64],
    columns: usize,
    some: &'a [usize],
}

impl Signals<'_> {
    /// Sample of signals, with zeros after the last one.
    #[inline]
    fn at<const N: usize>(&self, row: usize) -> [f64; N] {
        let (sample, mut values) = (&self.record[row * self.columns..(row + 1) * self.columns], [0.0; N]);
        for (value, &column) in values.iter_mut().zip(self.some) {
            *value = sample[column];
        }
        values
    }
}

/// Sample of signals reflected at a point.
#[inline]
fn reflected<const N: usize>(point: [f64; N], mut values: [f64; N]) -> [f64; N] {
    for (value, middle) in values.iter_mut().zip(point) {
        *value = 2.0 * middle - *value;
    }
    values
}
