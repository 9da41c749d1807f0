//! What a step takes of a control period.

use std::time::{Duration, Instant};

/// Control period in s.
pub const PERIOD: f64 = 1e-3;
/// How long steps are made for the mean.
const WATCHED: Duration = Duration::from_millis(300);

/// Prints the share of a control period that its steps of so many seconds take, from the mean of many.
pub fn print(name: &str, step: f64, mut make: impl FnMut()) {
    let (begin, mut count) = (Instant::now(), 0_u32);
    while begin.elapsed() < WATCHED {
        for _ in 0..10 {
            make();
        }
        count += 10;
    }
    let mean = begin.elapsed().as_secs_f64() / f64::from(count);
    let steps = (PERIOD / step).round().max(1.0);
    let percent = 100.0 * steps * mean / PERIOD;
    let (micro, milli) = (1e6 * mean, 1e3 * step);
    println!(
        "{name}: one step of {milli} ms takes {micro:.3} us, {percent:.3} % of a 1 ms period with {steps} of them"
    );
}
