//! The two-link arm through the general tree: against its converged motion, and without allocations.

use allocation_counter::measure;
use serde_json::{Value, json};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::simulate::{Setting, Stepping, free_run};
use vpm_core::table::Table;
use vpm_core::{Dual, Result, Scalar};

use crate::common::two_link::{SERVOS, arm};

#[test]
fn the_arm_follows_its_converged_motion() -> Result<()> {
    // Eight curvature coordinates per link and Richardson extrapolation of 0.1 and 0.05 ms, checked against six coordinates (5e-13 m) and
    // an implicit Runge-Kutta method (1e-12 m).
    let data: Value = serde_json::from_str(include_str!("../../data/flexible_arm.json")).unwrap_or_default();
    let case = &data["cases"]["fast"];
    let (half, speed) = (
        0.5 * case["amp"].as_f64().unwrap_or(f64::NAN),
        std::f64::consts::TAU / case["T"].as_f64().unwrap_or(f64::NAN),
    );
    let d = arm(&json!({"strain": 5}))?;
    let (step, rows) = (5e-4, 2001);
    // Commands are held: those of the middle of the interval are right to second order.
    let middle = |k: usize| {
        let (sine, cosine) = (speed * step * (k as f64 + 0.5)).sin_cos();
        SERVOS.map(|[stiffness, damping]| stiffness * half * (1.0 - cosine) + damping * half * speed * sine)
    };
    let inputs: Vec<f64> = (0..rows).flat_map(middle).collect();
    let stepping = Stepping::new(step, 1, Method::Rosenbrock)?;
    let setting = Setting { description: &d, theta: &d.parameters, stepping, sensitivities: &[], interrupt: &|| false };
    let run = free_run(setting, &vec![0.0; d.n_states()], Table::new("inputs", &inputs, rows, 2)?)?;
    let layout = d.layout();
    for (k, sample) in case["samples_10Hz"].as_array().map_or(&[][..], Vec::as_slice).iter().take(10).enumerate() {
        let row = &run.outputs[(k + 1) * 200 * d.n_outputs()..];
        let [_, x, y, first, second] = [0, 1, 2, 3, 4].map(|j| sample[j].as_f64().unwrap_or(f64::NAN));
        let (tip, strain) = (&row[layout.markers()..], &row[layout.gauges()..]);
        assert!((tip[0] - x).hypot(tip[1] - y) < 2e-6, "{k}: {} {} instead of {x} {y}", tip[0], tip[1]);
        assert!(
            (strain[0] - first).abs() < 2e-7 && (strain[1] - second).abs() < 2e-7,
            "{k}: {:?} {first} {second}",
            &strain[..2]
        );
    }
    Ok(())
}

fn steps_allocate_nothing<S: Scalar>(lift: impl Fn(f64) -> S) -> Result<()> {
    let d = arm(&json!({"strain": 3}))?;
    let theta: Vec<S> = d.parameters.iter().map(|&value| lift(value)).collect();
    let mut system = d.system::<S>(&theta)?;
    for method in Method::ALL {
        system.make_for(method)?;
        let mut integrator = Integrator::new(method, system.dim());
        let (mut x, mut outputs) = (vec![S::zero(); system.dim()], vec![S::zero(); d.n_outputs()]);
        let mut rate = x.clone();
        let counted = measure(|| {
            integrator.step(&mut system, &mut x, 1e-5);
            system.sample(&x, &mut rate, &mut outputs);
        });
        assert_eq!(counted.count_total, 0, "{}", method.name());
    }
    Ok(())
}

#[test]
fn steps_of_a_flexible_machine_allocate_nothing() -> Result<()> {
    steps_allocate_nothing(|value| value)?;
    steps_allocate_nothing(Dual::<f64, 4>::constant)
}
