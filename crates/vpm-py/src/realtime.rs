//! The class `Loop`: a loop at a fixed rate.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use vpm_core::realtime::{Loop as Core, Right, Rights};

use crate::errors::CoreError;

/// A loop at a fixed rate with absolute deadlines; it belongs to the thread that made it.
///
/// Parameters
/// ----------
/// period : float
///     Time between two deadlines, s.
/// lock_memory : bool
///     Keep all memory of the process in RAM, if permitted.
/// priority : int, optional
///     Of ``SCHED_FIFO``, 1 to 99, if permitted.
#[pyclass(unsendable, module = "vpm._core")]
pub(crate) struct Loop {
    core: Core,
    rights: Option<Rights>,
}

#[pymethods]
impl Loop {
    #[new]
    fn new(period: f64, lock_memory: bool, priority: Option<u8>) -> PyResult<Self> {
        let core = Core::new(period).map_err(|error| CoreError::new_err(error.to_string()))?;
        Ok(Self { core, rights: Some(Rights::ask(lock_memory, priority)) })
    }

    /// Waits in the real-time loop for the next deadline. Gives its number, how late the wake-up was in s, and the
    /// deadlines missed since the last one.
    fn wait(&mut self, py: Python<'_>) -> PyResult<(u64, f64, u64)> {
        let Self { core, rights } = self;
        if rights.is_none() {
            return Err(CoreError::new_err("this loop is closed; make a new one"));
        }
        // The other threads of Python go on while this one sleeps; a signal that ends the sleep is Python's to handle.
        let mut signal = None;
        let tick = py.detach(|| {
            core.wait(|| {
                signal = Python::attach(|py| py.check_signals()).err();
                signal.is_some()
            })
        });
        match (tick, signal) {
            (_, Some(signal)) => Err(signal),
            (Some(tick), None) => Ok((tick.number, tick.late as f64 * 1e-9, tick.missed)),
            (None, None) => Err(PyRuntimeError::new_err("the wait was ended by nobody; report it")),
        }
    }

    /// Closes the real-time loop: gives memory and priority back. What was recorded stays.
    fn close(&mut self) {
        self.rights = None;
    }

    /// Rights of the real-time loop to locked memory and priority. Each is None (not asked), an empty text (given) or a
    /// sentence (refused).
    #[getter]
    fn rights(&self) -> (Option<String>, Option<String>) {
        let told = |right: &Right| match right {
            Right::NotAsked => None,
            Right::Given => Some(String::new()),
            Right::Refused(sentence) => Some(sentence.clone()),
        };
        self.rights.as_ref().map_or((None, None), |rights| (told(&rights.memory), told(&rights.priority)))
    }

    /// Wake-ups that the real-time loop recorded.
    #[getter]
    fn wakes(&self) -> u64 {
        self.core.wakes()
    }

    /// Deadlines that the real-time loop missed.
    #[getter]
    fn missed(&self) -> u64 {
        self.core.missed()
    }

    /// Latencies of the real-time loop from a deadline to its wake-up, s, at quantiles between 0 and 1.
    fn latencies(&self, quantiles: Vec<f64>) -> Vec<f64> {
        quantiles.into_iter().map(|quantile| self.core.latency(quantile)).collect()
    }

    /// Work of the real-time loop from a wake-up to the next wait, s, at these quantiles.
    fn work(&self, quantiles: Vec<f64>) -> Vec<f64> {
        quantiles.into_iter().map(|quantile| self.core.work(quantile)).collect()
    }

    fn __repr__(&self) -> String {
        format!("Loop(period={} s)", self.core.period())
    }
}
