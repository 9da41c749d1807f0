//! Numbers over time: rows of equal length in one slice, as they come from outside.

use crate::error::{Error, Result};

/// A table of numbers, row by row; a row is a sample, a column a channel.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    numbers: &'a [f64],
    rows: usize,
    columns: usize,
}

impl<'a> Table<'a> {
    /// A table of `rows` and `columns`, or what is wrong with it: its size, or a number that is not finite.
    pub fn new(name: &str, numbers: &'a [f64], rows: usize, columns: usize) -> Result<Self> {
        if rows.checked_mul(columns) != Some(numbers.len()) {
            let (what, each) = (name.to_owned(), format!("entry of a table of {rows} x {columns}"));
            return Err(Error::Dimension { what, expected: rows.saturating_mul(columns), found: numbers.len(), each });
        }
        if let Some(place) = numbers.iter().position(|number| !number.is_finite()) {
            let path = match rows {
                1 => format!("{name}[{place}]"),
                _ => format!("{name}[{}, {}]", place / columns, place % columns),
            };
            return Err(Error::NonFinite { path, value: numbers[place] });
        }
        Ok(Self { numbers, rows, columns })
    }

    /// Table of a single row of `length` numbers, one per `each`.
    pub(crate) fn vector(name: &str, numbers: &'a [f64], length: usize, each: &str) -> Result<Self> {
        if numbers.len() != length {
            let (what, each) = (name.to_owned(), each.to_owned());
            return Err(Error::Dimension { what, expected: length, found: numbers.len(), each });
        }
        Self::new(name, numbers, 1, length)
    }

    /// Number of samples in a table.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of channels in a table.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// All numbers of a table, row by row.
    pub fn numbers(&self) -> &'a [f64] {
        self.numbers
    }

    /// Number of a channel at a sample of a table.
    #[inline]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.numbers[row * self.columns + column]
    }

    /// Channels of a sample in a table.
    #[inline]
    pub fn row(&self, row: usize) -> &'a [f64] {
        &self.numbers[row * self.columns..(row + 1) * self.columns]
    }

    /// Complains unless the table has this shape.
    pub(crate) fn expect(&self, name: &str, rows: usize, columns: usize) -> Result<()> {
        let wrong = |axis: &str, expected, found, each: &str| {
            Err(Error::Dimension { what: format!("the {axis} of {name}"), expected, found, each: each.to_owned() })
        };
        if self.rows != rows {
            return wrong("rows", rows, self.rows, "sample");
        }
        if self.columns != columns {
            return wrong("columns", columns, self.columns, "channel of the model");
        }
        Ok(())
    }
}
