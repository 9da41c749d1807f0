//! Observers: a machine beside its log.

use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use vpm_core::simulate::{Gains, Hold, Inputs, Noise, Observed, Readings, filter, observe_all};

use super::System;
use super::simulation::Request;
use crate::arrays::{self, Numbers, cube, matrix};

type Table<'py> = Bound<'py, PyArray2<f64>>;
type Cube<'py> = Bound<'py, PyArray3<f64>>;
type Any<'py> = Bound<'py, PyAny>;
/// What an observer gives of a record: outputs, states, derivatives.
type Followed<'py> = (Table<'py>, Table<'py>, Cube<'py>);

/// A record for an observer: its first state, inputs, readings and gains.
struct Record([Numbers; 4]);

impl Record {
    fn new((initial, inputs, readings, gains): &(Any<'_>, Any<'_>, Any<'_>, Any<'_>)) -> PyResult<Self> {
        let initial = Numbers::vector("initial_state", initial)?;
        let [inputs, readings, gains] = [("inputs", inputs), ("readings", readings), ("gains", gains)]
            .map(|(name, numbers)| Numbers::table(name, numbers));
        Ok(Self([initial, inputs?, readings?, gains?]))
    }
}

#[pymethods]
impl System {
    /// Observer by an extended Kalman filter on readings of some channels. Innovations (N, m), their covariances (N, m,
    /// m), gains (N, nx, m), corrected states (N, nx) and their deviations (N, nx).
    #[pyo3(signature = (theta, initial_state, inputs, channels, readings, noise, time_step, substeps, integrator, hold="zero_order"))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn filter<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        initial_state: &Any<'py>,
        inputs: &Any<'py>,
        channels: Vec<i64>,
        readings: &Any<'py>,
        noise: (Any<'py>, Any<'py>, Any<'py>, Any<'py>),
        time_step: f64,
        substeps: i64,
        integrator: &str,
        hold: &str,
    ) -> PyResult<(Table<'py>, Cube<'py>, Cube<'py>, Table<'py>, Table<'py>)> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &[])?;
        let hold = self.checked(py, Hold::from_name(hold))?;
        let initial = Numbers::vector("initial_state", initial_state)?;
        let (inputs, readings) = (Numbers::table("inputs", inputs)?, Numbers::table("readings", readings)?);
        let channels = arrays::places("channels", &channels)?;
        let of_readings = Numbers::vector("noise of readings", &noise.0)?;
        let of_forces = Numbers::vector("noise of forces", &noise.1)?;
        let of_states = Numbers::vector("noise of states", &noise.2)?;
        let of_first = Numbers::vector("uncertainty of the first state", &noise.3)?;
        let found = self.compute(py, |interrupt| {
            let setting = request.setting(&self.description, interrupt);
            let inputs = Inputs { table: inputs.as_table()?, hold };
            let readings = Readings { channels: &channels, table: readings.as_table()? };
            let noise = Noise {
                readings: of_readings.values(),
                forces: of_forces.values(),
                states: of_states.values(),
                first: of_first.values(),
            };
            filter(setting, initial.values(), inputs, readings, noise)
        })?;
        let (rows, states, m) = (readings.rows(), self.description.n_states(), channels.len());
        Ok((
            matrix(py, found.innovations, [rows, m])?,
            cube(py, found.covariances, [rows, m, m])?,
            cube(py, found.gains, [rows, states, m])?,
            matrix(py, found.states, [rows, states])?,
            matrix(py, found.deviations, [rows, states])?,
        ))
    }

    /// Of each record, its first state, inputs, readings and gains (N, nx * m): outputs (N, ny) that an observer with these gains predicts from
    /// the samples before, or the measured ones (N, m) alone, its states before they are corrected (N, nx), and the derivatives of the measured
    /// outputs (N, m, k): of the steps, or approximate ones where these take less time and `moves` (k,) tell by how much parameters may be moved
    /// for them.
    #[pyo3(signature = (theta, records, channels, time_step, substeps, integrator, sensitivities=vec![], hold="zero_order", alone=false, moves=None, innovations=false))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn observe<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        records: Vec<(Any<'py>, Any<'py>, Any<'py>, Any<'py>)>,
        channels: Vec<i64>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        sensitivities: Vec<i64>,
        hold: &str,
        alone: bool,
        moves: Option<Any<'py>>,
        innovations: bool,
    ) -> PyResult<Vec<Followed<'py>>> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &sensitivities)?;
        let hold = self.checked(py, Hold::from_name(hold))?;
        let records: Vec<Record> = records.iter().map(Record::new).collect::<PyResult<_>>()?;
        let channels = arrays::places("channels", &channels)?;
        let moves = moves.map(|moves| Numbers::vector("moves", &moves)).transpose()?;
        let moves = moves.as_ref().map(Numbers::values);
        let runs = self.compute(py, |interrupt| {
            let setting = request.setting(&self.description, interrupt);
            let mut observed = Vec::with_capacity(records.len());
            for Record([initial, inputs, readings, gains]) in &records {
                let inputs = Inputs { table: inputs.as_table()?, hold };
                let readings = Readings { channels: &channels, table: readings.as_table()? };
                let gains = Gains { readings, gains: gains.as_table()?, innovations, alone, moves };
                observed.push(Observed { initial: initial.values(), inputs, gains });
            }
            observe_all(setting, &observed)
        })?;
        runs.into_iter().map(|run| self.run(py, run, [channels.len(), sensitivities.len()])).collect()
    }
}
