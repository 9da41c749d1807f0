//! What a closed linkage costs: the leg's equation of motion by each derivation, and the ways to assemble the limb.

use std::hint::black_box;

use criterion::Criterion;
use vpm_studies::Result;
use vpm_studies::linkage::Newton;
use vpm_studies::linkage::karl::{Karl, KarlGeometry};
use vpm_studies::linkage::leg::{HyqData, Leg, LegParameters};

#[path = "common/share.rs"]
mod share;

fn leg(criterion: &mut Criterion) -> Result<()> {
    let leg = Leg::new(LegParameters::hyq(HyqData::Cad, 0.341))?;
    let (q, v, a) = ([0.35, -1.4], [2.0, -3.0], [4.0, -5.0]);
    let mut group = criterion.benchmark_group("linkages");
    group.bench_function("leg_virtual_work", |bench| bench.iter(|| leg.terms(black_box(q), black_box(v))));
    group.bench_function("leg_lagrange", |bench| bench.iter(|| leg.lagrange(black_box(q), black_box(v))));
    group.bench_function("leg_newton_euler", |bench| bench.iter(|| leg.newton_euler(black_box(q), v, black_box(a))));
    group.bench_function("leg_forward", |bench| bench.iter(|| leg.acceleration(black_box(q), black_box(v), a)));
    group.finish();
    // What a semi-implicit step of the closed leg is made of: one evaluation of its accelerations.
    share::print("closed leg, accelerations", share::PERIOD, || {
        let _ = black_box(leg.acceleration(black_box(q), black_box(v), a));
    });
    Ok(())
}

fn karl(criterion: &mut Criterion) -> Result<()> {
    let (karl, strokes) = (Karl::new(KarlGeometry::default())?, [0.20, 0.18]);
    let start = karl.direct(strokes)?[0].angles.map(|angle| angle + 0.05);
    let mut group = criterion.benchmark_group("linkages");
    group.bench_function("karl_direct", |bench| bench.iter(|| karl.direct(black_box(strokes))));
    let newton = Newton::default();
    group.bench_function("karl_newton", |bench| bench.iter(|| newton.solve(&karl, black_box(start), &strokes)));
    group.finish();
    Ok(())
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default().configure_from_args();
    leg(&mut criterion)?;
    karl(&mut criterion)?;
    criterion.final_summary();
    Ok(())
}
