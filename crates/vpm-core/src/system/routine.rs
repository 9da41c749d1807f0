//! A function of a machine as somebody runs it, with the memory for it.

use std::sync::Arc;

use super::constant::Constant;
use super::functions::{Function, Functions};
use super::recorded::Kind;
use crate::error::{Error, Result};
use crate::graph::{Evaluator, Program, Work};
use crate::integrator::Method;
use crate::scalar::{Dual, Scalar};

/// Evaluations of the rates from which on machine code pays in two runs: recording and compiling an operation takes some 10 us, and
/// each evaluation saves about half a nanosecond of it.
const PAYS: usize = 10_000;
/// How often a run that is part of a fit comes again.
const REPEATS: usize = 100;
/// Directions that are taken at once.
const LANES: usize = 8;

/// A function of a machine in numbers `S`.
#[derive(Clone, Debug)]
pub(crate) struct Routine<S> {
    function: Arc<Function>,
    /// State, inputs, parameters, then what follows from the parameters.
    inputs: Vec<S>,
    outputs: Vec<S>,
    engine: Engine<S>,
    directions: Option<Box<Directions<S>>>,
}

/// What works a program out.
#[derive(Clone, Debug)]
enum Engine<S> {
    Operations(Evaluator<S>),
    /// Machine code, of numbers without derivatives.
    Code(Work),
    /// The same of its derivatives, for numbers that carry some.
    Derivatives(Derivatives),
}

/// Machine code of a function and its derivatives by all that may move.
///
/// Law: numbers with derivatives x' along some directions give those of what is made of them, `f'(x) x'` (Griewank & Walther 2008, chapter 3).
#[derive(Clone, Debug)]
struct Derivatives {
    function: Arc<Function>,
    inputs: Vec<f64>,
    outputs: Vec<f64>,
    work: Work,
    /// How many derivatives each number has, and the inputs of all, row by row.
    counts: Vec<usize>,
    moving: Vec<usize>,
}

/// The numbers of which a matrix is the derivative, along N directions at once.
#[derive(Clone, Debug)]
struct Along<S, const N: usize> {
    evaluator: Evaluator<Dual<S, N>>,
    inputs: Vec<Dual<S, N>>,
    outputs: Vec<Dual<S, N>>,
}

/// A matrix worked out along directions.
#[derive(Clone, Debug)]
struct Directions<S> {
    /// Its values, some columns at a time: derivatives of all of it would be derivatives of derivatives.
    columns: Along<f64, LANES>,
    /// What it makes of one vector, with the derivatives that numbers carry, if any.
    product: Option<Along<S, 1>>,
}

impl<S: Scalar> Routine<S> {
    /// Routine for a machine's function with the parameters `theta`.
    pub(crate) fn new(function: Arc<Function>, theta: &[S]) -> Self {
        let (given, inputs) = (function.places.count(), function.inputs(theta));
        let (outputs, engine) = (vec![S::zero(); function.often.outputs().len()], Evaluator::new(&function.often));
        let directions = function.directions.as_ref().map(|program| {
            let values: Vec<f64> = inputs[..given].iter().map(Scalar::re).collect();
            let product = S::has_derivatives().then(|| Along::new(program, &inputs[..given]));
            Box::new(Directions { columns: Along::new(program, &values), product })
        });
        Self { function, inputs, outputs, engine: Engine::Operations(engine), directions }
    }

    /// Compiles a routine to machine code of numbers without derivatives, or says why not.
    pub(crate) fn compile(&mut self) -> std::result::Result<(), String> {
        self.engine = Engine::Code(self.function.code::<S>()?.work());
        Ok(())
    }

    /// Gives a routine machine code of its derivatives, or says why not.
    fn differentiate_by(&mut self, derived: Arc<Function>, by: &[u32]) -> std::result::Result<(), String> {
        self.engine = Engine::Derivatives(Derivatives::new(derived, by, &self.inputs, self.outputs.len())?);
        Ok(())
    }

    /// Number of operations in an evaluation of a routine without machine code.
    pub(crate) fn size(&self) -> usize {
        self.function.often.size()
    }

