//! Efforts along measured motions: derivatives against central differences, blocks of samples against the laws, any number of threads.

use std::ops::Range;

use rayon::ThreadPoolBuilder;
use serde_json::json;
use vpm_core::Error;
use vpm_core::description::Description;
use vpm_core::inverse::{Efforts, Motion, delivered, inverse_dynamics, required};
use vpm_core::motion::JointMotion;
use vpm_core::samples::{Random, arm7, double_pendulum, random_tree};
use vpm_core::system::Kind;
use vpm_core::table::Table;

use super::sensitivities::{check, movable};
use crate::common::{ALWAYS, Machine, close};

const STEP: f64 = 0.01;

/// A record of random numbers.
struct Log {
    joints: usize,
    inputs: usize,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    u: Vec<f64>,
}

impl Log {
    fn new(d: &Description, rows: usize) -> Self {
        let (joints, inputs, mut random) = (d.n_joints(), d.n_inputs(), Random::new(4));
        let [q, v, a] = [1.0, 2.0, 5.0].map(|size| random.numbers(joints * rows, size));
        Self { joints, inputs, q, v, a, u: random.numbers(inputs * rows, 2.0) }
    }

    fn motion(&self, rows: Range<usize>) -> JointMotion<'_> {
        let [position, velocity, acceleration] = [&self.q, &self.v, &self.a].map(|numbers| {
            let numbers = &numbers[rows.start * self.joints..rows.end * self.joints];
            Table::new("motion", numbers, rows.len(), self.joints).unwrap()
        });
        JointMotion { position, velocity, acceleration }
    }

    fn inputs(&self, rows: Range<usize>) -> Table<'_> {
        let numbers = &self.u[rows.start * self.inputs..rows.end * self.inputs];
        Table::new("inputs", numbers, rows.len(), self.inputs).unwrap()
    }

    fn rows(&self) -> Range<usize> {
        0..self.q.len() / self.joints
    }

    fn efforts(&self, d: &Description, theta: &[f64], rows: Range<usize>, by: &[usize]) -> Efforts {
        let JointMotion { position, velocity, acceleration } = self.motion(rows.clone());
        let motion = Motion { position, velocity, acceleration, inputs: self.inputs(rows), time_step: STEP };
        inverse_dynamics(d, theta, motion, by, ALWAYS).unwrap()
    }
}

/// Two joints behind sensors, with friction that remembers, one driven directly, one by a line.
fn machine() -> Machine {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .effect("hysteresis", 0, &[("force", 1.3), ("displacement", 0.7), ("shape", 0.6)])
        .effect("viscous_friction", 1, &[("viscous", 0.2)])
        .effect("hysteresis", 1, &[("force", 0.8), ("displacement", 0.4), ("shape", 1.2)])
        .actuator(1, &[("gain", 0.8), ("delay", 0.0043), ("lag", 0.03)]);
    let line = json!({"name": "strut", "from": {"on": "world", "point": [0.4, 0.0, 0.3]},
        "to": {"on": {"body": 1}, "point": [0.05, 0.0, -0.2]}, "barrel": null, "rod": null});
    machine.add("lines", line, json!({}));
    let drive = json!({"drive": {"type": "ideal", "gain": 1.5}, "lag": 0.05});
    machine.add("actuators", json!({"name": "piston", "on": {"line": 0}}), drive);
    for (joint, gain) in [1.1, 0.9].into_iter().enumerate() {
        let numbers = [("gain", gain), ("offset", 0.03), ("delay", 0.0172 - 0.004 * joint as f64)];
        machine.sensor(json!({"kind": "position", "joint": joint}), &numbers);
    }
    movable(machine)
}

fn all(machine: &Machine) -> Vec<usize> {
    (0..machine.values.len()).collect()
}

#[test]
fn derivatives_are_those_of_the_efforts() {
    let machine = machine();
    let d = machine.build();
    let log = Log::new(&d, 40);
    let efforts = log.efforts(&d, &machine.values, log.rows(), &all(&machine));
    check(&machine, &efforts.jacobian, "inverse dynamics", |theta| {
        let Efforts { required, applied, .. } = log.efforts(&d, theta, log.rows(), &[]);
        required.iter().zip(applied).map(|(required, applied)| required - applied).collect()
    });
}

#[test]
fn what_a_motion_needs_is_the_same_without_commands() {
    let machine = machine();
    let (d, by) = (machine.build(), all(&machine));
    let log = Log::new(&d, 40);
    let motion = (log.motion(log.rows()), STEP);
    let at = |theta: &[f64], by: &[usize]| required(&d, theta, motion, by, ALWAYS).unwrap();
    let (efforts, jacobian) = at(&machine.values, &by);
    assert_eq!(efforts, log.efforts(&d, &machine.values, log.rows(), &[]).required);
    check(&machine, &jacobian, "required", |theta| at(theta, &[]).0);
}

