//! The state Jacobian of a machine, by dual numbers.

use super::driven::Driven;
use super::{Build, Dynamics, add_effects};
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
    /// One with drives or supplies that have states.
    Driven(Driven<S>),
}

/// The machine in dual numbers of `N` directions.
#[derive(Clone, Debug)]
pub(super) struct Lanes<S, const N: usize> {
    dynamics: Dynamics<Dual<S, N>>,
    state: Vec<Dual<S, N>>,
    rate: Vec<Dual<S, N>>,
}

/// What effects and contacts do in a right-hand side.
pub(super) trait Laws<S: Scalar> {
    /// Adds the efforts of the effects on the joints at (q, v) where the actuators push with u.
    fn add(&self, effects: &[(usize, JointEffect<S>)], state: [&[S]; 3], total: &mut [S]);
    /// Resistance of a contact's friction at the square of its velocity, under its normal force.
    fn resistance(&self, law: &ContactFriction<S>, square: S, normal: S) -> S;
}

/// The laws as they are.
#[derive(Clone, Copy, Debug)]
struct Exact;

impl<S: Scalar> Laws<S> for Exact {
    fn add(&self, effects: &[(usize, JointEffect<S>)], state: [&[S]; 3], total: &mut [S]) {
        add_effects(effects, state, total);
    }
    fn resistance(&self, law: &ContactFriction<S>, square: S, normal: S) -> S {
        law.resistance(square, normal)
    }
}

/// The friction laws of joints replaced by these resistances, and those of contacts by their chords.
#[derive(Clone, Copy, Debug)]
struct Chords<'a, S>(&'a [S]);

impl<S: Scalar, const N: usize> Laws<Dual<S, N>> for Chords<'_, S> {
    fn add(
        &self,
        effects: &[(usize, JointEffect<Dual<S, N>>)],
        [q, v, _]: [&[Dual<S, N>]; 3],
        total: &mut [Dual<S, N>],
    ) {
        for (joint, effect) in effects {
            total[*joint] += effect.effort_at_rest(q[*joint]);
        }
        for ((total, &v), &resistance) in total.iter_mut().zip(v).zip(self.0) {
            *total -= Dual::constant(resistance) * v;
        }
    }
    fn resistance(&self, law: &ContactFriction<Dual<S, N>>, square: Dual<S, N>, normal: Dual<S, N>) -> Dual<S, N> {
        Dual::constant(law.chord(Dual::constant(square.value)).value) * normal
    }
}

impl<S: Scalar> Tangent<S> {
    /// For a machine as `dynamics`.
    pub(super) fn new<E>(theta: &[S], build: impl Build<Error = E>, dynamics: &Dynamics<S>) -> Result<Self, E> {
        let dim = dynamics.dim();
        Ok(if dim <= NARROW {
            Self::Narrow(Lanes::new(theta, build, dim)?)
        } else if dynamics.ideal {
            Self::Wide(Lanes::new(theta, build, dim)?)
        } else {
            Self::Driven(Driven::new(theta, build, dim)?)
        })
    }

    #[inline]
    pub(super) fn hold(&mut self, number: usize, input: S) {
        match self {
            Self::Narrow(lanes) => lanes.dynamics.inputs[number] = Dual::constant(input),
            Self::Wide(lanes) => lanes.dynamics.inputs[number] = Dual::constant(input),
            Self::Driven(driven) => driven.dynamics.inputs[number] = Dual::constant(input),
        }
    }

    /// df/dx, row by row, at the state `x` where `machine` was evaluated last if [`Tangent::leans`].
    pub(super) fn jacobian(&mut self, machine: &mut Dynamics<S>, x: &[S], matrix: &mut [S]) {
        match self {
            Self::Narrow(lanes) => lanes.columns(x, matrix, &Exact),
            Self::Wide(lanes) => lanes.columns(x, matrix, &Exact),
            Self::Driven(driven) => driven.jacobian(machine, x, matrix, &Exact),
        }
    }

    /// df/dx with the friction laws replaced by `resistances` on the joints and by those of the `seals`, likewise the `fadings` of memories.
    pub(super) fn chords(
        &mut self,
        machine: &mut Dynamics<S>,
        x: &[S],
        matrix: &mut [S],
        (resistances, seals, fadings): (&[S], &[Option<S>], &[Option<S>]),
    ) {
        let laws = Chords(resistances);
        match self {
            Self::Narrow(lanes) => lanes.chords(x, matrix, laws, (seals, fadings)),
            Self::Wide(lanes) => lanes.chords(x, matrix, laws, (seals, fadings)),
            Self::Driven(driven) => {
                put(&mut driven.dynamics, seals, fadings);
                driven.jacobian(machine, x, matrix, &laws);
                take_back(&mut driven.dynamics);
            }
        }
    }

    /// Whether the Jacobian needs the machine to be evaluated at the state before.
    #[inline]
    pub(super) fn leans(&self) -> bool {
        matches!(self, Self::Driven(_))
    }
}

/// Replaces the friction of the seals and the fading of memories.
fn put<S: Scalar, const N: usize>(dynamics: &mut Dynamics<Dual<S, N>>, seals: &[Option<S>], fadings: &[Option<S>]) {
    for (seal, chord) in dynamics.seals.iter_mut().zip(seals) {
        *seal = chord.map(Dual::constant);
    }
    dynamics.memories.replace(fadings.iter().map(|fading| fading.map(Dual::constant)));
}

/// Takes the laws as they are again.
fn take_back<S: Scalar>(dynamics: &mut Dynamics<S>) {
    dynamics.seals.fill(None);
    dynamics.memories.replace(std::iter::repeat(None));
}

impl<S: Scalar, const N: usize> Lanes<S, N> {
    fn new<E>(theta: &[S], build: impl Build<Error = E>, dim: usize) -> Result<Self, E> {
        let lifted: Vec<_> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let zero = vec![Dual::default(); dim];
        Ok(Self { dynamics: build.dynamics(&lifted)?, state: zero.clone(), rate: zero })
    }

    fn chords(
        &mut self,
        x: &[S],
        matrix: &mut [S],
        laws: Chords<'_, S>,
        (seals, fadings): (&[Option<S>], &[Option<S>]),
    ) {
        put(&mut self.dynamics, seals, fadings);
        self.columns(x, matrix, &laws);
        take_back(&mut self.dynamics);
    }

    /// The derivative of the rates along each state, `N` at a time, as columns of a matrix stored row by row.
    #[inline]
    fn columns(&mut self, x: &[S], matrix: &mut [S], laws: &impl Laws<Dual<S, N>>) {
        let dim = x.len();
        for first in (0..dim).step_by(N) {
            for (column, (state, &value)) in self.state.iter_mut().zip(x).enumerate() {
                // A column before `first` wraps around to a lane that does not exist, which gives a constant.
                *state = Dual::variable(value, column.wrapping_sub(first));
            }
            let add = |effects: &[_], state: [&[_]; 3], total: &mut [_]| laws.add(effects, state, total);
            let resistance = |law: &_, square, normal| laws.resistance(law, square, normal);
            self.dynamics.rhs_with(&self.state, &mut self.rate, (add, resistance));
            for (row, rate) in matrix.chunks_exact_mut(dim).zip(&self.rate) {
                for (entry, &slope) in row[first..].iter_mut().zip(&rate.gradient) {
                    *entry = slope;
                }
            }
        }
    }
}
