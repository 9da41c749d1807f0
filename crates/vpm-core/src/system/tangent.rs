//! The state Jacobian of a machine, by dual numbers.

use super::{Build, Dynamics};
use crate::contact::ContactFriction;
use crate::effect::JointEffect;
use crate::scalar::{Dual, Scalar};

/// States up to which two directions are taken at once: the two states of a single axis, and a good fit to the vector registers.
const NARROW: usize = 4;

/// The machine in dual numbers, with as many directions at once as suit the length of its state.
#[derive(Clone, Debug)]
pub(super) enum Tangent<S> {
    /// A machine of few states.
    Narrow(Lanes<S, 2>),
    /// A machine of many.
    Wide(Lanes<S, 8>),
}

/// The machine in dual numbers of `N` directions.
#[derive(Clone, Debug)]
pub(super) struct Lanes<S, const N: usize> {
    dynamics: Dynamics<Dual<S, N>>,
    state: Vec<Dual<S, N>>,
    rate: Vec<Dual<S, N>>,
}

impl<S: Scalar> Tangent<S> {
    pub(super) fn new<E>(theta: &[S], build: impl Build<Error = E>, dim: usize) -> Result<Self, E> {
        Ok(if dim <= NARROW {
            Self::Narrow(Lanes::new(theta, build, dim)?)
        } else {
            Self::Wide(Lanes::new(theta, build, dim)?)
        })
    }

    #[inline]
    pub(super) fn hold(&mut self, number: usize, input: S) {
        match self {
            Self::Narrow(lanes) => lanes.dynamics.inputs[number] = Dual::constant(input),
            Self::Wide(lanes) => lanes.dynamics.inputs[number] = Dual::constant(input),
        }
    }

    /// df/dx, row by row.
    pub(super) fn jacobian(&mut self, x: &[S], matrix: &mut [S]) {
        match self {
            Self::Narrow(lanes) => lanes.columns(x, matrix, Dynamics::rhs),
            Self::Wide(lanes) => lanes.columns(x, matrix, Dynamics::rhs),
        }
    }

    /// df/dx with the friction laws replaced by `resistances` on the joints and by those of the `seals`.
    pub(super) fn chords(&mut self, x: &[S], matrix: &mut [S], resistances: &[S], seals: &[Option<S>]) {
        match self {
            Self::Narrow(lanes) => lanes.chords(x, matrix, resistances, seals),
            Self::Wide(lanes) => lanes.chords(x, matrix, resistances, seals),
        }
    }
}

/// The right-hand side with the friction laws of joints replaced by `resistances`, and those of contacts by their chords.
#[inline]
fn chords<S: Scalar, const N: usize>(
    dynamics: &mut Dynamics<Dual<S, N>>,
    x: &[Dual<S, N>],
    rate: &mut [Dual<S, N>],
    resistances: &[S],
) {
    let at_rest = |effects: &[(usize, JointEffect<_>)], q: &[_], v: &[_], total: &mut [_]| {
        for (joint, effect) in effects {
            total[*joint] += effect.effort_at_rest(q[*joint]);
        }
        for ((total, &v), &resistance) in total.iter_mut().zip(v).zip(resistances) {
            *total -= Dual::constant(resistance) * v;
        }
    };
    let chord = |law: &ContactFriction<Dual<S, N>>, square: Dual<S, N>, normal| {
        Dual::constant(law.chord(Dual::constant(square.value)).value) * normal
    };
    dynamics.rhs_with(x, rate, (at_rest, chord));
}

impl<S: Scalar, const N: usize> Lanes<S, N> {
    fn new<E>(theta: &[S], build: impl Build<Error = E>, dim: usize) -> Result<Self, E> {
        let lifted: Vec<_> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let zero = vec![Dual::default(); dim];
        Ok(Self { dynamics: build.dynamics(&lifted)?, state: zero.clone(), rate: zero })
    }

    fn chords(&mut self, x: &[S], matrix: &mut [S], resistances: &[S], seals: &[Option<S>]) {
        for (seal, chord) in self.dynamics.seals.iter_mut().zip(seals) {
            *seal = chord.map(Dual::constant);
        }
        self.columns(x, matrix, |d, x, rate| chords(d, x, rate, resistances));
        self.dynamics.seals.fill(None);
    }

    /// The derivative of `rhs` along each state, `N` at a time, as columns of a matrix stored row by row.
    #[inline]
    fn columns(
        &mut self,
        x: &[S],
        matrix: &mut [S],
        rhs: impl Fn(&mut Dynamics<Dual<S, N>>, &[Dual<S, N>], &mut [Dual<S, N>]),
    ) {
        let dim = x.len();
        for first in (0..dim).step_by(N) {
            for (column, (state, &value)) in self.state.iter_mut().zip(x).enumerate() {
                // A column before `first` wraps around to a lane that does not exist, which gives a constant.
                *state = Dual::variable(value, column.wrapping_sub(first));
            }
            rhs(&mut self.dynamics, &self.state, &mut self.rate);
            for (row, rate) in matrix.chunks_exact_mut(dim).zip(&self.rate) {
                for (entry, &slope) in row[first..].iter_mut().zip(&rate.gradient) {
                    *entry = slope;
                }
            }
        }
    }
}
