//! Machines in contact with planes, against closed forms, balances and differences.

use std::f64::consts::TAU;
use std::sync::Arc;

use allocation_counter::measure;
use serde_json::Value;
use vpm_core::Result;
use vpm_core::beam::{BeamEntry, Component, DampingEntry, Level, Material, SectionEntry, Shape};
use vpm_core::body::Inertia;
use vpm_core::contact::{Contact, ContactFriction, NormalContact};
use vpm_core::description::Description;
use vpm_core::evaluate::{energy, equilibrium};
use vpm_core::integrator::Method;
use vpm_core::joint::JointKind;
use vpm_core::live::Live;
use vpm_core::model::Parts;
use vpm_core::motion::JointMotion;
use vpm_core::mount::Mount;
use vpm_core::simulate::{Run, Setting, Stepping, prescribed};
use vpm_core::table::Table;

use super::{G, run};
use crate::common::close;
use crate::common::connections::{chain, contact};
use crate::common::trees;
use crate::common::trees::{UPRIGHT, description};

const Z: [f64; 3] = [0.0, 0.0, 1.0];
const GROUND: [[f64; 3]; 2] = [[0.0; 3], Z];
const FRICTION: [f64; 4] = [0.7, 0.1, 0.55, 1.0];
const MASS: f64 = 2.0;

fn ball(mass: f64) -> Option<Inertia<f64>> {
    Some(Inertia { mass, center_of_mass: [0.0; 3], moments: [0.01, 0.01, 0.01, 0.0, 0.0, 0.0] })
}

/// A body that slides along x and z, its point against a plane.
fn block(normal: [f64; 4], friction: Option<[f64; 4]>, plane: [[f64; 3]; 2]) -> Description {
    let slides = [(JointKind::Prismatic, [1.0, 0.0, 0.0]), (JointKind::Prismatic, Z)];
    let bodies = chain("block", 0, Mount::World, &slides, ball(MASS));
    let parts = Parts { gravity: [0.0, 0.0, -G], bodies, ..Parts::default() };
    description(&parts, |content| contact(content, ("foot", Mount::Body(1), [0.0; 3]), plane, normal, friction))
}

/// A column of a table over time.
fn column(numbers: &[f64], width: usize, place: usize) -> Vec<f64> {
    numbers.iter().skip(place).step_by(width).copied().collect()
}

/// Where a falling function changes its sign.
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

#[test]
fn a_ball_sinks_as_deep_as_its_energy_goes_and_bounces_back() -> Result<()> {
    let (k, n, height) = (1e5, 1.5, 0.05);
    let d = block([k, n, 0.0, 1e-4], None, GROUND);
    let (step, rows) = (1e-5, 24_000);
    let run = run(&d, &[0.0, height, 0.0, 0.0], (step, 1, rows), Method::Rosenbrock, &[])?;
    let width = d.n_outputs();
    let (depth, force) = (column(&run.outputs, width, 8), column(&run.outputs, width, 9));
    let deepest = root(0.0, 0.1, |d| MASS * G * (height + d) - k * d.powf(n + 1.0) / (n + 1.0));
    let found = depth.iter().fold(0.0_f64, |most, depth| most.max(*depth));
    close(found, deepest, 1e-6 * deepest);
    // What the ground gave is what the speed changed by beside the weight.
    let speed = column(&run.states, 4, 3);
    let given: f64 = force.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]) * step).sum();
    let change = MASS * (speed[rows - 1] - speed[0]) + MASS * G * step * (rows - 1) as f64;
    close(given, change, 1e-6 * change);
    close(speed[rows - 1], (2.0 * G * height).sqrt() - G * (step * (rows - 1) as f64 - landing(&depth, step)), 0.05);
    let energies = [0, rows - 1].map(|row| {
        let state = &run.states[4 * row..4 * row + 4];
        energy(&d, &d.parameters, &state[..2], &state[2..]).map(|(kinetic, potential)| kinetic + potential)
    });
    let [before, after] = energies;
    close(after?, before?, 1e-6 * MASS * G * height);
    Ok(())
}