    /// Inputs of a routine that may carry derivatives: all but step lengths and parameters.
    fn moving(&self) -> Vec<u32> {
        let reach = self.function.places.reach();
        let (first, given) = (self.function.places.first_parameter(), self.function.places.count());
        (0..given)
            .filter(|&place| place != reach && (place < first || !self.inputs[place].is_constant()))
            .map(|place| place as u32)
            .collect()
    }

    /// Puts numbers into a routine from place `first` on.
    #[inline]
    pub(crate) fn put(&mut self, first: usize, numbers: &[S]) {
        self.inputs[first..first + numbers.len()].copy_from_slice(numbers);
    }

    /// Holds input `number` of the machine in a routine.
    #[inline]
    pub(crate) fn hold(&mut self, number: usize, input: S) {
        self.inputs[self.function.places.states + number] = input;
    }

    /// Puts the accelerations of all coordinates into a routine.
    #[inline]
    pub(crate) fn put_accelerations(&mut self, a: &[S]) {
        self.put(self.function.places.accelerations(), a);
    }

    /// State after a whole step of this length from `x` by a routine, if that is exact.
    #[inline]
    pub(crate) fn step(&mut self, x: &[S], step: f64) -> Option<&[S]> {
        self.put(self.function.places.reach(), &[S::from_f64(step)]);
        let (next, exact) = self.at(x).split_at(x.len());
        (exact[0].re() == 1.0 && exact[0].is_constant()).then_some(next)
    }

    /// Begins an additive step of a routine at the rates `v` of all coordinates.
    #[inline]
    pub(crate) fn depart(&mut self, v: &[S]) {
        self.put(self.function.places.before(), v);
    }

    /// Rates of an additive step's stage by a routine, at explicit and implicit state.
    #[inline]
    pub(crate) fn additive(&mut self, [explicit, implicit]: [&[S]; 2], reach: S, rates: &mut [S]) {
        let places = self.function.places;
        self.put(places.implicit(), implicit);
        self.put(places.reach(), &[reach]);
        rates.copy_from_slice(self.at(explicit));
        // The next stage begins its turns of friction where this one ends.
        self.depart(&rates[..places.coordinates]);
    }

    /// All outputs of a routine at state `x`.
    #[inline]
    pub(crate) fn at(&mut self, x: &[S]) -> &[S] {
        self.put(0, x);
        match &mut self.engine {
            Engine::Operations(evaluator) => evaluator.evaluate(&self.inputs, &mut self.outputs),
            Engine::Code(work) => {
                let values = (S::values(&self.inputs), S::values_mut(&mut self.outputs));
                if let (Ok(native), (Some(inputs), Some(outputs))) = (self.function.code::<S>(), values) {
                    // The lengths are those of the function, so that this cannot fail.
                    let done = native.call(inputs, outputs, work);
                    debug_assert!(done.is_ok());
                }
            }
            Engine::Derivatives(derivatives) => derivatives.evaluate(&self.inputs, &mut self.outputs),
        }
        &self.outputs
    }

    /// Rates and matrix of a routine at `x`, row by row in `width` columns. Rates are the first outputs, as many as
    /// there are states.
    pub(crate) fn matrix(&mut self, x: &[S], matrix: &mut [S], width: usize, values: &mut [S]) {
        self.at(x);
        let dim = x.len();
        values.copy_from_slice(&self.outputs[..dim]);
        matrix.fill(S::zero());
        for (&(row, column), &entry) in self.function.entries.iter().zip(&self.outputs[dim..]) {
            matrix[row * width + column] = entry;
        }
        if let Some(Directions { columns, product }) = self.directions.as_deref_mut() {
            let inputs = &self.inputs[..self.function.places.first_parameter()];
            columns.place(inputs.iter().map(Scalar::re));
            columns.matrix(matrix, dim);
            if let Some(product) = product {
                product.place(inputs.iter().copied());
            }
        }
    }

    /// Whether the last matrix of a routine lacks derivatives.
    fn turns(&self) -> bool {
        self.directions.as_ref().is_some_and(|all| all.product.is_some())
    }

