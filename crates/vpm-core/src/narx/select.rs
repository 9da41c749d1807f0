//! Forward selection of terms by their error-reduction ratio.

use super::design::{DEPENDENT, Design, dot, norm, solve};
use super::model::Narx;
use super::record::Record;
use super::structure::Structure;
use crate::error::{Error, NarxError, Result};

/// What ends the selection. All of them look at training data only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// As many terms as allowed.
    Terms,
    /// The unexplained share of the output's energy, `1 - sum ERR`, is below this.
    Unexplained(f64),
    /// The least `N ln(sigma^2) + n ln N` (Schwarz).
    Bic,
    /// The least `N ln(sigma^2) + 2 n` (Akaike).
    Aic,
    /// The least squared error of a free run over the last part (this share) of every record, which the terms and coefficients
    /// compared there have not seen; the coefficients of the answer are then fitted to all of the records.
    FreeRunTail(f64),
}

/// Chosen terms in the order of choice, and how it came to them.
#[derive(Clone, Debug)]
pub struct Selection {
    /// The model: chosen terms with their coefficients.
    pub model: Narx,
    /// Share of the output's energy that each chosen term explains beyond those before it.
    pub error_reduction: Vec<f64>,
    /// Value of the criterion after 1, 2, ... terms; infinite where a free run diverged.
    pub criterion: Vec<f64>,
    /// Candidates that became dependent, within rounding, with the term whose choice made them so.
    pub dependent: Vec<(String, String)>,
}

