//! Observers: gains in closed form, the innovations that they leave, derivatives.

use std::sync::atomic::{AtomicUsize, Ordering};

use vpm_core::integrator::Method;
use vpm_core::samples::{Random, Sample, double_pendulum, random_tree, slider};
use vpm_core::simulate::{
    Filtered, Gains, Hold, Inputs, Noise, Observed, Readings, Run, Setting, filter, observe, observe_all,
};
use vpm_core::table::Table;

use super::sensitivities::check;
use crate::common::{Bench, Machine, close, solid};

const STEP: f64 = 0.01;

fn arm() -> Machine {
    let mut machine = Machine::new(&random_tree(5, 2));
    machine
        .effect("viscous_friction", 0, &[("viscous", 0.3)])
        .effect("coulomb_friction", 1, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .actuator(0, &[("gain", 1.5), ("delay", 0.0137), ("lag", 0.3)])
        .actuator(1, &[("gain", 0.8)])
        .sensor(serde_json::json!({"kind": "position", "joint": 0}), &[("gain", 1.1), ("delay", 0.0172)]);
    machine
}

const FIRST: [f64; 5] = [0.4, -0.3, 0.5, 0.2, 0.7];

/// Two commands, then the readings of both joints under others.
fn record(bench: &Bench, rows: usize) -> (Vec<f64>, Vec<f64>) {
    let commands = |scale: f64| -> Vec<f64> {
        let at = |k: usize| [2.0 * scale * (0.2 * k as f64).sin(), (0.13 * k as f64 + 1.0).cos()];
        (0..rows).flat_map(at).collect()
    };
    let run = bench.free(&[0.41, -0.28, 0.3, 0.4, 0.7], &commands(1.2));
    (commands(1.0), measured(bench, &run))
}

fn measured(bench: &Bench, run: &Run) -> Vec<f64> {
    run.outputs.chunks_exact(bench.description.n_outputs()).flat_map(|row| [row[0], row[4]]).collect()
}

fn filtered(bench: &Bench, (inputs, readings): (&[f64], &[f64])) -> Filtered {
    let rows = inputs.len() / 2;
    let noise = Noise { readings: &[1e-3, 2e-3], forces: &[0.5, 0.1], states: &[0.0; 5], first: &[1e-2; 5] };
    let readings = Readings { channels: &[0, 4], table: Table::new("readings", readings, rows, 2).unwrap() };
    filter(bench.setting(), &FIRST, Table::new("inputs", inputs, rows, 2).unwrap(), readings, noise).unwrap()
}

fn observed(bench: &Bench, record: (&[f64], &[f64]), gains: &[f64]) -> Run {
    observed_at(bench, &[0, 4], record, gains, false)
}

fn observed_at(
    bench: &Bench,
    channels: &[usize],
    (inputs, readings): (&[f64], &[f64]),
    gains: &[f64],
    alone: bool,
) -> Run {
    let rows = inputs.len() / 2;
    let readings = Readings { channels, table: Table::new("readings", readings, rows, 2).unwrap() };
    let gains = Gains {
        readings,
        gains: Table::new("gains", gains, rows, 10).unwrap(),
        innovations: false,
        alone,
        moves: None,
    };
    observe(bench.setting(), &FIRST, Table::new("inputs", inputs, rows, 2).unwrap(), gains).unwrap()
}

/// The steady gains of a mass whose place is measured and that unknown forces move: `alpha` and `beta` of Kalata, *IEEE Transactions on
/// Aerospace and Electronic Systems* 20, 1984.
#[test]
fn gains_of_a_mass_settle_at_their_closed_form() {
    let (mass, force, reading) = (4.0, 30.0, 2e-4);
    let mut machine = Machine::new(&slider(mass));
    machine.actuator(0, &[("gain", 1.0)]);
    let index = force / mass * STEP * STEP / reading;
    let ratio = (4.0 + index - (8.0 * index + index * index).sqrt()) / 4.0;
    let alpha = 1.0 - ratio * ratio;
    let beta = 2.0 * (2.0 - alpha) - 4.0 * (1.0 - alpha).sqrt();
    let spread = reading * reading / (1.0 - alpha);
    let rows = 400;
    let (inputs, places) = (vec![0.0; rows], vec![0.0; rows]);
    for method in [Method::Rk4, Method::Rosenbrock, Method::SemiImplicit] {
        let bench = Bench::new(&machine, STEP, 1, method);
        let noise = Noise { readings: &[reading], forces: &[force], states: &[0.0; 2], first: &[1.0, 1.0] };
        let readings = Readings { channels: &[0], table: Table::new("readings", &places, rows, 1).unwrap() };
        let table = Table::new("inputs", &inputs, rows, 1).unwrap();
        let found = filter(bench.setting(), &[0.0, 0.0], table, readings, noise).unwrap();
        // The step of the semi-implicit method moves a mass at rest by dt^2 instead of half of it; its transition is the same.
        close(found.gains[2 * rows - 2], alpha, 1e-9);
        close(found.gains[2 * rows - 1], beta / STEP, 1e-7);
        close(found.covariances[rows - 1], spread, 1e-6 * spread);
        close(found.deviations[2 * rows - 2], reading * alpha.sqrt(), 1e-6 * reading);
    }
}

#[test]
fn an_observer_with_these_gains_leaves_the_same() {
    for method in [Method::Rk4, Method::LinearlyImplicit, Method::Rosenbrock, Method::Additive] {
        let bench = Bench::new(&arm(), STEP, 2, method);
        let (inputs, readings) = record(&bench, 80);
        let found = filtered(&bench, (&inputs, &readings));
        let run = observed(&bench, (&inputs, &readings), &found.gains);
        let seen = measured(&bench, &run);
        assert!(found.innovations[100..].iter().any(|innovation| innovation.abs() > 1e-5), "nothing to correct");
        for ((&seen, &reading), &innovation) in seen.iter().zip(&readings).zip(&found.innovations) {
            close(reading - seen, innovation, 1e-12);
        }
    }
}

/// A method that remembers a step goes on across corrections, and keeps its order.
#[test]
fn corrections_keep_the_order_of_a_method_of_two_steps() {
    let machine = arm();
    let bench = |pieces: usize, method: Method| Bench::new(&machine, STEP, pieces, method);
    let (inputs, readings) = record(&bench(1, Method::Rk4), 80);
    let gains = filtered(&bench(1, Method::Rk4), (&inputs, &readings)).gains;
    let states = |bench: Bench| observed(&bench, (&inputs, &readings), &gains).states;
    let exact = states(bench(64, Method::Rk4));
    let gaps = [2, 4, 8].map(|pieces| {
        let found = states(bench(pieces, Method::CrankNicolson));
        found.iter().zip(&exact).map(|(found, exact)| (found - exact).abs()).fold(0.0, f64::max)
    });
    assert!(gaps[0] > 1e-6, "nothing to see: {gaps:?}");
    assert!(gaps[1] < 0.35 * gaps[0] && gaps[2] < 0.35 * gaps[1], "{gaps:?}");
}

#[test]
fn without_gains_it_runs_freely() {
    let bench = Bench::new(&arm(), STEP, 1, Method::Rosenbrock);
    let (inputs, readings) = record(&bench, 50);
    let run = observed(&bench, (&inputs, &readings), &vec![0.0; 50 * 10]);
    // The one by machine code, the other, which is short, by the laws.
    let free = bench.free(&FIRST, &inputs);
    run.states.iter().zip(&free.states).for_each(|(&own, &free)| close(own, free, 1e-12));
    run.outputs.iter().zip(&free.outputs).for_each(|(&own, &free)| close(own, free, 1e-10));
}

#[test]
fn derivatives_are_those_of_differences() {
    let machine = arm();
    let mut bench = Bench::new(&machine, STEP, 1, Method::Rosenbrock);
    let (inputs, readings) = record(&bench, 60);
    let gains = filtered(&bench, (&inputs, &readings)).gains;
    bench.sensitivities = (0..machine.values.len()).collect();
    let exact = observed(&bench, (&inputs, &readings), &gains);
    check(&machine, &exact.jacobian, "an observer", |theta| {
        let mut moved = Bench::new(&machine, STEP, 1, Method::Rosenbrock);
        moved.theta = theta.to_vec();
        measured(&moved, &observed(&moved, (&inputs, &readings), &gains))
    });
}

/// A run that is too short for machine code gives differences where these are allowed; moves must be some.
#[test]
fn differences_are_near_the_derivatives() {
    let mut bench = Bench::new(&arm(), STEP, 1, Method::LinearlyImplicit);
    let (inputs, readings) = record(&bench, 12);
    let gains = filtered(&bench, (&inputs, &readings)).gains;
    bench.sensitivities = vec![0, 2, 5, 7];
    let run = |moves: Option<&[f64]>| {
        let readings = Readings { channels: &[0, 4], table: Table::new("readings", &readings, 12, 2).unwrap() };
        let gains = Gains {
            readings,
            gains: Table::new("gains", &gains, 12, 10).unwrap(),
            innovations: false,
            alone: true,
            moves,
        };
        observe(bench.setting(), &FIRST, Table::new("inputs", &inputs, 12, 2).unwrap(), gains)
    };
    let (exact, differences) = (run(None).unwrap(), run(Some(&[1e-6; 4])).unwrap());
    assert_eq!(exact.outputs, differences.outputs);
    let largest = exact.jacobian.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
    assert!(exact.jacobian != differences.jacobian && largest > 1e-3);
    exact.jacobian.iter().zip(&differences.jacobian).for_each(|(&one, &other)| close(one, other, 1e-5 * largest));
    let refused = run(Some(&[1e-6, 0.0, 1e-6, 1e-6])).unwrap_err().to_string();
    assert!(refused.contains("a move of a parameter must not be zero"), "{refused}");
    assert!(run(Some(&[1e-6])).unwrap_err().to_string().contains("moves"));
}

/// Asked for the measured outputs alone, samples need no rates where the state decides them: positions and velocities, and not the
/// efforts of the last case. Short runs go by the laws, long ones by machine code.
#[test]
fn what_is_measured_is_the_same_without_all_else() {
    for method in [Method::Rk4, Method::LinearlyImplicit, Method::Rosenbrock, Method::Additive, Method::SemiImplicit] {
        for (channels, rows) in [([0, 4], 10), ([0, 4], 80), ([1, 5], 80), ([0, 7], 80)] {
            let mut bench = Bench::new(&arm(), STEP, 2, method);
            let (inputs, readings) = record(&bench, rows);
            let gains = filtered(&bench, (&inputs, &readings)).gains;
            for sensitivities in [0, 1, 9] {
                bench.sensitivities = (0..sensitivities).collect();
                let [all, alone] =
                    [false, true].map(|alone| observed_at(&bench, &channels, (&inputs, &readings), &gains, alone));
                let rows = all.outputs.chunks_exact(bench.description.n_outputs());
                let measured: Vec<f64> = rows.flat_map(|row| channels.map(|channel| row[channel])).collect();
                assert_eq!(alone.outputs.len(), measured.len());
                for (own, full) in
                    [(&alone.outputs, &measured), (&alone.states, &all.states), (&alone.jacobian, &all.jacobian)]
                {
                    own.iter().zip(full).for_each(|(&own, &full)| close(own, full, 1e-9 * (1.0 + full.abs())));
                }
            }
        }
    }
}

/// Forces and readings as the filter believes them: its innovations are as large as it says, one by one.
#[test]
fn innovations_are_as_large_as_they_are_said_to_be() {
    let (mass, force, reading, rows) = (2.0, 5.0, 1e-4, 4000);
    let mut machine = Machine::new(&slider(mass));
    machine.effect("viscous_friction", 0, &[("viscous", 3.0)]).actuator(0, &[("gain", 1.0)]);
    let bench = Bench::new(&machine, STEP, 1, Method::Rk4);
    let mut random = Random::new(7);
    // Twelve uniform numbers make a normal one, near enough for second moments.
    let mut normal = || (0..12).map(|_| 0.5 * random.symmetric()).sum::<f64>();
    let known: Vec<f64> = (0..rows).map(|k| 10.0 * (0.05 * k as f64).sin()).collect();
    let pushed: Vec<f64> = known.iter().map(|known| known + force * normal()).collect();
    let places: Vec<f64> =
        bench.channel(&bench.free(&[0.0, 0.0], &pushed), 0).iter().map(|place| place + reading * normal()).collect();
    let noise = Noise { readings: &[reading], forces: &[force], states: &[0.0; 2], first: &[1e-3, 1e-2] };
    let readings = Readings { channels: &[0], table: Table::new("readings", &places, rows, 1).unwrap() };
    let found =
        filter(bench.setting(), &[0.0, 0.0], Table::new("inputs", &known, rows, 1).unwrap(), readings, noise).unwrap();
    let whitened: Vec<f64> =
        found.innovations.iter().zip(&found.covariances).map(|(own, spread)| own / spread.sqrt()).collect();
    let count = rows as f64;
    let power = whitened.iter().map(|own| own * own).sum::<f64>() / count;
    // Three standard deviations of a mean of squares, and of a correlation.
    close(power, 1.0, 3.0 * (2.0 / count).sqrt());
    for lag in 1..6 {
        let shared = whitened.iter().zip(&whitened[lag..]).map(|(one, other)| one * other).sum::<f64>() / count;
        close(shared, 0.0, 3.5 / count.sqrt());
    }
}

#[test]
fn noise_that_is_none_is_refused() {
    let bench = Bench::new(&arm(), STEP, 1, Method::Rk4);
    let (inputs, readings) = record(&bench, 20);
    let table = Table::new("readings", &readings, 20, 2).unwrap();
    let run = |deviations: &[f64], channels: &[usize]| {
        let noise = Noise { readings: deviations, forces: &[0.1; 2], states: &[0.0; 5], first: &[0.1; 5] };
        let inputs = Table::new("inputs", &inputs, 20, 2).unwrap();
        filter(bench.setting(), &FIRST, inputs, Readings { channels, table }, noise).unwrap_err().to_string()
    };
    for (found, said) in [
        (run(&[0.0, 1e-3], &[0, 4]), "must be positive (of readings), got 0"),
        (run(&[1e-3], &[0, 4]), "noise of readings"),
        (run(&[1e-3; 2], &[0, 900]), "output"),
    ] {
        assert!(found.contains(said), "{found}");
    }
}

/// One command and one position: what an observer leaves does not depend on whether the command or the reading is late. Its speed is
/// drawn while a position is under way, so that both agree as far as that is short.
#[test]
fn a_late_sensor_is_observed_as_a_late_command() {
    let rows = 600;
    let command: Vec<f64> = (0..rows).map(|k| (0.05 * k as f64).sin() - 0.4 * (0.31 * k as f64).sin()).collect();
    let readings: Vec<f64> = (0..rows).map(|k| 1e-3 * (0.11 * k as f64).sin()).collect();
    let left = |gain: [f64; 2], late: &[(&str, f64)], read: &[(&str, f64)]| -> Vec<f64> {
        let mut machine = Machine::new(&slider(2.0));
        machine.actuator(0, &[&[("gain", 1.0)], late].concat());
        machine.sensor(serde_json::json!({"kind": "position", "joint": 0}), &[&[("gain", 1.0)], read].concat());
        let bench = Bench::new(&machine, 1e-3, 4, Method::SemiImplicit);
        let table = Table::new("readings", &readings, rows, 1).unwrap();
        let gains = [gain; 600].concat();
        let gains = Gains {
            readings: Readings { channels: &[0], table },
            gains: Table::new("gains", &gains, rows, 2).unwrap(),
            innovations: false,
            alone: false,
            moves: None,
        };
        let inputs = Table::new("inputs", &command, rows, 1).unwrap();
        let run = observe(bench.setting(), &[0.0, 0.0], inputs, gains).unwrap();
        run.outputs.chunks_exact(bench.description.n_outputs()).zip(&readings).map(|(row, y)| y - row[0]).collect()
    };
    let power = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let gap = |late: &[f64], read: &[f64]| {
        let difference: Vec<f64> = late.iter().zip(read).map(|(a, b)| a - b).collect();
        power(&difference) / power(late)
    };
    let delay = [("delay", 3.4e-3)];
    // A position that is drawn alone is drawn at once.
    assert!(gap(&left([0.2, 0.0], &delay, &[]), &left([0.2, 0.0], &[], &delay)) < 1e-3);
    assert!(gap(&left([0.05, 1.4], &delay, &[]), &left([0.05, 1.4], &[], &delay)) < 0.06);
}

/// A machine in innovations form gives the record that its observer leaves these innovations of (T. Kailath, *IEEE Transactions on Automatic
/// Control* 13, 1968).
#[test]
fn innovations_give_their_record_again() {
    let bench = Bench::new(&arm(), STEP, 2, Method::Rk4);
    let (inputs, readings) = record(&bench, 300);
    let gains = filtered(&bench, (&inputs, &readings)).gains;
    let run = observed(&bench, (&inputs, &readings), &gains);
    let left: Vec<f64> =
        measured(&bench, &run).iter().zip(&readings).map(|(output, reading)| reading - output).collect();
    let table = |name, values, width| Table::new(name, values, 300, width).unwrap();
    let gains = Gains {
        readings: Readings { channels: &[0, 4], table: table("readings", &left, 2) },
        gains: table("gains", &gains, 10),
        innovations: true,
        alone: false,
        moves: None,
    };
    let again = observe(bench.setting(), &FIRST, table("inputs", &inputs, 2), gains).unwrap();
    assert!(left.iter().any(|e| e.abs() > 1e-3));
    for ((output, e), reading) in measured(&bench, &again).iter().zip(&left).zip(&readings) {
        assert!((output + e - reading).abs() < 1e-11, "{output} + {e} is not {reading}");
    }
}

/// Channels and lengths of two records.
const LOGS: [(&[usize], usize); 2] = [(&[0, 4], 900), (&[0, 4], 700)];

/// What observers leave of two records, together and one by one, and how often they asked whether to stop.
fn side_by_side(
    machine: &Machine,
    method: Method,
    hold: Hold,
    logs: [(&[usize], usize); 2],
) -> ([Vec<Run>; 2], [usize; 2]) {
    let asked = AtomicUsize::new(0);
    let interrupt = || asked.fetch_add(1, Ordering::Relaxed) == usize::MAX;
    let bench = Bench::new(machine, STEP, 2, method);
    let setting = Setting { interrupt: &interrupt, ..bench.setting() };
    let records = logs.map(|(_, rows)| record(&bench, rows));
    let gains = [0.3, 0.1, 0.0, 0.2, 2.0, 0.0, 0.1, 1.5, 0.0, 0.0].repeat(900);
    let firsts = [FIRST, FIRST.map(|value| 0.9 * value)];
    let observed: Vec<_> = records
        .iter()
        .zip(firsts.iter().zip(logs))
        .map(|((inputs, readings), (initial, (channels, rows)))| {
            let table = |name, numbers, width| Table::new(name, numbers, rows, width).unwrap();
            let readings = Readings { channels, table: table("readings", readings, 2) };
            let gains = table("gains", &gains[..10 * rows], 10);
            let gains = Gains { readings, gains, innovations: false, alone: true, moves: None };
            Observed { initial, inputs: Inputs { table: table("inputs", inputs, 2), hold }, gains }
        })
        .collect();
    let together = observe_all(setting, &observed).unwrap();
    let often = asked.swap(0, Ordering::Relaxed);
    let alone = observed.iter().map(|one| observe(setting, one.initial, one.inputs, one.gains).unwrap()).collect();
    ([together, alone], [often, asked.into_inner()])
}

#[test]
fn two_records_side_by_side_leave_bitwise_what_each_leaves_alone() {
    for method in Method::FIXED {
        for hold in [Hold::ZeroOrder, Hold::FirstOrder] {
            let ([together, alone], [often, one_by_one]) = side_by_side(&arm(), method, hold, LOGS);
            assert!(together == alone, "{method}");
            assert!(one_by_one > 0 && 10 * often < 7 * one_by_one, "{method} asked {often} times, {one_by_one} alone");
        }
    }
}

#[test]
fn steps_of_controlled_errors_are_those_of_each_record() {
    let method = Method::Adaptive { tolerance: 1e-7 };
    let ([together, alone], [often, one_by_one]) = side_by_side(&arm(), method, Hold::ZeroOrder, LOGS);
    assert!(together == alone);
    assert_eq!(often, one_by_one);
}

#[test]
fn records_of_other_channels_go_one_by_one() {
    // Readings of the wrong joint soon drive the second machine away.
    let logs: [(&[usize], usize); 2] = [(&[0, 4], 60), (&[4, 0], 50)];
    let ([together, alone], _) = side_by_side(&arm(), Method::Rk4, Hold::ZeroOrder, logs);
    assert!(together == alone);
}

/// A closed loop: a point of one body on a point of another.
fn tied(machine: &mut Machine, [a, b]: [usize; 2], points: [[f64; 3]; 2]) {
    let upright = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let [a, b] = [(a, points[0]), (b, points[1])]
        .map(|(body, point)| serde_json::json!({"on": {"body": body}, "translation": point, "rotation": upright}));
    let part = serde_json::json!({"name": "pin", "joint": "spherical", "a": a, "b": b});
    machine.add("loops", part, serde_json::json!({}));
}

/// One position drawn with these gains of its place and its rate.
fn drawn(bench: &Bench, initial: &[f64], (inputs, readings): (&[f64], &[f64]), gain: [f64; 2]) -> Run {
    let (rows, n) = (readings.len(), initial.len() / 2);
    let mut gains = vec![0.0; 2 * n];
    (gains[0], gains[n]) = (gain[0], gain[1]);
    let readings = Readings { channels: &[0], table: Table::new("readings", readings, rows, 1).unwrap() };
    let gains = gains.repeat(rows);
    let gains = Table::new("gains", &gains, rows, 2 * n).unwrap();
    let gains = Gains { readings, gains, innovations: false, alone: false, moves: None };
    observe(bench.setting(), initial, Table::new("inputs", inputs, rows, 1).unwrap(), gains).unwrap()
}

/// Two masses on one rail that a loop ties are one mass, whichever of them is drawn, and however light that is.
#[test]
fn tied_masses_are_observed_as_one() {
    let rows = 400;
    let command: Vec<f64> = (0..rows).map(|k| (0.05 * k as f64).sin()).collect();
    let readings: Vec<f64> = (0..rows).map(|k| 1e-2 * (0.02 * k as f64).sin()).collect();
    let gain = [0.2, 3.0];
    let mut whole = Machine::new(&slider(2.5));
    whole.actuator(0, &[("gain", 1.0)]);
    let bench = Bench::new(&whole, STEP, 1, Method::Rk4);
    let alone = bench.channel(&drawn(&bench, &[0.0; 2], (&command, &readings), gain), 0);
    for masses in [[1.5, 1.0], [0.1, 2.4]] {
        let [first, second] = masses.map(|mass| slider(mass).bodies.remove(0));
        let second = vpm_core::body::Body { name: "other".to_owned(), ..second };
        let mut pair = Machine::new(&Sample { gravity: [0.0; 3], bodies: vec![first, second] });
        pair.actuator(0, &[("gain", 1.0)]);
        tied(&mut pair, [0, 1], [[0.0; 3]; 2]);
        let bench = Bench::new(&pair, STEP, 1, Method::Rk4);
        let run = drawn(&bench, &[0.0; 4], (&command, &readings), gain);
        let [own, other] = [0, 4].map(|column| bench.channel(&run, column));
        assert!(alone.iter().any(|place| place.abs() > 5e-3), "nothing moves");
        for ((&own, &other), &alone) in own.iter().zip(&other).zip(&alone) {
            // A held mass gives way by a millionth of the other's share.
            close(own, alone, 1e-6);
            close(other, own, 1e-13);
        }
    }
}

/// Lengths of a crank and its rod, and the height of the rail above the crank's joint, m.
const CRANK: ([f64; 2], f64) = ([0.5, 0.4], 0.6);
/// Where the crank begins, rad.
const BEGUN: f64 = 0.3;

/// A slider-crank, with its first state.
fn slider_crank() -> (Machine, [f64; 6]) {
    let (lengths, height) = CRANK;
    let mut bodies = double_pendulum([1.0, 0.7], lengths).bodies;
    bodies.extend(slider(2.0).bodies);
    let mut machine = Machine::new(&solid(Sample { gravity: [0.0, 0.0, -9.81], bodies }));
    machine.effect("viscous_friction", 1, &[("viscous", 0.2)]).actuator(0, &[("gain", 1.0)]);
    tied(&mut machine, [1, 2], [[0.0, 0.0, -lengths[1]], [0.0, 0.0, -height]]);
    let rod = ((height - lengths[0] * BEGUN.cos()) / lengths[1]).acos();
    (machine, [BEGUN, rod - BEGUN, -lengths[0] * BEGUN.sin() - lengths[1] * rod.sin(), 0.0, 0.0, 0.0])
}

/// The second record leads farther away at some samples, where its loop alone is closed again more than once.
#[test]
fn loops_side_by_side_are_closed_bitwise_as_alone() {
    let (machine, first) = slider_crank();
    let rows = [900, 700];
    let readings = rows.map(|rows| (0..rows).map(|k| BEGUN + 0.02 * (0.01 * k as f64).sin()).collect::<Vec<_>>());
    let [near, mut far] = readings;
    (100..700).step_by(150).for_each(|k| far[k] += 0.25);
    let gains = [1.0, 0.0, 0.0, 2.0, 0.0, 0.0].repeat(rows[0]);
    for method in [Method::Rk4, Method::LinearlyImplicit, Method::Rosenbrock] {
        let asked = AtomicUsize::new(0);
        let interrupt = || asked.fetch_add(1, Ordering::Relaxed) == usize::MAX;
        let bench = Bench::new(&machine, STEP, 2, method);
        let setting = Setting { interrupt: &interrupt, ..bench.setting() };
        let inputs = vec![0.1; rows[0]];
        let observed: Vec<_> = [(&near, rows[0]), (&far, rows[1])]
            .map(|(readings, rows)| {
                let table = |name, numbers, width| Table::new(name, numbers, rows, width).unwrap();
                let readings = Readings { channels: &[0], table: table("readings", readings, 1) };
                let gains = table("gains", &gains[..6 * rows], 6);
                let gains = Gains { readings, gains, innovations: false, alone: true, moves: None };
                let inputs = Inputs { table: table("inputs", &inputs[..rows], 1), hold: Hold::ZeroOrder };
                Observed { initial: &first, inputs, gains }
            })
            .into();
        let together = observe_all(setting, &observed).unwrap();
        let often = asked.swap(0, Ordering::Relaxed);
        let alone: Vec<_> =
            observed.iter().map(|one| observe(setting, one.initial, one.inputs, one.gains).unwrap()).collect();
        assert!(together == alone, "{method}");
        let one_by_one = asked.into_inner();
        assert!(one_by_one > 0 && 10 * often < 7 * one_by_one, "{method} asked {often} times, {one_by_one} alone");
        for state in alone[1].states.chunks_exact(6) {
            let ([crank, rod], height) = CRANK;
            close(crank * state[0].cos() + rod * (state[0] + state[1]).cos(), height, 1e-9);
        }
    }
}

/// A slider-crank whose crank alone is measured: the loop stays closed, and derivatives are those of differences.
#[test]
fn loops_are_closed_again_after_corrections() {
    let ((machine, first), (lengths, height), crank) = (slider_crank(), CRANK, BEGUN);
    let rows = 40;
    let inputs: Vec<f64> = (0..rows).map(|k| 3.0 * (0.2 * k as f64).sin()).collect();
    let readings: Vec<f64> = (0..rows).map(|k| crank + 0.02 * (0.1 * k as f64).sin()).collect();
    for method in [Method::Rk4, Method::LinearlyImplicit, Method::Rosenbrock] {
        let observed = |theta: &[f64], sensitivities: Vec<usize>| {
            let mut bench = Bench::new(&machine, STEP, 2, method);
            (bench.theta, bench.sensitivities) = (theta.to_vec(), sensitivities);
            let run = drawn(&bench, &first, (&inputs, &readings), [0.1, 2.0]);
            (bench.channel(&run, 0), run)
        };
        let (own, exact) = observed(&machine.values, (0..machine.values.len()).collect());
        // Kept on what it would have left.
        assert!(own.iter().zip(&readings).all(|(own, reading)| (own - reading).abs() < 0.02));
        let free = observed(&machine.values, Vec::new());
        assert!(free.1.states.chunks_exact(6).any(|state| (state[0] - crank).abs() > 5e-3), "nothing moves");
        for state in exact.states.chunks_exact(6) {
            let angle = state[0] + state[1];
            close(lengths[0] * state[0].cos() + lengths[1] * angle.cos(), height, 1e-12);
            close(-lengths[0] * state[0].sin() - lengths[1] * angle.sin(), state[2], 1e-12);
        }
        check(&machine, &exact.jacobian, "a closed loop", |theta| observed(theta, Vec::new()).0);
        // A reading that is far away is reached at once.
        let bench = Bench::new(&machine, STEP, 2, method);
        let far = drawn(&bench, &first, (&inputs, &vec![crank + 0.3; rows]), [1.0, 0.0]);
        close(far.states[6], crank + 0.3, 1e-2);
        close(lengths[0] * far.states[6].cos() + lengths[1] * (far.states[6] + far.states[7]).cos(), height, 1e-12);
    }
}

#[test]
fn a_filter_on_closed_loops_is_refused() {
    let bodies =
        ["one", "other"].map(|name| vpm_core::body::Body { name: name.to_owned(), ..slider(1.0).bodies.remove(0) });
    let mut machine = Machine::new(&Sample { gravity: [0.0; 3], bodies: bodies.into() });
    machine.actuator(0, &[("gain", 1.0)]);
    tied(&mut machine, [0, 1], [[0.0; 3]; 2]);
    let bench = Bench::new(&machine, STEP, 1, Method::Rk4);
    let noise = Noise { readings: &[1e-3], forces: &[0.1; 2], states: &[0.0; 4], first: &[0.1; 4] };
    let readings = Readings { channels: &[0], table: Table::new("readings", &[0.0; 9], 9, 1).unwrap() };
    let table = Table::new("inputs", &[0.0; 9], 9, 1).unwrap();
    let said = filter(bench.setting(), &[0.0; 4], table, readings, noise).unwrap_err().to_string();
    assert!(said.contains("`pin`") && said.contains("give the gains"), "{said}");
}
