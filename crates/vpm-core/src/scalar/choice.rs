//! Choices by value: which of two results a law gives, depending on how two numbers compare.

use super::Scalar;

/// What a choice may give: a number, or arrays and tuples of them.
///
/// A plain number takes one branch and never works out the other; a number that records its operations works out both and
/// keeps the choice, entry by entry.
pub trait Choice<S>: Copy {
    /// Result of a choice from its two branches: what `pick` makes of each pair of numbers.
    fn choose(pick: &impl Fn(S, S) -> S, yes: Self, no: Self) -> Self;
}

impl<S: Scalar> Choice<S> for S {
    #[inline]
    fn choose(pick: &impl Fn(S, S) -> S, yes: Self, no: Self) -> Self {
        pick(yes, no)
    }
}

impl<S: Copy, T: Choice<S>, const N: usize> Choice<S> for [T; N] {
    #[inline]
    fn choose(pick: &impl Fn(S, S) -> S, yes: Self, no: Self) -> Self {
        std::array::from_fn(|k| T::choose(pick, yes[k], no[k]))
    }
}

impl<S: Copy, A: Choice<S>, B: Choice<S>> Choice<S> for (A, B) {
    #[inline]
    fn choose(pick: &impl Fn(S, S) -> S, yes: Self, no: Self) -> Self {
        (A::choose(pick, yes.0, no.0), B::choose(pick, yes.1, no.1))
    }
}
