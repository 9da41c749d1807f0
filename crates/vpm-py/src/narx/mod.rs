//! NARX models: the class `Narx`, its steps, fits and selections of terms.

use std::sync::{Mutex, MutexGuard};

use numpy::PyArray1;
use pyo3::prelude::*;
use vpm_core::Error;
use vpm_core::error::NarxError;
use vpm_core::narx;

pub(crate) use maxwell::MaxwellNarx;

use crate::arrays::{Numbers, Vector};
use crate::errors::{CoreError, Diverged, exception};

mod maxwell;

type Row<'py> = Bound<'py, PyArray1<f64>>;
type Any<'py> = Bound<'py, PyAny>;
/// Factors (signal, lag) of every term.
type Terms = Vec<Vec<(usize, usize)>>;
/// Name, output (N,) and inputs (N, m) of a record.
type Given<'py> = (String, Any<'py>, Any<'py>);

fn structure(signals: &[String], terms: Terms) -> Result<narx::Structure, Error> {
    let factor = |(signal, delay)| narx::Factor { signal, delay };
    let term = |factors: Vec<_>| narx::Term::new(factors.into_iter().map(factor).collect());
    narx::Structure::new(signals, terms.into_iter().map(term).collect())
}

fn terms(structure: &narx::Structure) -> Terms {
    let pairs = |term: &narx::Term| term.factors().iter().map(|factor| (factor.signal, factor.delay)).collect();
    structure.terms().iter().map(pairs).collect()
}

/// Python exception for an error of a NARX model; a free run that diverged carries its samples.
fn raised(py: Python<'_>, error: Error) -> PyErr {
    let Error::Narx(inner) = &error else { return exception(py, error, 0, 0) };
    let NarxError::Diverged { sample, samples, .. } = &**inner else { return exception(py, error, 0, 0) };
    let diverged = Diverged::new_err(error.to_string());
    let value = diverged.value(py);
    let filled = value
        .setattr("sample_index", *sample)
        .and_then(|()| value.setattr("outputs", PyArray1::from_slice(py, samples)))
        .and_then(|()| value.setattr("states", PyArray1::from_slice(py, samples)));
    filled.err().unwrap_or(diverged)
}

/// A record, copied so that the core can read it without the interpreter lock.
struct Copied {
    name: String,
    output: Numbers,
    inputs: Numbers,
}

impl Copied {
    fn new((name, output, inputs): &Given<'_>) -> PyResult<Self> {
        let (output, inputs) = (Numbers::vector("output", output)?, Numbers::table("inputs", inputs)?);
        if inputs.rows() != output.values().len() {
            let (rows, samples) = (inputs.rows(), output.values().len());
            let text =
                format!("record `{name}` has {rows} rows of inputs for {samples} samples; give one row for each");
            return Err(CoreError::new_err(text));
        }
        Ok(Self { name: name.clone(), output, inputs })
    }

    fn record(&self) -> narx::Record<'_> {
        narx::Record { name: &self.name, output: self.output.values(), inputs: self.inputs.values() }
    }
}

fn copied(records: &[Given<'_>]) -> PyResult<Vec<Copied>> {
    records.iter().map(Copied::new).collect()
}

/// A polynomial of lagged outputs and inputs with its coefficients.
///
/// Parameters
/// ----------
/// signals : list of str
///     The output's name, then the inputs'.
/// terms : list of list of (int, int)
///     Factors of each term: signal (0 is the output) and lag.
/// coefficients : array_like, shape (P,)
///
/// Raises
/// ------
/// CoreError
///     A term that is not possible; one sentence with the repair.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct Narx {
    model: narx::Narx,
}

#[pymethods]
impl Narx {
    #[new]
    #[pyo3(signature = (signals, terms, coefficients))]
    fn new(py: Python<'_>, signals: Vec<String>, terms: Terms, coefficients: &Any<'_>) -> PyResult<Self> {
        if signals.is_empty() {
            return Err(CoreError::new_err("`signals` is empty; give the output's name first, then the inputs'"));
        }
        let theta = Numbers::vector("coefficients", coefficients)?;
        let model = structure(&signals, terms).and_then(|structure| narx::Narx::new(structure, theta.values()));
        Ok(Self { model: model.map_err(|error| raised(py, error))? })
    }

    /// Longest lag of a NARX model in samples.
    #[getter]
    fn longest_lag(&self) -> usize {
        self.model.structure().longest_lag()
    }

    /// Terms of a NARX model as they are written.
    fn texts(&self) -> Vec<String> {
        let structure = self.model.structure();
        structure.terms().iter().map(|term| term.text(structure.signals())).collect()
    }

