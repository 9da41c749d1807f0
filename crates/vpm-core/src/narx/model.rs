//! A model with its numbers.

use super::program::Program;
use super::record::Record;
use super::stepper::Stepper;
use super::structure::Structure;
use crate::error::{NarxError, Result};
use crate::scalar::Scalar;

/// `y[k] = sum_i theta_i prod_j x_ij` with numbers for theta.
#[derive(Clone, Debug, PartialEq)]
pub struct Narx {
    structure: Structure,
    coefficients: Vec<f64>,
    pub(super) program: Program,
}

impl Narx {
    /// The model with these coefficients, one per term.
    ///
    /// # Errors
    ///
    /// Another number of coefficients than of terms, or one that is not finite.
    pub fn new(structure: Structure, coefficients: &[f64]) -> Result<Self> {
        let terms = structure.terms().len();
        let wrong = |found: String, repair| NarxError::Count {
            what: "the coefficients".to_owned(),
            found,
            needed: format!("has {terms} terms"),
            repair,
        };
        if coefficients.len() != terms {
            return Err(wrong(format!("are {}", coefficients.len()), "give one for each term").into());
        }
        if let Some(at) = coefficients.iter().position(|value| !value.is_finite()) {
            let found =
                format!("contain {} for `{}`", coefficients[at], structure.terms()[at].text(structure.signals()));
            return Err(wrong(found, "give finite numbers").into());
        }
        let program = Program::new(&structure, coefficients);
        Ok(Self { structure, coefficients: coefficients.to_vec(), program })
    }

    /// Structure of the NARX model: terms and names.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Coefficients of the NARX model, one per term.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Stepper of the NARX model that is fed sample by sample; all its memory is made here.
    pub fn stepper(&self) -> Stepper {
        Stepper::new(self)
    }

    /// Stepper of the NARX model in numbers that may carry derivatives.
    pub(crate) fn stepper_in<S: Scalar>(&self) -> Stepper<S> {
        Stepper::new(self)
    }

    /// One-step prediction of the NARX model from the **measured** outputs before each sample. The first samples, which
    /// have no past, are the measured ones.
    ///
    /// # Errors
    ///
    /// The record does not fit the model.
    pub fn predict_one_step(&self, record: &Record<'_>) -> Result<Vec<f64>> {
        record.check(&self.structure, record.samples())?;
        let (stride, lag) = (self.program.stride, self.structure.longest_lag());
        let rows = record.interleaved(stride - 1, record.samples(), self.program.reach());
        let predicted = (lag..record.samples()).map(|k| self.program.evaluate(&rows, (k - lag) * stride));
        Ok(record.output[..lag].iter().copied().chain(predicted).collect())
    }
}
