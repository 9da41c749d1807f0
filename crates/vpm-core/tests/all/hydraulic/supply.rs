//! Supplies that sag, that are inputs, that feed several cylinders; oil that stays; what is refused.

use std::sync::Arc;

use serde_json::{Value, json};
use vpm_core::actuator::hydraulic::{PistonSize, Sagging, ServoCylinder, SupplyDrop};
use vpm_core::description::Description;
use vpm_core::error::{DriveError, Error};
use vpm_core::evaluate::internal_state;
use vpm_core::integrator::Method;
use vpm_core::linearize::linearize;
use vpm_core::live::Live;
use vpm_core::mount::Mount;
use vpm_core::samples::{Sample, slider};
use vpm_core::simulate::Stepping;

use crate::common::hydraulics::nominal;
use crate::common::servo_machine::{MIDDLE, On, drive, machine, machine_fed, rest, supply};
use crate::common::{Bench, Machine, close};

/// Two masses on a rail, each pushed by a long cylinder without leakage, fed by one supply.
fn twins(servo: &ServoCylinder<f64>, source: Value) -> Machine {
    let mut sample: Sample = slider(3.0);
    let mut second = sample.bodies[0].clone();
    (second.name, second.joint.name, second.on) = ("second".into(), "second.axis".into(), Mount::World);
    sample.bodies.push(second);
    let mut machine = Machine::new(&sample);
    machine.add("supplies", json!({"name": "pump"}), supply(servo, source));
    for (joint, name) in ["left", "right"].into_iter().enumerate() {
        machine.add("actuators", json!({"name": name, "on": {"joint": joint}}), json!({"drive": drive(servo)}));
    }
    machine
}

#[test]
fn a_drop_and_a_sag_follow_a_flow_exponentially() {
    // From rest under a flow Q both end R Q lower: the drop with its own time constant, the sag with R C.
    let (resistance, flow, pressure) = (4e10, 3e-5, 16e6);
    let (drop, sag) =
        (SupplyDrop { resistance, time_constant: 0.02 }, Sagging { resistance, capacitance: 0.05 / resistance });
    for t in [0.0, 0.013, 0.07] {
        let [fast, slow] = [0.02, 0.05].map(|time: f64| (-t / time).exp());
        let fall = resistance * flow;
        close(drop.rate(fall * (1.0 - fast), flow), fall / 0.02 * fast, 1e-12 * fall / 0.02);
        close(sag.rate(pressure - fall * (1.0 - slow), pressure, flow), -fall / 0.05 * slow, 1e-11 * fall / 0.05);
    }
}

#[test]
fn two_cylinders_let_a_supply_sag_by_what_both_draw() {
    let mut servo = nominal();
    servo.cylinder.stroke = 2.0;
    servo.cylinder.internal_leakage = 0.0;
    let resistance = 4e10;
    let machine = twins(&servo, json!({"sagging": {"resistance": resistance, "capacitance": 5e-13}}));
    let bench = Bench::new(&machine, 1e-3, 2, Method::Rosenbrock);
    let at = [MIDDLE - 0.7; 2];
    let internal = internal_state(&bench.description, &bench.theta, &at).unwrap();
    assert_eq!((internal.len(), internal[8]), (9, servo.supply_pressure));
    let run = bench.free(&[&at[..], &[0.0; 2], &internal].concat(), &[2e-3; 2 * 1500]);
    // Pistons that nothing resists: A pa = alpha A pb, qa = A v = K u sqrt(p - pa), qb = alpha A v = K u sqrt(pb - pt), so that
    // v^2 = (K u / A)^2 (p - alpha pt) / (1 + alpha^3), with p = ps - 2 R A v.
    let areas = servo.cylinder.areas();
    let (alpha, opened) = (areas.b / areas.a, servo.valve.orifice.gain * 2e-3 / areas.a);
    let factor = opened * opened / (1.0 + alpha.powi(3));
    let half = factor * resistance * areas.a;
    let speed = -half + (half * half + factor * (servo.supply_pressure - alpha * servo.tank_pressure)).sqrt();
    let last = &run.states[1499 * 13..];
    let pressure = servo.supply_pressure - 2.0 * resistance * areas.a * speed;
    assert!(pressure < 0.85 * servo.supply_pressure, "{pressure}");
    close(last[2], speed, 1e-7 * speed);
    close(last[3], speed, 1e-7 * speed);
    close(last[12], pressure, 1e-7 * pressure);
    // The outputs of the supply: its pressure, and what both draw.
    let (layout, width) = (bench.description.layout(), bench.description.n_outputs());
    let shown = &run.outputs[1499 * width + layout.supplies()..];
    assert_eq!(shown[0], last[12]);
    close(shown[1], 2.0 * areas.a * speed, 1e-7 * 2.0 * areas.a * speed);
}

