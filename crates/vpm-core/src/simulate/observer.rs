//! Beams that are held to what their gauges showed, so that no error of the motion rings on in them.

use crate::description::Description;
use crate::model::Model;
use crate::motion::{StrainRates, strain_sensors};
use crate::scalar::{Dual, Scalar};
use crate::sensor::Sensor;

/// One gauge that holds its beam.
#[derive(Clone)]
pub(super) struct Held<S> {
    /// First coordinate of the beam.
    pub(super) first: usize,
    /// Strain per unit of each coordinate of the beam.
    pub(super) row: Vec<f64>,
    /// Force on the coordinates per rate of strain that the beam lacks, J s.
    pub(super) gain: f64,
    /// Rate of strain at the sample before and after, 1/s.
    ends: [S; 2],
    /// Number of the gauge.
    gauge: usize,
    sensor: Option<Sensor<S>>,
}

impl<S: Scalar> Held<S> {
    /// All gauges that hold their beams.
    pub(super) fn all(
        description: &Description,
        model: &Model<S>,
        strains: Option<StrainRates<'_>>,
        theta: &[S],
    ) -> Vec<Self> {
        let Some(StrainRates { gain, .. }) = strains else { return Vec::new() };
        let sensors = strain_sensors(description, theta);
        let strips = model.gauges().iter().zip(gain).zip(sensors).enumerate();
        let held = strips.filter(|(_, ((strip, gain), _))| **gain > 0.0 && strip.len > 0);
        held.map(|(gauge, ((strip, &gain), sensor))| Self {
            first: strip.first,
            row: strip.row(),
            gain,
            ends: [S::zero(); 2],
            gauge,
            sensor,
        })
        .collect()
    }

    /// Takes the true rates behind what was read at two samples.
    pub(super) fn move_on(&mut self, strains: StrainRates<'_>, samples: [usize; 2], time_step: f64) {
        let last = strains.rate.rows() - 1;
        let read = |sample| S::from_f64(strains.rate.at(sample, self.gauge));
        self.ends = samples.map(|k| match &self.sensor {
            Some(sensor) => sensor.undo_rate(k, last, time_step, read),
            None => read(k),
        });
    }

    /// Takes the force that holds the beam off the load on all coordinates with rates `v`, at a share of the interval.
    pub(super) fn hold(&self, v: &[S], load: &mut [S], share: S) {
        let own = self.first..self.first + self.row.len();
        let [begin, end] = self.ends;
        let mut lacking = begin + (end - begin) * share;
        for (&rate, &entry) in v[own.clone()].iter().zip(&self.row) {
            lacking -= rate * entry;
        }
        for (load, &entry) in load[own].iter_mut().zip(&self.row) {
            *load -= lacking * (self.gain * entry);
        }
    }

    /// Takes the change in time of the force at standing rates of the beam off that of the load.
    pub(super) fn drift(&self, load: &mut [S], interval: f64) {
        let [begin, end] = self.ends;
        let own = &mut load[self.first..self.first + self.row.len()];
        for (load, &entry) in own.iter_mut().zip(&self.row) {
            *load -= (end - begin) * (self.gain * entry / interval);
        }
    }

    /// The same for derivatives.
    pub(super) fn lifted<const N: usize>(&self) -> Held<Dual<S, N>> {
        let Self { first, ref row, gain, ends, gauge, .. } = *self;
        Held { first, row: row.clone(), gain, ends: ends.map(Dual::constant), gauge, sensor: None }
    }

    /// Takes over the rates at both samples.
    pub(super) fn follow<const N: usize>(held: &mut [Held<Dual<S, N>>], values: &[Self]) {
        for (lifted, value) in held.iter_mut().zip(values) {
            lifted.ends = value.ends.map(Dual::constant);
        }
    }
}