/// When the point leaves the plane for good.
fn landing(depth: &[f64], step: f64) -> f64 {
    depth.iter().rposition(|&depth| depth > 0.0).map_or(f64::NAN, |row| row as f64 * step)
}

#[test]
fn a_block_sticks_below_the_friction_angle_and_slides_above_it() -> Result<()> {
    let (k, n) = (1e6, 1.2);
    for (share, sticks) in [(0.9, true), (1.1, false)] {
        let angle = (FRICTION[0] * share).atan();
        let plane = [[0.0; 3], [-angle.sin(), 0.0, angle.cos()]];
        let d = block([k, n, 2e3, 1e-4], Some(FRICTION), plane);
        let weight = MASS * G;
        let depth = (weight * angle.cos() / k).powf(1.0 / n);
        let start = [depth * angle.sin(), -depth * angle.cos(), 0.0, 0.0];
        let run = run(&d, &start, (1e-3, 4, 2001), Method::LinearlyImplicit, &[])?;
        let (width, rows) = (d.n_outputs(), 2001);
        let down = |row: usize| {
            let state = &run.states[4 * row..4 * row + 4];
            -(state[2] * angle.cos() + state[3] * angle.sin())
        };
        let speed = down(rows - 1);
        if sticks {
            // It creeps where mu(v) N = T.
            let law = ContactFriction {
                static_coefficient: FRICTION[0],
                static_velocity: FRICTION[1],
                dynamic_coefficient: FRICTION[2],
                dynamic_velocity: FRICTION[3],
            };
            let creep = root(0.0, FRICTION[1], |v| angle.tan() - law.coefficient(v));
            close(speed, creep, 1e-6 * creep);
        } else {
            let before = down(rows - 501);
            let expected = G * (angle.sin() - FRICTION[2] * angle.cos());
            close((speed - before) / 0.5, expected, 1e-4 * expected);
        }
        close(run.outputs[width * (rows - 1) + 9], weight * angle.cos(), 1e-4 * weight);
    }
    Ok(())
}

/// A clamped beam along x whose tip is above a plane, all of it under gravity along z.
fn propped(level: Level, stiffness: f64, gap: f64) -> Description {
    let beam = BeamEntry {
        name: "beam".to_owned(),
        on: Mount::World,
        translation: [0.0; 3],
        rotation: [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0],
        length: 0.8,
        level,
        deforms: vec![Component::BendingX, Component::BendingY],
        material: Some(Material { young: 70e9, poisson: 0.3, density: 2700.0 }),
        sections: vec![SectionEntry::new(0.0, Shape::Rectangle { width: 0.02, height: 0.02 })],
        rest: Vec::new(),
        damping: DampingEntry { stiffness: Some(1e-4), mass: None, ratios: Vec::new() },
        reduced: None,
    };
    let parts = Parts { gravity: [0.0, 0.0, -G], beams: vec![beam], ..Parts::default() };
    let tip = ("tip", Mount::Section { beam: 0, at: 0.8 }, [0.0; 3]);
    description(&parts, |content| contact(content, tip, [[0.0, 0.0, -gap], Z], [stiffness, 1.0, 0.0, 1e-4], None))
}

#[test]
fn a_beam_on_a_prop_is_that_of_the_books() -> Result<()> {
    // Uniform weight q, bending stiffness B: the tip of the free beam is q L^4 / (8 B) down, and a force N lifts it by N L^3 / (3 B).
    let (length, area, inertia) = (0.8_f64, 0.02_f64 * 0.02, 0.02_f64.powi(4) / 12.0);
    let (q, bending) = (2700.0 * area * G, 70e9 * inertia);
    let sag = q * length.powi(4) / (8.0 * bending);
    for (stiffness, gap) in [(1e4, 0.0), (1e7, 0.0), (1e7, 0.5 * sag)] {
        let d = propped(Level::Bezier(4), stiffness, gap);
        let (rest, _) = equilibrium(&d, &d.parameters, &[])?;
        let mut state = rest.clone();
        state.resize(d.n_states(), 0.0);
        let run = run(&d, &state, (1e-3, 1, 2), Method::LinearlyImplicit, &[])?;
        let expected = (sag - gap) / (length.powi(3) / (3.0 * bending) + 1.0 / stiffness);
        close(run.outputs[1], expected, 1e-3 * expected);
        // At rest it stays.
        close(run.outputs[6], run.outputs[1], 1e-6 * expected);
    }
    Ok(())
}