    /// Correction of `k` for derivatives that a routine's last matrix lacks, see [`crate::ode::Ode::turned`].
    fn turned(&mut self, k: &[S], product: &mut [S]) {
        let Some(Along { evaluator, inputs, outputs }) = self.directions.as_mut().and_then(|all| all.product.as_mut())
        else {
            return;
        };
        for (input, k) in inputs.iter_mut().zip(k) {
            input.gradient = [S::from_f64(k.re())];
        }
        evaluator.evaluate(inputs, outputs);
        for (product, Dual { gradient: [along], .. }) in product.iter_mut().zip(outputs) {
            *product = *along - along.frozen();
        }
    }
}

impl Derivatives {
    /// Derivatives of a routine's function of so many `outputs`, `by` these inputs.
    fn new<S: Scalar>(
        function: Arc<Function>,
        by: &[u32],
        inputs: &[S],
        outputs: usize,
    ) -> std::result::Result<Self, String> {
        let (given, work) = (function.places.count(), function.native()?.work());
        let mut values = vec![0.0; function.often.n_inputs()];
        values.iter_mut().zip(&inputs[..given]).for_each(|(value, input)| *value = input.re());
        let (known, constants) = values.split_at_mut(given);
        Evaluator::new(&function.seldom).evaluate(known, constants);
        let (mut counts, made) = (vec![0; outputs], vec![0.0; function.often.outputs().len()]);
        function.entries.iter().for_each(|&(row, _)| counts[row] += 1);
        let moving = function.entries.iter().map(|&(_, column)| by[column] as usize).collect();
        Ok(Self { inputs: values, outputs: made, function, work, counts, moving })
    }

    /// All outputs of a routine at `inputs`, with derivatives along those of the inputs.
    #[inline]
    fn evaluate<S: Scalar>(&mut self, inputs: &[S], outputs: &mut [S]) {
        let moving = self.function.places.first_parameter();
        self.inputs[..moving].iter_mut().zip(inputs).for_each(|(value, input)| *value = input.re());
        if let Ok(native) = self.function.native() {
            // The lengths are those of the function, so that this cannot fail.
            let done = native.call(&self.inputs, &mut self.outputs, &mut self.work);
            debug_assert!(done.is_ok());
        }
        let (values, slopes) = self.outputs.split_at(self.counts.len());
        let mut slopes = slopes.iter().zip(&self.moving);
        for ((output, &value), &count) in outputs.iter_mut().zip(values).zip(&self.counts) {
            let mut number = S::from_f64(value);
            slopes.by_ref().take(count).for_each(|(&slope, &input)| number.add_derivatives(&inputs[input], slope));
            *output = number;
        }
    }
}

impl<S: Scalar, const N: usize> Along<S, N> {
    /// Routine's program at `inputs` with derivatives along directions.
    fn new(program: &Program, inputs: &[S]) -> Self {
        let evaluator: Evaluator<Dual<S, N>> = Evaluator::new(program);
        let outputs = vec![Dual::default(); evaluator.n_outputs()];
        Self { evaluator, inputs: inputs.iter().map(|&value| Dual::constant(value)).collect(), outputs }
    }

    /// Puts the first inputs into a routine's program.
    fn place(&mut self, inputs: impl Iterator<Item = S>) {
        self.inputs.iter_mut().zip(inputs).for_each(|(input, value)| *input = Dual::constant(value));
    }
}

impl Along<f64, LANES> {
    /// Derivatives of a routine by the first `dim` inputs as columns of a matrix stored row by row.
    fn matrix<S: Scalar>(&mut self, matrix: &mut [S], dim: usize) {
        for first in (0..dim).step_by(LANES) {
            for (column, input) in self.inputs[..dim].iter_mut().enumerate() {
                // A column before `first` wraps around to a lane that does not exist, which gives a constant.
                *input = Dual::variable(input.value, column.wrapping_sub(first));
            }
            self.evaluator.evaluate(&self.inputs, &mut self.outputs);
            for (row, output) in matrix.chunks_exact_mut(dim).zip(&self.outputs) {
                row[first..].iter_mut().zip(output.gradient).for_each(|(entry, slope)| *entry = S::from_f64(slope));
            }
        }
    }
}

