//! Constraint equations of a closed linkage, and what their derivatives say about its motion.

use crate::algebra::solve;
use crate::error::{LinkageError, Result};
use vpm_core::scalar::{Dual, Scalar};

/// A linkage with `N` dependent coordinates that `N` constraints fix for given values of `I` inputs.
pub trait ClosedLinkage<const N: usize, const I: usize> {
    /// Name of a closed linkage's constraint, for messages.
    fn name(&self) -> &str;
    /// The constraint equations `phi(q, u)`, all zero where the linkage is closed. Source: eq 2.3.
    fn constraints<S: Scalar>(&self, q: &[S; N], input: &[S; I]) -> [S; N];
}

/// Coordinates of a closed linkage over time: values, rates and accelerations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkageMotion<const N: usize> {
    /// Values (rad or m).
    pub q: [f64; N],
    /// Rates.
    pub v: [f64; N],
    /// Accelerations.
    pub a: [f64; N],
}

/// The constraints' values and their Jacobian `phi_q`, exact by dual numbers.
pub(super) fn linearised<S: Scalar, L: ClosedLinkage<N, I>, const N: usize, const I: usize>(
    linkage: &L,
    q: &[S; N],
    input: &[S; I],
) -> ([S; N], [[S; N]; N]) {
    let lifted = std::array::from_fn(|k| Dual::<S, N>::variable(q[k], k));
    let phi = linkage.constraints(&lifted, &input.map(Dual::constant));
    (phi.map(|entry| entry.value), phi.map(|entry| entry.gradient))
}

/// Constrained rates `v` of the coordinates for input rates `du`.
///
/// Law: `phi_q v + phi_u du = 0`. Source: eq 2.31. In a singular configuration an error with the pivot.
pub fn velocity<L: ClosedLinkage<N, I>, const N: usize, const I: usize>(
    linkage: &L,
    q: &[f64; N],
    input: &[f64; I],
    du: &[f64; I],
) -> Result<[f64; N]> {
    let moving = std::array::from_fn(|k| Dual::<f64, 1> { value: input[k], gradient: [du[k]] });
    let phi = linkage.constraints(&q.map(Dual::constant), &moving);
    balance(linkage, q, input, phi.map(|entry| entry.gradient[0]))
}

/// Constrained motion of the coordinates for an input motion, at coordinates `q` that close the linkage.
///
/// Law: `phi_q a + phi_q_dot v + phi_t_dot = 0`, where the last two terms are the second time derivative of the
/// constraints with `a = 0`. Source: eq 2.37 with its signs corrected. Checked: against finite differences and closed
/// forms.
pub fn acceleration<L: ClosedLinkage<N, I>, const N: usize, const I: usize>(
    linkage: &L,
    q: &[f64; N],
    input: &LinkageMotion<I>,
) -> Result<LinkageMotion<N>> {
    let v = velocity(linkage, q, &input.q, &input.v)?;
    let along = |q: f64, v: f64, a: f64| Dual {
        value: Dual::<f64, 1> { value: q, gradient: [v] },
        gradient: [Dual { value: v, gradient: [a] }],
    };
    let coordinates: [Dual<Dual<f64, 1>, 1>; N] = std::array::from_fn(|k| along(q[k], v[k], 0.0));
    let inputs = std::array::from_fn(|k| along(input.q[k], input.v[k], input.a[k]));
    let phi = linkage.constraints(&coordinates, &inputs);
    let a = balance(linkage, q, &input.q, phi.map(|entry| entry.gradient[0].gradient[0]))?;
    Ok(LinkageMotion { q: *q, v, a })
}

/// Solution x of the constraint equation `phi_q x + right = 0`.
fn balance<L: ClosedLinkage<N, I>, const N: usize, const I: usize>(
    linkage: &L,
    q: &[f64; N],
    input: &[f64; I],
    right: [f64; N],
) -> Result<[f64; N]> {
    let (_, jacobian) = linearised(linkage, q, input);
    Ok(solve(jacobian, right.map(|entry| -entry)).map_err(|pivot| singular(linkage.name(), q, pivot))?)
}

pub(super) fn singular(linkage: &str, q: &[f64], pivot: f64) -> LinkageError {
    LinkageError::Singular { linkage: linkage.to_owned(), coordinates: q.to_vec(), pivot }
}