#[test]
fn valves_that_are_shut_keep_the_oil() {
    let mut servo = nominal();
    servo.valve.overlap.width = 1e-3;
    servo.cylinder.internal_leakage = 0.0;
    let machine = twins(&servo, json!({"sagging": {"resistance": 2e10, "capacitance": 5e-13}}));
    let bench = Bench::new(&machine, 1e-3, 10, Method::Rosenbrock);
    let internal = internal_state(&bench.description, &bench.theta, &[MIDDLE; 2]).unwrap();
    let run = bench.free(&[&[MIDDLE; 2][..], &[0.2, -0.3], &internal].concat(), &[5e-4; 2 * 200]);
    // rho V, with rho growing as e^(p / beta).
    let mass = |state: &[f64], cylinder: usize| {
        let volumes = servo.cylinder.volumes(state[cylinder] - MIDDLE);
        let chambers = &state[6 + 4 * cylinder..];
        [volumes.a, volumes.b]
            .map(f64::ln)
            .into_iter()
            .zip(&chambers[..2])
            .map(|(v, p)| v + p / 1.2e9)
            .collect::<Vec<_>>()
    };
    let mut moved = 0.0_f64;
    for state in run.states.chunks_exact(13) {
        for cylinder in 0..2 {
            for (found, start) in mass(state, cylinder).into_iter().zip(mass(&run.states, cylinder)) {
                close(found, start, 1e-9);
            }
            moved = moved.max((state[cylinder] - MIDDLE).abs());
        }
        assert_eq!(state[12], servo.supply_pressure);
    }
    assert!(moved > 1e-4, "{moved} m");
}

/// A slow change of the pressure of the supply and a current, sample by sample.
fn inputs(rows: usize) -> Vec<f64> {
    (0..rows).flat_map(|k| [2e-3 * (0.1 * k as f64).sin(), 12e6 + 2e6 * (0.07 * k as f64).cos()]).collect()
}

#[test]
fn a_logged_pressure_is_an_input() {
    let servo = nominal();
    let (logged, constant) = (machine_fed(&servo, On::Line, json!("logged")), machine(&servo, On::Line));
    let [fed, still] = [&logged, &constant].map(|machine| Bench::new(machine, 1e-3, 2, Method::LinearlyImplicit));
    assert_eq!((fed.description.n_inputs(), fed.description.n_actuators(), still.description.n_inputs()), (2, 1, 1));
    let start = rest(&logged);
    let same: Vec<f64> = [2e-3, servo.supply_pressure].repeat(50);
    assert_eq!(fed.free(&start, &same).outputs, still.free(&start, &[2e-3; 50]).outputs);
    // Another pressure, another motion; the output shows it.
    let inputs = inputs(80);
    let run = fed.free(&start, &inputs);
    let shown = fed.channel(&run, fed.description.layout().supplies());
    assert!(shown.iter().zip(inputs.iter().skip(1).step_by(2)).all(|(found, given)| found == given));
    // A simulation driven from outside goes the same way.
    let theta = fed.theta.clone();
    let mut live = Live::new(Arc::new(logged.build()), &theta, &start, fed.stepping).unwrap();
    assert_eq!(live.outputs()[fed.description.layout().supplies()], servo.supply_pressure);
    for (row, state) in inputs.chunks_exact(2).zip(run.states.chunks_exact(6)).take(79) {
        assert_eq!(live.state(), state);
        live.step(row).unwrap();
    }
    assert!(live.step(&[1e-3]).unwrap_err().to_string().contains("inputs must have 2 entries, got 1"));
}