/// Selects terms of `pool`, at most `most`, and fits their coefficients.
///
/// Law: forward orthogonal least squares. Candidates `p` are orthogonalised against the chosen `w` as those are chosen (modified
/// Gram-Schmidt), `ERR = <p, y>^2 / (<p, p> <y, y>)` is the share of the output's energy that a candidate would explain, and the
/// largest is chosen. Source: Chen, Billings & Luo 1989; Billings 2013, section 3.2. The final coefficients come from a Householder QR
/// of the chosen columns, not from the recursion.
///
/// # Errors
///
/// Records that do not fit, a channel that never moves, too few samples, no candidate that explains anything.
pub fn select(pool: &Structure, records: &[Record<'_>], most: usize, stop: Stop) -> Result<Selection> {
    let most = most.min(pool.terms().len());
    if most == 0 {
        let reason = "there is no candidate, or none is allowed".to_owned();
        return Err(NarxError::Nothing { reason, repair: "give lags and a degree, and allow one term at least" }.into());
    }
    match stop {
        Stop::FreeRunTail(share) => by_free_run(pool, records, most, share),
        _ => {
            let design = Design::new(pool, records, most)?;
            let path = Path::search(pool, &design, most, stop)?;
            let criterion = path.criterion(stop, design.target.len());
            let count = best(&criterion, stop);
            let model = path.model(pool, records, count)?;
            Ok(path.selection(pool, model, count, criterion))
        }
    }
}

fn best(criterion: &[f64], stop: Stop) -> usize {
    match stop {
        Stop::Terms | Stop::Unexplained(_) => criterion.len(),
        _ => 1 + (1..criterion.len()).fold(0, |best, at| if criterion[at] < criterion[best] { at } else { best }),
    }
}

/// Splits every record in time, selects on the first parts, counts terms by free runs over the last parts.
fn by_free_run(pool: &Structure, records: &[Record<'_>], most: usize, share: f64) -> Result<Selection> {
    let (inputs, lag) = (pool.inputs(), pool.longest_lag());
    if !(share > 0.0 && share < 1.0) {
        let (condition, repair) = ("lie between 0 and 1".to_owned(), "give the part of each record that is held out");
        return Err(Error::Setting { setting: "the share of the free-run tail", condition, value: share, repair });
    }
    let cut = |record: &Record<'_>| ((1.0 - share) * record.samples() as f64) as usize;
    for record in records {
        record.check(pool, record.samples())?;
        let (least, samples) = (2 * lag + 2, record.samples());
        if cut(record) <= lag || cut(record) >= samples {
            return Err(NarxError::Short { record: record.name.to_owned(), samples, lag, least }.into());
        }
    }
    let heads: Vec<_> = records.iter().map(|record| record.part(0, cut(record), inputs)).collect();
    let tails: Vec<_> = records.iter().map(|record| record.part(cut(record) - lag, record.samples(), inputs)).collect();
    let design = Design::new(pool, &heads, most)?;
    let path = Path::search(pool, &design, most, Stop::Terms)?;
    let mut criterion = Vec::with_capacity(path.chosen.len());
    for count in 1..=path.chosen.len() {
        let model = path.model(pool, &heads, count)?;
        let error = |tail: &Record<'_>| match model.simulate_free_run(tail, f64::MAX.sqrt()) {
            Ok(run) => run.iter().zip(tail.output).map(|(run, y)| (run - y).powi(2)).sum(),
            Err(_) => f64::INFINITY,
        };
        criterion.push(tails.iter().map(error).sum());
    }
    let count = best(&criterion, Stop::FreeRunTail(share));
    if criterion[count - 1].is_infinite() {
        let reason = "every free run over the held-out tail diverged".to_owned();
        return Err(NarxError::Nothing { reason, repair: "take shorter lags or a lower degree" }.into());
    }
    let model = path.model(pool, records, count)?;
    Ok(path.selection(pool, model, count, criterion))
}

/// The order in which terms were chosen.
struct Path {
    chosen: Vec<usize>,
    error_reduction: Vec<f64>,
    dependent: Vec<(usize, usize)>,
}

impl Path {
    fn search(pool: &Structure, design: &Design, most: usize, stop: Stop) -> Result<Self> {
        let energy = dot(&design.target, &design.target);
        if energy == 0.0 {
            let reason = format!("`{}` is zero in every sample", pool.signals()[0]);
            return Err(NarxError::Nothing { reason, repair: "give a record in which it moves" }.into());
        }
        let mut rest = design.target.clone();
        let mut candidates = Candidate::all(design);
        let mut path = Self { chosen: Vec::new(), error_reduction: Vec::new(), dependent: Vec::new() };
        let mut unexplained = 1.0;
        while path.chosen.len() < most {
            let gain = |candidate: &Candidate| dot(&candidate.own, &rest).powi(2) / (candidate.length.powi(2) * energy);
            let gains: Vec<f64> = candidates.iter().map(gain).collect();
            let Some(at) = (0..gains.len()).reduce(|best, at| if gains[at] > gains[best] { at } else { best }) else {
                break;
            };
            if gains[at] == 0.0 {
                break;
            }
            let chosen = candidates.swap_remove(at);
            path.chosen.push(chosen.term);
            path.error_reduction.push(gains[at]);
            unexplained -= gains[at];
            remove(&mut rest, &chosen.own, chosen.length);
            candidates.retain_mut(|candidate| {
                remove(&mut candidate.own, &chosen.own, chosen.length);
                candidate.length = norm(&candidate.own);
                let independent = candidate.length > DEPENDENT * 10.0;
                if !independent {
                    path.dependent.push((candidate.term, chosen.term));
                }
                independent
            });
            if matches!(stop, Stop::Unexplained(share) if unexplained < share) {
                break;
            }
        }
        if path.chosen.is_empty() {
            let reason = format!("no candidate explains anything of `{}`", pool.signals()[0]);
            return Err(NarxError::Nothing { reason, repair: "give other lags or inputs" }.into());
        }
        Ok(path)
    }

    /// Criterion of the selection after each number of terms.
    fn criterion(&self, stop: Stop, samples: usize) -> Vec<f64> {
        let count = samples as f64;
        let mut unexplained = 1.0;
        let mut values = Vec::with_capacity(self.chosen.len());
        for (at, gain) in self.error_reduction.iter().enumerate() {
            unexplained -= gain;
            // Below rounding the logarithm would speak of nothing else.
            let likelihood = count * unexplained.max(f64::EPSILON).ln();
            values.push(match stop {
                Stop::Bic => likelihood + (at + 1) as f64 * count.ln(),
                Stop::Aic => likelihood + 2.0 * (at + 1) as f64,
                _ => unexplained,
            });
        }
        values
    }

    fn model(&self, pool: &Structure, records: &[Record<'_>], count: usize) -> Result<Narx> {
        let terms = self.chosen[..count].iter().map(|&term| pool.terms()[term].clone()).collect();
        let chosen = Structure::new(pool.signals(), terms)?;
        let design = Design::new(&chosen, records, count)?;
        let theta = solve(&chosen, &design, count)?;
        Narx::new(chosen, &theta)
    }

    fn selection(self, pool: &Structure, model: Narx, count: usize, criterion: Vec<f64>) -> Selection {
        let text = |term: usize| pool.terms()[term].text(pool.signals());
        let dependent = self.dependent.iter().map(|&(term, by)| (text(term), text(by))).collect();
        let mut error_reduction = self.error_reduction;
        error_reduction.truncate(count);
        Selection { model, error_reduction, criterion, dependent }
    }
}

/// A candidate's column of unit length, less what the chosen ones span.
struct Candidate {
    term: usize,
    own: Vec<f64>,
    length: f64,
}

impl Candidate {
    fn all(design: &Design) -> Vec<Self> {
        let scaled = |(term, column): (usize, &Vec<f64>)| {
            let length = norm(column);
            let own = column.iter().map(|value| value / length).collect();
            (length > 0.0 && length.is_finite()).then_some(Self { term, own, length: 1.0 })
        };
        design.columns.iter().enumerate().filter_map(scaled).collect()
    }
}

/// Removes from a selection's `values` their part along `direction`.
fn remove(values: &mut [f64], direction: &[f64], length: f64) {
    let share = dot(values, direction) / (length * length);
    for (value, direction) in values.iter_mut().zip(direction) {
        *value -= share * direction;
    }
}
