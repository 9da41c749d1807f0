//! What one step of a polynomial NARX model of twenty terms costs: in a loop, over a record, as an actuator of a machine, and the Maxwell
//! element.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use criterion::Criterion;
use serde_json::{Value, json};
use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::live::Live;
use vpm_core::narx::{
    Lags, MaxwellNarx, MaxwellScheme, Narx, Record, Stop, Structure, Surface, Term, candidates, select,
};
use vpm_core::samples::Random;
use vpm_core::simulate::Stepping;

#[path = "common/share.rs"]
mod share;

/// Samples per call, so that the clock does not count.
const SAMPLES: usize = 1000;

/// One constant, 5 linear, 7 quadratic and 7 cubic terms of y and u up to lag 3.
fn twenty() -> Result<Narx> {
    let lags = [Lags { signal: 0, delays: vec![1, 2, 3] }, Lags { signal: 1, delays: vec![1, 2] }];
    let pool: Vec<Term> = candidates(&lags, 3, true);
    let of = |degree: usize, most: usize| pool.iter().filter(move |term| term.factors().len() == degree).take(most);
    let terms: Vec<Term> = of(0, 1).chain(of(1, 5)).chain(of(2, 7)).chain(of(3, 7)).cloned().collect();
    let theta: Vec<f64> = (0..terms.len()).map(|at| 0.05 / (1.0 + at as f64)).collect();
    Narx::new(Structure::new(&["y".to_owned(), "u".to_owned()], terms)?, &theta)
}

fn model_steps(criterion: &mut Criterion, inputs: &[f64]) -> Result<()> {
    let model = twenty()?;
    let mut stepper = model.stepper();
    criterion.bench_function("narx/20_terms/1000_steps", |b| {
        b.iter(|| inputs.iter().map(|&u| stepper.step(black_box(&[u]))).sum::<f64>());
    });
    let mut along = inputs.iter().copied().cycle();
    share::print("NARX model of 20 terms", share::PERIOD, || {
        black_box(stepper.step(black_box(&[along.next().unwrap_or(0.0)])));
    });
    let start = vec![0.0; SAMPLES];
    let record = Record { name: "noise", output: &start, inputs };
    criterion.bench_function("narx/20_terms/free_run_of_1000", |b| {
        b.iter(|| model.simulate_free_run(black_box(&record), 1e6));
    });
    criterion.bench_function("narx/20_terms/one_step_prediction_of_1000", |b| {
        b.iter(|| model.predict_one_step(black_box(&record)));
    });
    let output = model.simulate_free_run(&record, 1e6)?;
    let record = Record { name: "noise", output: &output, inputs };
    let lags = [Lags { signal: 0, delays: vec![1, 2, 3] }, Lags { signal: 1, delays: vec![1, 2, 3] }];
    let pool = Structure::new(&["y".to_owned(), "u".to_owned()], candidates(&lags, 3, true))?;
    criterion.bench_function("narx/select_10_of_84_from_1000_samples", |b| {
        b.iter(|| select(&pool, &[black_box(record)], 10, Stop::Terms).map(|found| found.error_reduction));
    });
    Ok(())
}

fn maxwell_steps(criterion: &mut Criterion, inputs: &[f64]) -> Result<()> {
    let map = |size: f64| Surface(std::array::from_fn(|at| size / (1.0 + at as f64)));
    let element = MaxwellNarx::new(map(1e5), map(0.1), 5e5, 2e3, 1e-3, MaxwellScheme::Trapezoidal)?;
    let mut state = element.start([0.0; 2], 0.0, [0.3; 2]);
    criterion.bench_function("narx/maxwell/1000_steps", |b| {
        b.iter(|| {
            inputs.iter().map(|&u| element.step(&mut state, black_box(u), black_box(0.3 + 0.01 * u))).sum::<f64>()
        });
    });
    let mut along = inputs.iter().copied().cycle();
    share::print("Maxwell NARX element", share::PERIOD, || {
        let u = along.next().unwrap_or(0.0);
        black_box(element.step(&mut state, black_box(u), black_box(0.3 + 0.01 * u)));
    });
    Ok(())
}

/// A carriage of 10 kg with friction, behind a drive.
fn carriage(drive: &Value) -> Result<Description> {
    let description = json!({
        "gravity": [0.0, 0.0, 0.0],
        "parameters": [10.0, 0.0, 20.0, 4.0],
        "parameter_names": ["carriage.mass", "nothing", "axis.friction.viscous", "drive.gain"],
        "bodies": [{"name": "carriage", "on": "world",
            "inertia": {"mass": 0, "center_of_mass": [1, 1, 1], "moments": [1, 1, 1, 1, 1, 1]},
            "joint": {"name": "axis", "kind": "prismatic", "axis": [1.0, 0.0, 0.0], "translation": [0.0, 0.0, 0.0],
                "rotation": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]}}],
        "effects": [{"type": "viscous_friction", "joint": 0, "viscous": 2}],
        "actuators": [{"name": "drive", "on": {"joint": 0}, "drive": drive}],
    });
    Description::from_json(&description.to_string())
}

/// One step of 0.1 ms of a machine that somebody else drives, with a NARX actuator of twenty terms and with an ideal one.
fn machine_steps(criterion: &mut Criterion) -> Result<()> {
    let model = twenty()?;
    let factors = |term: &Term| term.factors().iter().map(|factor| (factor.signal, factor.delay)).collect::<Vec<_>>();
    let narx = json!({"type": "narx", "sample_time": 1e-4, "inputs": [["u", "command"]],
        "terms": model.structure().terms().iter().map(factors).collect::<Vec<_>>(), "coefficients": model.coefficients()});
    for (name, drive) in [("ideal", json!({"type": "ideal", "gain": 3})), ("narx_of_20_terms", narx)] {
        for method in [Method::Rk4, Method::LinearlyImplicit] {
            let (description, stepping) = (carriage(&drive)?, Stepping::new(1e-4, 1, method)?);
            let theta = description.parameters.clone();
            let mut live = Live::new(Arc::new(description), &theta, &[0.0, 0.0], stepping)?;
            let mut sign = 1.0;
            criterion.bench_function(&format!("narx/machine_step_{}/{name}", method.name()), |b| {
                b.iter(|| {
                    sign = -sign;
                    live.step(black_box(&[sign])).map(<[f64]>::len)
                });
            });
            share::print(&format!("carriage, {name}, {}", method.name()), 1e-4, || {
                sign = -sign;
                let _ = black_box(live.step(black_box(&[sign])).map(<[f64]>::len));
            });
        }
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .configure_from_args();
    let inputs = Random::new(3).numbers(SAMPLES, 1.0);
    model_steps(&mut criterion, &inputs)?;
    maxwell_steps(&mut criterion, &inputs)?;
    machine_steps(&mut criterion)?;
    criterion.final_summary();
    Ok(())
}
