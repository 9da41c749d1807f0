//! Reaction wrenches at joints: weights, joints that hold still, stiff bushings, and the efforts along the axes.

use std::sync::Arc;

use allocation_counter::measure;
use serde_json::{Value, json};
use vpm_core::Result;
use vpm_core::body::{Body, Inertia};
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::joint::{Joint, JointKind};
use vpm_core::linearize::linearize;
use vpm_core::live::Live;
use vpm_core::model::Parts;
use vpm_core::motion::JointMotion;
use vpm_core::mount::Mount;
use vpm_core::prepared::Prepared;
use vpm_core::samples::Random;
use vpm_core::simulate::{Setting, Stepping, free_run, prescribed};
use vpm_core::spatial::{Matrix3, Vector3};
use vpm_core::table::Table;

use crate::common::close;
use crate::common::connections::{FREE, bushing, chain, contact, load_cell};
use crate::common::trees;
use crate::common::trees::{UPRIGHT, description, everything, parameter, push, section};

const G: f64 = 9.81;
const SHOULDER: usize = 1;

/// What acts besides: a contact at the tip, a bushing across, an actuator on a massive line.
fn act(content: &mut Value, parts: &Parts<f64>) {
    let tip = section(parts, 1, 1.0);
    contact(
        content,
        ("foot", tip, [0.0; 3]),
        [[0.0, 0.0, 3.0], [0.1, 0.3, 1.0]],
        [50.0, 1.2, 1.0, 0.1],
        Some([0.7, 0.1, 0.5, 1.0]),
    );
    let ends = [(section(parts, 0, 0.5), [0.1, 0.0, 0.1]), (Mount::World, [0.0, 0.2, 0.0])];
    bushing(content, "rope", ends, [3.0; 6], [0.5; 6], [1.0; 6]);
    let ends = [(Mount::Body(4), [0.1, 0.0, 0.1]), (Mount::Body(2), [0.0, 0.2, 0.0])];
    bushing(content, "strap", ends, [3.0; 6], [0.5; 6], [0.5; 6]);
    for line in 0..2 {
        let gain = parameter(content, "drive.gain", 7.0);
        push(
            content,
            "actuators",
            json!({"name": format!("drive{line}"), "on": {"line": line}, "drive": {"type": "ideal", "gain": gain}}),
        );
    }
}

/// Rates and outputs.
fn reading(d: &Description, state: &[f64], inputs: &[f64]) -> Result<[Vec<f64>; 2]> {
    let linear = linearize(d, &d.parameters, state, inputs)?;
    Ok([linear.rate, linear.reading])
}

#[test]
fn a_joint_carries_what_six_held_ones_below_it_carry() -> Result<()> {
    for seed in 0..6 {
        let random = &mut Random::new(seed);
        let kind = [JointKind::Revolute, JointKind::Prismatic][(seed % 2) as usize];
        let mut parts = everything(seed);
        let axis = random.direction();
        let name = "shoulder.joint".to_owned();
        parts.bodies[SHOULDER].joint = Joint { name, kind, axis, translation: [0.0; 3], rotation: UPRIGHT };
        let d = description(&parts, |content| {
            act(content, &parts);
            load_cell(content, "cell", SHOULDER);
        });
        let (n, joints) = (d.n_coordinates(), d.n_joints());
        let state = [random.numbers(n, 0.3), random.numbers(n, 0.5)].concat();
        let inputs = [3.0, -2.0];
        let [rate, outputs] = reading(&d, &state, &inputs)?;
        let cell = &outputs[d.layout().load_cells()..];
        // The same on six joints that hold still: what they need, without the drives, whose forces come as loads on the coordinates.
        // A weight at rest below the shoulder keeps the seven coordinates apart, and is known.
        let weight = Inertia { mass: 2.0, center_of_mass: [0.0; 3], moments: [1.0, 1.0, 1.0, 0.0, 0.0, 0.0] };
        let carriers: Vec<Body<f64>> = chain("held", joints, Mount::World, &FREE, Some(weight));
        let mut held = parts.clone();
        held.bodies.extend(carriers);
        held.bodies[SHOULDER].on = Mount::Body(joints + 5);
        let other = description(&held, |content| act(content, &held));
        let spread = |numbers: &[f64]| [&numbers[..joints], &[0.0; 6], &numbers[joints..]].concat();
        let (q, v, a) = (spread(&state[..n]), spread(&state[n..2 * n]), spread(&rate[n..2 * n]));
        let mut prepared = Prepared::new(&other, &other.parameters)?;
        let needed = prepared.inverse_dynamics(&q, &v, &a)?[joints..joints + 6].to_vec();
        // Forces on lines pass the held joints where a line begins at the world.
        let lines = line_loads(&other, &q, &v, [7.0 * 3.0, 7.0 * -2.0])?;
        let mut needed: Vec<f64> = needed.iter().zip(&lines).map(|(needed, line)| needed - line).collect();
        needed.iter_mut().zip(parts.gravity).for_each(|(needed, gravity)| *needed += weight.mass * gravity);
        let turn = match kind {
            JointKind::Revolute => Matrix3::rotation(Vector3::from(axis), state[SHOULDER]),
            _ => Matrix3::identity(),
        };
        let (moment, force) =
            (turn * Vector3::new(cell[0], cell[1], cell[2]), turn * Vector3::new(cell[3], cell[4], cell[5]));
        let place = match kind {
            JointKind::Prismatic => Vector3::from(axis) * state[SHOULDER],
            _ => Vector3::zero(),
        };
        let moment = moment + place.cross(force);
        let found = [force.to_array(), moment.to_array()].concat();
        let size = needed.iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
        for (found, needed) in found.iter().zip(&needed) {
            close(*found, *needed, 1e-9 * size);
        }
        assert!(size > 10.0);
    }
    Ok(())
}