#[test]
fn a_stiff_contact_of_a_beam_limits_no_implicit_step() -> Result<()> {
    // A tip that rests on steel and is knocked a little, in steps of a millisecond, far beyond the period of the contact.
    let d = propped(Level::Strain(2), 1e9, 0.0);
    let (rest, _) = equilibrium(&d, &d.parameters, &[])?;
    let mut state = rest.clone();
    state.resize(d.n_states(), 1e-9);
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let run = run(&d, &state, (1e-3, 1, 1500), method, &[])?;
        let (first, last) = (run.outputs[1], run.outputs[5 * 1499 + 1]);
        close(last, first, 1e-3 * first);
    }
    let refused = run(&d, &state, (1e-3, 1, 10), Method::Rk4, &[]);
    assert!(refused.is_err_and(|error| error.to_string().contains("too large")));
    Ok(())
}

/// State of the block in the ground and sliding.
const PRESSED: [f64; 4] = [-0.02, -2e-3, 0.3, -0.2];

fn sliding() -> Description {
    block([1e5, 1.3, 500.0, 1e-3], Some(FRICTION), [[0.0; 3], [0.2, 0.1, 1.0]])
}

#[test]
fn derivatives_are_exact() -> Result<()> {
    let d = sliding();
    let linear = vpm_core::linearize::linearize(&d, &d.parameters, &PRESSED, &[])?;
    let step = 1e-6;
    for place in 0..4 {
        let moved = |way: f64| -> Result<Vec<f64>> {
            let mut state = PRESSED;
            state[place] += way;
            Ok(vpm_core::linearize::linearize(&d, &d.parameters, &state, &[])?.rate)
        };
        let (above, below) = (moved(step)?, moved(-step)?);
        for row in 0..4 {
            let exact = linear.state[4 * row + place];
            close((above[row] - below[row]) / (2.0 * step), exact, 1e-5 * exact.abs().max(1.0));
        }
    }
    let first = d.n_parameters() - 8;
    let by: Vec<usize> = (first..first + 8).collect();
    let found = run(&d, &PRESSED, (1e-3, 2, 4), Method::Rosenbrock, &by)?;
    for (k, &place) in by.iter().enumerate() {
        let moved = |share: f64| -> Result<Run> {
            let mut other = d.clone();
            other.parameters[place] *= 1.0 + share;
            run(&other, &PRESSED, (1e-3, 2, 4), Method::Rosenbrock, &[])
        };
        let (above, below, way) = (moved(1e-5)?, moved(-1e-5)?, 2e-5 * d.parameters[place]);
        for (output, pair) in above.outputs.iter().zip(&below.outputs).enumerate() {
            let exact = found.jacobian[8 * output + k];
            let size = found.outputs[output].abs() / d.parameters[place];
            close((pair.0 - pair.1) / way, exact, 1e-5 * exact.abs() + 1e-6 * size + 1e-9);
        }
    }
    Ok(())
}

