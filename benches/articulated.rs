//! What accelerations of an arm of two links cost by the number of their elements: by articulated bodies, with an implicit step in the
//! same sweep, and by a mass matrix.

use std::hint::black_box;
use std::time::Duration;

use criterion::Criterion;
use vpm_core::Result;
use vpm_core::beam::{Component, Level};
use vpm_core::data::Data;
use vpm_core::dynamics::articulated::{Shift, articulated, shifted};
use vpm_core::dynamics::flexible;
use vpm_core::model::Model;

#[path = "../crates/vpm-core/tests/all/common/element_arm.rs"]
mod element_arm;

use Component::{BendingX, BendingY, Torsion};

fn arm(criterion: &mut Criterion, name: &str, level: Level, deforms: &[Component]) -> Result<()> {
    let tree = Model::<f64>::assemble(element_arm::arm(level, deforms))?;
    let (n, mut data) = (tree.n_coordinates(), Data::new(&tree));
    let state = |size: f64| -> Vec<f64> { (0..n).map(|k| size * (1.0 + k as f64).sin()).collect() };
    let (q, v, tau) = (state(0.1), state(0.3), state(1.0));
    let shift = Shift { reach: 1e-3, resistances: &[0.1, 0.1] };
    let id = |way: &str| format!("articulated/{way}_{name}");
    criterion.bench_function(&id("plain"), |bencher| {
        bencher.iter(|| articulated(&tree, &mut data, black_box(&q), &v, &tau)[0]);
    });
    criterion.bench_function(&id("implicit"), |bencher| {
        bencher.iter(|| shifted(&tree, &mut data, (black_box(&q), &v), &tau, shift)[0]);
    });
    criterion.bench_function(&id("mass_matrix"), |bencher| {
        bencher.iter(|| {
            flexible::terms(&tree, &mut data, black_box(&q), &v);
            flexible::solve(&tree, &mut data, &q, &v, &tau)[0]
        });
    });
    Ok(())
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .sample_size(30)
        .configure_from_args();
    for elements in [1, 2, 5, 10, 20, 40] {
        arm(&mut criterion, &format!("{elements}_plane"), Level::Elements(elements), &[BendingX])?;
        arm(&mut criterion, &format!("{elements}_space"), Level::Elements(elements), &[BendingX, BendingY, Torsion])?;
    }
    for segments in [2, 3, 4, 6, 10, 20] {
        arm(&mut criterion, &format!("{segments}_lumped"), Level::Lumped(segments), &[BendingX])?;
    }
    criterion.final_summary();
    Ok(())
}
