//! Long computations that Ctrl-C can stop.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use vpm_core::Error;
use vpm_core::sensitivity::Interrupt;

thread_local! {
    /// Asked by this thread together with the signals: a Python function that says whether to stop.
    static WATCH: RefCell<Option<Py<PyAny>>> = const { RefCell::new(None) };
}

/// Lets long computations be interrupted when `asked()` is true, or raises. Ctrl-C reaches the main thread alone, and
/// this is how it tells the threads that work for it. None ends it.
#[pyfunction]
#[pyo3(signature = (asked))]
pub(crate) fn stop_when(asked: Option<Py<PyAny>>) {
    WATCH.set(asked);
}

/// Raises if there is an interrupt: a signal, or what the thread was told to watch.
fn check(py: Python<'_>) -> PyResult<()> {
    py.check_signals()?;
    let watch = WATCH.with_borrow(|watch| watch.as_ref().map(|asked| asked.clone_ref(py)));
    match watch {
        Some(asked) if asked.call0(py)?.is_truthy(py)? => {
            Err(PyKeyboardInterrupt::new_err(Error::Interrupted.to_string()))
        }
        _ => Ok(()),
    }
}

/// Time between two looks at the signals.
const PERIOD: Duration = Duration::from_millis(50);

/// Runs `job` beside the calling thread, with the interpreter lock released, and stops it when Python has a signal to handle.
///
/// Only Python's main thread handles signals, and the core computes on several threads: so the job gets a thread of its own, asks a
/// flag now and then, and the calling thread looks after the signals.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    job: impl FnOnce(Interrupt<'_>) -> Result<T, Error> + Send,
) -> PyResult<Result<T, Error>> {
    let stop = AtomicBool::new(false);
    py.detach(|| {
        std::thread::scope(|scope| {
            let (running, finished) = channel::<()>();
            let worker = Builder::new().name("vpm".to_owned()).spawn_scoped(scope, || {
                let _running = running; // dropped at the end, whatever the end is
                job(&|| stop.load(Ordering::Relaxed))
            })?;
            while let Err(RecvTimeoutError::Timeout) = finished.recv_timeout(PERIOD) {
                if let Err(signal) = Python::attach(check) {
                    stop.store(true, Ordering::Relaxed);
                    // The scope waits for the worker, which looks at the flag within milliseconds.
                    return worker.join().map_or_else(|_| Err(crashed()), |_| Err(signal));
                }
            }
            worker.join().map_err(|_| crashed())
        })
    })
}

/// Runs a short `job` without interrupts on this thread; a panic becomes an ordinary exception. It would be a mistake
/// of the core.
#[inline]
pub(crate) fn unbroken<T>(job: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(job)).map_err(|_| crashed())
}

fn crashed() -> PyErr {
    PyRuntimeError::new_err(
        "the core stopped on an internal error; please report it with the model and the record that lead to it",
    )
}
