//! Bushings in machines: loads against Jacobians, momenta, the limit of a joint, derivatives.

use vpm_core::Result;
use vpm_core::body::Inertia;
use vpm_core::description::Description;
use vpm_core::evaluate::{energy, marker_jacobian};
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::joint::JointKind;
use vpm_core::linearize::linearize;
use vpm_core::model::Parts;
use vpm_core::mount::{Marker, Mount};
use vpm_core::prepared::Prepared;
use vpm_core::samples::{Random, random_tree};
use vpm_core::simulate::Run;
use vpm_core::spatial::{Matrix3, Vector3};
use vpm_core::table::Table;

use super::{G, run};
use crate::common::close;
use crate::common::connections::{FREE, bushing, chain};
use crate::common::trees;
use crate::common::trees::{UPRIGHT, description, everything, section};

fn tree(seed: u64) -> Parts<f64> {
    let sample = random_tree(seed, 5);
    Parts { gravity: sample.gravity, bodies: sample.bodies, ..Parts::default() }
}

/// The machine with a bushing between two mounts, and a marker on each of its ends.
fn bushed(mut parts: Parts<f64>, ends: [(Mount, [f64; 3]); 2], laws: [[f64; 6]; 3]) -> Description {
    for (name, (on, translation)) in ["a", "b"].into_iter().zip(ends) {
        parts.markers.push(Marker { name: name.to_owned(), on, translation, rotation: UPRIGHT });
    }
    description(&parts, |content| bushing(content, "bushing", ends, laws[0], laws[1], laws[2]))
}

#[test]
fn loads_are_those_of_the_jacobians() -> Result<()> {
    for seed in 0..12 {
        let random = &mut Random::new(seed);
        let flexible = seed % 2 == 1;
        let parts = if flexible { everything(seed) } else { tree(seed) };
        let on = if flexible { section(&parts, 1, 0.6) } else { Mount::Body(4) };
        let other = [Mount::World, Mount::Body(2)][usize::from(seed % 4 > 1)];
        let ends = [(on, random.vector(0.3)), (other, random.vector(0.3))];
        let mut six = |size: f64| -> [f64; 6] { std::array::from_fn(|_| size * (0.1 + random.unit())) };
        let d = bushed(parts, ends, [six(50.0), six(5.0), six(20.0)]);
        let mut bare = d.clone();
        bare.bushings.clear();
        let n = d.n_coordinates();
        let [q, v, a] = [0.3, 0.5, 2.0].map(|size| random.numbers(n, size));
        let [with, without] = [&d, &bare].map(|d| -> Result<Vec<f64>> {
            Ok(Prepared::new(d, &d.parameters)?.inverse_dynamics(&q, &v, &a)?.to_vec())
        });
        let (with, without) = (with?, without?);
        // What the bushing shows, in world axes.
        let mut state = [q.clone(), v].concat();
        state.resize(d.n_states(), 0.0);
        let reading = linearize(&d, &d.parameters, &state, &[])?.reading;
        let layout = d.layout();
        let marker = d.markers.len() - 2;
        let pose = |k: usize| &reading[layout.markers() + 6 * (marker + k)..][..6];
        let vector = |numbers: &[f64]| Vector3::new(numbers[0], numbers[1], numbers[2]);
        let turn = vector(&pose(0)[3..]);
        let angle = turn.dot(turn).sqrt();
        let rotation = Matrix3::rotation(turn * angle.recip(), angle);
        let shown = &reading[layout.bushings()..];
        let (moment, force) = (rotation * vector(shown), rotation * vector(&shown[3..]));
        let arm = vector(pose(0)) - vector(pose(1));
        let wrenches = [(moment, force), (-(moment + arm.cross(force)), -force)];
        let mut expected = vec![0.0; n];
        for (k, (moment, force)) in wrenches.into_iter().enumerate() {
            let jacobian = marker_jacobian(&d, &d.parameters, &q, marker + k)?;
            let wrench = [moment.to_array(), force.to_array()].concat();
            for (row, entry) in jacobian.chunks_exact(n).zip(wrench) {
                row.iter().zip(&mut expected).for_each(|(column, sum)| *sum += column * entry);
            }
        }
        for k in 0..n {
            close(without[k] - with[k], expected[k], 1e-9 * (1.0 + without[k].abs() + with[k].abs()));
        }
        assert!(expected.iter().any(|load| load.abs() > 0.1));
    }
    Ok(())
}

const ROUND: f64 = 0.02;

fn round(mass: f64) -> Option<Inertia<f64>> {
    Some(Inertia { mass, center_of_mass: [0.0; 3], moments: [ROUND, ROUND, ROUND, 0.0, 0.0, 0.0] })
}

