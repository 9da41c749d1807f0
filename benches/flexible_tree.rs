//! What a flexible machine of the general tree costs: the two-link arm with three strains per link, eight coordinates.

use std::hint::black_box;
use std::time::Duration;

use criterion::Criterion;
use serde_json::json;
use vpm_core::error::Result;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;

#[path = "common/share.rs"]
mod share;
#[path = "../crates/vpm-core/tests/all/common/two_link.rs"]
mod two_link;

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    for (name, level) in [
        ("strain3", json!({"strain": 3})),
        ("bezier4", json!({"bezier": 4})),
        ("deflection4", json!({"deflection": 4})),
        ("modal3", json!({"modal": 3})),
    ] {
        let description = two_link::arm(&level)?;
        let mut system = description.system::<f64>(&description.parameters)?;
        let start: Vec<f64> = (0..system.dim()).map(|k| 0.01 * (1.0 + k as f64).sin()).collect();
        let mut rate = start.clone();
        criterion.bench_function(&format!("flexible_tree/rhs_{name}"), |bencher| {
            bencher.iter(|| system.rhs(black_box(&start), &mut rate));
        });
        for method in Method::ALL {
            let mut integrator = Integrator::new(method, system.dim());
            criterion.bench_function(&format!("flexible_tree/step_{}_{name}", method.name()), |bencher| {
                bencher.iter(|| {
                    let mut x = start.clone();
                    integrator.step(&mut system, black_box(&mut x), 1e-4);
                    x
                });
            });
            share::print(&format!("two-link arm, {name}, {}", method.name()), 1e-4, || {
                let mut x = start.clone();
                integrator.step(&mut system, black_box(&mut x), 1e-4);
            });
        }
    }
    criterion.final_summary();
    Ok(())
}
