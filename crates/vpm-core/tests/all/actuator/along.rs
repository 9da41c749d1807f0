//! Drives along a given motion: what a free run makes them do, they do again on its motion.

use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::motion::JointMotion;
use vpm_core::simulate::{Along, Run, Setting, Stepping, drives_along};
use vpm_core::table::Table;

use crate::common::hydraulics::{Chirp, nominal};
use crate::common::servo_machine::{On, machine, rest, simpler_drives};
use crate::common::{ALWAYS, Bench, Machine};

const STEP: f64 = 2e-4;
const ROWS: usize = 900;

fn currents() -> Vec<f64> {
    let chirp = Chirp { amplitude: 2e-3, start: 12.0, slope: 300.0 };
    (0..ROWS).map(|k| chirp.current(k as f64 * STEP)).collect()
}

fn description(machine: &Machine) -> Description {
    Bench::new(machine, STEP, 4, Method::Rosenbrock).description
}

fn free(machine: &Machine) -> Run {
    Bench::new(machine, STEP, 4, Method::Rosenbrock).free(&rest(machine), &currents())
}

/// The joints follow what the run shows of them; `seen` are measured states of the drive.
fn along(d: &Description, run: &Run, theta: &[f64], by: &[usize], seen: (&[usize], &[f64])) -> Result<Along> {
    let column = |offset: usize| -> Vec<f64> { run.outputs.chunks(d.n_outputs()).map(|row| row[offset]).collect() };
    let (motion, inputs) = ([column(0), column(1), column(2)], currents());
    let table = |k: usize| Table::new("motion", &motion[k], ROWS, 1);
    let stepping = Stepping::new(STEP, 4, Method::Rosenbrock)?;
    let setting = Setting { description: d, theta, stepping, sensitivities: by, interrupt: ALWAYS };
    let motion = JointMotion { position: table(0)?, velocity: table(1)?, acceleration: table(2)? };
    let measured = (seen.0, Table::new("seen", seen.1, ROWS, seen.0.len())?);
    drives_along(setting, motion, Table::new("inputs", &inputs, ROWS, 1)?, &run.states[2..d.n_states()], measured)
}

#[test]
fn a_free_run_gives_its_drive_back() -> Result<()> {
    for on in [On::Joint, On::Line] {
        let machine = machine(&nominal(), on);
        let (d, run) = (description(&machine), free(&machine));
        let found = along(&d, &run, &d.parameters, &[], (&[], &[]))?;
        let width = d.n_outputs() + 1;
        let mut largest = 0.0_f64;
        for (k, (row, state)) in found.outputs.chunks(width).zip(found.states.chunks(6)).enumerate() {
            let expected = &run.states[k * 6..(k + 1) * 6];
            for place in 4..6 {
                let off = (state[place] - expected[place]).abs();
                assert!(off < 2e3, "{on:?} sample {k}: a pressure is {off} Pa off");
            }
            // What the motion needs is what the drive gives: on the slide both are its only efforts.
            assert!((row[3] - row[width - 1]).abs() < 1.0, "{on:?} sample {k}: {} N and {} N", row[3], row[width - 1]);
            largest = largest.max(row[3].abs());
        }
        assert!(largest > 100.0, "the drive has to work: {largest} N at most");
    }
    Ok(())
}

#[test]
fn drives_with_fewer_states_give_theirs_back() -> Result<()> {
    for (name, machine) in simpler_drives(&nominal()) {
        let (d, run) = (description(&machine), free(&machine));
        let found = along(&d, &run, &d.parameters, &[], (&[], &[]))?;
        let (width, states) = (d.n_outputs() + 1, d.n_states());
        let mut largest = 0.0_f64;
        for (k, row) in found.outputs.chunks(width).enumerate() {
            assert!((row[3] - row[width - 1]).abs() < 2.0, "{name} sample {k}: {} N and {} N", row[3], row[width - 1]);
            largest = largest.max(row[3].abs());
            for place in 2..states {
                let (state, expected) = (found.states[k * states + place], run.states[k * states + place]);
                // A spool or its rate, or a pressure.
                let near = if expected.abs() > 1e4 { 2e3 } else { 1e-3 * expected.abs().max(1e-2) };
                assert!((state - expected).abs() < near, "{name} sample {k}, state {place}: {state}, not {expected}");
            }
        }
        assert!(largest > 100.0, "{name} has to work: {largest} N at most");
    }
    Ok(())
}

