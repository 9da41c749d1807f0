//! The two-link arm through the general tree: against its converged motion, against its rigid limit, and without allocations.

use allocation_counter::measure;
use serde_json::{Value, json};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::simulate::{Setting, Stepping, free_run};
use vpm_core::table::Table;
use vpm_core::{Dual, Result, Scalar, evaluate};

#[path = "common/two_link.rs"]
mod two_link;
use two_link::{SERVOS, arm};

#[test]
fn the_arm_follows_its_converged_motion() -> Result<()> {
    // Eight curvature coordinates per link, Richardson extrapolation: see tests/common/flexible_arm.rs.
    let data: Value = serde_json::from_str(include_str!("data/flexible_arm.json")).unwrap_or_default();
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

#[test]
fn without_compliance_the_arm_is_the_rigid_one() -> Result<()> {
    // Stiffness a million times larger: what beams still give is a millionth of the little they give.
    let (elastic, rigid) = (arm(&json!({"strain": 3}))?, arm(&json!("rigid"))?);
    assert_eq!((elastic.n_coordinates(), rigid.n_coordinates(), rigid.n_elastic()), (8, 2, 0));
    let young = elastic.parameter_names.iter().position(|name| name == "young").unwrap_or(0);
    let (q, v, efforts) = ([0.4, -0.9], [1.0, -2.0], [3.0, -1.0]);
    let expected = evaluate::accelerations(&rigid, &rigid.parameters, &q, &v, &efforts)?;
    let mut theta = elastic.parameters.clone();
    theta[young] *= 1e6;
    // Beams at rest under gravity and this motion: their own accelerations vanish.
    let mut system = elastic.system::<f64>(&theta)?;
    let (mut x, n) = (vec![0.0; 16], 8);
    (x[0], x[1], x[n], x[n + 1]) = (q[0], q[1], v[0], v[1]);
    for _ in 0..20 {
        let a = system.dynamics().accelerations(&x[..n], &x[n..], &efforts).to_vec();
        let mut block = vec![0.0; 2 * n * n];
        system.elasticity(&x, &mut block);
        let stiff = nalgebra::DMatrix::from_fn(6, 6, |i, j| block[(2 + i) * 2 * n + 2 + j]);
        let step = stiff.lu().solve(&nalgebra::DVector::from_row_slice(&a[2..]));
        for (entry, step) in x[2..n].iter_mut().zip(step.iter().flat_map(|step| step.iter())) {
            *entry -= step;
        }
    }
    let found = system.dynamics().accelerations(&x[..n], &x[n..], &efforts).to_vec();
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found - expected).abs() < 1e-5 * expected.abs(), "{found} is not {expected}");
    }
    // The tip is where the rigid arm has it.
    Ok(())
}

fn steps_allocate_nothing<S: Scalar>(lift: impl Fn(f64) -> S) -> Result<()> {
    let d = arm(&json!({"strain": 3}))?;
    let theta: Vec<S> = d.parameters.iter().map(|&value| lift(value)).collect();
    let mut system = d.system::<S>(&theta)?;
    for method in Method::ALL {
        let mut integrator = Integrator::new(method, system.dim());
        let (mut x, mut outputs) = (vec![S::zero(); system.dim()], vec![S::zero(); d.n_outputs()]);
        let mut rate = x.clone();
        let counted = measure(|| {
            integrator.step(&mut system, &mut x, 1e-5);
            system.rhs(&x, &mut rate);
            system.dynamics().observe(&x, &rate, &mut outputs);
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
