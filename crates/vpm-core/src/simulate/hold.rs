//! What inputs do between samples.

use super::Setting;
use crate::error::{Error, Result};
use crate::scalar::Scalar;
use crate::table::Table;

/// How inputs go on from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hold {
    /// Each keeps its value until the next sample, as the output of a digital controller does.
    #[default]
    ZeroOrder,
    /// Each goes straight to its value at the next sample.
    FirstOrder,
    /// Each follows a cubic with its values at both samples and slopes by central differences, continuous with its slope.
    Cubic,
}

impl Hold {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::ZeroOrder, Self::FirstOrder, Self::Cubic];

    /// Name of a hold in options.
    pub fn name(self) -> &'static str {
        match self {
            Self::ZeroOrder => "zero_order",
            Self::FirstOrder => "first_order",
            Self::Cubic => "cubic",
        }
    }

    /// The hold of that name.
    ///
    /// # Errors
    /// [`Error::Hold`] for a name that is none.
    pub fn from_name(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|hold| hold.name() == name).ok_or_else(|| Error::Hold { name: name.to_owned() })
    }

    /// Course of a held signal from sample `k` on, of a record whose last sample is `last`.
    pub fn course<S: Scalar>(self, k: usize, last: usize, at: impl Fn(usize) -> S) -> Course<S> {
        let begin = at(k);
        if self == Self::ZeroOrder || k >= last {
            return Course::constant(begin);
        }
        let gap = at(k + 1) - begin;
        if self == Self::FirstOrder {
            return Course([begin, gap, S::zero(), S::zero()]);
        }
        let slope = |k: usize| match (k.checked_sub(1), k + 1) {
            _ if last == 1 => gap,
            (None, _) => (at(1) * 4.0 - at(0) * 3.0 - at(2)) * 0.5,
            (Some(before), after) if after > last => (at(k) * 3.0 - at(before) * 4.0 + at(before - 1)) * 0.5,
            (Some(before), after) => (at(after) - at(before)) * 0.5,
        };
        let (first, second) = (slope(k), slope(k + 1));
        Course([begin, first, gap * 3.0 - first * 2.0 - second, first + second - gap * 2.0])
    }
}

/// Inputs of a run, sample by sample, and what they do in between.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// Row k: commands, then pressures of logged supplies, at sample k.
    pub table: Table<'a>,
    /// What happens between samples.
    pub hold: Hold,
}

impl Inputs<'_> {
    pub(super) fn expect(&self, setting: &Setting<'_>) -> Result<()> {
        self.table.expect("inputs", self.table.rows(), setting.description.n_inputs())
    }
}

/// Inputs that are held between samples.
impl<'a> From<Table<'a>> for Inputs<'a> {
    fn from(table: Table<'a>) -> Self {
        Self { table, hold: Hold::ZeroOrder }
    }
}

/// A signal from one sample to the next: coefficients of a polynomial in the share of the interval that is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course<S>([S; 4]);

impl<S: Scalar> Course<S> {
    pub(super) fn constant(value: S) -> Self {
        Self([value, S::zero(), S::zero(), S::zero()])
    }

    /// Value of a held signal at a share of the interval.
    #[inline]
    pub fn at(&self, share: S) -> S {
        let [begin, first, second, third] = self.0;
        begin + share * (first + share * (second + share * third))
    }

    /// Slope of a held signal at a share of the interval, per interval.
    #[inline]
    pub fn slope(&self, share: S) -> S {
        let [_, first, second, third] = self.0;
        first + share * (second * 2.0 + share * third * 3.0)
    }
}