#[test]
fn measured_pressures_decide_the_effort_and_nothing_else() -> Result<()> {
    let machine = machine(&nominal(), On::Joint);
    let (d, run) = (description(&machine), free(&machine));
    let plain = along(&d, &run, &d.parameters, &[], (&[], &[]))?;
    let seen: Vec<f64> = run.states.chunks(6).flat_map(|state| [state[4] + 1e5, state[5]]).collect();
    let raised = along(&d, &run, &d.parameters, &[], (&[2, 3], &seen))?;
    let (width, area) = (d.n_outputs() + 1, nominal().cylinder.areas().a);
    for (a, b) in plain.outputs.chunks(width).zip(raised.outputs.chunks(width)) {
        assert_eq!(a[..width - 1], b[..width - 1]);
        let more = b[width - 1] - a[width - 1];
        assert!((more - 1e5 * area).abs() < 1.0, "{more} N, not {} N", 1e5 * area);
    }
    assert_eq!(plain.states, raised.states);
    Ok(())
}

#[test]
fn sensitivities_are_slopes() -> Result<()> {
    let machine = machine(&nominal(), On::Line);
    are_slopes(&machine, &[machine_column(&description(&machine))], 16)
}

#[test]
fn sensitivities_of_drives_with_fewer_states_are_slopes() -> Result<()> {
    // What a table says depends on no parameter.
    simpler_drives(&nominal())
        .iter()
        .try_for_each(|(name, machine)| are_slopes(machine, &[], if *name == "table" { 0 } else { 8 }))
}

/// Derivatives of these columns and of the effort by every parameter; `least` of them have to differ from zero.
fn are_slopes(machine: &Machine, columns: &[usize], least: usize) -> Result<()> {
    let (d, run) = (description(machine), free(machine));
    let every: Vec<usize> = (0..d.parameters.len()).collect();
    let exact = along(&d, &run, &d.parameters, &every, (&[], &[]))?;
    let width = d.n_outputs() + 1;
    let mut moved = 0;
    for &place in &every {
        let size = 1e-5 * d.parameters[place].abs();
        if size == 0.0 {
            continue;
        }
        let shifted = |by: f64| {
            let mut theta = d.parameters.clone();
            theta[place] += by;
            along(&d, &run, &theta, &[], (&[], &[]))
        };
        let (Ok(up), Ok(down)) = (shifted(size), shifted(-size)) else { continue };
        for &column in columns.iter().chain(&[width - 1]) {
            let slope = |k: usize| (up.outputs[k * width + column] - down.outputs[k * width + column]) / (2.0 * size);
            let all = |k: usize| exact.jacobian[(k * width + column) * every.len() + place];
            let most = (0..ROWS).fold(0.0_f64, |most, k| most.max(all(k).abs()));
            let off = (0..ROWS).fold(0.0_f64, |most, k| most.max((slope(k) - all(k)).abs()));
            let rounding = 1e-4 * run.outputs.iter().fold(0.0_f64, |most, x| most.max(x.abs())) * 1e-9 / size;
            assert!(off <= 1e-3 * most + rounding, "{} of column {column}: {off} of {most}", machine.names[place]);
            moved += usize::from(most > 0.0);
        }
    }
    assert!(moved >= least, "only {moved} derivatives differ from zero");
    Ok(())
}

/// Column of the first chamber's pressure.
fn machine_column(d: &Description) -> usize {
    d.layout().hydraulics() + 1
}

#[test]
fn wrong_tables_are_refused() {
    let machine = machine(&nominal(), On::Joint);
    let (d, run) = (description(&machine), free(&machine));
    let refused = along(&d, &run, &d.parameters, &[], (&[4], &[0.0; ROWS])).unwrap_err().to_string();
    assert!(refused.contains("list of measured states") && refused.contains('4'), "{refused}");
}
