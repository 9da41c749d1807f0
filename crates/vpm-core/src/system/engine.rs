//! Functions of a motion worked out for many motions, one after the other or in blocks.

use std::sync::Arc;

use super::Dynamics;
use super::functions::Function;
use super::recorded::{Kind, Places};
use super::routine::code_pays;
use crate::error::Result;
use crate::graph::{Evaluator, Lanes, Work};
use crate::scalar::Scalar;
use crate::spatial::Pose;

/// One of three ways to evaluate a function of a motion: the laws, blocks of motions, or machine code.
#[derive(Clone)]
pub(crate) enum Engine {
    /// The laws.
    Laws(Box<Dynamics<f64>>, Kind),
    /// Eight motions at once, operation by operation.
    Blocks(Evaluator<Lanes>),
    /// Machine code, two motions at once.
    Code(Pairs),
}

/// Machine code of a function for two motions at a time, with the memory for it.
#[derive(Clone)]
pub(crate) struct Pairs {
    function: Arc<Function>,
    /// Motion, parameters and what follows from them, each twice.
    inputs: Vec<f64>,
    outputs: Vec<f64>,
    work: Work,
}

impl Engine {
    /// Engine for a function of many motions without derivatives: machine code if there is some, or the `laws`.
    pub(crate) fn of_values(
        (kind, theta, rows): (&Kind, &[f64], usize),
        function: impl FnOnce() -> Result<Arc<Function>>,
        laws: impl FnOnce() -> Result<Dynamics<f64>>,
    ) -> Result<Self> {
        match Self::code(function, theta, rows) {
            Some(engine) => Ok(engine),
            None => Ok(Self::Laws(Box::new(laws()?), kind.clone())),
        }
    }

    /// Engine for a function of many motions with derivatives.
    pub(crate) fn of_derivatives(function: &Arc<Function>, theta: &[f64], rows: usize) -> Self {
        let code = Self::code(|| Ok(function.clone()), theta, rows);
        code.unwrap_or_else(|| Self::Blocks(function.blocks(theta)))
    }

    /// Machine code of an engine, if that pays and there is any.
    fn code(function: impl FnOnce() -> Result<Arc<Function>>, theta: &[f64], rows: usize) -> Option<Self> {
        if !code_pays(rows) {
            return None;
        }
        Pairs::new(function().ok()?, theta).map(Self::Code)
    }

    /// Runs an engine: outputs of many rows of inputs, `made` for each.
    pub(crate) fn run(&mut self, places: Places, inputs: &[f64], outputs: &mut [f64], made: usize) {
        let rows = inputs.chunks_exact(places.first_parameter()).zip(outputs.chunks_exact_mut(made.max(1)));
        match self {
            Self::Blocks(evaluator) => evaluator.run(inputs, outputs),
            Self::Code(pairs) => pairs.run(inputs, outputs, [places.first_parameter(), made.max(1)]),
            Self::Laws(dynamics, kind) => rows.for_each(|(inputs, outputs)| {
                let (state, a) = (&inputs[..places.states], &inputs[places.accelerations()..]);
                dynamics.answer(kind, state, &a[..places.coordinates], outputs);
            }),
        }
    }
}

impl Pairs {
    /// Machine code for the parameters `theta`, if there is any.
    fn new(function: Arc<Function>, theta: &[f64]) -> Option<Self> {
        let native = function.pairs().ok()?;
        let (outputs, work) = (vec![0.0; native.n_outputs()], native.work());
        let inputs = function.inputs(theta).into_iter().flat_map(|value| [value; 2]).collect();
        Some(Self { function, inputs, outputs, work })
    }

    /// Outputs of two rows of inputs after two, rows of these lengths.
    fn run(&mut self, inputs: &[f64], outputs: &mut [f64], [wide, made]: [usize; 2]) {
        let Ok(native) = self.function.pairs() else { return };
        for (inputs, outputs) in inputs.chunks(2 * wide).zip(outputs.chunks_mut(2 * made)) {
            let (first, second) = inputs.split_at(wide);
            // A row without a second stands for it.
            let second = if second.is_empty() { first } else { second };
            for (pair, (&a, &b)) in self.inputs.chunks_exact_mut(2).zip(first.iter().zip(second)) {
                pair.copy_from_slice(&[a, b]);
            }
            // The lengths are those of the function, so that this cannot fail.
            let done = native.call(&self.inputs, &mut self.outputs, &mut self.work);
            debug_assert!(done.is_ok());
            for (lane, row) in outputs.chunks_exact_mut(made).enumerate() {
                let lanes = self.outputs.chunks_exact(2).map(|pair| pair[lane]);
                row.iter_mut().zip(lanes).for_each(|(output, value)| *output = value);
            }
        }
    }
}

impl Kind {
    /// Number of values that an engine's function of a motion gives; none for other functions.
    pub(crate) fn width<S: Scalar>(&self, dynamics: &Dynamics<S>) -> usize {
        let n = dynamics.coordinates();
        match self {
            Self::Required | Self::RequiredOfTree | Self::Accelerations => n,
            Self::MassMatrix => n * n,
            Self::Levers => dynamics.layout().lines * n,
            Self::MarkerPose(_) => 16,
            Self::MarkerJacobian(_) => 6 * n,
            Self::Energy => 2,
            _ => 0,
        }
    }
}

impl<S: Scalar> Dynamics<S> {
    /// Function of a motion for an engine: its values at coordinates, rates and memories. `state` begins with
    /// coordinates and rates, and ends with memories. `third` are the accelerations, or the efforts where it is these
    /// that are given.
    pub(crate) fn answer(&mut self, kind: &Kind, state: &[S], third: &[S], numbers: &mut [S]) {
        let (n, first) = (self.coordinates(), state.len() - self.memories.len());
        let (q, v) = state[..2 * n].split_at(n);
        self.memories.hold(&state[first..]);
        match kind {
            Kind::Required => self.inverse_dynamics(q, v, third, numbers),
            Kind::RequiredOfTree => self.inverse_dynamics_of_tree(q, v, third, numbers),
            Kind::Accelerations => numbers.copy_from_slice(self.forward_dynamics(q, v, third)),
            Kind::MassMatrix => numbers.copy_from_slice(self.mass_matrix(q)),
            Kind::Levers => self.levers(q, numbers),
            Kind::MarkerPose(marker) => self.marker_pose(q, *marker as usize, numbers),
            Kind::MarkerJacobian(marker) => self.jacobian(q, *marker as usize, numbers),
            Kind::Energy => {
                let total = self.energy(q, v);
                numbers.copy_from_slice(&[total.kinetic, total.potential]);
            }
            _ => {}
        }
    }

    /// Pose of a marker at `q` for an engine, as a homogeneous matrix, 4 x 4 row by row.
    ///
    /// Checked: its derivative against the Jacobian, poses of chains against closed forms.
    pub(crate) fn marker_pose(&mut self, q: &[S], marker: usize, matrix: &mut [S]) {
        matrix.fill(S::zero());
        let Some(Pose { rotation, translation }) = self.located(q, marker) else { return };
        for (column, axis) in rotation.columns.into_iter().chain([translation]).enumerate() {
            for (row, entry) in axis.to_array().into_iter().enumerate() {
                matrix[4 * row + column] = entry;
            }
        }
        matrix[15] = S::one();
    }
}
