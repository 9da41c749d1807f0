//! One second of the published servo-cylinder under a chirp from 2 to 50 Hz: time beside error, for fixed and controlled steps.
//!
//! The error is the largest of piston and pressures over the end of each 10 ms, relative to their largest change along the way.
//! Besides, one step of 1 ms of the same drive as a rig and as a part of a machine, on a sliding joint and on a line.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use criterion::Criterion;
use serde_json::{Value, json};
use vpm_core::Result;
use vpm_core::actuator::hydraulic::ServoRig;
use vpm_core::description::Description;
use vpm_core::evaluate::internal_state;
use vpm_core::integrator::{Adaptive, Integrator, Method};
use vpm_core::ode::Ode;

#[path = "../crates/vpm-core/tests/all/common/hydraulics.rs"]
mod hydraulics;
use hydraulics::{Chirp, Chirped, nominal};
#[path = "common/share.rs"]
mod share;

/// How often the motions are compared.
const ROWS: usize = 100;
/// Position, pressure a, pressure b.
const SHOWN: [usize; 3] = [0, 4, 5];

fn fixed(ode: &mut Chirped, method: Method, steps: usize, mut row: impl FnMut(&[f64; 7])) {
    let (mut x, mut integrator) = (ode.rest(), Integrator::new(method, 7));
    for k in 1..=steps {
        integrator.step(ode, &mut x, 1.0 / steps as f64);
        if k % (steps / ROWS) == 0 {
            row(&x);
        }
    }
}

/// Controlled steps; they are cut short at every row, or only at the end.
fn controlled(ode: &mut Chirped, tolerance: f64, rows: usize, mut row: impl FnMut(&[f64; 7])) -> Result<usize> {
    let mut adaptive = Adaptive::new(tolerance, 7)?;
    let (mut x, mut taken) = (ode.rest(), 0);
    for _ in 0..rows {
        let steps = adaptive.advance(ode, &mut x, 1.0 / rows as f64, &|| false)?;
        taken += steps.accepted + steps.refused;
        row(&x);
    }
    Ok(taken)
}

fn error(exact: &[[f64; 7]], found: &[[f64; 7]]) -> f64 {
    SHOWN.into_iter().fold(0.0, |worst: f64, k| {
        let range = exact.iter().map(|x| (x[k] - exact[0][k]).abs()).fold(0.0, f64::max);
        let off = exact.iter().zip(found).map(|(a, b)| (a[k] - b[k]).abs()).fold(0.0, f64::max);
        worst.max(off / range)
    })
}

/// Every float of a part as a parameter of its own.
fn numbered(values: &mut Vec<f64>, part: &Value) -> Value {
    match part {
        Value::Number(number) if number.is_f64() => {
            values.extend(number.as_f64());
            json!(values.len() - 1)
        }
        Value::Object(parts) => parts.iter().map(|(key, part)| (key.clone(), numbered(values, part))).collect(),
        other => other.clone(),
    }
}

/// The rig's cylinder and load as a machine: on a sliding joint, or on a line along it.
fn machine(on: &Value) -> Result<Description> {
    let (servo, mut values) = (nominal(), vec![0.0]);
    let (valve, cylinder) = (&servo.valve, &servo.cylinder);
    let supply = json!({"pressure": servo.supply_pressure, "tank_pressure": servo.tank_pressure,
        "oil": {"bulk_modulus": servo.fluid.bulk_modulus, "vapour_pressure": servo.fluid.vapour_pressure}});
    let drive = json!({"type": "hydraulic", "retracted_length": 0.46,
        "valve": {"gain": valve.gain, "frequency": valve.frequency, "damping": valve.damping, "stroke": valve.stroke,
            "overlap": 0.0, "orifice": {"gain": valve.orifice.gain, "transition_pressure": valve.orifice.transition_pressure}},
        "cylinder": {"size": {"bore": 0.016, "rod": 0.01}, "stroke": cylinder.stroke, "line_a": cylinder.line_a,
            "line_b": cylinder.line_b, "internal_leakage": cylinder.internal_leakage, "external_leakage": 0.0,
            "stop": {"stiffness": cylinder.stop.stiffness, "damping": cylinder.stop.damping}, "seal": {}}});
    let (mut supply, mut drive) = (numbered(&mut values, &supply), numbered(&mut values, &drive));
    (supply["name"], supply["source"], drive["supply"]) = (json!("pump"), json!("constant"), json!(0));
    let mut number = |value: f64| {
        values.push(value);
        values.len() - 1
    };
    let [mass, viscous, stiffness, rest] =
        [servo.load.mass, servo.load.damping, servo.load.stiffness, 0.5].map(&mut number);
    let names: Vec<String> = (0..values.len()).map(|place| format!("p{place}")).collect();
    let end = |on: Value| json!({"on": on, "point": [0.0, 0.0, 0.0]});
    let description = json!({"gravity": [0.0, 0.0, 0.0], "parameters": values, "parameter_names": names,
        "bodies": [{"name": "load", "on": "world", "inertia": {"mass": mass, "center_of_mass": [0, 0, 0], "moments": [0, 0, 0, 0, 0, 0]},
            "joint": {"name": "rod", "kind": "prismatic", "axis": [1.0, 0.0, 0.0], "translation": [0.0, 0.0, 0.0],
                "rotation": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]}}],
        "lines": [{"name": "strut", "from": end(json!("world")), "to": end(json!({"body": 0})), "barrel": null, "rod": null}],
        "effects": [{"type": "viscous_friction", "joint": 0, "viscous": viscous},
            {"type": "spring", "joint": 0, "stiffness": stiffness, "rest": rest}],
        "supplies": [supply], "actuators": [{"name": "hip", "on": on, "drive": drive}]});
    Description::from_json(&description.to_string())
}

