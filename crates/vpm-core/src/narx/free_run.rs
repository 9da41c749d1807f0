//! Free runs over whole records.

use super::model::Narx;
use super::record::Record;
use crate::error::{NarxError, Result};

impl Narx {
    /// Free run over a record: each sample computed from the **simulated** outputs before it. Of the record's output
    /// only the first [`Structure::longest_lag`](super::Structure::longest_lag) samples are read, as the start.
    ///
    /// # Errors
    ///
    /// The record does not fit the model, or the output is no longer finite or beyond `limit` in magnitude: which sample, which value,
    /// and the samples before.
    pub fn simulate_free_run(&self, record: &Record<'_>, limit: f64) -> Result<Vec<f64>> {
        let structure = self.structure();
        let (stride, lag, samples) = (self.program.stride, structure.longest_lag(), record.samples());
        record.check(structure, lag)?;
        let mut rows = record.interleaved(stride - 1, lag, self.program.reach());
        let output = |rows: &[f64], upto: usize| rows.iter().step_by(stride).take(upto).copied().collect();
        for k in lag..samples {
            let value = self.program.evaluate(&rows, (k - lag) * stride);
            // Written so that a value that is no number is beyond any limit.
            if !(value.is_finite() && value.abs() <= limit) {
                let (record, output) = (record.name.to_owned(), output(&rows, k));
                let name = structure.signals()[0].clone();
                return Err(
                    NarxError::Diverged { record, output: name, sample: k, value, limit, samples: output }.into()
                );
            }
            rows[k * stride] = value;
        }
        Ok(output(&rows, samples))
    }
}
