//! Machine code of a machine's functions: made where it pays, kept with the description, shared by all that run the machine.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::Build;
use super::recorded::{Kind, Placed, Places, Recording};
use crate::error::{Error, Result};
use crate::graph::{Evaluator, Native, Program, Work};
use crate::integrator::Method;

/// Evaluations of the rates from which on machine code pays: recording and compiling an operation takes some 15 us, and
/// each evaluation saves about 1 ns of it.
const PAYS: usize = 15_000;

/// The machine code of one machine, function by function as it is asked for.
#[derive(Debug)]
pub struct Natives {
    recording: Mutex<Recording>,
    functions: [OnceLock<std::result::Result<Arc<Function>, String>>; Kind::ALL.len()],
    /// The parameters for which alone the code is right, of a machine that was built by their values.
    theta: Option<Vec<f64>>,
}

#[derive(Debug)]
struct Function {
    places: Places,
    /// What follows from parameters alone.
    seldom: Program,
    native: Native,
    entries: Vec<(usize, usize)>,
}

/// Where a description keeps the code of its machine. A copy of the description begins without.
#[derive(Debug, Default)]
pub struct Cache(Mutex<Option<std::result::Result<Arc<Natives>, String>>>);

impl Clone for Cache {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Cache {
    /// The code of the machine that `build` makes, right for the checked parameters `theta`; or why there is none.
    pub fn natives(
        &self,
        build: impl Build<Error = Error>,
        places: Places,
        theta: &[f64],
    ) -> std::result::Result<Arc<Natives>, String> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some(Ok(natives)) if natives.holds(theta) => return Ok(natives.clone()),
            Some(Err(reason)) => return Err(reason.clone()),
            _ => {}
        }
        let made = Natives::new(build, places, theta).map(Arc::new).map_err(|error| error.to_string());
        *kept = Some(made.clone());
        made
    }
}

impl Natives {
    fn new(build: impl Build<Error = Error>, places: Places, theta: &[f64]) -> Result<Self> {
        let recording = Recording::new(build, places, theta)?;
        let theta = recording.is_of_values().then(|| theta.to_vec());
        Ok(Self { recording: Mutex::new(recording), functions: Default::default(), theta })
    }

    fn holds(&self, theta: &[f64]) -> bool {
        self.theta.as_ref().is_none_or(|own| own == theta)
    }

    /// The function of that kind, compiled when it is asked for first; or why there is none.
    fn function(&self, kind: Kind) -> std::result::Result<Arc<Function>, String> {
        self.functions[kind as usize]
            .get_or_init(|| {
                let mut recording = self.recording.lock().unwrap_or_else(PoisonError::into_inner);
                let (places, Placed { program, entries }) = (recording.places(), recording.program(kind));
                let stages = program.split(|number| number >= places.first_parameter());
                let native = Native::compile(&stages.often).map_err(|reason| reason.to_string())?;
                Ok(Arc::new(Function { places, seldom: stages.seldom, native, entries }))
            })
            .clone()
    }
}

/// A compiled function with the memory of one caller.
#[derive(Clone, Debug)]
struct Call {
    function: Arc<Function>,
    /// State, inputs, parameters, then what follows from the parameters.
    inputs: Vec<f64>,
    outputs: Vec<f64>,
    work: Work,
}

impl Call {
    fn new(function: Arc<Function>, theta: &[f64]) -> Self {
        let first = function.places.first_parameter();
        let mut inputs = vec![0.0; function.native.n_inputs()];
        inputs[first..first + theta.len()].copy_from_slice(theta);
        let (given, constants) = inputs.split_at_mut(function.places.count());
        Evaluator::new(&function.seldom).run(given, constants);
        let (outputs, work) = (vec![0.0; function.native.n_outputs()], function.native.work());
        Self { function, inputs, outputs, work }
    }

    /// All outputs at state `x`.
    fn at(&mut self, x: &[f64]) -> &[f64] {
        self.inputs[..x.len()].copy_from_slice(x);
        // The lengths are those of the function, so that this cannot fail.
        let done = self.function.native.call(&self.inputs, &mut self.outputs, &mut self.work);
        debug_assert!(done.is_ok());
        &self.outputs
    }
}