#[test]
fn two_bodies_in_free_space_keep_their_momentum() -> Result<()> {
    let mut bodies = chain("left", 0, Mount::World, &FREE, round(1.5));
    bodies.extend(chain("right", 6, Mount::World, &FREE, round(0.7)));
    let mut parts = Parts { bodies, ..Parts::default() };
    for body in [5, 11] {
        let marker =
            Marker { name: format!("m{body}"), on: Mount::Body(body), translation: [0.0; 3], rotation: UPRIGHT };
        parts.markers.push(marker);
    }
    let ends = [(Mount::Body(5), [0.1, 0.0, 0.2]), (Mount::Body(11), [-0.3, 0.1, 0.0])];
    let d = bushed(parts, ends, [[3.0, 4.0, 5.0, 200.0, 150.0, 250.0], [0.02; 6], [0.1, 0.2, 0.0, 1.0, -2.0, 0.5]]);
    let state = [Random::new(4).numbers(12, 0.2), Random::new(5).numbers(12, 1.0)].concat();
    let found = run(&d, &state, (1e-2, 20, 101), Method::Rosenbrock, &[])?;
    let momentum = |row: usize| -> Result<[f64; 6]> {
        let (q, v) = found.states[24 * row..24 * row + 24].split_at(12);
        let mut sum = [0.0; 6];
        for (marker, mass) in [(0, 1.5), (1, 0.7)] {
            let jacobian = marker_jacobian(&d, &d.parameters, q, marker)?;
            let rate = |k: usize| jacobian[12 * k..12 * k + 12].iter().zip(v).map(|(j, v)| j * v).sum::<f64>();
            let p = Vector3::new(rate(3), rate(4), rate(5)) * mass;
            let place = &found.outputs[d.n_outputs() * row + d.layout().markers() + 6 * marker..];
            let about = Vector3::new(place[0], place[1], place[2]).cross(p).to_array();
            for k in 0..3 {
                sum[k] += ROUND * rate(k) + about[k];
                sum[3 + k] += p.to_array()[k];
            }
        }
        Ok(sum)
    };
    let (before, after) = (momentum(0)?, momentum(100)?);
    before.iter().zip(after).for_each(|(before, after)| close(after, *before, 1e-8));
    let of = |row: usize| -> Result<f64> {
        let (q, v) = found.states[24 * row..24 * row + 24].split_at(12);
        energy(&d, &d.parameters, q, v).map(|(kinetic, potential)| kinetic + potential)
    };
    assert!(of(100)? < of(0)? - 0.01, "the damper takes energy");
    Ok(())
}

#[test]
fn energy_is_kept_without_damping() -> Result<()> {
    for seed in 0..6 {
        let flexible = seed % 2 == 1;
        let mut parts = if flexible { everything(seed) } else { tree(seed) };
        parts.beams.iter_mut().for_each(|beam| beam.damping = Default::default());
        let on = if flexible { section(&parts, 0, 1.0) } else { Mount::Body(3) };
        let random = &mut Random::new(seed);
        let ends = [(on, random.vector(0.3)), (Mount::Body(1), random.vector(0.3))];
        let d = bushed(parts, ends, [[40.0; 6], [0.0; 6], random.numbers(6, 5.0).try_into().unwrap_or([0.0; 6])]);
        let n = d.n_coordinates();
        let state: Vec<f64> = [random.numbers(n, 0.2), random.numbers(n, 0.5)].concat();
        let rate = linearize(&d, &d.parameters, &state, &[])?.rate;
        let at = |way: f64| -> Result<(f64, f64)> {
            let state: Vec<f64> = state.iter().zip(&rate).map(|(state, rate)| state + way * rate).collect();
            energy(&d, &d.parameters, &state[..n], &state[n..])
        };
        let step = 1e-3 / rate.iter().fold(1.0_f64, |most, rate| most.max(rate.abs()));
        let (above, below) = (at(step)?, at(-step)?);
        let [kinetic, potential] = [above.0 - below.0, above.1 - below.1].map(|change| change / (2.0 * step));
        // What rounding leaves of a difference of energies.
        let noise = 1e-14 / step * (above.0.abs() + above.1.abs());
        assert!(noise < 1e-3 * potential.abs());
        close(kinetic, -potential, 1e-6 * potential.abs() + noise);
        assert!(potential.abs() > 0.1);
    }
    Ok(())
}

