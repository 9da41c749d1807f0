//! What a flexible arm costs: the planar two-link arm under control, over a motion of 24 s and per step.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::Criterion;
use vpm_core::Result;
use vpm_core::beam::planar::{Order, State};
use vpm_core::error::Error;

#[path = "../crates/vpm-core/tests/all/common/flexible_arm.rs"]
mod flexible_arm;
use flexible_arm::{Case, Errors, arm};
#[path = "common/share.rs"]
mod share;

/// Length of the motion in s.
const MOTION: f64 = 24.0;

/// The whole fast motion with `EACH - 1` curvature coordinates per link in steps of `step` (s).
fn motion<const EACH: usize, const ALL: usize>(
    order: Order,
    case: &Case,
    step: f64,
) -> Result<impl FnMut() + use<EACH, ALL>> {
    let (mut arm, reference) = (arm::<EACH, ALL>(order, 5, step)?, case.reference());
    let steps = (MOTION / step).round() as usize;
    Ok(move || {
        let mut state = State::default();
        for _ in 0..steps {
            arm.step(black_box(&mut state), reference);
        }
    })
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3))
        .sample_size(30)
        .configure_from_args();
    let case = Case::load("fast").ok_or(Error::Interrupted)?;
    let mut usual = motion::<5, 10>(Order::Second, &case, 2e-3)?;
    criterion.bench_function("flexible_arm/24s_four_coordinates_2ms", |bencher| bencher.iter(&mut usual));
    let mut small = motion::<4, 8>(Order::Second, &case, 2e-3)?;
    criterion.bench_function("flexible_arm/24s_three_coordinates_2ms", |bencher| bencher.iter(&mut small));
    let mut close = motion::<5, 10>(Order::Second, &case, 1e-3)?;
    criterion.bench_function("flexible_arm/24s_four_coordinates_1ms", |bencher| bencher.iter(&mut close));
    let mut high = motion::<5, 10>(Order::Fourth, &case, 1e-2)?;
    criterion.bench_function("flexible_arm/24s_four_coordinates_fourth_order_10ms", |bencher| bencher.iter(&mut high));
    criterion.final_summary();
    report("2 ms, second order", &mut usual, &case.run::<5, 10>(Order::Second, 5, 2e-3)?);
    period::<5, 10>("four coordinates", &case)?;
    period::<4, 8>("three coordinates", &case)?;
    report("10 ms, fourth order", &mut high, &case.run::<5, 10>(Order::Fourth, 5, 1e-2)?);
    Ok(())
}

/// Prints what a step of 1 ms takes of a control period, at a motion that goes on.
fn period<const EACH: usize, const ALL: usize>(name: &str, case: &Case) -> Result<()> {
    let (mut arm, reference) = (arm::<EACH, ALL>(Order::Second, 5, share::PERIOD)?, case.reference());
    let mut state = State::default();
    share::print(&format!("planar arm, {name} per link"), share::PERIOD, || arm.step(black_box(&mut state), reference));
    Ok(())
}

/// Prints speed and errors of one motion.
fn report(steps: &str, motion: &mut impl FnMut(), errors: &Errors) {
    let begin = Instant::now();
    motion();
    let wall = begin.elapsed();
    let times = MOTION / wall.as_secs_f64();
    println!("24 s of the fast motion take {wall:?} in steps of {steps}: {times:.0} times real time");
    println!("tip error {:.1e} m, strain errors {:.1e} and {:.1e}", errors.tip, errors.strain[0], errors.strain[1]);
}
