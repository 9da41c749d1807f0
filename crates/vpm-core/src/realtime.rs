//! A loop at a fixed rate: absolute deadlines, and how late the machine woke up for each of them.
//!
//! Deadline k is at `start + k period`, whatever happened before: a late wake-up does not move the next one, so that the rate has no drift
//! (the reason for `clock_nanosleep` with `TIMER_ABSTIME` in POSIX.1b, 14.2.5). Work that reaches beyond deadlines misses these; the loop
//! goes on with the next one that is still to come and counts the missed.

mod clock;
mod rights;

use hdrhistogram::Histogram;

pub use clock::{now, sleep_until};
pub use rights::{Right, Rights};

use crate::error::{Error, Result};

/// Longest time told apart from longer ones, ns: one minute.
const LONGEST: u64 = 60_000_000_000;
/// Significant decimal digits of a recorded time.
const DIGITS: u8 = 3;
/// The shortest period, s: below it no timer of an operating system wakes anybody.
const SHORTEST_PERIOD: f64 = 1e-5;
/// The longest period, s.
const LONGEST_PERIOD: f64 = 60.0;

/// One wake-up of the loop: which deadline it serves and how late it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// Number of the deadline, from 0; grows by more than one where deadlines were missed.
    pub number: u64,
    /// Time from the deadline to the wake-up, ns.
    pub late: u64,
    /// Deadlines that passed while the work before was still going on.
    pub missed: u64,
}

/// A loop at a fixed rate. After it is made, waiting allocates nothing.
#[derive(Clone, Debug)]
pub struct Loop {
    period: u64,
    /// The next deadline on the monotonic clock, ns; none before the first wait.
    deadline: Option<u64>,
    number: u64,
    woken: u64,
    missed: u64,
    latencies: Histogram<u64>,
    work: Histogram<u64>,
}

impl Loop {
    /// Real-time loop with this period in s; its clock begins with the first [`Loop::wait`].
    pub fn new(period: f64) -> Result<Self> {
        if !(SHORTEST_PERIOD..=LONGEST_PERIOD).contains(&period) {
            return Err(Error::Setting {
                setting: "period",
                condition: format!("lie between {SHORTEST_PERIOD} s and {LONGEST_PERIOD} s"),
                value: period,
                repair: "choose a rate that a timer can keep",
            });
        }
        Ok(Self {
            period: (period * 1e9).round() as u64,
            deadline: None,
            number: 0,
            woken: 0,
            missed: 0,
            latencies: histogram()?,
            work: histogram()?,
        })
    }

    /// Sleeps until the real-time loop's next deadline. None if `interrupted`, asked whenever a signal ends the sleep
    /// early, says so.
    ///
    /// The first call returns at once and begins the clock.
    pub fn wait(&mut self, mut interrupted: impl FnMut() -> bool) -> Option<Tick> {
        let before = now();
        let Some(deadline) = self.deadline else {
            self.deadline = Some(before + self.period);
            self.woken = before;
            return Some(Tick { number: 0, late: 0, missed: 0 });
        };
        self.work.saturating_record(before - self.woken);
        // Deadlines that the work has passed already are lost; one that is due just now is not.
        let missed = before.saturating_sub(deadline).div_ceil(self.period);
        let deadline = deadline + missed * self.period;
        while !sleep_until(deadline) {
            if interrupted() {
                return None;
            }
        }
        self.woken = now();
        let late = self.woken.saturating_sub(deadline);
        self.latencies.saturating_record(late);
        self.number += 1 + missed;
        self.missed += missed;
        self.deadline = Some(deadline + self.period);
        Some(Tick { number: self.number, late, missed })
    }

    /// Runs `work` at each deadline of a real-time loop, `count` times or until it returns false. True if nothing
    /// interrupted it.
    pub fn run(
        &mut self,
        count: u64,
        mut interrupted: impl FnMut() -> bool,
        mut work: impl FnMut(Tick) -> bool,
    ) -> bool {
        for _ in 0..count {
            let Some(tick) = self.wait(&mut interrupted) else { return false };
            if !work(tick) {
                break;
            }
        }
        true
    }

    /// Period of the real-time loop, s.
    pub fn period(&self) -> f64 {
        self.period as f64 * 1e-9
    }

    /// Wake-ups that the real-time loop recorded.
    pub fn wakes(&self) -> u64 {
        self.latencies.len()
    }

    /// Deadlines that the real-time loop missed.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Latency of the real-time loop: wake-up after a deadline, at the share `quantile`, s; to three digits.
    pub fn latency(&self, quantile: f64) -> f64 {
        self.latencies.value_at_quantile(quantile) as f64 * 1e-9
    }

    /// Work of the real-time loop from a wake-up to the next wait, at the share `quantile`, s; to three digits.
    pub fn work(&self, quantile: f64) -> f64 {
        self.work.value_at_quantile(quantile) as f64 * 1e-9
    }
}

fn histogram() -> Result<Histogram<u64>> {
    Histogram::new_with_bounds(1, LONGEST, DIGITS).map_err(|error| Error::Timer { message: error.to_string() })
}
