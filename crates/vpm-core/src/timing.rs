//! How long a step takes, one by one: the distribution matters to a real-time loop, not the mean.

use std::time::Instant;

use crate::error::{Error, Result};
use crate::simulate::{Drive, Plan, Setting, Stepper, check_starts, check_state};
use crate::table::Table;

/// Duration in s of each of `count` steps on the way through `inputs`, which begins again from `initial_state` at its end.
///
/// A step is what a real-time loop does between two samples: hold the command, evaluate and record the sample, integrate all substeps.
pub fn time_steps(setting: Setting<'_>, initial_state: &[f64], inputs: Table<'_>, count: usize) -> Result<Vec<f64>> {
    inputs.expect("inputs", inputs.rows(), setting.description.n_inputs())?;
    check_state("initial_state", setting.description, initial_state)?;
    if inputs.rows() == 0 {
        let (what, each) = ("inputs".to_owned(), "sample, at least one".to_owned());
        return Err(Error::Dimension { what, expected: 1, found: 0, each });
    }
    check_starts(setting, initial_state)?;
    let plan = Plan { drive: Drive::Commands(inputs), initial: initial_state, starts: &[0], horizon: inputs.rows() };
    let mut stepper = Stepper::new(&setting, &plan, setting.theta)?;
    let mut durations = Vec::with_capacity(count);
    for number in 0..count {
        let row = number % inputs.rows();
        if row == 0 {
            stepper.restart(0);
        }
        let begin = Instant::now();
        stepper.sample(row, 0)?;
        stepper.advance(row, 0, setting.interrupt)?;
        durations.push(begin.elapsed().as_secs_f64());
    }
    Ok(durations)
}