/// Times one right-hand side and one linearly implicit step of 1 ms, under a current that swings.
fn cost<O: Ode<f64>>(
    criterion: &mut Criterion,
    name: &str,
    (mut ode, start): (O, Vec<f64>),
    hold: impl Fn(&mut O, f64),
) {
    let mut rates = start.clone();
    criterion.bench_function(&format!("hydraulic/{name}_rhs"), |bencher| {
        bencher.iter(|| ode.rhs(black_box(&start), black_box(&mut rates)));
    });
    let (mut integrator, mut x, mut time) = (Integrator::new(Method::LinearlyImplicit, start.len()), start, 0.0_f64);
    criterion.bench_function(&format!("hydraulic/{name}_step"), |bencher| {
        bencher.iter(|| {
            hold(&mut ode, 1e-3 * time.sin());
            integrator.step(&mut ode, black_box(&mut x), 1e-3);
            time += 0.05;
        });
    });
    share::print(&format!("hydraulic {name}"), share::PERIOD, || {
        hold(&mut ode, 1e-3 * time.sin());
        integrator.step(&mut ode, black_box(&mut x), share::PERIOD);
        time += 0.05;
    });
}

fn costs(criterion: &mut Criterion) -> Result<()> {
    let rig = ServoRig::new(nominal())?;
    cost(criterion, "rig", (rig, nominal().rest().to_array().to_vec()), |rig, current| rig.current = current);
    for (name, on) in [("machine", json!({"joint": 0})), ("machine_on_line", json!({"line": 0}))] {
        let d = machine(&on)?;
        let start = [vec![0.5, 0.0], internal_state(&d, &d.parameters, &[0.5])?].concat();
        cost(criterion, name, (d.system::<f64>(&d.parameters)?, start), |system, current| system.hold(0, current));
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .sample_size(20)
        .configure_from_args();
    costs(&mut criterion)?;
    let chirp = Chirp { amplitude: 0.5e-3, start: 2.0 * TAU, slope: 0.5 * (50.0 - 2.0) * TAU };
    let (mut ode, mut exact) = (Chirped::new(nominal(), chirp), Vec::new());
    fixed(&mut ode, Method::Rosenbrock, 100_000, |x| exact.push(*x));
    for (method, rates) in [(Method::LinearlyImplicit, [1000, 4000, 10_000]), (Method::Rosenbrock, [1000, 2000, 4000])]
    {
        for rate in rates {
            let mut found = Vec::new();
            fixed(&mut ode, method, rate, |x| found.push(*x));
            println!("{} at {rate} Hz: error {:.1e}", method.name(), error(&exact, &found));
            let id = format!("hydraulic/{}_{rate}_hz", method.name());
            criterion.bench_function(&id, |bencher| bencher.iter(|| fixed(&mut ode, method, rate, |_| ())));
        }
    }
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7] {
        let mut found = Vec::new();
        controlled(&mut ode, tolerance, ROWS, |x| found.push(*x))?;
        let taken = controlled(&mut ode, tolerance, 1, |_| ())?;
        println!("controlled, tolerance {tolerance:.0e}: error {:.1e}, {taken} steps", error(&exact, &found));
        let id = format!("hydraulic/controlled_{tolerance:.0e}");
        criterion.bench_function(&id, |bencher| bencher.iter(|| controlled(&mut ode, tolerance, 1, |_| ())));
    }
    Ok(())
}
