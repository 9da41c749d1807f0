//! One second of the published servo-cylinder under a chirp from 2 to 50 Hz: time beside error, for fixed and controlled steps.
//!
//! The error is the largest of piston and pressures over the end of each 10 ms, relative to their largest change along the way.

use std::f64::consts::TAU;
use std::time::Duration;

use criterion::Criterion;
use vpm_core::Result;
use vpm_core::integrator::{Adaptive, Integrator, Method};

#[path = "../crates/vpm-core/tests/common/hydraulics.rs"]
mod hydraulics;
use hydraulics::{Chirp, Chirped, nominal};

/// How often the motions are compared.
const ROWS: usize = 100;
/// Position, pressure a, pressure b.
const SHOWN: [usize; 3] = [0, 4, 5];

fn fixed(ode: &mut Chirped, method: Method, steps: usize, mut row: impl FnMut(&[f64; 7])) {
    let (mut x, mut integrator) = (ode.rest(), Integrator::new(method, 7));
    for k in 1..=steps {
        integrator.step(ode, &mut x, 1.0 / steps as f64);
        if k % (steps / ROWS) == 0 {
            row(&x);
        }
    }
}

/// Controlled steps; they are cut short at every row, or only at the end.
fn controlled(ode: &mut Chirped, tolerance: f64, rows: usize, mut row: impl FnMut(&[f64; 7])) -> Result<usize> {
    let mut adaptive = Adaptive::new(tolerance, 7)?;
    let (mut x, mut taken) = (ode.rest(), 0);
    for _ in 0..rows {
        let steps = adaptive.advance(ode, &mut x, 1.0 / rows as f64, &|| false)?;
        taken += steps.accepted + steps.refused;
        row(&x);
    }
    Ok(taken)
}

fn error(exact: &[[f64; 7]], found: &[[f64; 7]]) -> f64 {
    SHOWN.into_iter().fold(0.0, |worst: f64, k| {
        let range = exact.iter().map(|x| (x[k] - exact[0][k]).abs()).fold(0.0, f64::max);
        let off = exact.iter().zip(found).map(|(a, b)| (a[k] - b[k]).abs()).fold(0.0, f64::max);
        worst.max(off / range)
    })
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .sample_size(20)
        .configure_from_args();
    let chirp = Chirp { amplitude: 0.5e-3, start: 2.0 * TAU, slope: 0.5 * (50.0 - 2.0) * TAU };
    let (mut ode, mut exact) = (Chirped::new(nominal(), chirp), Vec::new());
    fixed(&mut ode, Method::Rosenbrock, 100_000, |x| exact.push(*x));
    for (method, rates) in [(Method::LinearlyImplicit, [1000, 4000, 10_000]), (Method::Rosenbrock, [1000, 2000, 4000])]
    {
        for rate in rates {
            let mut found = Vec::new();
            fixed(&mut ode, method, rate, |x| found.push(*x));
            println!("{} at {rate} Hz: error {:.1e}", method.name(), error(&exact, &found));
            let id = format!("hydraulic/{}_{rate}_hz", method.name());
            criterion.bench_function(&id, |bencher| bencher.iter(|| fixed(&mut ode, method, rate, |_| ())));
        }
    }
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7] {
        let mut found = Vec::new();
        controlled(&mut ode, tolerance, ROWS, |x| found.push(*x))?;
        let taken = controlled(&mut ode, tolerance, 1, |_| ())?;
        println!("controlled, tolerance {tolerance:.0e}: error {:.1e}, {taken} steps", error(&exact, &found));
        let id = format!("hydraulic/controlled_{tolerance:.0e}");
        criterion.bench_function(&id, |bencher| bencher.iter(|| controlled(&mut ode, tolerance, 1, |_| ())));
    }
    Ok(())
}
