//! Arrays between Python and the core.

use numpy::prelude::*;
use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArray3, PyArrayLikeDyn, PyReadonlyArray1};
use pyo3::prelude::*;
use vpm_core::table::Table;

use crate::errors::CoreError;

/// A copy of an array of two dimensions (or of one, as a single row), so that the core can read it without the interpreter lock.
pub(crate) struct Numbers {
    name: &'static str,
    values: Vec<f64>,
    rows: usize,
    columns: usize,
}

impl Numbers {
    /// Copies an array of one dimension.
    pub(crate) fn vector(name: &'static str, array: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (values, shape) = read(name, array)?;
        match shape[..] {
            [columns] => Ok(Self { name, values, rows: 1, columns }),
            _ => Err(wrong_shape(name, "one dimension", &shape)),
        }
    }

    /// Copies an array of two dimensions, (time, channel).
    pub(crate) fn table(name: &'static str, array: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (values, shape) = read(name, array)?;
        match shape[..] {
            [rows, columns] => Ok(Self { name, values, rows, columns }),
            _ => Err(wrong_shape(name, "two dimensions, (time, channel)", &shape)),
        }
    }

    /// All numbers of an array from Python, row by row.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Array rows of exactly `N` numbers each.
    pub(crate) fn rows_of<const N: usize>(&self) -> PyResult<Vec<[f64; N]>> {
        if self.columns != N {
            let wanted = format!("rows of {N}");
            return Err(wrong_shape(self.name, &wanted, &[self.rows, self.columns]));
        }
        Ok(self.values.as_chunks::<N>().0.to_vec())
    }

    /// Array copy as a table that the core can read.
    pub(crate) fn as_table(&self) -> Result<Table<'_>, vpm_core::Error> {
        Table::new(self.name, &self.values, self.rows, self.columns)
    }

    /// Number of an array's rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Number of an array's columns.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }
}

/// One dimension, for calls so short that a copy counts: read where it is if it is double precision and without gaps.
pub(crate) enum Vector<'py> {
    /// Python's own memory, which nobody may write meanwhile.
    There(PyReadonlyArray1<'py, f64>),
    /// A converted copy.
    Copied(Numbers),
}

impl<'py> Vector<'py> {
    /// An array of one dimension.
    #[inline]
    pub(crate) fn new(name: &'static str, array: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = array.cast::<PyArray1<f64>>()
            && array.is_contiguous()
            && let Ok(array) = array.try_readonly()
        {
            return Ok(Self::There(array));
        }
        Numbers::vector(name, array).map(Self::Copied)
    }

    /// Numbers of an array of one dimension.
    #[inline]
    pub(crate) fn values(&self) -> PyResult<&[f64]> {
        match self {
            Self::There(array) => Ok(array.as_slice()?),
            Self::Copied(numbers) => Ok(numbers.values()),
        }
    }
}

fn read(name: &str, array: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array: PyArrayLikeDyn<'_, f64, AllowTypeChange> = array.extract().map_err(|_| {
        CoreError::new_err(format!("`{name}` must be an array of numbers; convert it with numpy.asarray(..., float)"))
    })?;
    let view = array.as_array();
    // Without gaps it is one copy of memory, which matters for records.
    let values = view.as_slice().map_or_else(|| view.iter().copied().collect(), <[f64]>::to_vec);
    Ok((values, view.shape().to_vec()))
}

fn wrong_shape(name: &str, wanted: &str, shape: &[usize]) -> PyErr {
    CoreError::new_err(format!("`{name}` must have {wanted}, got shape {shape:?}; reshape it"))
}

/// Array of places in a list that Python may have counted from the end or beyond.
pub(crate) fn places(name: &str, numbers: &[i64]) -> PyResult<Vec<usize>> {
    numbers.iter().map(|&number| place(name, number)).collect()
}

/// Place in an array that Python may have counted from the end or beyond.
pub(crate) fn place(name: &str, number: i64) -> PyResult<usize> {
    usize::try_from(number)
        .map_err(|_| CoreError::new_err(format!("`{name}` must not be negative, got {number}; count from 0")))
}

/// A table as an array of shape (rows, columns).
pub(crate) fn matrix(py: Python<'_>, values: Vec<f64>, shape: [usize; 2]) -> PyResult<Bound<'_, PyArray2<f64>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// A table of vectors as an array of shape (rows, columns, entries).
pub(crate) fn cube(py: Python<'_>, values: Vec<f64>, shape: [usize; 3]) -> PyResult<Bound<'_, PyArray3<f64>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// A square matrix, row by row, as an array of shape (n, n).
#[inline]
pub(crate) fn square<'py>(py: Python<'py>, values: &[f64], n: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, values).reshape([n, n])
}