#[test]
fn pressure_of_a_loop_stands_among_the_disturbances() {
    let mut machine = machine_fed(&nominal(), On::Joint, json!("logged"));
    machine.controller("pid", 0, 0, &[("proportional", 0.2), ("integral", 0.0), ("derivative", 0.0)]);
    let bench = Bench::new(&machine, 1e-3, 2, Method::LinearlyImplicit);
    let disturbances: Vec<f64> = inputs(60).chunks_exact(2).flat_map(|row| [0.0, row[1]]).collect();
    let run = bench.closed(&rest(&machine), &[MIDDLE + 0.01, 0.0].repeat(60), &disturbances);
    let (layout, first) = (bench.description.layout(), bench.description.layout().actuators());
    let commands: Vec<f64> = bench.channel(&run, first);
    let positions: Vec<f64> = bench.channel(&run, 0);
    assert!(commands.iter().zip(&positions).all(|(u, y)| (u - 0.2 * (MIDDLE + 0.01 - y)).abs() < 1e-15));
    // The same commands and pressures as inputs of a free run.
    let given: Vec<f64> = commands.iter().zip(disturbances.chunks_exact(2)).flat_map(|(&u, row)| [u, row[1]]).collect();
    assert_eq!(bench.free(&rest(&machine), &given).outputs, run.outputs);
    assert!(bench.channel(&run, layout.supplies()).iter().any(|pressure| *pressure < 11e6));
}

#[test]
fn linear_machine_has_a_column_for_the_pressure() {
    let machine = machine_fed(&nominal(), On::Line, json!("logged"));
    let (description, theta) = (machine.build(), &machine.values);
    let mut state = rest(&machine);
    (state[1], state[2]) = (0.1, 2e-3);
    let at = |inputs: [f64; 2]| linearize(&description, theta, &state, &inputs).unwrap();
    let linear = at([2e-3, 15e6]);
    assert_eq!(linear.input.len(), 6 * 2);
    for (column, step) in [(0, 1e-4), (1, 1e2)] {
        let moved = |side: f64| {
            let mut inputs = [2e-3, 15e6];
            inputs[column] += side * step;
            at(inputs)
        };
        let (ahead, behind) = (moved(1.0), moved(-1.0));
        for row in 0..6 {
            let slope = (ahead.rate[row] - behind.rate[row]) / (2.0 * step);
            let exact = linear.input[2 * row + column];
            close(exact, slope, 1e-6 * slope.abs().max(1e-9));
        }
        for row in 0..description.n_outputs() {
            let slope = (ahead.reading[row] - behind.reading[row]) / (2.0 * step);
            close(linear.feedthrough[2 * row + column], slope, 1e-6 * slope.abs().max(1e-9));
        }
    }
    assert!(linear.input[2 * 4 + 1] > 0.0 && linear.input[2 * 3] > 0.0);
}

fn sentence(machine: &Machine) -> String {
    Description::from_json(&machine.json()).map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
}

#[test]
fn what_cannot_be_is_told_in_a_sentence() {
    let with = |change: &dyn Fn(&mut ServoCylinder<f64>)| {
        let mut servo = nominal();
        change(&mut servo);
        sentence(&machine(&servo, On::Line))
    };
    let size = |bore, rod| PistonSize::Diameters { bore, rod };
    let told = with(&|servo| servo.cylinder.size = size(0.016, 0.02));
    assert_eq!(
        told,
        "`hip.drive.cylinder.size.rod` must be below `hip.drive.cylinder.size.bore` (0.016), got 0.02; give both as diameters, or the size \
         as area and area_ratio"
    );
    let told = with(&|servo| servo.cylinder.size = PistonSize::Areas { area: 2e-4, area_ratio: 1.2 });
    assert!(told.contains("area_ratio` must be greater than zero and at most 1, got 1.2"), "{told}");
    let told = with(&|servo| servo.cylinder.size = PistonSize::Areas { area: -2e-4, area_ratio: 0.6 });
    assert!(told.contains("size.area` must be greater than zero, got -0.0002"), "{told}");
    let told = with(&|servo| servo.tank_pressure = 16e6);
    assert!(told.contains("`pump.tank_pressure` must be below `pump.pressure` (16000000)"), "{told}");
    let told = with(&|servo| servo.cylinder.line_a = 0.0);
    assert!(told.contains("hip.drive.cylinder.line_a"), "{told}");
    // The same when a vector of parameters brings them.
    let machine = machine(&nominal(), On::Joint);
    let (description, mut theta) = (machine.build(), machine.values.clone());
    theta[machine.index("hip.drive.cylinder.size.rod")] = 0.02;
    assert!(matches!(description.check_values(&theta), Err(Error::Drive(DriveError::Order { .. }))));
    let told =
        sentence(&machine_fed(&nominal(), On::Line, json!({"sagging": {"resistance": 0.0, "capacitance": 1e-12}})));
    assert!(told.contains("pump.source.sagging.resistance"), "{told}");
    assert!(sentence(&machine_fed(&nominal(), On::Line, json!("pulsing"))).contains("pulsing"));
}

