//! Drives in sampled time inside machines: the same numbers as the difference equation beside the machine, and what is refused.

use std::sync::Arc;

use allocation_counter::measure;
use proptest::prelude::*;
use serde_json::{Value, json};
use vpm_core::error::{DriveError, Error};
use vpm_core::integrator::Method;
use vpm_core::linearize::linearize;
use vpm_core::live::Live;
use vpm_core::narx::{Factor, Narx, Structure, Term};
use vpm_core::samples::{double_pendulum, pendulum, slider};
use vpm_core::simulate::{Gains, Noise, Readings, Run, Setting, Stepping, observe};
use vpm_core::table::Table;

use crate::common::{ALWAYS, Bench, Machine, solid};
use crate::simulate::check;

/// Time between samples of the record, s.
const STEP: f64 = 1e-3;

/// Signal and lag of each factor of each term, with the coefficients: effort, command, position and velocity of joint 0.
const TERMS: [(&[(usize, usize)], f64); 6] = [
    (&[(0, 1)], 1.2),
    (&[(0, 2)], -0.5),
    (&[(1, 0)], 0.4),
    (&[(1, 2), (2, 0)], -0.2),
    (&[(3, 1)], -0.1),
    (&[(0, 1), (0, 1), (0, 1)], -0.003),
];

fn narx(sample_time: f64) -> Value {
    let (terms, coefficients): (Vec<_>, Vec<_>) = TERMS.iter().copied().unzip();
    json!({"type": "narx", "sample_time": sample_time, "terms": terms, "coefficients": coefficients,
        "inputs": [["u", "command"], ["q", {"position": 0}], ["v", {"velocity": 0}]]})
}

fn beside() -> Narx {
    let term = |factors: &[(usize, usize)]| {
        Term::new(factors.iter().map(|&(signal, delay)| Factor { signal, delay }).collect())
    };
    let signals = ["y", "u", "q", "v"].map(str::to_owned);
    let structure = Structure::new(&signals, TERMS.iter().map(|(factors, _)| term(factors)).collect()).unwrap();
    Narx::new(structure, &TERMS.map(|(_, value)| value)).unwrap()
}

fn driven(drive: Value) -> Machine {
    let mut machine = Machine::new(&solid(double_pendulum([1.0, 0.7], [0.5, 0.4])));
    machine.effect("viscous_friction", 1, &[("viscous", 0.1)]);
    machine.add("actuators", json!({"name": "valve", "on": {"joint": 0}, "drive": drive}), json!({}));
    machine.actuator(1, &[("gain", 1.5), ("lag", 0.06)]);
    machine
}

/// Outputs: 4 of each joint, then command and force of each actuator.
const WIDTH: usize = 12;
const FORCE: usize = 9;
const START: [f64; 5] = [0.4, -0.3, 0.5, 0.2, 0.7];

fn commands(rows: u32) -> Vec<f64> {
    (0..rows).flat_map(|k| [(0.21 * f64::from(k)).sin(), 0.3 * (0.05 * f64::from(k)).cos()]).collect()
}

#[test]
fn efforts_are_those_of_the_model_beside_the_machine() {
    let inputs = commands(300);
    for method in Method::ALL {
        for (every, substeps) in [(1, 1), (1, 3), (5, 2)] {
            let bench = Bench::new(&driven(narx(f64::from(every) * STEP)), STEP, substeps, method);
            let outputs = bench.free(&START, &inputs).outputs;
            let mut stepper = beside().stepper();
            let mut effort = 0.0;
            for (k, row) in outputs.chunks_exact(WIDTH).enumerate() {
                let seen = [row[8], row[0], row[1]];
                if k == 0 {
                    stepper.stand(0.0, &seen);
                }
                if k % every as usize == 0 {
                    effort = stepper.step(&seen);
                }
                assert_eq!(row[FORCE].to_bits(), effort.to_bits(), "{} at {k}", method.name());
            }
            assert!(effort.abs() > 1e-3, "nothing moves");
        }
    }
}

