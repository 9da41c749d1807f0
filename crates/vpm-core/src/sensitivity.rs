//! Derivatives of a whole computation with respect to chosen parameters: exact ones, a few at a time, or differences.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::scalar::{Dual, Scalar, Twins, seed};

/// Parameters per pass: the gradient of a number then fills one 256-bit register.
pub const LANES: usize = 4;

/// The same where there are more and little is kept of each sample: most of a pass is work that none of them adds to.
pub(crate) const MANY: usize = 16;

/// Asked now and then whether to stop; true stops the computation with [`Error::Interrupted`].
pub type Interrupt<'a> = &'a (dyn Fn() -> bool + Sync);

/// Two arrays that a computation fills; what they hold is its own affair. Nobody asks for derivatives of the second one.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair<S> {
    /// The first array.
    pub first: Vec<S>,
    /// The second array.
    pub second: Vec<f64>,
}

/// A computation that can run over any number type.
pub(crate) trait Job: Sync {
    /// Runs a job of sensitivities with the parameters `theta`.
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>>;

    /// Runs a job of sensitivities with two sets of parameters in lanes of numbers, each as if it were alone; none where
    /// that does not pay, or where one could lead to other steps than the other.
    fn run_in_lanes(&self, _theta: &[Twins]) -> Option<[Pair<f64>; 2]> {
        None
    }
}

/// Sensitivity of a job's first array to each parameter index in `variables`, with its values. Place by place,
/// derivative number k stands at `place * variables.len() + k`.
pub(crate) fn differentiate<J: Job>(job: &J, theta: &[f64], variables: &[usize]) -> Result<(Pair<f64>, Vec<f64>)> {
    differentiate_by::<J, LANES>(job, theta, variables, None)
}

/// Sensitivity at some `places` of the first array alone, with `N` parameters per pass. Where a pass is long, one that
/// takes few parameters wants no more lanes. Else as [`differentiate`].
pub(crate) fn differentiate_by<J: Job, const N: usize>(
    job: &J,
    theta: &[f64],
    variables: &[usize],
    places: Option<&[usize]>,
) -> Result<(Pair<f64>, Vec<f64>)> {
    check_variables(theta, variables)?;
    if variables.is_empty() {
        return Ok((job.run(theta)?, Vec::new()));
    }
    let pass = |chunk: &[usize]| job.run(&seed::<f64, N>(theta, chunk));
    let passes: Vec<Pair<Dual<f64, N>>> = if variables.len() <= N {
        vec![pass(variables)?]
    } else {
        variables.par_chunks(N).map(pass).collect::<Result<_>>()?
    };
    let Some(one) = passes.first() else { return Err(Error::Interrupted) };
    let count = places.map_or(one.first.len(), <[usize]>::len);
    let mut jacobian = vec![0.0; count * variables.len()];
    for (number, row) in jacobian.chunks_exact_mut(variables.len()).enumerate() {
        let place = places.map_or(number, |places| places[number]);
        for (entries, pass) in row.chunks_mut(N).zip(&passes) {
            entries.copy_from_slice(&pass.first[place].gradient[..entries.len()]);
        }
    }
    let first = one.first.iter().map(|number| number.value).collect();
    Ok((Pair { first, second: one.second.clone() }, jacobian))
}

/// Sensitivity by differences of runs of which one parameter each is moved by its step. Else as [`differentiate_by`].
///
/// Law: `(f(x + h) - f(x)) / h` errs by `h/2 f''`, and by what a run is rounded to, divided by h (Griewank & Walther 2008, chapter 1).
/// Checked: against exact derivatives.
pub(crate) fn difference<J: Job>(
    job: &J,
    theta: &[f64],
    variables: &[usize],
    steps: &[f64],
    places: Option<&[usize]>,
) -> Result<(Pair<f64>, Vec<f64>)> {
    let moved = variables.iter().zip(steps).map(|(&variable, &step)| {
        let mut moved = theta.to_vec();
        moved[variable] += step;
        moved
    });
    let all: Vec<Vec<f64>> = std::iter::once(theta.to_vec()).chain(moved).collect();
    let alone = |runs: &[Vec<f64>]| runs.iter().map(|theta| job.run(theta)).collect();
    let some = |pair: &[Vec<f64>]| match pair {
        [first, second] => {
            let lanes: Vec<Twins> = first.iter().zip(second).map(|(&a, &b)| Twins::side_by_side(a, b)).collect();
            job.run_in_lanes(&lanes).map_or_else(|| alone(pair), |both| Ok(Vec::from(both)))
        }
        one => alone(one),
    };
    let runs: Vec<Vec<Pair<f64>>> = all.par_chunks(2).map(some).collect::<Result<_>>()?;
    let mut runs = runs.into_iter().flatten();
    let Some(pair) = runs.next() else { return Err(Error::Interrupted) };
    let runs: Vec<Vec<f64>> = runs.map(|run| run.first).collect();
    let count = places.map_or(pair.first.len(), <[usize]>::len);
    let mut jacobian = vec![0.0; count * variables.len()];
    for (number, row) in jacobian.chunks_exact_mut(variables.len().max(1)).enumerate() {
        let place = places.map_or(number, |places| places[number]);
        for (entry, (run, &step)) in row.iter_mut().zip(runs.iter().zip(steps)) {
            *entry = (run[place] - pair.first[place]) / step;
        }
    }
    Ok((pair, jacobian))
}

/// Checks whether all sensitivities asked for are by parameters.
pub(crate) fn check_variables(theta: &[f64], variables: &[usize]) -> Result<()> {
    for &index in variables {
        if index >= theta.len() {
            let what = "the list of sensitivities".to_owned();
            return Err(Error::Reference { what, target: "parameter", index, count: theta.len() });
        }
    }
    Ok(())
}
