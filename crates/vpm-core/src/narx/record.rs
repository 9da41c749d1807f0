//! A record of one output and its inputs, sample by sample.

use super::structure::Structure;
use crate::error::{NarxError, Result};

/// One contiguous record; rows of inputs follow each other.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// Name, for messages.
    pub name: &'a str,
    /// The output, one number per sample. A free run reads its first samples only.
    pub output: &'a [f64],
    /// The inputs, row by row, `output.len()` rows.
    pub inputs: &'a [f64],
}

impl Record<'_> {
    /// Number of samples in a NARX record.
    pub fn samples(&self) -> usize {
        self.output.len()
    }

    /// The samples `from..to` as a record of their own.
    pub(super) fn part(&self, from: usize, to: usize, inputs: usize) -> Self {
        let Self { name, output, inputs: rows } = *self;
        Self { name, output: &output[from..to], inputs: &rows[from * inputs..to * inputs] }
    }

    /// Whether the record fits the structure: its shape, its length, finite numbers in the first `measured` outputs.
    pub(super) fn check(&self, structure: &Structure, measured: usize) -> Result<()> {
        let (samples, inputs, lag) = (self.samples(), structure.inputs(), structure.longest_lag());
        if self.inputs.len() != samples * inputs {
            let found = format!("has {} numbers of inputs for {samples} samples of output", self.inputs.len());
            let needed = format!("has {inputs} inputs");
            let what = format!("record `{}`", self.name);
            return Err(
                NarxError::Count { what, found, needed, repair: "give one row of inputs for each sample" }.into()
            );
        }
        if samples <= lag {
            return Err(NarxError::Short { record: self.name.to_owned(), samples, lag, least: lag + 1 }.into());
        }
        let output = self.output.iter().take(measured).enumerate().map(|(sample, &value)| (0, sample, value));
        let rows = self.inputs.iter().enumerate().map(|(at, &value)| (1 + at % inputs, at / inputs, value));
        match output.chain(rows).find(|(_, _, value)| !value.is_finite()) {
            None => Ok(()),
            Some((signal, sample, value)) => {
                let channel = structure.signals()[signal].clone();
                Err(NarxError::NotFinite { record: self.name.to_owned(), channel, sample, value }.into())
            }
        }
    }

    /// Rows `[y, u_1, ..., u_m]` of a NARX record, and `reach` numbers behind the last. Outputs after the first
    /// `outputs` are zero.
    pub(super) fn interleaved(&self, inputs: usize, outputs: usize, reach: usize) -> Vec<f64> {
        let stride = inputs + 1;
        let mut rows = vec![0.0; self.samples() * stride + reach];
        for (sample, row) in rows.chunks_exact_mut(stride).take(self.samples()).enumerate() {
            if sample < outputs {
                row[0] = self.output[sample];
            }
            row[1..].copy_from_slice(&self.inputs[sample * inputs..][..inputs]);
        }
        rows
    }
}