#[test]
fn what_is_lost_is_what_the_law_takes() -> Result<()> {
    let d = sliding();
    let system =
        |state: &[f64]| -> Result<Vec<f64>> { Ok(vpm_core::linearize::linearize(&d, &d.parameters, state, &[])?.rate) };
    let rate = system(&PRESSED)?;
    let at = |way: f64| -> Result<f64> {
        let state: Vec<f64> = PRESSED.iter().zip(&rate).map(|(state, rate)| state + way * rate).collect();
        let (kinetic, potential) = energy(&d, &d.parameters, &state[..2], &state[2..])?;
        Ok(kinetic + potential)
    };
    let step = 1e-6;
    let power = (at(step)? - at(-step)?) / (2.0 * step);
    let p = &d.parameters[d.n_parameters() - 8..];
    let normal = NormalContact { stiffness: p[0], exponent: p[1], damping: p[2], damping_depth: p[3] };
    let friction = ContactFriction {
        static_coefficient: p[4],
        static_velocity: p[5],
        dynamic_coefficient: p[6],
        dynamic_velocity: p[7],
    };
    let law = Contact { normal, friction: Some(friction) };
    let n = [0.2, 0.1, 1.0].map(|entry: f64| entry / (0.05_f64 + 1.0).sqrt());
    let [x, z, vx, vz] = PRESSED;
    let (depth, leaving) = (-(n[0] * x + n[2] * z), n[0] * vx + n[2] * vz);
    let sliding = [vx - n[0] * leaving, -n[1] * leaving, vz - n[2] * leaving];
    let square: f64 = sliding.iter().map(|entry| entry * entry).sum();
    let pressed = law.normal.force(depth, -leaving);
    let expected = law.normal.dissipation(depth, -leaving) + friction.resistance(square, pressed) * square;
    assert!(depth > 0.0 && expected > 1.0);
    close(power, -expected, 1e-6 * expected);
    Ok(())
}

#[test]
fn an_open_contact_costs_nothing_and_changes_nothing() -> Result<()> {
    let d = sliding();
    let mut bare = d.clone();
    bare.contacts.clear();
    let start = [0.1, 0.5, 0.3, 0.0];
    let (with, without) =
        (run(&d, &start, (1e-3, 1, 50), Method::Rk4, &[])?, run(&bare, &start, (1e-3, 1, 50), Method::Rk4, &[])?);
    assert_eq!(with.states, without.states);
    Ok(())
}

#[test]
fn long_explicit_steps_are_refused_where_the_contact_is_closed() {
    let d = sliding();
    for method in [Method::Rk4, Method::SemiImplicit] {
        let refused = run(&d, &PRESSED, (0.05, 1, 10), method, &[]).map(|_| ()).map_err(|error| error.to_string());
        assert!(
            refused.clone().is_err_and(|text| text.contains("too large") && text.contains("block.joint")),
            "{refused:?}"
        );
        assert!(run(&d, &[0.0, 0.5, 0.0, 0.0], (0.05, 1, 2), method, &[]).is_ok());
    }
}

#[test]
fn steps_allocate_nothing() -> Result<()> {
    let d = Arc::new(sliding());
    for method in Method::ALL {
        let stepping = Stepping::new(1e-4, 1, method)?;
        let mut live = Live::new(Arc::clone(&d), &d.parameters, &PRESSED, stepping)?;
        let mut failed = false;
        let count = measure(|| failed = (0..20).any(|_| live.step(&[]).is_err())).count_total;
        assert!(!failed && count == 0, "{} allocates {count} times", method.name());
    }
    Ok(())
}

#[test]
fn nonsense_is_refused_in_one_sentence() {
    let d = sliding();
    let first = d.n_parameters() - 8;
    let refused = |place: usize, value: f64| {
        let mut theta = d.parameters.clone();
        theta[first + place] = value;
        d.check_values(&theta).map_err(|error| error.to_string()).unwrap_err()
    };
    for (place, value, text) in [
        (0, -1.0, "`foot.stiffness` must not be negative"),
        (1, 0.0, "`foot.exponent` must be greater than zero"),
        (2, -1.0, "`foot.damping` must not be negative"),
        (3, 0.0, "`foot.damping_depth` must be greater than zero"),
        (5, 2.0, "contact `foot` has the static velocity 2 m/s and the dynamic velocity 1 m/s"),
        (7, 0.1, "give a dynamic velocity above the static one"),
    ] {
        assert!(refused(place, value).contains(text), "{}", refused(place, value));
    }
    let bodies = chain("ball", 0, Mount::World, &[(JointKind::Prismatic, Z)], ball(1.0));
    let parts = Parts { bodies, ..Parts::default() };
    let of = |on: Mount, plane: [[f64; 3]; 2]| {
        let change = |content: &mut Value| contact(content, ("foot", on, [0.0; 3]), plane, [1e5, 1.0, 0.0, 1e-3], None);
        trees::try_description(&parts, change).map(|_| ()).map_err(|error| error.to_string()).unwrap_err()
    };
    assert!(of(Mount::World, GROUND).contains("contact `foot` is on the world"));
    assert!(of(Mount::Body(3), GROUND).contains("`foot`"));
    assert!(of(Mount::Body(0), [[0.0; 3]; 2]).contains("`foot.plane.normal`"));
    assert!(of(Mount::Body(0), [[f64::MAX, f64::MAX, 0.0], [0.0; 3]]).contains("foot"));
}

