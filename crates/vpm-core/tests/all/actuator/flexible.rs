//! Drives that push on elastic beams: derivatives, implicit steps, energy.

use serde_json::{Value, json};
use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::evaluate::{energy, internal_state};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::linearize::linearize;
use vpm_core::model::Omissions;
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::system::System;

use crate::common::hydraulics;
use crate::common::trees::{description, everything, parameter, push};

/// Every float as a parameter of its own.
fn numbered(content: &mut Value, name: &str, value: &Value) -> Value {
    match value {
        Value::Number(number) if number.is_f64() => {
            json!(parameter(content, name, number.as_f64().unwrap_or(f64::NAN)))
        }
        Value::Object(parts) => {
            parts.iter().map(|(key, part)| (key.clone(), numbered(content, &format!("{name}.{key}"), part))).collect()
        }
        other => other.clone(),
    }
}

/// The tree with everything, with drives on both of its lines, whose parts weigh something.
fn machine(drives: [&Value; 2]) -> Description {
    reduced(drives, Omissions::default())
}

/// The same without some of its terms.
fn reduced(drives: [&Value; 2], omissions: Omissions) -> Description {
    let mut parts = everything(3);
    for beam in &mut parts.beams {
        beam.damping = vpm_core::beam::DampingEntry::default();
    }
    description(&parts, |content| {
        content["omissions"] = json!({"velocity_of_bodies": omissions.velocity_of_bodies,
            "velocity_of_beams": omissions.velocity_of_beams, "coupling": omissions.coupling,
            "second_order": omissions.second_order});
        let oil = json!({"bulk_modulus": 1.2e9, "vapour_pressure": 1e3});
        let source = json!({"sagging": {"resistance": 2e10, "capacitance": 1e-12}});
        let supply = json!({"pressure": 16e6, "tank_pressure": 1e5, "source": source, "oil": oil});
        let mut supply = numbered(content, "pump", &supply);
        supply["name"] = json!("pump");
        content["supplies"] = json!([supply]);
        for (line, drive) in drives.into_iter().enumerate() {
            let drive = numbered(content, "drive", drive);
            push(content, "actuators", json!({"name": format!("drive{line}"), "on": {"line": line}, "drive": drive}));
        }
    })
}

fn maxwell(free_length: f64) -> Value {
    json!({"type": "maxwell", "stiffness": 900.0, "free_length": free_length, "fast_stiffness": 400.0, "relaxation_time": 0.02})
}

/// A cylinder of 2 m stroke, as long as that.
fn cylinder() -> Value {
    let servo = hydraulics::nominal();
    json!({"type": "hydraulic", "supply": 0, "retracted_length": 0.0,
        "valve": {"gain": 1.0, "frequency": servo.valve.frequency, "damping": 0.7, "stroke": 0.01, "overlap": 0.0,
            "orifice": {"gain": servo.valve.orifice.gain, "transition_pressure": 1e4}},
        "cylinder": {"size": {"bore": 0.016, "rod": 0.01}, "stroke": 3.0, "line_a": 2.9e-6, "line_b": 2.9e-6,
            "internal_leakage": 1.7e-13, "external_leakage": 0.0, "stop": {"stiffness": 5e8, "damping": 2e4}, "seal": {}}})
}

/// A machine on its way.
fn moving(d: &Description) -> Result<(System<f64>, Vec<f64>)> {
    let (mut system, random) = (d.system::<f64>(&d.parameters)?, &mut Random::new(8));
    let (n, joints) = (d.n_coordinates(), d.n_joints());
    let q = [random.numbers(joints, 0.3), random.numbers(n - joints, 1e-3)].concat();
    let internal = internal_state(d, &d.parameters, &q)?;
    system.hold(0, 0.01);
    system.hold(1, 2e-3);
    Ok((system, [q, random.numbers(n, 0.1), internal].concat()))
}