/// The compiled functions of a machine that somebody runs, with their memory.
#[derive(Clone, Debug)]
pub(crate) struct Fast {
    rates: Call,
    sample: Call,
    others: Vec<(Kind, Call)>,
}

impl Fast {
    /// Whether machine code pays in a run of so many evaluations of the rates.
    pub(crate) fn pays(evaluations: usize) -> bool {
        evaluations >= PAYS
    }

    /// For steps by `method`; or why there is no code. A matrix alone that has none is worked out directly.
    pub(crate) fn new(natives: &Natives, theta: &[f64], method: Method) -> std::result::Result<Self, String> {
        let call = |kind| natives.function(kind).map(|function| Call::new(function, theta));
        let kind = match method {
            Method::SemiImplicit | Method::Rk4 => None,
            Method::Additive => Some(Kind::Additive),
            Method::LinearlyImplicit => Some(Kind::Prepared),
            Method::Rosenbrock | Method::Adaptive { .. } | Method::Guarded => Some(Kind::Linearised),
        };
        let others = kind.and_then(|kind| Some((kind, call(kind).ok()?))).into_iter().collect();
        Ok(Self { rates: call(Kind::Rates)?, sample: call(Kind::Sample)?, others })
    }

    /// Holds input `number`, see [`super::Dynamics::input`].
    #[inline]
    pub(crate) fn hold(&mut self, number: usize, input: f64) {
        for call in [&mut self.rates, &mut self.sample].into_iter().chain(self.others.iter_mut().map(|(_, call)| call))
        {
            call.inputs[call.function.places.states + number] = input;
        }
    }

    /// dx/dt at `x`.
    #[inline]
    pub(crate) fn rates(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt.copy_from_slice(self.rates.at(x));
    }

    /// dx/dt and all true outputs at `x`.
    #[inline]
    pub(crate) fn sample(&mut self, x: &[f64], dxdt: &mut [f64], outputs: &mut [f64]) {
        let (rates, seen) = self.sample.at(x).split_at(x.len());
        dxdt.copy_from_slice(rates);
        outputs.copy_from_slice(seen);
    }

    /// Begins an additive step at the rates `v` of all coordinates.
    #[inline]
    pub(crate) fn depart(&mut self, v: &[f64]) {
        if let Some((_, call)) = self.others.iter_mut().find(|(own, _)| *own == Kind::Additive) {
            let before = call.function.places.before();
            call.inputs[before..before + v.len()].copy_from_slice(v);
        }
    }

    /// Rates of a stage of an additive step at its explicit and implicit state; false if there is no code for it.
    #[inline]
    pub(crate) fn additive(&mut self, [explicit, implicit]: [&[f64]; 2], reach: f64, rates: &mut [f64]) -> bool {
        let Some((_, call)) = self.others.iter_mut().find(|(own, _)| *own == Kind::Additive) else { return false };
        let places = call.function.places;
        call.inputs[places.implicit()..places.reach()].copy_from_slice(implicit);
        call.inputs[places.reach()] = reach;
        rates.copy_from_slice(call.at(explicit));
        // The next stage begins its turns of friction where this one ends.
        let before = places.before();
        call.inputs[before..before + places.coordinates].copy_from_slice(&rates[..places.coordinates]);
        true
    }

    /// dx/dt and a matrix at `x`, row by row; false if there is no code for it.
    #[inline]
    pub(crate) fn matrix(&mut self, kind: Kind, x: &[f64], matrix: &mut [f64], dxdt: &mut [f64]) -> bool {
        let Some((_, call)) = self.others.iter_mut().find(|(own, _)| *own == kind) else { return false };
        call.at(x);
        let dim = x.len();
        dxdt.copy_from_slice(&call.outputs[..dim]);
        matrix.fill(0.0);
        for (&(row, column), &entry) in call.function.entries.iter().zip(&call.outputs[dim..]) {
            matrix[row * dim + column] = entry;
        }
        true
    }
}