/// The functions that somebody runs of a machine, each made when it is asked for first.
#[derive(Clone, Debug)]
pub(crate) struct Routines<S> {
    functions: Arc<Functions>,
    theta: Vec<S>,
    /// What the inputs of the machine hold.
    held: Vec<S>,
    made: Vec<(Kind, Routine<S>)>,
    /// Which of them gave a matrix last.
    last: Option<usize>,
    /// Gives the matrices of linearly implicit steps without their derivatives, if these may be left out.
    constant: Option<Box<Constant>>,
}

impl<S: Scalar> Routines<S> {
    /// Routines for the checked parameters `theta`, with `inputs` held at first.
    pub(crate) fn new(functions: Arc<Functions>, theta: &[S], inputs: Vec<S>) -> Self {
        Self { functions, theta: theta.to_vec(), held: inputs, made: Vec::new(), last: None, constant: None }
    }

    /// Leaves derivatives out of routines for matrices of linearly implicit steps, or says why not. That holds from now
    /// on where there is machine code of these matrices. Else it goes on as before.
    pub(crate) fn leave_matrices_constant(&mut self) -> std::result::Result<(), String> {
        let plain = |numbers: &[S]| numbers.iter().map(Scalar::re).collect::<Vec<_>>();
        let routines = Routines::new(self.functions.clone(), &plain(&self.theta), plain(&self.held));
        self.constant = Some(Box::new(Constant::new(routines)?));
        self.forget(&Kind::Prepared);
        Ok(())
    }

    /// Makes the routine of that kind if it is not there yet.
    ///
    /// # Errors
    /// As [`Functions::function`].
    pub(crate) fn make(&mut self, kind: &Kind) -> Result<()> {
        if self.get(kind).is_none() {
            let values: Vec<f64> = self.theta.iter().map(Scalar::inspect).collect();
            let mut routine = Routine::new(self.functions.function(kind, &values)?, &self.theta);
            self.held.iter().enumerate().for_each(|(number, &input)| routine.hold(number, input));
            self.made.push((kind.clone(), routine));
        }
        Ok(())
    }

    /// Makes the routine of that kind as machine code, or says why not.
    pub(crate) fn compile(&mut self, kind: &Kind) -> std::result::Result<(), String> {
        self.compile_within(kind, usize::MAX)
    }

    /// Makes the routine of that kind as machine code with at most `most` operations, or says why not.
    pub(crate) fn compile_within(&mut self, kind: &Kind, most: usize) -> std::result::Result<(), String> {
        let words = |error: Error| error.to_string();
        let fits = |function: &Function| match function.often.size() {
            size if size <= most => Ok(()),
            size => Err(format!("{size} operations are more than {most}, up to which their code is worth its time")),
        };
        self.make(kind).map_err(words)?;
        self.get(kind).map_or(Ok(()), |routine| fits(&routine.function))?;
        let one_machine = !S::has_derivatives() && self.theta.iter().all(Scalar::is_constant);
        if !one_machine && self.get(kind).is_some_and(|routine| routine.function.of_values) {
            return Err(
                "the machine is another one at other parameters, so that its code would be made again and again"
                    .to_owned(),
            );
        }
        if !S::has_derivatives() {
            return self.get(kind).map_or(Ok(()), Routine::compile);
        }
        if !S::is_first_order() {
            return Err("no machine code is made for derivatives of derivatives".to_owned());
        }
        let values: Vec<f64> = self.theta.iter().map(Scalar::re).collect();
        let by = self.get(kind).map_or_else(Vec::new, |routine| routine.moving());
        let derived = self.functions.function(&Kind::Derived(Box::new(kind.clone()), by.clone()), &values);
        let derived = derived.map_err(words)?;
        fits(&derived)?;
        self.get(kind).map_or(Ok(()), |routine| routine.differentiate_by(derived, &by))
    }