/// What forces on the lines do to the six held joints, from the accelerations that they change.
fn line_loads(d: &Description, q: &[f64], v: &[f64], forces: [f64; 2]) -> Result<Vec<f64>> {
    let joints = d.n_joints();
    let n = q.len();
    let state = [q, v].concat();
    let of = |inputs: &[f64]| -> Result<Vec<f64>> {
        Ok(linearize(d, &d.parameters, &state, inputs)?.rate[n..2 * n].to_vec())
    };
    let (with, without) = (of(&[forces[0] / 7.0, forces[1] / 7.0])?, of(&[0.0; 2])?);
    let mass = vpm_core::evaluate::mass_matrix(d, &d.parameters, q)?;
    let load = |row: usize| (0..n).map(|k| mass[row * n + k] * (with[k] - without[k])).sum();
    Ok((joints - 6..joints).map(load).collect())
}

#[test]
fn along_its_axis_a_joint_carries_its_effort() -> Result<()> {
    // Free joints carry nothing along their axes, but for what accelerates the rotor.
    for seed in 0..4 {
        let mut parts = everything(seed);
        parts.bodies[2].rotor_inertia = Some(0.4);
        let d = description(&parts, |content| {
            act(content, &parts);
            for joint in 0..5 {
                load_cell(content, &format!("cell{joint}"), joint);
            }
        });
        let n = d.n_coordinates();
        let random = &mut Random::new(seed);
        let state = [random.numbers(n, 0.3), random.numbers(n, 0.5)].concat();
        let [rate, outputs] = reading(&d, &state, &[1.0, 2.0])?;
        for joint in 0..5 {
            let cell = &outputs[d.layout().load_cells() + 6 * joint..];
            let axis = parts.bodies[joint].joint.axis;
            let along = |first: usize| (0..3).map(|k| axis[k] * cell[first + k]).sum::<f64>();
            let carried = match parts.bodies[joint].joint.kind {
                JointKind::Revolute => along(0),
                JointKind::Prismatic => along(3),
                JointKind::Helical { pitch } => along(0) + pitch * along(3),
            };
            let size = cell[..6].iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
            let rotor = if joint == 2 { 0.4 * rate[n + joint] } else { 0.0 };
            close(carried, -rotor, 1e-9 * size * (1.0 + rotor.abs()));
        }
    }
    Ok(())
}

#[test]
fn a_hanging_chain_weighs_on_its_joints() -> Result<()> {
    let inertia =
        |mass: f64| Some(Inertia { mass, center_of_mass: [0.2, 0.0, 0.0], moments: [0.01, 0.01, 0.01, 0.0, 0.0, 0.0] });
    let pin = [(JointKind::Revolute, [0.0, 1.0, 0.0])];
    let mut bodies = chain("upper", 0, Mount::World, &pin, inertia(2.0));
    bodies.extend(chain("lower", 1, Mount::Body(0), &pin, inertia(3.0)));
    bodies[1].joint.translation = [0.4, 0.0, 0.0];
    let parts = Parts { gravity: [0.0, 0.0, -G], bodies, ..Parts::default() };
    let d = description(&parts, |content| {
        load_cell(content, "shoulder", 0);
        load_cell(content, "elbow", 1);
        // Springs that hold the chain level: 2 g 0.2 + 3 g 0.6 and 3 g 0.2, at an angle of 0.
        for (joint, torque) in [(0, 2.2 * G), (1, 0.6 * G)] {
            let force = parameter(content, "hold", torque);
            push(content, "effects", json!({"type": "bias_force", "joint": joint, "force": force}));
        }
    });
    let [rate, outputs] = reading(&d, &[0.0; 4], &[])?;
    rate.iter().for_each(|rate| close(*rate, 0.0, 1e-12));
    let cells = &outputs[d.layout().load_cells()..];
    let expected = [0.0, -2.2 * G, 0.0, 0.0, 0.0, 5.0 * G, 0.0, -0.6 * G, 0.0, 0.0, 0.0, 3.0 * G];
    cells.iter().zip(expected).for_each(|(found, expected)| close(*found, expected, 1e-11));
    Ok(())
}

