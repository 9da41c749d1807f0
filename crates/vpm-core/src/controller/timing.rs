//! How often a controller or a sampled drive is at work in a record.

use crate::error::{Error, Result};

/// A whole multiple may be off by this share of itself: numbers in files are rounded.
const SLACK: f64 = 1e-9;

/// Samples of a record in steps of `time_step` (s) from one sample of the `kind` (controller, actuator) of a name to its next, which lies `sample_time` (s) later; 1 where
/// nothing is said.
pub fn samples_between(kind: &'static str, name: &str, sample_time: Option<f64>, time_step: f64) -> Result<usize> {
    let Some(sample_time) = sample_time else { return Ok(1) };
    let count = (sample_time / time_step).round().max(1.0);
    if (sample_time - count * time_step).abs() <= SLACK * sample_time {
        // The cast saturates: a controller slower than any record commands once.
        return Ok(count as usize);
    }
    // Without the last bits of the product, which nobody wants to read or write.
    let nearest = (count * time_step * 1e12).round() / 1e12;
    Err(Error::SampleTime { kind, name: name.to_owned(), sample_time, time_step, nearest })
}
