//! Searches for a number by trial, in plain numbers.

use std::fmt::{Debug, Formatter};

/// The most arguments that a search takes.
pub const ARGUMENTS: usize = 12;

/// A number that steps in plain numbers look for, as many as it takes: what no formula of fixed length gives.
///
/// It carries no derivatives. A law refines what it finds by Newton's steps over its own numbers, which bring them in: those of an
/// implicit function, and each step doubles the order that is right.
pub struct Search {
    /// Name of the function in C; no two searches share one.
    pub name: &'static str,
    /// How many arguments it takes, at most [`ARGUMENTS`].
    pub arguments: usize,
    /// Finds it; what stands behind the arguments is zero. Does not panic.
    pub run: fn(&[f64; ARGUMENTS]) -> f64,
    /// Static functions of C99, each text after those that it needs; the last one is called with the arguments, each a `double`.
    pub source: &'static [&'static str],
}

impl Search {
    /// Result of a search with these arguments; zeros stand for those that are missing.
    #[inline]
    pub fn value(&self, arguments: impl Iterator<Item = f64>) -> f64 {
        let mut all = [0.0; ARGUMENTS];
        all.iter_mut().zip(arguments).for_each(|(to, from)| *to = from);
        (self.run)(&all)
    }
}

impl Debug for Search {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Search {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Search {}

impl std::hash::Hash for Search {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}
