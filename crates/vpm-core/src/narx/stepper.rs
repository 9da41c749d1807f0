//! A simulation that is fed sample by sample, for use inside a control loop.

use super::model::Narx;
use super::program::Program;
use crate::error::{NarxError, Result};
use crate::scalar::Scalar;

/// Rows that a window moves along before it is moved back: the copy is spread over so many steps.
const ROWS: usize = 256;

/// The memory of a running model: a window that slides along a buffer. A step allocates nothing.
#[derive(Clone, Debug)]
pub struct Stepper<S = f64> {
    program: Program,
    buffer: Vec<S>,
    /// Where the window begins.
    from: usize,
    /// Where it begins at last.
    end: usize,
    longest: usize,
}

impl<S: Scalar> Stepper<S> {
    pub(super) fn new(model: &Narx) -> Self {
        let program = model.program.clone();
        let end = program.stride * ROWS;
        let buffer = vec![S::zero(); end + program.reach()];
        Self { longest: model.structure().longest_lag(), program, buffer, from: 0, end }
    }

    /// Starts the stepper with a past: the last samples of output and inputs, oldest first. Both are as long as the
    /// longest lag.
    ///
    /// # Errors
    ///
    /// Other lengths.
    pub fn start(&mut self, output: &[S], inputs: &[S]) -> Result<()> {
        let (stride, lag) = (self.program.stride, self.longest);
        if output.len() != lag || inputs.len() != lag * (stride - 1) {
            let needed = format!("looks back {lag} samples with {} inputs", stride - 1);
            let found = format!("has {} outputs and {} numbers of inputs", output.len(), inputs.len());
            let what = "the start".to_owned();
            return Err(
                NarxError::Count { what, found, needed, repair: "give exactly those rows, oldest first" }.into()
            );
        }
        self.from = 0;
        for (sample, &value) in output.iter().enumerate() {
            let row = &mut self.buffer[sample * stride..][..stride];
            row[0] = value;
            row[1..].copy_from_slice(&inputs[sample * (stride - 1)..][..stride - 1]);
        }
        Ok(())
    }

    /// Starts the stepper with a past in which output and inputs stood; missing `inputs` count as zero.
    pub fn stand(&mut self, output: S, inputs: &[S]) {
        self.from = 0;
        for row in self.buffer.chunks_exact_mut(self.program.stride).take(self.longest) {
            row[0] = output;
            for (at, place) in row[1..].iter_mut().enumerate() {
                *place = inputs.get(at).copied().unwrap_or_default();
            }
        }
    }

    /// Number of inputs that a step of the stepper takes.
    pub fn inputs(&self) -> usize {
        self.program.stride - 1
    }

    /// Steps to the output of this sample from its inputs and the **simulated** past. Numbers missing in `inputs` count
    /// as zero.
    #[inline]
    pub fn step(&mut self, inputs: &[S]) -> S {
        let (row, value) = self.present(inputs);
        self.buffer[row] = value;
        self.advance();
        value
    }

    /// Steps as [`step`](Self::step), but the past of the next samples is what was **measured** here.
    #[inline]
    pub fn step_measured(&mut self, inputs: &[S], measured: S) -> S {
        let (row, value) = self.present(inputs);
        self.buffer[row] = measured;
        self.advance();
        value
    }

    /// Takes this sample's inputs into the stepper: where their row begins, and the model's output for it.
    #[inline]
    fn present(&mut self, inputs: &[S]) -> (usize, S) {
        let row = self.from + self.longest * self.program.stride;
        for (at, place) in self.buffer[row + 1..row + self.program.stride].iter_mut().enumerate() {
            *place = inputs.get(at).copied().unwrap_or_default();
        }
        (row, self.program.evaluate(&self.buffer, self.from))
    }

    #[inline]
    fn advance(&mut self) {
        self.from += self.program.stride;
        if self.from >= self.end {
            self.buffer.copy_within(self.from..self.from + self.program.window, 0);
            self.from = 0;
        }
    }
}
