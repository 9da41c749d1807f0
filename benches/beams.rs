//! What the map of a beam costs at each level: all sections with their Jacobian and acceleration, for values and for derivatives.

use std::hint::black_box;
use std::time::Duration;

use criterion::Criterion;
use vpm_core::beam::{Beam, Component, Level};
use vpm_core::{Dual, Result, Scalar};

#[path = "../crates/vpm-core/tests/all/common/entries.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod entries;
use entries::{entry, lift};

use Component::{BendingX, BendingY, Torsion};

/// One motion of a steel strip, 0.44 m long.
fn motion<S: Scalar>(level: Level, deforms: &[Component]) -> Result<impl FnMut() + use<S>> {
    let beam = Beam::new(&lift::<S>(&entry(level, deforms, 0.44, [0.015, 0.004])), &[0.44])?;
    let (n, mut sections) = (beam.len(), beam.sections());
    let [q, v] = [0.1, 0.2].map(|value| vec![S::from_f64(value); n]);
    Ok(move || beam.motion(black_box(&q), &v, black_box(&mut sections)))
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .sample_size(30)
        .configure_from_args();
    for level in
        [Level::Strain(3), Level::Bezier(4), Level::Deflection(4), Level::Hermite(4), Level::Modal(2), Level::Lumped(6)]
    {
        for (name, deforms) in [("plane", &[BendingX][..]), ("space", &[BendingX, BendingY, Torsion])] {
            let (mut values, mut derivatives) =
                (motion::<f64>(level, deforms)?, motion::<Dual<f64, 8>>(level, deforms)?);
            criterion.bench_function(&format!("beams/{level:?}_{name}"), |bencher| bencher.iter(&mut values));
            let id = format!("beams/{level:?}_{name}_eight_derivatives");
            criterion.bench_function(&id, |bencher| bencher.iter(&mut derivatives));
        }
    }
    Ok(())
}
