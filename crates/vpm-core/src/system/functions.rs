//! The functions of a machine: recorded as programs when they are asked for first, shared by all that run the machine.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::recorded::{Kind, Placed, Places};
use crate::error::Result;
use crate::graph::{Evaluator, Lanes, Native, Program};

/// Who can record the functions of a machine.
pub(crate) trait Recorder: std::fmt::Debug + Send + Sync {
    /// The function of that kind, its parts built for the checked parameters `theta`.
    ///
    /// # Errors
    /// [`crate::error::Error::Unrecorded`] where a law decides by the value of a state.
    fn record(&self, kind: &Kind, theta: &[f64]) -> Result<Placed>;
}

/// The functions of one machine.
#[derive(Debug)]
pub struct Functions {
    recorder: Box<dyn Recorder>,
    known: Mutex<HashMap<Kind, Known>>,
}

/// A function and the parameters for which it was recorded.
#[derive(Clone, Debug)]
struct Known {
    theta: Vec<f64>,
    function: Arc<Function>,
}

/// A function of a machine.
#[derive(Debug)]
pub(crate) struct Function {
    pub(crate) places: Places,
    /// What follows from parameters alone.
    pub(crate) seldom: Program,
    /// The rest: its inputs are those of the whole, then what follows from the parameters.
    pub(crate) often: Program,
    /// Row and column of each of its last outputs, if these are the entries of a matrix.
    pub(crate) entries: Vec<(usize, usize)>,
    /// What is differentiated along directions, where the entries would be too many operations.
    pub(crate) directions: Option<Program>,
    native: OnceLock<std::result::Result<Native, String>>,
    /// Whether it holds for the parameters of the recording alone.
    of_values: bool,
}

/// Where a description keeps the functions of its machine. A copy of the description begins without.
#[derive(Debug, Default)]
pub struct Cache(OnceLock<Arc<Functions>>);

impl Clone for Cache {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Cache {
    /// The functions of the machine to which the cache belongs.
    pub(crate) fn functions(&self, recorder: impl FnOnce() -> Box<dyn Recorder>) -> Arc<Functions> {
        let new = || Functions { recorder: recorder(), known: Mutex::default() };
        self.0.get_or_init(|| Arc::new(new())).clone()
    }
}

impl Functions {
    /// The function of that kind, right for the checked parameters `theta`.
    ///
    /// # Errors
    /// [`crate::error::Error::Unrecorded`] where a law decides by the value of a state.
    pub(crate) fn function(&self, kind: &Kind, theta: &[f64]) -> Result<Arc<Function>> {
        let lock = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let known = lock().get(kind).cloned();
        if let Some(known) = known.filter(|known| !known.function.of_values || known.theta == theta) {
            return Ok(known.function);
        }
        let function = Arc::new(Function::new(self.recorder.record(kind, theta)?));
        lock().insert(kind.clone(), Known { theta: theta.to_vec(), function: function.clone() });
        Ok(function)
    }
}

impl Function {
    fn new(placed: Placed) -> Self {
        let Placed { program, entries, directions, places, of_values } = placed;
        let stages = program.split(|number| number >= places.first_parameter());
        let (seldom, often) = (stages.seldom, stages.often);
        Self { places, seldom, often, entries, directions, native: OnceLock::new(), of_values }
    }

    /// Itself for the parameters `theta`, many inputs at once: rows of inputs end before the parameters.
    pub(crate) fn blocks(&self, theta: &[f64]) -> Evaluator<Lanes> {
        let (first, given) = (self.places.first_parameter(), self.places.count());
        let mut inputs = vec![0.0; self.often.n_inputs()];
        inputs[first..given].copy_from_slice(theta);
        let (known, constants) = inputs.split_at_mut(given);
        Evaluator::new(&self.seldom).evaluate(known, constants);
        let mut evaluator: Evaluator<Lanes> = Evaluator::new(&self.often);
        evaluator.hold(first, &inputs[first..]);
        evaluator
    }

    /// Its machine code, compiled when it is asked for first; or why there is none.
    pub(crate) fn native(&self) -> std::result::Result<&Native, String> {
        if self.directions.is_some() {
            return Err(
                "the derivatives are too many operations to compile; they are worked out directly instead".into()
            );
        }
        let made = self.native.get_or_init(|| Native::compile(&self.often).map_err(|reason| reason.to_string()));
        made.as_ref().map_err(Clone::clone)
    }
}