#[test]
fn a_foot_under_a_turning_leg_feels_the_ground() -> Result<()> {
    // A bob on a rod, that turns about y, on a plane below: at rest the torque of the weight is that of the ground.
    let bodies = chain("rod", 0, Mount::World, &[(JointKind::Revolute, [0.0, 1.0, 0.0])], ball(MASS));
    let parts = Parts { gravity: [0.0, 0.0, -G], bodies, ..Parts::default() };
    let (length, k) = (0.5, 1e4);
    let d = description(&parts, |content| {
        contact(
            content,
            ("foot", Mount::Body(0), [length, 0.0, 0.0]),
            [[0.0, 0.0, -0.3], Z],
            [k, 1.0, 200.0, 1e-4],
            None,
        );
        content["bodies"][0]["joint"]["rotation"] = serde_json::json!(UPRIGHT);
    });
    let mut other = d.clone();
    let at = (0..other.n_parameters()).find(|&place| other.parameter_names[place].starts_with("rod")).unwrap_or(0);
    other.parameters[at + 1] = length; // centre of mass along x
    let run = run(&other, &[0.4 * TAU / 4.0, 0.0], (1e-3, 1, 3000), Method::LinearlyImplicit, &[])?;
    let last = run.outputs.chunks_exact(other.n_outputs()).last().unwrap_or(&[]);
    close(last[5], MASS * G, 1e-6 * MASS * G);
    close(last[4], MASS * G / k, 1e-6 * MASS * G / k);
    Ok(())
}

#[test]
fn a_passive_joint_finds_its_rest_on_the_ground() -> Result<()> {
    // The block is dragged along x by a given motion; z is nobody's.
    let (k, n, rows, step) = (1e5, 1.3, 200, 1e-3);
    let d = block([k, n, 500.0, 1e-4], Some(FRICTION), GROUND);
    let speed = 2.0 * FRICTION[3];
    let table = |numbers: &[f64]| numbers.iter().flat_map(|&number| [number, 9.9]).collect::<Vec<f64>>();
    let places: Vec<f64> = (0..rows).map(|k| speed * step * k as f64).collect();
    let [position, velocity, acceleration] = [table(&places), table(&vec![speed; rows]), table(&vec![0.0; rows])];
    let motion = JointMotion {
        position: Table::new("position", &position, rows, 2)?,
        velocity: Table::new("velocity", &velocity, rows, 2)?,
        acceleration: Table::new("acceleration", &acceleration, rows, 2)?,
    };
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let stepping = Stepping::new(step, 1, method)?;
        let setting =
            Setting { description: &d, theta: &d.parameters, stepping, sensitivities: &[], interrupt: &|| false };
        let run = prescribed(setting, motion, &[1])?;
        for row in [0, rows - 1] {
            let outputs = &run.outputs[d.n_outputs() * row..];
            close(outputs[8], (MASS * G / k).powf(1.0 / n), 1e-9);
            close(outputs[9], MASS * G, 1e-6 * MASS * G);
            // The motion needs what friction takes, the joint without a drive nothing.
            close(outputs[3], FRICTION[2] * MASS * G, 1e-6 * MASS * G);
            close(outputs[7], 0.0, 1e-6 * MASS * G);
        }
    }
    Ok(())
}
