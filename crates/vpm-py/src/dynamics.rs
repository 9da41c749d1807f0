//! The class `Dynamics`: single evaluations, as fast as the crossing into Python allows.

use std::sync::{Mutex, MutexGuard};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use vpm_core::prepared::Prepared;

use crate::arrays::{Numbers, Vector, place, square};
use crate::errors::{CoreError, exception};
use crate::interrupt::unbroken;
use crate::system::System;

type Row<'py> = Bound<'py, PyArray1<f64>>;
type Any<'py> = Bound<'py, PyAny>;

/// The dynamics of a machine with fixed parameters, all buffers prepared.
///
/// Arrays of one dimension, double precision and without gaps are read where they are; everything else is converted first. One
/// result array is made per call. Several threads may share an object, but each its own is faster.
///
/// Parameters
/// ----------
/// system : System
/// theta : array_like, shape (P,)
///
/// Raises
/// ------
/// CoreError
///     A parameter is not possible; one sentence with the repair.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct Dynamics {
    prepared: Mutex<Prepared>,
}

impl Dynamics {
    /// Buffers of `Dynamics`. With the interpreter lock held they are always free; without one (free-threaded Python) a
    /// call may find them taken.
    #[inline]
    fn prepared(&self) -> PyResult<MutexGuard<'_, Prepared>> {
        self.prepared.try_lock().map_err(|_| {
            CoreError::new_err("these dynamics are at work in another thread; give each thread its own dynamics")
        })
    }
}

#[pymethods]
impl Dynamics {
    #[new]
    fn new(py: Python<'_>, system: &System, theta: &Any<'_>) -> PyResult<Self> {
        let theta = Numbers::vector("theta", theta)?;
        let prepared = Prepared::new(system.description(), theta.values());
        Ok(Self { prepared: Mutex::new(system.checked(py, prepared)?) })
    }

    /// Inverse dynamics of `Dynamics`: efforts (n,) that accelerations (n,) need, effects carried as well.
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        acceleration: &Any<'py>,
    ) -> PyResult<Row<'py>> {
        let (q, v) = (Vector::new("position", position)?, Vector::new("velocity", velocity)?);
        let a = Vector::new("acceleration", acceleration)?;
        let mut prepared = self.prepared()?;
        let (q, v, a) = (q.values()?, v.values()?, a.values()?);
        let result = unbroken(|| prepared.inverse_dynamics(q, v, a))?;
        result.map(|effort| PyArray1::from_slice(py, effort)).map_err(|error| exception(py, error, 0, 0))
    }

    /// Forward dynamics of `Dynamics`: accelerations (n,) that efforts (n,) give, with all effects.
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        position: &Any<'py>,
        velocity: &Any<'py>,
        effort: &Any<'py>,
    ) -> PyResult<Row<'py>> {
        let (q, v) = (Vector::new("position", position)?, Vector::new("velocity", velocity)?);
        let effort = Vector::new("effort", effort)?;
        let mut prepared = self.prepared()?;
        let (q, v, effort) = (q.values()?, v.values()?, effort.values()?);
        let result = unbroken(|| prepared.forward_dynamics(q, v, effort))?;
        result.map(|a| PyArray1::from_slice(py, a)).map_err(|error| exception(py, error, 0, 0))
    }

    /// Mass matrix (n, n) of `Dynamics`, payloads included.
    fn mass_matrix<'py>(&self, py: Python<'py>, position: &Any<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let q = Vector::new("position", position)?;
        let mut prepared = self.prepared()?;
        let n = prepared.coordinates();
        let q = q.values()?;
        match unbroken(|| prepared.mass_matrix(q))? {
            Ok(matrix) => square(py, matrix, n),
            Err(error) => Err(exception(py, error, 0, 0)),
        }
    }

    /// Kinetic and potential energy of `Dynamics` in J: of bodies in gravity, and of effects with a potential.
    fn energy(&self, py: Python<'_>, position: &Any<'_>, velocity: &Any<'_>) -> PyResult<(f64, f64)> {
        let (q, v) = (Vector::new("position", position)?, Vector::new("velocity", velocity)?);
        let (q, v) = (q.values()?, v.values()?);
        let mut prepared = self.prepared()?;
        unbroken(|| prepared.energy(q, v))?.map_err(|error| exception(py, error, 0, 0))
    }

    /// Jacobian (6, n) of a marker by `Dynamics`: angular velocity, then velocity of its origin, in world axes.
    fn jacobian<'py>(&self, py: Python<'py>, position: &Any<'py>, marker: i64) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let q = Vector::new("position", position)?;
        let marker = place("marker", marker)?;
        let mut prepared = self.prepared()?;
        let n = prepared.coordinates();
        let q = q.values()?;
        match unbroken(|| prepared.jacobian(q, marker))? {
            Ok(jacobian) => PyArray1::from_slice(py, jacobian).reshape([6, n]),
            Err(error) => Err(exception(py, error, 0, 0)),
        }
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("Dynamics(coordinates={})", self.prepared()?.coordinates()))
    }
}