fn live(machine: &Machine, method: Method) -> Live {
    let description = machine.build();
    let theta = description.parameters.clone();
    Live::new(Arc::new(description), &theta, &START, Stepping::new(STEP, 2, method).unwrap()).unwrap()
}

#[test]
fn steps_from_outside_are_those_of_a_free_run() {
    let inputs = commands(200);
    for method in Method::ALL {
        let machine = driven(narx(3.0 * STEP));
        let run = Bench::new(&machine, STEP, 2, method).free(&START, &inputs);
        let mut live = live(&machine, method);
        for _ in 0..2 {
            let mut copy = live.clone();
            for (k, row) in inputs.chunks_exact(2).enumerate().take(199) {
                assert_eq!(live.state(), &run.states[5 * k..5 * (k + 1)], "{} at {k}", method.name());
                live.step(row).unwrap();
                assert_eq!(live.outputs()[FORCE].to_bits(), run.outputs[WIDTH * k + FORCE].to_bits());
                if k == 100 {
                    copy = live.clone();
                }
            }
            // What was put aside in the middle of a hold goes on as the other did.
            inputs.chunks_exact(2).take(199).skip(101).for_each(|row| assert!(copy.step(row).is_ok()));
            assert_eq!(copy.state(), live.state());
            live.reset(&START).unwrap();
        }
    }
}

#[test]
fn steps_allocate_nothing() {
    let mut live = live(&driven(narx(2.0 * STEP)), Method::LinearlyImplicit);
    // More steps than the window of a model slides along before it is moved back.
    let counted = measure(|| (0..1000).for_each(|_| assert!(live.step(&[0.3, -0.2]).is_ok())));
    assert_eq!(counted.count_total, 0);
    let bench = Bench::new(&driven(narx(STEP)), STEP, 1, Method::Rk4);
    let inputs = commands(2000);
    let free = |rows: usize| measure(|| drop(bench.free(&START, &inputs[..2 * rows]))).count_total;
    // What is recorded in the first run is kept.
    free(20);
    assert_eq!(free(20), free(2000));
    let element = Bench::new(&sprung(&sampled_maxwell(STEP), Value::Null), STEP, 1, Method::Rk4);
    let free = |rows: usize| measure(|| drop(element.free(&[0.05, 0.0], &inputs[..rows]))).count_total;
    // What is recorded in the first run is kept.
    free(20);
    assert_eq!(free(20), free(2000));
}

/// A mass on a rail and a Maxwell element from the world to it, as a differential or as a difference equation.
fn sprung(drive: &Value, numbers: Value) -> Machine {
    let mut machine = Machine::new(&solid(slider(3.0)));
    let line = json!({"name": "strut", "from": {"on": "world", "point": [-0.3, 0.0, 0.0]},
        "to": {"on": {"body": 0}, "point": [0.0, 0.0, 0.0]}, "barrel": null, "rod": null});
    machine.add("lines", line, json!({}));
    let mut actuator = json!({"name": "spring", "on": {"line": 0}, "drive": drive});
    if numbers.is_null() {
        machine.add("actuators", actuator.take(), json!({}));
    } else {
        machine.add("actuators", json!({"name": "spring", "on": {"line": 0}}), json!({"drive": numbers}));
    }
    machine
}

