//! Matrices of linearly implicit steps in plain numbers, for numbers that carry derivatives.

use super::recorded::Kind;
use super::routine::Routines;
use crate::scalar::Scalar;

/// Gives the matrices without their derivatives.
///
/// Law: a linearly implicit step has its order whatever its matrix is, see [`crate::integrator::LinearlyImplicit`]; so have derivatives that
/// follow the linearised equations by the same step with the same matrix. Derivatives of the step itself have those of the matrix beside
/// them, which are derivatives of derivatives. Checked: both differ by the square of the step.
#[derive(Clone, Debug)]
pub(super) struct Constant {
    routines: Routines<f64>,
    state: Vec<f64>,
    matrix: Vec<f64>,
    rates: Vec<f64>,
}

impl Constant {
    /// Compiles routines for constant matrices of linearly implicit steps to machine code, or says why not.
    pub(super) fn new(mut routines: Routines<f64>) -> Result<Self, String> {
        routines.compile(&Kind::Prepared)?;
        let [state, matrix, rates] = [const { Vec::new() }; 3];
        Ok(Self { routines, state, matrix, rates })
    }

    /// Holds input `number` of the machine for its constant matrix.
    #[inline]
    pub(super) fn hold(&mut self, number: usize, input: f64) {
        self.routines.hold(number, input);
    }

    /// Writes the constant matrix at `x`, row by row in `width` columns.
    pub(super) fn write<S: Scalar>(&mut self, x: &[S], matrix: &mut [S], width: usize) {
        let Self { routines, state, matrix: values, rates } = self;
        state.clear();
        state.extend(x.iter().map(Scalar::re));
        values.resize(matrix.len(), 0.0);
        rates.resize(x.len(), 0.0);
        routines.matrix(&Kind::Prepared, state, values, width, rates);
        matrix.iter_mut().zip(&*values).for_each(|(entry, &value)| *entry = S::from_f64(value));
    }
}