#[test]
fn supplies_and_joints_that_do_not_fit_are_refused() {
    let build = |kind: vpm_core::joint::JointKind, change: &dyn Fn(&mut Value)| {
        let mut sample = slider(3.0);
        sample.bodies[0].joint.kind = kind;
        sample.bodies[0].inertia.iter_mut().for_each(|inertia| inertia.moments[..3].fill(0.1));
        let (mut machine, mut drive) = (Machine::new(&sample), drive(&nominal()));
        change(&mut drive);
        machine.add("supplies", json!({"name": "pump"}), supply(&nominal(), json!("constant")));
        machine.add("actuators", json!({"name": "hip", "on": {"joint": 0}}), json!({"drive": drive}));
        sentence(&machine)
    };
    use vpm_core::joint::JointKind::{Prismatic, Revolute};
    let told = build(Revolute, &|_| ());
    assert!(
        told.contains("actuator `hip` of type hydraulic acts on joint `axis`, but it needs a line or a prismatic"),
        "{told}"
    );
    let told = build(Prismatic, &|drive| drive["supply"] = json!(3));
    assert!(told.contains("actuator `hip` refers to supply number 3, but there are 1"), "{told}");
    let told = build(Prismatic, &|drive| drive["cylinder"]["size"] = json!({"bore": 0.01, "area": 1e-4}));
    assert!(told.contains("{bore, rod} or {area, area_ratio}"), "{told}");
    let told = build(Prismatic, &|drive| drive["valve"]["leak"] = json!(0.01));
    assert!(told.contains("leak"), "{told}");
}

#[test]
fn a_piston_starts_within_its_stroke() {
    for on in [On::Joint, On::Line] {
        let machine = machine(&nominal(), on);
        let bench = Bench::new(&machine, 1e-3, 1, Method::LinearlyImplicit);
        let mut start = rest(&machine);
        // A stop gives way: 1 mm, or 2 % of the stroke.
        start[0] = MIDDLE + 0.0415;
        assert!(bench.try_free(&start, &[0.0; 3]).is_ok());
        start[0] = MIDDLE + 0.05;
        let error = bench.try_free(&start, &[0.0; 3]).unwrap_err();
        assert!(matches!(error, Error::Drive(DriveError::Piston { .. })));
        let told = error.to_string();
        let part = if on == On::Joint { "position of joint `axis`" } else { "length of line `strut`" };
        assert!(
            told.contains("actuator `hip`") && told.contains(part) && told.contains("0.460000 m and 0.540000 m"),
            "{told}"
        );
        let stepping = Stepping::new(1e-3, 1, Method::LinearlyImplicit).unwrap();
        let live = Live::new(Arc::new(machine.build()), &machine.values, &start, stepping);
        assert!(matches!(live, Err(Error::Drive(DriveError::Piston { .. }))));
    }
}

#[test]
fn steps_of_a_fixed_length_that_leap_over_a_stop_are_refused() {
    let machine = machine(&nominal(), On::Joint);
    let full: Vec<f64> = (0..200).map(|k| if k < 150 { 10e-3 } else { -10e-3 }).collect();
    let run = |method| Bench::new(&machine, 1e-3, 1, method).try_free(&rest(&machine), &full);
    let told = run(Method::Rosenbrock).unwrap_err().to_string();
    let sentence = "the piston of actuator `hip` is ";
    assert!(told.contains(sentence) && told.contains("leapt over its stop") && told.contains("adaptive"), "{told}");
    for method in [Method::Guarded, Method::Adaptive { tolerance: 1e-6 }] {
        let states = run(method).unwrap().states;
        let largest = states.chunks_exact(6).fold(0.0, |most: f64, state| most.max((state[0] - MIDDLE).abs()));
        assert!((0.0400..0.0401).contains(&largest), "{largest}");
    }
}