#[test]
fn a_stiff_bushing_in_place_of_the_joint_carries_the_same() -> Result<()> {
    // A rod that swings through the bottom, on a pin with a load cell and on a bushing that is free about y.
    let inertia =
        Some(Inertia { mass: 1.3, center_of_mass: [0.0, 0.02, -0.3], moments: [0.02, 0.03, 0.01, 0.0, 0.0, 0.0] });
    let pin = [(JointKind::Revolute, [0.0, 1.0, 0.0])];
    let gravity = [0.0, 0.0, -G];
    let pinned = Parts { gravity, bodies: chain("rod", 0, Mount::World, &pin, inertia), ..Parts::default() };
    let pinned = description(&pinned, |content| load_cell(content, "cell", 0));
    let parts = Parts { gravity, bodies: chain("rod", 0, Mount::World, &FREE, inertia), ..Parts::default() };
    let mut gaps = Vec::new();
    for k in [1e6, 1e7] {
        let c = 0.3 * f64::sqrt(k);
        let free = description(&parts, |content| {
            let ends = [(Mount::Body(5), [0.0; 3]), (Mount::World, [0.0; 3])];
            bushing(content, "pin", ends, [k, 0.0, k, k, k, k], [c, 0.0, c, c, c, c], [0.0; 6]);
        });
        let mut states = [vec![0.9, 0.0], vec![0.0; 12]];
        states[1][4] = 0.9;
        let ends = [(&pinned, &states[0]), (&free, &states[1])].map(|(d, state)| -> Result<Vec<f64>> {
            let stepping = Stepping::new(1e-2, 100, Method::Rosenbrock)?;
            let setting =
                Setting { description: d, theta: &d.parameters, stepping, sensitivities: &[], interrupt: &|| false };
            let run = free_run(setting, state, Table::new("inputs", &[], 41, 0)?)?;
            Ok(run.outputs[40 * d.n_outputs()..][d.n_outputs() - 6..].to_vec())
        });
        let [cell, held] = ends;
        let (cell, held) = (cell?, held?);
        let gap = cell.iter().zip(&held).fold(0.0_f64, |most, (cell, held)| most.max((cell - held).abs()));
        gaps.push(gap);
        assert!(cell[5].abs() > 10.0);
    }
    assert!(gaps[1] < 0.02 && gaps[1] < 0.3 * gaps[0], "{gaps:?}");
    Ok(())
}

#[test]
fn a_given_motion_loads_its_joints() -> Result<()> {
    // A bob at l that turns about y with w: m l w^2 towards the joint, its weight, and m l^2 a about the axis.
    let (mass, length, speed, turn) = (2.0, 0.5, 3.0, 1.5);
    let inertia = Some(Inertia { mass, center_of_mass: [length, 0.0, 0.0], moments: [0.0; 6] });
    let pin = [(JointKind::Revolute, [0.0, 1.0, 0.0])];
    let parts =
        Parts { gravity: [0.0, 0.0, -G], bodies: chain("rod", 0, Mount::World, &pin, inertia), ..Parts::default() };
    let d = description(&parts, |content| load_cell(content, "cell", 0));
    let (angle, rates, acceleration) = ([0.4, 0.4 + speed * 1e-3], [speed; 2], [turn; 2]);
    let motion = JointMotion {
        position: Table::new("position", &angle, 2, 1)?,
        velocity: Table::new("velocity", &rates, 2, 1)?,
        acceleration: Table::new("acceleration", &acceleration, 2, 1)?,
    };
    let stepping = Stepping::new(1e-3, 1, Method::LinearlyImplicit)?;
    let setting = Setting { description: &d, theta: &d.parameters, stepping, sensitivities: &[], interrupt: &|| false };
    let run = prescribed(setting, motion, &[])?;
    // About y, the bob is down by l sin q; in the rod's axes gravity is g [sin q, 0, -cos q].
    let (sine, cosine) = (0.4_f64.sin(), 0.4_f64.cos());
    let along = -mass * (length * speed * speed + G * sine);
    let across = mass * (-length * turn + G * cosine);
    let expected = [0.0, -length * across, 0.0, along, 0.0, across];
    run.outputs[4..10].iter().zip(expected).for_each(|(found, expected)| close(*found, expected, 1e-9));
    close(run.outputs[3], expected[1], 1e-9);
    Ok(())
}

#[test]
fn steps_allocate_nothing() -> Result<()> {
    let parts = everything(2);
    let d = Arc::new(description(&parts, |content| {
        act(content, &parts);
        load_cell(content, "cell", SHOULDER);
    }));
    let n = d.n_coordinates();
    let state = Random::new(2).numbers(2 * n, 0.1);
    let mut live = Live::new(Arc::clone(&d), &d.parameters, &state, Stepping::new(1e-5, 1, Method::LinearlyImplicit)?)?;
    let mut failed = false;
    let count = measure(|| failed = (0..5).any(|_| live.step(&[0.0; 2]).is_err())).count_total;
    assert!(!failed && count == 0, "{count} allocations");
    Ok(())
}

#[test]
fn a_cell_at_no_joint_is_refused() {
    let parts = everything(1);
    let refused = trees::try_description(&parts, |content| load_cell(content, "cell", 9)).map(|_| ());
    assert!(refused.is_err_and(|error| error.to_string().contains("load cell `cell`")));
}