/// Two rods in a plane (about y) on pins, or on free joints that stiff bushings hold.
fn pendulum(stiffness: Option<f64>) -> Description {
    let inertia = |mass: f64| {
        let moments = [0.02, 0.02, 0.001, 0.0, 0.0, 0.0];
        Some(Inertia { mass, center_of_mass: [0.0, 0.0, -0.25], moments })
    };
    let pin = [(JointKind::Revolute, [0.0, 1.0, 0.0])];
    let Some(k) = stiffness else {
        let mut bodies = chain("upper", 0, Mount::World, &pin, inertia(1.0));
        bodies.extend(chain("lower", 1, Mount::Body(0), &pin, inertia(0.8)));
        bodies[1].joint.translation = [0.0, 0.0, -0.5];
        return description(&Parts { gravity: [0.0, 0.0, -G], bodies, ..Parts::default() }, |_| ());
    };
    let mut bodies = chain("upper", 0, Mount::World, &FREE, inertia(1.0));
    bodies.extend(chain("lower", 6, Mount::Body(5), &FREE, inertia(0.8)));
    bodies[6].joint.translation = [0.0, 0.0, -0.5];
    let parts = Parts { gravity: [0.0, 0.0, -G], bodies, ..Parts::default() };
    // Damped so that what the start sets ringing is gone soon.
    let (springs, c) = ([k, 0.0, k, k, k, k], 0.2 * k.sqrt());
    let dampers = [c, 0.0, c, 10.0 * c, 10.0 * c, 10.0 * c];
    description(&parts, |content| {
        let first = [(Mount::Body(5), [0.0; 3]), (Mount::World, [0.0; 3])];
        bushing(content, "shoulder", first, springs, dampers, [0.0; 6]);
        let second = [(Mount::Body(11), [0.0; 3]), (Mount::Body(5), [0.0, 0.0, -0.5])];
        bushing(content, "elbow", second, springs, dampers, [0.0; 6]);
    })
}

#[test]
fn stiff_bushings_become_joints() -> Result<()> {
    let (angles, setting) = ([0.8, -0.5], (1e-2, 10, 41));
    let pinned = run(&pendulum(None), &[angles[0], angles[1], 0.0, 0.0], setting, Method::Rosenbrock, &[])?;
    let end = &pinned.states[4 * 40..];
    let mut distances = Vec::new();
    for stiffness in [1e6, 1e7, 1e8] {
        let d = pendulum(Some(stiffness));
        let mut state = vec![0.0; 24];
        (state[4], state[10]) = (angles[0], angles[1]);
        let held = run(&d, &state, setting, Method::Rosenbrock, &[])?;
        let last = &held.states[24 * 40..];
        distances.push((last[4] - end[0]).abs().max((last[10] - end[1]).abs()));
    }
    for pair in distances.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((7.0..13.0).contains(&ratio), "{distances:?} does not fall with the compliance");
    }
    assert!(distances[2] < 1e-4);
    Ok(())
}

#[test]
fn derivatives_are_exact() -> Result<()> {
    let parts = everything(3);
    let ends = [(section(&parts, 0, 1.0), [0.1, 0.0, 0.05]), (Mount::Body(1), [0.0, 0.2, 0.1])];
    let d = bushed(parts, ends, [[40.0; 6], [2.0; 6], [1.0; 6]]);
    let (n, random) = (d.n_coordinates(), &mut Random::new(8));
    let state: Vec<f64> = [random.numbers(n, 0.2), random.numbers(n, 0.5)].concat();
    let linear = linearize(&d, &d.parameters, &state, &[])?;
    let step = 1e-6;
    for place in 0..2 * n {
        let moved = |way: f64| -> Result<Vec<f64>> {
            let mut state = state.clone();
            state[place] += way;
            Ok(linearize(&d, &d.parameters, &state, &[])?.rate)
        };
        let (above, below) = (moved(step)?, moved(-step)?);
        let size = (0..2 * n).fold(1.0_f64, |most, row| most.max(linear.state[2 * n * row + place].abs()));
        for row in 0..2 * n {
            // What rounding leaves of a difference of large rates.
            let noise = 1e-14 / step * above[row].abs();
            close((above[row] - below[row]) / (2.0 * step), linear.state[2 * n * row + place], 1e-6 * size + noise);
        }
    }
    Ok(())
}

