//! How long a step takes, one by one: the distribution matters to a real-time loop, not the mean; and what its time goes into.

use std::time::Instant;

use crate::error::{Error, Result};
use crate::simulate::{Drive, Plan, Setting, Stepper, check_starts, check_state};
use crate::system::Calls;
use crate::table::Table;

/// One part of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// What it does.
    pub name: &'static str,
    /// Seconds of one call, the least of several at the same state, the mean over states.
    pub seconds: f64,
    /// Calls in a step.
    pub calls: f64,
}

/// Steps on the way through inputs, which begin again from the initial state at their end. All buffers are there before the first.
///
/// A step is what a real-time loop does between two samples: hold the command, evaluate and record the sample, integrate all substeps.
pub struct Course<'a> {
    stepper: Stepper<'a, f64>,
    setting: Setting<'a>,
    rows: usize,
    next: usize,
}

impl<'a> Course<'a> {
    /// Course for timing from this state on, with checked inputs (N x inputs).
    pub fn new(setting: Setting<'a>, initial_state: &'a [f64], inputs: Table<'a>) -> Result<Self> {
        let rows = inputs.rows();
        inputs.expect("inputs", rows, setting.description.n_inputs())?;
        check_state("initial_state", setting.description, initial_state)?;
        if rows == 0 {
            let (what, each) = ("inputs".to_owned(), "sample, at least one".to_owned());
            return Err(Error::Dimension { what, expected: 1, found: 0, each });
        }
        check_starts(setting, initial_state)?;
        let plan = Plan {
            drive: Drive::Commands(inputs.into()),
            initial: initial_state,
            starts: &[0],
            horizon: rows,
            gains: None,
            beside: None,
        };
        Ok(Self { stepper: Stepper::new(&setting, &plan, setting.theta)?, setting, rows, next: 0 })
    }

    /// Compiles the steps to be timed, as long runs and compiled simulations do; or says why not.
    pub fn compile(&mut self) -> std::result::Result<(), String> {
        self.stepper.compile()
    }

    /// Times as many steps as there are places and writes the duration of each, s. Allocates nothing.
    pub fn time(&mut self, durations: &mut [f64]) -> Result<()> {
        for duration in durations {
            let row = self.begin();
            let begin = Instant::now();
            self.stepper.sample(row, 0)?;
            self.stepper.advance(row, 0, self.setting.interrupt)?;
            *duration = begin.elapsed().as_secs_f64();
        }
        Ok(())
    }

    /// What the time of a step goes into, at `states` states along the way that was timed; along the whole way if none was.
    pub fn stages(&mut self, states: usize) -> Result<Vec<Stage>> {
        let rows = if self.next == 0 { self.rows } else { self.rows.min(self.next) };
        let stride = (rows / states.max(1)).max(1);
        let mut calls = Calls::default();
        let mut parts: Vec<Stage> = Vec::new();
        self.next = 0;
        for row in 0..rows {
            self.begin();
            self.stepper.sample(row, 0)?;
            calls += self.stepper.advance_counted(row, 0, self.setting.interrupt)?;
            if row % stride == 0 {
                // After the step, which has said what the method asks for: nothing else need be timed.
                for (name, seconds) in self.stepper.parts(&calls) {
                    match parts.iter_mut().find(|stage| stage.name == name) {
                        Some(stage) => (stage.seconds, stage.calls) = (stage.seconds + seconds, stage.calls + 1.0),
                        None => parts.push(Stage { name, seconds, calls: 1.0 }),
                    }
                }
            }
        }
        self.next = 0;
        for stage in &mut parts {
            stage.seconds /= stage.calls;
            stage.calls = calls.of(stage.name) / rows as f64;
        }
        parts.retain(|stage| stage.calls > 0.0 && stage.seconds > 0.0);
        Ok(parts)
    }

    /// Row of the next timed step; at the first the machine is where the way begins.
    fn begin(&mut self) -> usize {
        let row = self.next % self.rows;
        if row == 0 {
            self.stepper.restart(0);
        }
        self.next += 1;
        row
    }
}
