//! What one step costs: the axis with each integrator, a closed-loop sample, inverse dynamics, and the recursions on a long chain.
//!
//! The last line puts the axis in proportion: the share of a 1 ms control period that one step takes.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::Criterion;
use serde_json::json;
use vpm_core::data::Data;
use vpm_core::description::Description;
use vpm_core::dynamics::{aba, crba, rnea};
use vpm_core::error::{Error, Result};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::ode::Ode;
use vpm_core::samples::{Random, arm7};
use vpm_core::simulate::{Setting, Stepping, closed_loop};
use vpm_core::table::Table;

/// Control period in s.
const PERIOD: f64 = 1e-3;
/// Samples of a record; its fixed cost is spread over them.
const ROWS: usize = 10_000;

/// A positioning axis: 95 kg on a screw, friction of four kinds, a delayed drive, a cascade controller.
fn axis() -> Result<Description> {
    let names = [
        ("carriage.mass", 95.0),
        ("carriage.center_of_mass.x", 0.0),
        ("axis.friction.viscous", 200.0),
        ("axis.friction.coulomb", 20.0),
        ("axis.friction.transition_velocity", 1e-3),
        ("axis.friction.stribeck", 4.0),
        ("axis.friction.stribeck_velocity", 0.01),
        ("axis.bias.force", -3.0),
        ("drive.gain", 35.0),
        ("drive.delay.time", 1.3e-3),
        ("servo.position_gain", 160.0),
        ("servo.velocity_gain", 243.0),
        ("servo.limit", 10.0),
    ];
    let (parameter_names, parameters): (Vec<_>, Vec<_>) = names.into_iter().unzip();
    let description = json!({
        "gravity": [0.0, 0.0, 0.0],
        "parameters": parameters,
        "parameter_names": parameter_names,
        "bodies": [{"name": "carriage", "on": "world", "inertia": {"mass": 0, "center_of_mass": [1, 1, 1], "moments": [1, 1, 1, 1, 1, 1]},
            "joint": {"name": "axis", "kind": "prismatic", "axis": [1.0, 0.0, 0.0], "translation": [0.0, 0.0, 0.0],
                "rotation": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]}}],
        "effects": [
            {"type": "viscous_friction", "joint": 0, "viscous": 2},
            {"type": "coulomb_friction", "joint": 0, "coulomb": 3, "transition_velocity": 4},
            {"type": "stribeck_friction", "joint": 0, "stribeck": 5, "stribeck_velocity": 6, "transition_velocity": 4},
            {"type": "bias_force", "joint": 0, "force": 7}],
        "actuators": [{"name": "drive", "on": {"joint": 0}, "drive": {"type": "ideal", "gain": 8}, "delay": 9}],
        "controllers": [{"type": "cascade", "name": "servo", "actuator": 0, "measures": {"kind": "position", "joint": 0},
            "position_gain": 10, "velocity_gain": 11, "limit": 12}],
    });
    Description::from_json(&description.to_string())
}

/// One step of 1 ms of the axis, moving through its friction.
fn steps(criterion: &mut Criterion, description: &Description) -> Result<()> {
    for method in Method::ALL {
        let mut step = stepper(description, method)?;
        criterion.bench_function(&format!("axis/step_{}", method.name()), |bencher| bencher.iter(&mut step));
    }
    Ok(())
}

/// A closure that takes one step and swings between the directions of motion.
fn stepper(description: &Description, method: Method) -> Result<impl FnMut() + use<>> {
    let mut system = description.system::<f64>(&description.parameters)?;
    let mut integrator = Integrator::new(method, system.dim());
    let (mut state, mut time) = (vec![0.0, 0.01], 0.0_f64);
    Ok(move || {
        system.hold(0, 2.0 * time.sin());
        integrator.step(&mut system, black_box(&mut state), PERIOD);
        time += 0.01;
    })
}

/// One sample of whole-record computations, their fixed cost spread over the record.
fn samples(criterion: &mut Criterion, description: &Description) -> Result<()> {
    let wave: Vec<f64> = (0..ROWS).map(|k| 0.1 * (0.002 * k as f64).sin()).collect();
    let table = Table::new("record", &wave, ROWS, 1)?;
    let stepping = Stepping::new(PERIOD, 1, Method::LinearlyImplicit)?;
    let theta = &description.parameters;
    let setting = Setting { description, theta, stepping, sensitivities: &[], interrupt: &|| false };
    per_sample(criterion, "axis/closed_loop_sample", || closed_loop(setting, &[0.0, 0.0], table, table).map(drop))?;
    let four = Setting { sensitivities: &[0, 2, 3, 8], ..setting };
    per_sample(criterion, "axis/closed_loop_sample_four_sensitivities", || {
        closed_loop(four, &[0.0, 0.0], table, table).map(drop)
    })?;
    let motion = Motion { position: table, velocity: table, acceleration: table, inputs: table, time_step: PERIOD };
    per_sample(criterion, "axis/inverse_dynamics_sample", || {
        inverse_dynamics(description, theta, motion, &[], &|| false).map(drop)
    })
}

/// Times a computation over [`ROWS`] samples and reports the time of one.
fn per_sample(criterion: &mut Criterion, name: &str, mut record: impl FnMut() -> Result<()>) -> Result<()> {
    record()?;
    criterion.bench_function(name, |bencher| {
        bencher.iter_custom(|iterations| {
            let records = iterations.div_ceil(ROWS as u64);
            let begin = Instant::now();
            for _ in 0..records {
                black_box(record().is_ok());
            }
            begin.elapsed().mul_f64(iterations as f64 / (records * ROWS as u64) as f64)
        });
    });
    Ok(())
}

/// The recursions on a seven-joint arm.
fn chain(criterion: &mut Criterion) -> Result<()> {
    let model = arm7().model::<f64>()?;
    let (mut data, mut random) = (Data::new(&model), Random::new(1));
    let [q, v, a] = [3.0, 1.0, 5.0].map(|size| random.numbers(7, size));
    criterion.bench_function("chain7/rnea", |bencher| {
        bencher.iter(|| black_box(rnea(&model, &mut data, black_box(&q), &v, &a)[0]));
    });
    criterion.bench_function("chain7/crba", |bencher| {
        bencher.iter(|| black_box(crba(&model, &mut data, black_box(&q))[0]));
    });
    criterion.bench_function("chain7/aba", |bencher| {
        bencher.iter(|| black_box(aba(&model, &mut data, black_box(&q), &v, &a)[0]));
    });
    Ok(())
}

/// The share of the control period that one step takes, averaged over many.
fn share(description: &Description) -> Result<()> {
    const STEPS: u32 = 1_000_000;
    let mut step = stepper(description, Method::LinearlyImplicit)?;
    let begin = Instant::now();
    for _ in 0..STEPS {
        step();
    }
    let mean = begin.elapsed() / STEPS;
    let percent = 100.0 * mean.as_secs_f64() / PERIOD;
    println!("one linearly implicit step of the axis takes {mean:?}: {percent:.3} % of a 1 ms period");
    Ok(())
}

fn main() -> std::result::Result<(), Error> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    let description = axis()?;
    steps(&mut criterion, &description)?;
    samples(&mut criterion, &description)?;
    chain(&mut criterion)?;
    criterion.final_summary();
    share(&description)
}
