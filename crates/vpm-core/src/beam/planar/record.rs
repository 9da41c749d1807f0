//! Whole motions of an arm.

use super::arm::{Arm, Order, Reference, State};
use crate::error::{Diverged, Error, Result};

impl<const ALL: usize> State<ALL> {
    /// Coordinates, then rates.
    fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.motion.position.iter().chain(&self.motion.velocity).copied()
    }
}

impl<const LINKS: usize, const EACH: usize, const ALL: usize> Arm<LINKS, EACH, ALL> {
    /// Runs from `start` and returns `samples` states, the first of them `start` itself, `steps` steps from one to the next.
    ///
    /// Checked: a state that is not finite ends the run with an error that holds the states before, row by row.
    pub fn record(
        &mut self,
        start: State<ALL>,
        reference: impl Fn(f64) -> [Reference; LINKS] + Copy,
        samples: usize,
        steps: usize,
    ) -> Result<Vec<State<ALL>>> {
        let mut rows = Vec::with_capacity(samples);
        let mut state = start;
        for sample in 0..samples {
            if !state.numbers().all(f64::is_finite) {
                return Err(self.diverged(&rows, state.time, sample));
            }
            rows.push(state);
            for _ in 0..steps {
                self.step(&mut state, reference);
            }
        }
        Ok(rows)
    }

    fn diverged(&self, rows: &[State<ALL>], time: f64, sample: usize) -> Error {
        Error::Diverged(Box::new(Diverged {
            what: "the motion of the flexible arm".to_owned(),
            event: Diverged::NOT_FINITE.to_owned(),
            time,
            sample_index: sample,
            method: match self.order() {
                Order::Second => "linearly_implicit",
                Order::Fourth => "additive",
            }
            .to_owned(),
            step: self.step_size(),
            repair: "use a smaller step, and check gains, masses and stiffnesses with their units",
            outputs: Vec::new(),
            states: rows.iter().flat_map(State::numbers).collect(),
        }))
    }
}
