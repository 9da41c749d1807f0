//! The functions of a machine: recorded as programs when they are asked for first, shared by all that run the machine.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::recorded::{Kind, Placed, Places};
use crate::error::Result;
use crate::graph::{Evaluator, Lanes, Native, Program, Unavailable};
use crate::scalar::Scalar;

/// Functions that are kept of a machine: its own, some twenty kinds, and those of the last lists of parameters and of followed joints. A fit
/// asks for up to four of each list, again and again, and takes few parameters in a list; what a search asked for and left, the next list
/// puts out.
const KEPT: usize = 256;

/// Who can record the functions of a machine.
pub(crate) trait Recorder: std::fmt::Debug + Send + Sync {
    /// Records a function of a machine of that kind, built for the checked parameters `theta`.
    ///
    /// # Errors
    /// [`crate::error::Error::Unrecorded`] where a law decides by the value of a state.
    fn record(&self, kind: &Kind, theta: &[f64]) -> Result<Placed>;
}

/// The functions of one machine.
#[derive(Debug)]
pub struct Functions {
    recorder: Box<dyn Recorder>,
    /// At most [`KEPT`], the last asked for first. Whoever runs a function has it: no evaluation comes here.
    known: Mutex<Vec<Known>>,
}

/// A function and the parameters for which it was recorded.
#[derive(Clone, Debug)]
struct Known {
    kind: Kind,
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
    pairs: OnceLock<std::result::Result<Native, String>>,
    /// Whether it holds for the parameters of the recording alone.
    pub(crate) of_values: bool,
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
    /// Functions of the machine to which the cache belongs.
    pub(crate) fn functions(&self, recorder: impl FnOnce() -> Box<dyn Recorder>) -> Arc<Functions> {
        let new = || Functions { recorder: recorder(), known: Mutex::default() };
        self.0.get_or_init(|| Arc::new(new())).clone()
    }
}

impl Functions {
    /// Recorded function of that kind from a machine's functions, for the checked parameters `theta`.
    ///
    /// # Errors
    /// [`crate::error::Error::Unrecorded`] where a law decides by the value of a state.
    pub(crate) fn function(&self, kind: &Kind, theta: &[f64]) -> Result<Arc<Function>> {
        let lock = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(function) = recall(&mut lock(), kind, theta) {
            return Ok(function);
        }
        // Without the lock: others may record meanwhile.
        let function = Arc::new(Function::new(self.recorder.record(kind, theta)?));
        let mut known = lock();
        known.retain(|own| own.kind != *kind);
        known.insert(0, Known { kind: kind.clone(), theta: theta.to_vec(), function: function.clone() });
        known.truncate(KEPT);
        Ok(function)
    }
}

/// Recalls a recorded function of that kind if it is `known` and fits the parameters `theta`.
fn recall(known: &mut [Known], kind: &Kind, theta: &[f64]) -> Option<Arc<Function>> {
    let right = |own: &Known| own.kind == *kind && (!own.function.of_values || own.theta == theta);
    let place = known.iter().position(right)?;
    known[..=place].rotate_right(1);
    Some(known[0].function.clone())
}

impl Function {
    fn new(placed: Placed) -> Self {
        let Placed { program, entries, directions, places, of_values } = placed;
        let stages = program.split(|number| number >= places.first_parameter());
        let (seldom, often) = (stages.seldom, stages.often);
        Self { places, seldom, often, entries, directions, native: OnceLock::new(), pairs: OnceLock::new(), of_values }
    }

    /// Inputs of a recorded function, with the parameters `theta` and what follows from them.
    pub(crate) fn inputs<S: Scalar>(&self, theta: &[S]) -> Vec<S> {
        let (first, given) = (self.places.first_parameter(), self.places.count());
        let mut inputs = vec![S::zero(); self.often.n_inputs()];
        inputs[first..given].copy_from_slice(theta);
        let (known, constants) = inputs.split_at_mut(given);
        Evaluator::new(&self.seldom).evaluate(known, constants);
        inputs
    }

    /// Recorded function for many inputs at once, with the parameters `theta`.
    pub(crate) fn blocks(&self, theta: &[f64]) -> Evaluator<Lanes> {
        let first = self.places.first_parameter();
        let mut evaluator: Evaluator<Lanes> = Evaluator::new(&self.often);
        evaluator.hold(first, &self.inputs(theta)[first..]);
        evaluator
    }

    /// Machine code of a recorded function, compiled at the first call, or why there is none.
    pub(crate) fn native(&self) -> std::result::Result<&Native, String> {
        self.compiled(&self.native, Native::compile)
    }

    /// Machine code of a recorded function in numbers without derivatives, likewise.
    pub(crate) fn code<S: Scalar>(&self) -> std::result::Result<&Native, String> {
        if S::plain(&[]).is_some() { self.native() } else { self.pairs() }
    }

    /// Machine code of a recorded function for two motions at a time, likewise.
    pub(crate) fn pairs(&self) -> std::result::Result<&Native, String> {
        self.compiled(&self.pairs, Native::compile_pairs)
    }

    fn compiled<'a>(
        &self,
        kept: &'a OnceLock<std::result::Result<Native, String>>,
        compile: impl Fn(&Program) -> std::result::Result<Native, Unavailable>,
    ) -> std::result::Result<&'a Native, String> {
        if self.directions.is_some() {
            return Err(
                "the derivatives are too many operations to compile; they are worked out directly instead".into()
            );
        }
        let made = kept.get_or_init(|| compile(&self.often).map_err(|reason| reason.to_string()));
        made.as_ref().map_err(Clone::clone)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::graph::Graph;

    /// Counts what it records: of each kind one number, which is an input.
    #[derive(Debug)]
    struct Counting(Arc<AtomicUsize>);

    impl Recorder for Counting {
        fn record(&self, _: &Kind, _: &[f64]) -> Result<Placed> {
            self.0.fetch_add(1, Ordering::Relaxed);
            let mut graph = Graph::new(1);
            let node = graph.input(0, 0.0);
            Ok(Placed {
                program: Program::new(&graph, &[node], 1),
                places: Places { coordinates: 0, states: 0, inputs: 0, parameters: 0 },
                entries: Vec::new(),
                directions: None,
                of_values: false,
            })
        }
    }

    #[test]
    fn of_many_lists_the_last_are_kept_and_so_is_what_is_in_use() -> Result<()> {
        let recorded = Arc::new(AtomicUsize::new(0));
        let functions = Cache::default().functions(|| Box::new(Counting(recorded.clone())));
        let count = || recorded.load(Ordering::Relaxed);
        let list = |number: usize| Kind::Derived(Box::new(Kind::Required), vec![number as u32]);
        let running = functions.function(&list(0), &[])?;
        for number in 0..4 * KEPT {
            functions.function(&Kind::Rates, &[])?;
            functions.function(&list(number), &[])?;
        }
        // The rates, asked for in between, and each list were recorded once.
        assert_eq!(count(), 1 + 4 * KEPT);
        assert_eq!(functions.known.lock().map_or(0, |known| known.len()), KEPT);
        // The last lists are at hand, the first is recorded again; who runs it still has it.
        for number in 3 * KEPT + 1..4 * KEPT {
            functions.function(&list(number), &[])?;
        }
        assert_eq!(count(), 1 + 4 * KEPT);
        assert!(!Arc::ptr_eq(&running, &functions.function(&list(0), &[])?));
        assert_eq!(count(), 2 + 4 * KEPT);
        Ok(())
    }
}