    /// Makes the routines of these kinds as machine code, all or none, or says why not.
    pub(crate) fn compile_all(&mut self, kinds: &[Kind]) -> std::result::Result<(), String> {
        kinds.iter().try_for_each(|kind| self.compile(kind)).inspect_err(|_| {
            kinds.iter().for_each(|kind| self.forget(kind));
        })
    }

    /// All outputs of a routine at the first states and accelerations `a`; NaN if it cannot be made.
    pub(crate) fn copy(&mut self, kind: &Kind, x: &[S], a: &[S], outputs: &mut [S]) {
        match self.made(kind) {
            Some(routine) => {
                routine.put_accelerations(a);
                outputs.copy_from_slice(routine.at(x));
            }
            None => outputs.fill(S::from_f64(f64::NAN)),
        }
    }

    /// Matrix by a routine, see [`Routine::matrix`]; NaN if it cannot be made.
    pub(crate) fn matrix(&mut self, kind: &Kind, x: &[S], matrix: &mut [S], width: usize, values: &mut [S]) {
        if let Some(constant) = self.constant.as_deref_mut().filter(|_| *kind == Kind::Prepared) {
            constant.write(x, matrix, width);
            self.last = None;
            return self.copy(&Kind::Rates, x, &[], values);
        }
        match self.made(kind) {
            Some(routine) => routine.matrix(x, matrix, width, values),
            None => matrix.fill(S::from_f64(f64::NAN)),
        }
        self.last = self.made.iter().position(|(own, _)| own == kind);
    }

    /// Whether the routine's last matrix lacks derivatives, see [`crate::ode::Ode::turns`].
    #[inline]
    pub(crate) fn turns(&self) -> bool {
        S::has_derivatives()
            && self.last.and_then(|last| self.made.get(last)).is_some_and(|(_, routine)| routine.turns())
    }

    /// Correction by a routine for lacking derivatives, see [`crate::ode::Ode::turned`].
    pub(crate) fn turned(&mut self, k: &[S], product: &mut [S]) {
        if let Some((_, routine)) = self.last.and_then(|last| self.made.get_mut(last)) {
            routine.turned(k, product);
        }
    }

    /// Routine of that kind, made now if it was not yet.
    fn made(&mut self, kind: &Kind) -> Option<&mut Routine<S>> {
        self.make(kind).ok().and_then(|()| self.get(kind))
    }

    /// Forgets the routine of that kind.
    pub(crate) fn forget(&mut self, kind: &Kind) {
        self.made.retain(|(own, _)| own != kind);
        self.last = None;
    }

    /// Routine of that kind, if it was made.
    #[inline]
    pub(crate) fn get(&mut self, kind: &Kind) -> Option<&mut Routine<S>> {
        self.made.iter_mut().find(|(own, _)| own == kind).map(|(_, routine)| routine)
    }

    /// Holds input `number` in all routines, see [`super::System::input`].
    #[inline]
    pub(crate) fn hold(&mut self, number: usize, input: S) {
        self.held[number] = input;
        self.made.iter_mut().for_each(|(_, routine)| routine.hold(number, input));
        if let Some(constant) = &mut self.constant {
            constant.hold(number, input.re());
        }
    }
}

/// Whether machine code of routines pays in a run with so many evaluations of the rates.
pub(crate) fn code_pays(evaluations: usize) -> bool {
    evaluations >= PAYS
}

/// Whether machine code of routines pays in so many evaluations that a fit repeats.
pub(crate) fn code_pays_in_fits(evaluations: usize) -> bool {
    code_pays(REPEATS * evaluations)
}

/// Kind of routine that steps by `method` need beside the rates.
pub(crate) fn kind_of(method: Method) -> Option<Kind> {
    match method {
        Method::Rk4 => None,
        Method::SemiImplicit => Some(Kind::Elasticity),
        Method::Additive | Method::CrankNicolson => Some(Kind::Additive),
        Method::LinearlyImplicit => Some(Kind::Prepared),
        Method::Rosenbrock | Method::Adaptive { .. } | Method::Guarded => Some(Kind::Linearised),
    }
}