    /// Free run of a NARX model: output (N,) from the simulated past. Of the given output the first samples are the
    /// start.
    #[pyo3(signature = (name, output, inputs, limit))]
    fn simulate_free_run<'py>(
        &self,
        py: Python<'py>,
        name: String,
        output: Any<'py>,
        inputs: Any<'py>,
        limit: f64,
    ) -> PyResult<Row<'py>> {
        let record = Copied::new(&(name, output, inputs))?;
        let run = py.detach(|| self.model.simulate_free_run(&record.record(), limit));
        run.map(|values| PyArray1::from_vec(py, values)).map_err(|error| raised(py, error))
    }

    /// One-step prediction of a NARX model: output (N,) from the measured past.
    #[pyo3(signature = (name, output, inputs))]
    fn predict_one_step<'py>(
        &self,
        py: Python<'py>,
        name: String,
        output: Any<'py>,
        inputs: Any<'py>,
    ) -> PyResult<Row<'py>> {
        let record = Copied::new(&(name, output, inputs))?;
        let predicted = py.detach(|| self.model.predict_one_step(&record.record()));
        predicted.map(|values| PyArray1::from_vec(py, values)).map_err(|error| raised(py, error))
    }

    /// Stepper of a NARX model that is fed sample by sample.
    fn stepper(&self) -> NarxStepper {
        NarxStepper { stepper: Mutex::new(self.model.stepper()) }
    }
}

/// A simulation that is fed sample by sample.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct NarxStepper {
    stepper: Mutex<narx::Stepper>,
}

impl NarxStepper {
    fn stepper(&self) -> PyResult<MutexGuard<'_, narx::Stepper>> {
        let taken = "this stepper is at work in another thread; give each thread its own";
        self.stepper.try_lock().map_err(|_| CoreError::new_err(taken))
    }
}

#[pymethods]
impl NarxStepper {
    /// Starts a NARX stepper with the past: outputs (L,) and inputs (L, m), oldest first, L the longest lag.
    #[pyo3(signature = (output, inputs))]
    fn start(&self, py: Python<'_>, output: Any<'_>, inputs: Any<'_>) -> PyResult<()> {
        let past = Copied::new(&("start".to_owned(), output, inputs))?;
        let record = past.record();
        self.stepper()?.start(record.output, record.inputs).map_err(|error| raised(py, error))
    }

    /// Output of a NARX stepper at this sample from its inputs (m,).
    fn step(&self, inputs: &Any<'_>) -> PyResult<f64> {
        let inputs = Vector::new("inputs", inputs)?;
        let (mut stepper, inputs) = (self.stepper()?, inputs.values()?);
        if inputs.len() != stepper.inputs() {
            let (found, needed) = (inputs.len(), stepper.inputs());
            let text =
                format!("`inputs` has {found} numbers, but the model has {needed} inputs; give one number for each");
            return Err(CoreError::new_err(text));
        }
        Ok(stepper.step(inputs))
    }
}

/// Candidate terms of a NARX model of at most `degree` lagged signals: factors (signal, lag) of each. `lags` are pairs
/// of a signal and its lags.
#[pyfunction]
#[pyo3(signature = (lags, degree, constant))]
pub(crate) fn narx_candidates(lags: Vec<(usize, Vec<usize>)>, degree: usize, constant: bool) -> Terms {
    let lags: Vec<_> = lags.into_iter().map(|(signal, delays)| narx::Lags { signal, delays }).collect();
    let pairs = |term: &narx::Term| term.factors().iter().map(|factor| (factor.signal, factor.delay)).collect();
    narx::candidates(&lags, degree, constant).iter().map(pairs).collect()
}

/// Coefficients of given NARX terms by least squares over all records.
#[pyfunction]
#[pyo3(signature = (signals, terms, records))]
pub(crate) fn narx_fit<'py>(
    py: Python<'py>,
    signals: Vec<String>,
    terms: Terms,
    records: Vec<Given<'py>>,
) -> PyResult<Row<'py>> {
    let records = copied(&records)?;
    let fitted = py.detach(|| {
        let views: Vec<_> = records.iter().map(Copied::record).collect();
        narx::fit(&structure(&signals, terms)?, &views)
    });
    let model = fitted.map_err(|error| raised(py, error))?;
    Ok(PyArray1::from_slice(py, model.coefficients()))
}

/// What a selection gives: terms, coefficients, error reductions, values of the criterion, dependent candidates with the term that
/// made them so.
type Selected<'py> = (Terms, Row<'py>, Row<'py>, Row<'py>, Vec<(String, String)>);

/// Terms of a NARX model selected by their error-reduction ratio.
#[pyfunction]
#[pyo3(signature = (signals, terms, records, most, stop, value))]
pub(crate) fn narx_select<'py>(
    py: Python<'py>,
    signals: Vec<String>,
    terms: Terms,
    records: Vec<Given<'py>>,
    most: usize,
    stop: &str,
    value: f64,
) -> PyResult<Selected<'py>> {
    let stop = match stop {
        "terms" => narx::Stop::Terms,
        "unexplained" => narx::Stop::Unexplained(value),
        "bic" => narx::Stop::Bic,
        "aic" => narx::Stop::Aic,
        "free_run_tail" => narx::Stop::FreeRunTail(value),
        other => {
            let text = format!("`stop` is {other}; the choices are terms, unexplained, bic, aic and free_run_tail");
            return Err(CoreError::new_err(text));
        }
    };
    let records = copied(&records)?;
    let found = py.detach(|| {
        let views: Vec<_> = records.iter().map(Copied::record).collect();
        narx::select(&structure(&signals, terms)?, &views, most, stop)
    });
    let found = found.map_err(|error| raised(py, error))?;
    let row = |values: &[f64]| PyArray1::from_slice(py, values);
    let theta = row(found.model.coefficients());
    let (ratios, criterion) = (row(&found.error_reduction), row(&found.criterion));
    Ok((self::terms(found.model.structure()), theta, ratios, criterion, found.dependent))
}
