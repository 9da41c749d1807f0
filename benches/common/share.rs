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
    let (micro, percent) = (1e6 * mean, 100.0 * steps * mean / PERIOD);
    let many = if steps > 1.0 { format!("; {steps} of them take") } else { ",".to_owned() };
    println!("{name}: one step of {} ms takes {micro:.3} us{many} {percent:.3} % of a 1 ms period", 1e3 * step);
}
