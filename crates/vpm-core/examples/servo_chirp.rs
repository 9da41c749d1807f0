//! One second of the published servo-cylinder under a chirp from 2 to 50 Hz, timed, as JSON for `benches/servo_chirp.py`.
//!
//! `servo_chirp METHOD RATE REPEATS`: the name of an integrator, samples per second, and how often to repeat. The rows are
//! position, pressure a and pressure b every 10 ms.

use std::f64::consts::TAU;
use std::time::Instant;

use vpm_core::error::{Error, Result};
use vpm_core::integrator::{Integrator, Method};

#[path = "../tests/all/common/hydraulics.rs"]
mod hydraulics;
use hydraulics::{Chirp, Chirped, nominal};

/// How often the motion is shown.
const ROWS: usize = 100;

fn run(ode: &mut Chirped, method: Method, rate: usize, rows: &mut Vec<[f64; 3]>) -> Result<()> {
    let (mut x, mut integrator) = (ode.rest(), Integrator::new(method, 7));
    rows.clear();
    for _ in 0..ROWS {
        let pieces = (1.0 / ROWS as f64, rate.div_ceil(ROWS));
        integrator.advance(ode, &mut x, pieces, &|| false)?;
        rows.push([x[0], x[4], x[5]]);
    }
    Ok(())
}

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [name, rate, repeats] = &words[..] else {
        let what = "the arguments METHOD RATE REPEATS".to_owned();
        return Err(Error::Dimension { what, expected: 3, found: words.len(), each: "word".to_owned() });
    };
    let (method, rate) = (Method::from_name(name)?, rate.parse().unwrap_or(1000));
    let repeats: usize = repeats.parse().unwrap_or(1);
    let chirp = Chirp { amplitude: 0.5e-3, start: 2.0 * TAU, slope: 0.5 * (50.0 - 2.0) * TAU };
    let (mut ode, mut rows) = (Chirped::new(nominal(), chirp), Vec::with_capacity(ROWS));
    let mut seconds = Vec::with_capacity(repeats);
    for _ in 0..repeats.max(1) {
        let begin = Instant::now();
        run(&mut ode, method, rate, &mut rows)?;
        seconds.push(begin.elapsed().as_secs_f64());
    }
    println!("{{\"seconds\": {seconds:?}, \"rows\": {rows:?}}}");
    Ok(())
}
