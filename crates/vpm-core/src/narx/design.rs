//! Regression equations of several records, and the least-squares solution over chosen columns.

use nalgebra::{DMatrix, DVector};

use super::model::Narx;
use super::record::Record;
use super::structure::Structure;
use crate::error::{NarxError, Result};

/// A column whose own part, orthogonal to the columns before it, is shorter than this share of it counts as dependent.
pub(super) const DEPENDENT: f64 = 1e-10;

/// Columns of the regression, one per term, over the samples of all records that have a full past.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) target: Vec<f64>,
}

impl Design {
    /// # Errors
    ///
    /// A record that does not fit, a channel that never moves, fewer equations than `least` parameters.
    pub(super) fn new(structure: &Structure, records: &[Record<'_>], least: usize) -> Result<Self> {
        let lag = structure.longest_lag();
        for record in records {
            record.check(structure, record.samples())?;
        }
        moving(structure, records)?;
        let equations: usize = records.iter().map(|record| record.samples() - lag).sum();
        if equations < least {
            return Err(NarxError::TooFew { equations, terms: least, lag }.into());
        }
        let stride = structure.signals().len();
        let rows: Vec<_> = records.iter().map(|record| record.interleaved(stride - 1, record.samples(), 0)).collect();
        let columns = structure.terms().iter().map(|term| {
            let places: Vec<usize> =
                term.factors().iter().map(|factor| (lag - factor.delay) * stride + factor.signal).collect();
            let mut column = Vec::with_capacity(equations);
            for rows in &rows {
                let last = (rows.len() / stride).saturating_sub(lag);
                column.extend((0..last).map(|k| places.iter().map(|place| rows[k * stride + place]).product::<f64>()));
            }
            column
        });
        let target = records.iter().flat_map(|record| record.output[lag..].iter().copied()).collect();
        Ok(Self { columns: columns.collect(), target })
    }
}

/// Checks for a design that every channel that a term reads moves in one record at least.
fn moving(structure: &Structure, records: &[Record<'_>]) -> Result<()> {
    let inputs = structure.inputs();
    for (signal, name) in structure.signals().iter().enumerate() {
        if !structure.terms().iter().flat_map(|term| term.factors()).any(|factor| factor.signal == signal) {
            continue;
        }
        let mut values = records.iter().flat_map(|record| {
            let (data, skip, step) =
                if signal == 0 { (record.output, 0, 1) } else { (record.inputs, signal - 1, inputs.max(1)) };
            data.iter().skip(skip).step_by(step).copied()
        });
        if let Some(first) = values.next()
            && values.all(|value| value == first)
        {
            return Err(NarxError::Constant { channel: name.clone(), value: first }.into());
        }
    }
    Ok(())
}

/// Fits all terms of the design by least squares. There is one equation per sample with a full past; by QR of scaled
/// columns.
///
/// # Errors
///
/// Records that do not fit, a channel that never moves, fewer equations than terms, terms that the records cannot tell apart: by name.
pub fn fit(structure: &Structure, records: &[Record<'_>]) -> Result<Narx> {
    let count = structure.terms().len();
    let design = Design::new(structure, records, count)?;
    let theta = solve(structure, &design, count)?;
    Narx::new(structure.clone(), &theta)
}

/// Coefficients of the design's first `count` columns.
pub(super) fn solve(structure: &Structure, design: &Design, count: usize) -> Result<Vec<f64>> {
    let (rows, columns) = (design.target.len(), &design.columns[..count]);
    let scale: Vec<f64> = columns.iter().map(|column| norm(column).max(f64::MIN_POSITIVE)).collect();
    let matrix = DMatrix::from_fn(rows, count, |row, column| columns[column][row] / scale[column]);
    let qr = matrix.qr();
    let r = qr.r();
    if let Some(at) = (0..count).find(|&at| r[(at, at)].abs().is_nan() || r[(at, at)].abs() < DEPENDENT) {
        return Err(collinear(structure, &r, at).into());
    }
    let mut right = DVector::from_column_slice(&design.target);
    qr.q_tr_mul(&mut right);
    let mut theta = right.rows(0, count).into_owned();
    r.solve_upper_triangular_mut(&mut theta);
    Ok(theta.iter().zip(&scale).map(|(value, scale)| value / scale).collect())
}

/// Columns of the design before column `at` that span it: those with a part in it.
fn collinear(structure: &Structure, r: &DMatrix<f64>, at: usize) -> NarxError {
    let text = |term: usize| format!("`{}`", structure.terms()[term].text(structure.signals()));
    let mut weights = r.view((0, at), (at, 1)).into_owned();
    r.view((0, 0), (at, at)).solve_upper_triangular_mut(&mut weights);
    let largest = weights.amax();
    let named: Vec<String> = (0..at).filter(|&term| weights[term].abs() > 1e-6 * largest).map(text).collect();
    let others = if named.is_empty() { "nothing: it is zero throughout".to_owned() } else { named.join(", ") };
    NarxError::Collinear { term: text(at).trim_matches('`').to_owned(), others, own: r[(at, at)].abs() }
}

pub(super) fn norm(values: &[f64]) -> f64 {
    dot(values, values).sqrt()
}

/// Dot product of design columns in four lanes.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut lanes = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..4 {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}