#[test]
fn derivatives_of_drives_are_those_of_what_they_deliver() {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine.actuator(0, &[("gain", 1.5), ("delay", 0.0137), ("dead_zone", 0.11), ("saturation", 1.4), ("lag", 0.06)]);
    machine.actuator(1, &[("gain", 0.8), ("limit", 0.9)]);
    let machine = movable(machine);
    let (d, by) = (machine.build(), all(&machine));
    let log = Log::new(&d, 40);
    let at = |theta: &[f64], by: &[usize]| delivered(&d, theta, (log.inputs(log.rows()), STEP), by).unwrap();
    let (efforts, jacobian) = at(&machine.values, &by);
    assert_eq!(efforts, log.efforts(&d, &machine.values, log.rows(), &[]).applied);
    check(&machine, &jacobian, "delivered", |theta| at(theta, &[]).0);
}

#[test]
fn columns_come_in_the_order_asked_for() {
    let machine = machine();
    let (d, count) = (machine.build(), machine.values.len());
    let log = Log::new(&d, 20);
    let full = log.efforts(&d, &machine.values, log.rows(), &all(&machine));
    let some = ["hysteresis.shape", "sensor0.gain", "piston.lag", "sensor0.gain", "hysteresis.shape", "drive1.gain"];
    let some = some.map(|name| machine.index(name));
    let found = log.efforts(&d, &machine.values, log.rows(), &some);
    for (row, full) in found.jacobian.chunks_exact(some.len()).zip(full.jacobian.chunks_exact(count)) {
        for (&slope, column) in row.iter().zip(some) {
            close(slope, full[column], 1e-12 * (1.0 + full[column].abs()));
        }
    }
}

/// Seven joints with friction.
fn arm() -> Machine {
    let mut machine = Machine::new(&arm7());
    for joint in 0..7 {
        machine
            .effect("coulomb_friction", joint, &[("coulomb", 0.4), ("transition_velocity", 0.05)])
            .effect("viscous_friction", joint, &[("viscous", 0.3)])
            .actuator(joint, &[("gain", 1.0)]);
    }
    machine
}

#[test]
fn long_records_are_what_their_pieces_are() {
    // Long enough for machine code, which short ones do without.
    const ROWS: usize = 15_300;
    let machine = arm();
    let d = machine.build();
    let (log, by) = (Log::new(&d, ROWS), [7, 12, machine.values.len() - 2]);
    let whole = [&[][..], &by].map(|by| log.efforts(&d, &machine.values, log.rows(), by));
    let near = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        found.iter().zip(expected).for_each(|(&found, &piece)| close(found, piece, 1e-12 * (1.0 + piece.abs())));
    };
    for first in [0, 7_200, ROWS - 300] {
        let (rows, place) = (first..first + 300, 7 * first);
        for (by, whole) in [&[][..], &by].into_iter().zip(&whole) {
            let piece = log.efforts(&d, &machine.values, rows.clone(), by);
            near(&whole.required[place..place + 2100], &piece.required);
            // Of the drives, the first sample of a piece knows nothing of the interval before it.
            let slopes = &whole.jacobian[place * by.len()..(place + 2100) * by.len()];
            near(&slopes[7 * by.len()..], &piece.jacobian[7 * by.len()..]);
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let machine = machine();
    let (d, by) = (machine.build(), all(&machine));
    let log = Log::new(&d, 1000);
    let on = |threads: usize| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| log.efforts(&d, &machine.values, log.rows(), &by))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn interrupt_stops_efforts() {
    let machine = machine();
    let d = machine.build();
    let log = Log::new(&d, 20);
    for by in [&[][..], &[0, 5]] {
        let motion = (log.motion(log.rows()), STEP);
        let found = required(&d, &machine.values, motion, by, &|| true);
        assert_eq!(found, Err(Error::Interrupted));
    }
}

#[test]
fn derivatives_too_large_to_record_are_worked_out_sample_by_sample() {
    let machine = Machine::new(&random_tree(3, 80));
    let d = machine.build();
    let log = Log::new(&d, 2);
    let motion = (log.motion(log.rows()), STEP);
    let places = d.program(&Kind::Required, &machine.values).unwrap().places;
    let by = all(&machine).into_iter().map(|parameter| (places.first_parameter() + parameter) as u32).collect();
    let derivative = d.program(&Kind::Derived(Box::new(Kind::Required), by), &machine.values).unwrap();
    assert!(derivative.directions.is_some());
    let at = |theta: &[f64], by: &[usize]| required(&d, theta, motion, by, ALWAYS).unwrap();
    let (values, few) = at(&machine.values, &[4, 250]);
    let (same, many) = at(&machine.values, &all(&machine));
    values.iter().zip(same).for_each(|(&few, many)| close(many, few, 1e-10 * (1.0 + few.abs())));
    for (few, many) in few.chunks_exact(2).zip(many.chunks_exact(machine.values.len())) {
        close(many[4], few[0], 1e-9 * (1.0 + few[0].abs()));
        close(many[250], few[1], 1e-9 * (1.0 + few[1].abs()));
    }
}
