//! Functions of a motion worked out for many motions, one after the other or in blocks.

use std::sync::Arc;

use super::Dynamics;
use super::functions::Function;
use super::recorded::{Kind, Places};
use super::routine::{Routine, code_pays};
use crate::error::Result;
use crate::graph::{Evaluator, Lanes};
use crate::scalar::Scalar;
use crate::spatial::Pose;

/// One of three ways to evaluate a function of a motion: the laws, blocks of motions, or machine code.
#[derive(Clone)]
pub(crate) enum Engine {
    /// The laws.
    Laws(Box<Dynamics<f64>>, Kind),
    /// Eight motions at once, operation by operation.
    Blocks(Evaluator<Lanes>),
    /// Machine code.
    Code(Box<Routine<f64>>),
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
        let mut routine = Box::new(Routine::new(function().ok()?, theta));
        routine.compile().ok()?;
        Some(Self::Code(routine))
    }

    /// Runs an engine: outputs of many rows of inputs, `made` for each.
    pub(crate) fn run(&mut self, places: Places, inputs: &[f64], outputs: &mut [f64], made: usize) {
        let rows = inputs.chunks_exact(places.first_parameter()).zip(outputs.chunks_exact_mut(made.max(1)));
        match self {
            Self::Blocks(evaluator) => evaluator.run(inputs, outputs),
            Self::Code(routine) => rows.for_each(|(inputs, outputs)| outputs.copy_from_slice(routine.at(inputs))),
            Self::Laws(dynamics, kind) => rows.for_each(|(inputs, outputs)| {
                let (state, a) = (&inputs[..places.states], &inputs[places.accelerations()..]);
                dynamics.answer(kind, state, &a[..places.coordinates], outputs);
            }),
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