fn sampled_maxwell(sample_time: f64) -> Value {
    let constant = |value: f64| [value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    json!({"type": "maxwell_narx", "sample_time": sample_time, "k0": constant(4e3), "s0": constant(0.29),
        "k1": 6e3, "c1": 60.0, "scheme": "trapezoidal"})
}

/// Law: both are one element; the held force lags by half a sample, so that what is between them shrinks with the step.
#[test]
fn the_sampled_element_is_the_continuous_one_as_the_step_goes_to_zero() {
    let numbers = json!({"type": "maxwell", "stiffness": 4e3, "free_length": 0.29, "fast_stiffness": 6e3, "relaxation_time": 0.01});
    let gap = |step: f64| {
        let rows = (0.2 / step).round() as usize + 1;
        let inputs = vec![0.0; rows];
        let last = |machine: &Machine, start: &[f64]| {
            let run = Bench::new(machine, step, 1, Method::Rk4).free(start, &inputs);
            run.states[run.states.len() - start.len()]
        };
        let continuous = sprung(&Value::Null, numbers.clone());
        let stretch = vpm_core::evaluate::internal_state(&continuous.build(), &continuous.values, &[0.0]).unwrap()[0];
        let exact = last(&continuous, &[0.0, 0.1, stretch]);
        (last(&sprung(&sampled_maxwell(step), Value::Null), &[0.0, 0.1]) - exact).abs()
    };
    let (coarse, fine) = (gap(1e-3), gap(2.5e-4));
    assert!(fine < 2e-4, "{fine}");
    assert!((3.0..5.5).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn an_element_that_stands_shows_its_spring_before_the_first_step() {
    let description = sprung(&sampled_maxwell(STEP), Value::Null).build();
    let theta = description.parameters.clone();
    let stepping = Stepping::new(STEP, 1, Method::Rk4).unwrap();
    let live = Live::new(Arc::new(description), &theta, &[0.0, 0.0], stepping).unwrap();
    // Longer than at rest by 10 mm: it pulls, and a positive force of an actuator pushes.
    assert!((live.outputs()[5] + 4e3 * 0.01).abs() < 1e-9, "{:?}", live.outputs());
}

#[test]
fn a_closed_loop_runs_through_a_sampled_drive() {
    let mut machine = Machine::new(&pendulum(1.0, 1.0));
    machine.effect("viscous_friction", 0, &[("viscous", 0.5)]);
    // A lag of 20 samples with a gain of 2.
    let drive = json!({"type": "narx", "sample_time": STEP, "inputs": [["u", "command"]], "terms": [[[0, 1]], [[1, 0]]],
        "coefficients": [0.95, 0.1]});
    machine.add("actuators", json!({"name": "valve", "on": {"joint": 0}, "drive": drive}), json!({}));
    machine.controller("pid", 0, 0, &[("proportional", 40.0), ("integral", 60.0), ("derivative", 8.0)]);
    let rows = 6000;
    let run = Bench::new(&machine, STEP, 1, Method::Rk4).closed(&[0.0, 0.0], &vec![0.5; rows], &vec![0.0; rows]);
    let last = run.states[2 * (rows - 1)];
    assert!((last - 0.5).abs() < 2e-3, "{last}");
}

fn error_of(result: vpm_core::Result<impl Sized>) -> Error {
    result.err().unwrap()
}

#[test]
fn what_sampled_drives_make_impossible_is_refused() {
    let machine = driven(narx(STEP));
    let description = machine.build();
    let theta = &description.parameters;
    let sampled = |error: Error| {
        let text = error.to_string();
        assert!(matches!(error, Error::Drive(DriveError::Sampled { .. })), "{text}");
        assert!(text.starts_with("actuator `valve` of type narx acts at samples of its own"), "{text}");
        text
    };
    assert!(sampled(error_of(linearize(&description, theta, &START, &[0.0; 2]))).contains("no linear model"));
    let inputs = commands(20);
    let stepping = Stepping::new(STEP, 1, Method::Rk4).unwrap();
    let setting = || Setting { description: &description, theta, stepping, sensitivities: &[], interrupt: ALWAYS };
    let table = Table::new("inputs", &inputs, 20, 2).unwrap();
    let readings = Readings { channels: &[0], table: Table::new("readings", &[0.0; 20], 20, 1).unwrap() };
    let noise = Noise { readings: &[1e-3], forces: &[0.1; 2], states: &[0.0; 5], first: &[0.1; 5] };
    let refused = vpm_core::simulate::filter(setting(), &START, table, readings, noise);
    assert!(sampled(error_of(refused)).contains("no filter knows"));
    let states = Table::new("states", &START, 1, 5).unwrap();
    let refused = vpm_core::simulate::restarts(setting(), states, &[3], 4, table);
    assert!(sampled(error_of(refused)).contains("start again"));
    let text = error_of(vpm_core::simulate::free_run(
        Setting { stepping: Stepping::new(3e-4, 1, Method::Rk4).unwrap(), ..setting() },
        &START,
        table,
    ));
    assert!(text.to_string().contains("actuator `valve` samples every 0.001 s"), "{text}");
    let mut lagging = narx(STEP);
    lagging["sample_time"] = json!(-1.0);
    let text = error_of(vpm_core::description::Description::from_json(&driven(lagging).json())).to_string();
    assert!(text.contains("valve.sample_time"), "{text}");
    let mut short = narx(STEP);
    short["coefficients"] = json!([1.0]);
    let text = error_of(vpm_core::description::Description::from_json(&driven(short).json())).to_string();
    assert!(text.contains("coefficients"), "{text}");
}

#[test]
fn an_effort_beyond_its_limit_is_reported_with_name_and_time() {
    let mut drive = narx(STEP);
    drive["terms"] = json!([[[0, 1]], [[1, 0]]]);
    drive["coefficients"] = json!([2.0, 1.0]);
    drive["limit"] = json!(100.0);
    let machine = driven(drive);
    let inputs = [1.0, 0.0].repeat(50);
    let description = machine.build();
    let stepping = Stepping::new(STEP, 1, Method::Rk4).unwrap();
    let setting = Setting {
        description: &description,
        theta: &description.parameters,
        stepping,
        sensitivities: &[],
        interrupt: ALWAYS,
    };
    let error = error_of(vpm_core::simulate::free_run(setting, &START, Table::new("inputs", &inputs, 50, 2).unwrap()));
    // 1, 3, 7, 15, 31, 63, 127
    let Error::Diverged(diverged) = &error else { panic!("{error}") };
    assert_eq!((diverged.sample_index, diverged.outputs.len()), (6, 6 * WIDTH));
    let text = error.to_string();
    assert!(
        text.starts_with("the effort of actuator `valve` is 1.2700e2, beyond its limit of 1.0000e2, at t = 0.006000 s"),
        "{text}"
    );
    let mut live = live(&machine, Method::Rk4);
    let found = (0..50).find_map(|_| live.step(&[1.0, 0.0]).err()).unwrap().to_string();
    assert!(found.starts_with("the effort of actuator `valve`") && found.contains("t = 0.006000 s"), "{found}");
    live.reset(&START).unwrap();
    live.step(&[1.0, 0.0]).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_stable_model_gives_the_same_inside_and_beside(
        pole in -0.95_f64..0.95, gain in -2.0_f64..2.0, mixed in -0.5_f64..0.5, every in 1_usize..5, substeps in 1_usize..4,
    ) {
        let drive = json!({"type": "narx", "sample_time": every as f64 * STEP, "inputs": [["u", "command"], ["v", {"velocity": 0}]],
            "terms": [[[0, 1]], [[1, 0]], [[1, 1], [2, 0]]], "coefficients": [pole, gain, mixed]});
        let inputs = commands(60);
        let outputs = Bench::new(&driven(drive), STEP, substeps, Method::SemiImplicit).free(&START, &inputs).outputs;
        let (mut effort, mut past) = (0.0, None);
        for (k, row) in outputs.chunks_exact(WIDTH).enumerate() {
            if k % every == 0 {
                effort = pole * effort + gain * row[8] + mixed * past.unwrap_or(row[8]) * row[1];
                past = Some(row[8]);
            }
            prop_assert!((row[FORCE] - effort).abs() < 1e-12);
        }
    }
}

/// Gains by which the first joint is drawn to its reading, by so many times.
fn drawn(rows: usize, times: f64) -> Vec<f64> {
    [0.05 * times, 0.0, 0.9 * times, 0.0, 0.0].repeat(rows)
}

fn observed(bench: &Bench, inputs: &[f64], readings: &[f64], gains: &[f64]) -> Run {
    let rows = readings.len();
    let readings = Readings { channels: &[0], table: Table::new("readings", readings, rows, 1).unwrap() };
    let gains = Gains {
        readings,
        gains: Table::new("gains", gains, rows, 5).unwrap(),
        innovations: false,
        alone: false,
        moves: None,
    };
    observe(bench.setting(), &START, Table::new("inputs", inputs, rows, 2).unwrap(), gains).unwrap()
}

#[test]
fn an_observer_without_gains_is_a_free_run() {
    // Short enough to go by the laws, and long enough to go by machine code, both.
    for rows in [10, 2500] {
        let inputs = commands(rows);
        let bench = Bench::new(&driven(narx(2.0 * STEP)), STEP, 2, Method::Rk4);
        let free = bench.free(&START, &inputs);
        let run = observed(&bench, &inputs, &vec![0.3; rows as usize], &drawn(rows as usize, 0.0));
        assert_eq!(run.states, free.states);
        assert_eq!(run.outputs, free.outputs);
    }
}

#[test]
fn an_observer_keeps_a_wrong_machine_on_its_log() {
    let (rows, inputs) = (1500, commands(1500));
    let truth = Bench::new(&driven(narx(STEP)), STEP, 1, Method::Rk4);
    let readings = truth.channel(&truth.free(&START, &inputs), 0);
    let mut machine = driven(narx(STEP));
    machine.payload(0, 0.4, [0.0, 0.0, -0.5]);
    let heavy = Bench::new(&machine, STEP, 1, Method::Rk4);
    let left = |times: f64| {
        let seen = heavy.channel(&observed(&heavy, &inputs, &readings, &drawn(rows, times)), 0);
        seen.iter().zip(&readings).fold(0.0_f64, |most, (own, reading)| most.max((own - reading).abs()))
    };
    let (free, kept) = (left(0.0), left(1.0));
    assert!(free > 0.02 && kept < 0.1 * free, "{free} {kept}");
}

/// Efforts that answer to the motion carry its derivatives, in a free run and beside a log.
#[test]
fn derivatives_through_sampled_drives_are_those_of_differences() {
    let (rows, inputs) = (80, commands(80));
    let readings: Vec<f64> = (0..rows).map(|k| 0.4 + 0.01 * (0.3 * k as f64).sin()).collect();
    let machine = driven(narx(2.0 * STEP));
    for times in [0.0, 1.0] {
        let run = |theta: &[f64], sensitivities: Vec<usize>| {
            let mut bench = Bench::new(&machine, STEP, 1, Method::Rosenbrock);
            (bench.theta, bench.sensitivities) = (theta.to_vec(), sensitivities);
            let run = observed(&bench, &inputs, &readings, &drawn(rows, times));
            (bench.channel(&run, 0), run.jacobian)
        };
        let exact = run(&machine.values, (0..machine.values.len()).collect()).1;
        check(&machine, &exact, "a sampled drive", |theta| run(theta, Vec::new()).0);
    }
    let element = sprung(&sampled_maxwell(STEP), Value::Null);
    let run = |theta: &[f64], sensitivities: Vec<usize>| {
        let mut bench = Bench::new(&element, STEP, 1, Method::Rk4);
        (bench.theta, bench.sensitivities) = (theta.to_vec(), sensitivities);
        bench.free(&[0.05, 0.0], &[0.0; 60])
    };
    let exact = run(&element.values, (0..element.values.len()).collect());
    let width = exact.outputs.len();
    assert_eq!(exact.jacobian.len(), width * element.values.len());
    check(&element, &exact.jacobian, "a sampled element", |theta| run(theta, Vec::new()).outputs);
}