#[test]
fn jacobian_through_the_forces_is_that_of_the_whole_right_hand_side() -> Result<()> {
    // Two cylinders that let one supply sag; a cylinder beside an element without a flow; two springs that stretch.
    // And a machine without some of its terms.
    let some = Omissions {
        velocity_of_bodies: vec![1, 4],
        velocity_of_beams: vec![0],
        coupling: vec![0, 2],
        second_order: vec![1],
    };
    for (drives, omissions) in [
        ([&cylinder(), &cylinder()], Omissions::default()),
        ([&cylinder(), &maxwell(0.4)], Omissions::default()),
        ([&maxwell(0.4), &maxwell(0.5)], Omissions::default()),
        ([&cylinder(), &maxwell(0.4)], Omissions { coupling: Vec::new(), ..some.clone() }),
        ([&cylinder(), &maxwell(0.4)], some),
    ] {
        let d = reduced(drives, omissions);
        let (mut system, mut x) = moving(&d)?;
        let (n, dim) = (d.n_coordinates(), x.len());
        // Both valves open, to different sides.
        if dim > 2 * n + 3 {
            x[2 * n] += 2e-3;
            x[dim - 5] -= 1e-3;
        }
        let whole = linearize(&d, &d.parameters, &x, &[0.01, 2e-3])?.state;
        let (mut found, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim]);
        system.jacobian(&x, &mut found);
        system.scales(&mut sizes);
        for row in 0..dim {
            let scaled = |matrix: &[f64], column: usize| matrix[row * dim + column] * sizes[column];
            let largest = (0..dim).map(|column| scaled(&whole, column).abs()).fold(0.0, f64::max);
            for column in 0..dim {
                let (found, expected) = (scaled(&found, column), scaled(&whole, column));
                assert!((found - expected).abs() <= 1e-10 * largest, "{row}, {column}: {found} {expected}");
            }
        }
    }
    Ok(())
}

#[test]
fn iteration_matrix_is_the_whole_jacobian() -> Result<()> {
    let d = machine([&maxwell(0.4), &cylinder()]);
    let (mut system, mut x) = moving(&d)?;
    // Away from the closed valve, where the slope of the flow jumps.
    x[2 * d.n_coordinates() + 1] = 1e-3;
    let dim = x.len();
    assert_eq!(dim, 2 * d.n_coordinates() + 1 + 4 + 1);
    let (mut exact, mut found, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim * dim], vec![0.0; dim]);
    system.jacobian(&x, &mut exact);
    system.iteration_matrix(&x, &mut found);
    assert_eq!(found, exact);
    // Along random directions against differences.
    system.scales(&mut sizes);
    let random = &mut Random::new(2);
    for _ in 0..5 {
        let direction: Vec<f64> = random.numbers(dim, 1.0).iter().zip(&sizes).map(|(a, size)| a * size).collect();
        let mut at = |side: f64| {
            let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + side * 1e-4 * d).collect();
            let mut rates = vec![0.0; dim];
            system.rhs(&moved, &mut rates);
            rates
        };
        let (ahead, behind, far_ahead, far_behind) = (at(1.0), at(-1.0), at(2.0), at(-2.0));
        for row in 0..dim {
            let slope: f64 = exact[row * dim..(row + 1) * dim].iter().zip(&direction).map(|(a, d)| a * d).sum();
            let size: f64 = exact[row * dim..(row + 1) * dim].iter().zip(&direction).map(|(a, d)| (a * d).abs()).sum();
            let near = 8.0 * (ahead[row] - behind[row]);
            let difference = (near - (far_ahead[row] - far_behind[row])) / 12e-4;
            assert!((difference - slope).abs() < 1e-6 * size, "{row}: {slope} {difference}");
        }
    }
    Ok(())
}

#[test]
fn implicit_steps_agree_with_explicit_ones() -> Result<()> {
    let d = machine([&maxwell(0.4), &cylinder()]);
    let (_, start) = moving(&d)?;
    let last = |method: Method, steps: u32| -> Result<Vec<f64>> {
        let ((mut system, mut x), mut integrator) = (moving(&d)?, Integrator::new(method, start.len()));
        (0..steps).for_each(|_| integrator.step(&mut system, &mut x, 0.01 / f64::from(steps)));
        Ok(x)
    };
    let exact = last(Method::Rk4, 8000)?;
    let mut before = f64::INFINITY;
    for steps in [40, 80, 160] {
        let found = last(Method::LinearlyImplicit, steps)?;
        let off = (0..d.n_joints()).map(|k| (found[k] - exact[k]).abs()).fold(0.0, f64::max);
        assert!(off < before / 2.5, "{steps}: {off} after {before}");
        before = off;
    }
    assert!(before < 1e-5, "{before}");
    Ok(())
}

#[test]
fn springs_on_flexible_machines_keep_energy() -> Result<()> {
    let spring = |free_length: f64| json!({"type": "spring_damper", "stiffness": 700.0, "free_length": free_length, "damping": 0.0});
    let d = machine([&spring(0.3), &spring(0.5)]);
    let n = d.n_coordinates();
    let (mut system, mut x) = moving(&d)?;
    system.hold(0, 0.0);
    system.hold(1, 0.0);
    let total =
        |x: &[f64]| energy(&d, &d.parameters, &x[..n], &x[n..2 * n]).map(|(kinetic, potential)| kinetic + potential);
    let (before, mut integrator) = (total(&x)?, Integrator::new(Method::Rosenbrock, x.len()));
    (0..2000).for_each(|_| integrator.step(&mut system, &mut x, 1e-5));
    let drift = (total(&x)? - before).abs();
    assert!(drift < 1e-6 * before.abs(), "{drift} J of {before} J");
    Ok(())
}
