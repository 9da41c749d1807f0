//! Steps timed one by one, and what their time goes into.

use allocation_counter::measure;
use numpy::PyArray1;
use pyo3::prelude::*;
use vpm_core::live::Live;
use vpm_core::timing::{Course, Stage};

use super::System;
use super::simulation::Request;
use crate::arrays::Numbers;
use crate::errors::CoreError;

type Any<'py> = Bound<'py, PyAny>;
/// Durations, allocations, bytes, stages, why there is no machine code.
type Timed<'py> = (Bound<'py, PyArray1<f64>>, u64, i64, Vec<(&'static str, f64, f64)>, Option<String>);

#[pymethods]
impl System {
    /// Timing of steps: duration in s of each of `count`, on the way through the inputs again and again. Also how often
    /// memory was asked for during these steps; the bytes that the simulation holds; and the stages of a step at
    /// `states` states: name, seconds of a call, calls. Compiled, the steps are made by machine code, where there is
    /// any; the last answer says why not.
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn time_steps<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        initial_state: &Any<'py>,
        inputs: &Any<'py>,
        time_step: f64,
        substeps: i64,
        integrator: &str,
        count: i64,
        states: usize,
        compiled: bool,
    ) -> PyResult<Timed<'py>> {
        let request = Request::new(self, theta, (time_step, substeps, integrator), &[])?;
        let initial = Numbers::vector("initial_state", initial_state)?;
        let inputs = Numbers::table("inputs", inputs)?;
        let count = usize::try_from(count)
            .map_err(|_| CoreError::new_err(format!("count must not be negative, got {count}; ask for some steps")))?;
        let (durations, allocations, bytes, stages, reason) = self.compute(py, |interrupt| {
            let setting = request.setting(&self.description, interrupt);
            let mut live = Ok(None);
            let held = measure(|| {
                live = Live::new(self.description.clone(), setting.theta, initial.values(), setting.stepping).map(Some);
            });
            live?;
            let mut course = Course::new(setting, initial.values(), inputs.as_table()?)?;
            let reason = if compiled { course.compile().err() } else { None };
            let mut durations = vec![0.0; count];
            let mut end = Ok(());
            let asked = measure(|| end = course.time(&mut durations));
            end?;
            let stages = if states > 0 { course.stages(states)? } else { Vec::new() };
            Ok((durations, asked.count_total, held.bytes_current, stages, reason))
        })?;
        let stages = stages.into_iter().map(|Stage { name, seconds, calls }| (name, seconds, calls)).collect();
        Ok((PyArray1::from_vec(py, durations), allocations, bytes, stages, reason))
    }
}