#[test]
fn parameters_are_differentiated_through_a_run() -> Result<()> {
    let ends = [(Mount::Body(4), [0.1, 0.0, 0.05]), (Mount::Body(1), [0.0, 0.2, 0.1])];
    let d = bushed(tree(2), ends, [[40.0; 6], [2.0; 6], [1.0; 6]]);
    let state = Random::new(3).numbers(10, 0.3);
    let by: Vec<usize> = (d.n_parameters() - 18..d.n_parameters()).collect();
    let setting = (1e-2, 2, 6);
    let found = run(&d, &state, setting, Method::LinearlyImplicit, &by)?;
    for (k, &place) in by.iter().enumerate() {
        let moved = |way: f64| -> Result<Run> {
            let mut other = d.clone();
            other.parameters[place] += way;
            run(&other, &state, setting, Method::LinearlyImplicit, &[])
        };
        let step = 1e-4;
        let (above, below) = (moved(step)?, moved(-step)?);
        for (output, pair) in above.outputs.iter().zip(&below.outputs).enumerate() {
            let exact = found.jacobian[18 * output + k];
            close((pair.0 - pair.1) / (2.0 * step), exact, 1e-6 * (1.0 + exact.abs() + found.outputs[output].abs()));
        }
    }
    Ok(())
}

#[test]
fn a_measured_motion_needs_the_force_of_its_bushing() -> Result<()> {
    // A slider on a spring: F = m a + k x.
    let bodies = chain("slider", 0, Mount::World, &[(JointKind::Prismatic, [1.0, 0.0, 0.0])], round(2.0));
    let parts = Parts { bodies, ..Parts::default() };
    let ends = [(Mount::Body(0), [0.0; 3]), (Mount::World, [0.0; 3])];
    let d = description(&parts, |content| {
        bushing(content, "spring", ends, [0.0, 0.0, 0.0, 30.0, 0.0, 0.0], [0.0, 0.0, 0.0, 4.0, 0.0, 0.0], [0.0; 6]);
    });
    let table = |numbers: &'static [f64]| Table::new("motion", numbers, 2, 1);
    let motion = Motion {
        position: table(&[0.1, 0.2])?,
        velocity: table(&[1.0, -1.0])?,
        acceleration: table(&[3.0, 5.0])?,
        inputs: Table::new("inputs", &[], 2, 0)?,
        time_step: 0.1,
    };
    let efforts = inverse_dynamics(&d, &d.parameters, motion, &[], &|| false)?;
    close(efforts.required[0], 6.0 + 3.0 + 4.0, 1e-12);
    close(efforts.required[1], 10.0 + 6.0 - 4.0, 1e-12);
    Ok(())
}

#[test]
fn nonsense_is_refused_in_one_sentence() {
    let of = |ends: [Mount; 2], stiffness: [f64; 6], damping: [f64; 6], change: fn(&mut serde_json::Value)| {
        let ends = ends.map(|on| (on, [0.0; 3]));
        let made = trees::try_description(&tree(1), |content| {
            bushing(content, "pad", ends, stiffness, damping, [0.0; 6]);
            change(content);
        });
        made.map(|_| ()).map_err(|error| error.to_string()).unwrap_err()
    };
    let apart = [Mount::Body(1), Mount::World];
    let fine = [1.0; 6];
    assert!(of([Mount::Body(1), Mount::Body(1)], fine, fine, |_| ()).contains("bushing `pad` has both ends on"));
    assert!(of([Mount::World; 2], fine, fine, |_| ()).contains("never deforms"));
    assert!(of([Mount::Body(9), Mount::World], fine, fine, |_| ()).contains("`pad.a`"));
    let negative = [1.0, 1.0, -1.0, 1.0, 1.0, 1.0];
    assert!(of(apart, negative, fine, |_| ()).contains("`pad.stiffness.2` must not be negative"));
    assert!(of(apart, fine, negative, |_| ()).contains("`pad.damping.2` must not be negative"));
    let text = of(apart, fine, fine, |content| {
        content["bushings"][0]["stiffness"][0][4] = content["bushings"][0]["stiffness"][0][0].clone();
    });
    assert!(text.contains("1 in row rx, column y, but 0 in row y, column rx"), "{text}");
    let text = of(apart, [4.0, 1.0, 1.0, 1.0, 1.0, 1.0], fine, |content| {
        let place = content["bushings"][0]["stiffness"][0][0].clone();
        content["bushings"][0]["stiffness"][1][2] = place.clone();
        content["bushings"][0]["stiffness"][2][1] = place;
    });
    assert!(text.contains("stiffness that is not positive semidefinite") && text.contains("-3.0000e0"), "{text}");
    let text = of(apart, fine, [4.0, 1.0, 1.0, 1.0, 1.0, 1.0], |content| {
        content["bushings"][0]["damping"][1][2] = content["bushings"][0]["damping"][0][0].clone();
    });
    assert!(text.contains("damping that is not positive semidefinite"), "{text}");
    let text = of(apart, fine, fine, |content| content["bushings"][0]["b"]["rotation"][0] = serde_json::json!(2.0));
    assert!(text.contains("pad.b"), "{text}");
}
