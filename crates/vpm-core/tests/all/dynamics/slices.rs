//! Beams that bend in one plane, whose slices are summed up about the root, against the same beams station by station.
//!
//! A marker on each Gauss point makes a frame of that station, which is then taken by itself, with the same quadrature.

use serde_json::json;
use vpm_core::Result;
use vpm_core::beam::quadrature::composite;
use vpm_core::beam::{Component, Level, SectionEntry, Shape};
use vpm_core::body::Weld;
use vpm_core::data::Data;
use vpm_core::dynamics::flexible;
use vpm_core::graph::{Function, Operation};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::{Marker, Mount};
use vpm_core::samples::Random;
use vpm_core::system::Kind;

use crate::common::trees::{UPRIGHT, beam, body, inertia, model, section, turn};
use crate::common::two_link;

/// Gauss points of the beams below: as many as coefficients and four, three on each of two elements, three more where they taper.
fn gauss_points(parts: &Parts<f64>, beam: usize) -> Vec<f64> {
    let entry = &parts.beams[beam];
    let mut breaks = vec![0.0];
    let taper = if entry.sections.len() > 1 { 3 } else { 0 };
    let count = match entry.level {
        Level::Strain(n) => n + 4,
        Level::Bezier(n) => n + 3,
        _ => {
            breaks.push(0.5 * entry.length);
            3
        }
    };
    breaks.extend(entry.sections.iter().map(|section| section.at).filter(|&at| at > 0.0 && at < entry.length));
    breaks.push(entry.length);
    breaks.sort_by(f64::total_cmp);
    composite(count + taper, &breaks).iter().map(|at| at.place).collect()
}

/// The same machine with a frame on each station of each beam.
fn station_by_station(parts: &Parts<f64>) -> Parts<f64> {
    let mut all = parts.clone();
    for beam in 0..parts.beams.len() {
        for (number, at) in gauss_points(parts, beam).into_iter().enumerate() {
            let (name, on) = (format!("station{beam}.{number}"), Mount::Section { beam, at });
            all.markers.push(Marker { name, on, translation: [0.0; 3], rotation: UPRIGHT });
        }
    }
    all
}

/// Mass matrix and bias.
fn terms(parts: &Parts<f64>, seed: u64) -> Result<(Vec<f64>, Vec<f64>, usize)> {
    let tree = model::<f64>(parts)?;
    let (n, random) = (tree.n_coordinates(), &mut Random::new(seed));
    let [q, v] = [1.0, 3.0].map(|size| random.numbers(n, size));
    let (mut data, zero, mut bias) = (Data::new(&tree), vec![0.0; n], vec![0.0; n]);
    // Once more: nothing may stay of the time before.
    for _ in 0..2 {
        flexible::terms(&tree, &mut data, &q, &v);
    }
    flexible::required(&tree, &data, (&zero, &zero), &zero, &mut bias);
    let stations = (0..tree.n_beams()).filter_map(|k| tree.beam(k)).map(|(beam, _)| beam.stations()).sum();
    Ok((data.mass_matrix().to_vec(), bias, stations))
}

fn agree(parts: &Parts<f64>, seed: u64) -> Result<()> {
    let (mass, bias, stations) = terms(parts, seed)?;
    let (each_mass, each_bias, same) = terms(&station_by_station(parts), seed)?;
    assert_eq!(stations, same, "{seed}: the markers are not on the Gauss points");
    for (found, expected) in [(mass, each_mass), (bias, each_bias)] {
        let size = expected.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((found - expected).abs() < 1e-12 * size, "{seed}, {k}: {found} is not {expected}");
        }
    }
    Ok(())
}

/// Beams on joints that turn anyhow and on each other, with bodies, joints and welds in their middles and at their tips.
fn in_space(seed: u64, level: Level) -> Parts<f64> {
    let random = &mut Random::new(seed);
    let mut parts = Parts { gravity: [1.0, -5.0, 8.0], ..Parts::default() };
    let planes = [Component::BendingX, Component::BendingY];
    for (number, on) in [Mount::Body(1), Mount::Body(2), Mount::World].into_iter().enumerate() {
        parts.beams.push(beam(
            random,
            &format!("beam{number}"),
            on,
            level,
            &planes[(number + seed as usize) % 2..][..1],
        ));
    }
    parts.beams[2].on = section(&parts, 0, 0.3);
    let shape = Shape::Rectangle { width: 0.02, height: 0.03 };
    let tapers = &mut parts.beams[1];
    tapers.sections.push(SectionEntry::new(tapers.length, shape));
    let (middle, tip, end) = (section(&parts, 0, 0.6), section(&parts, 0, 1.0), section(&parts, 2, 1.0));
    parts.bodies = vec![
        body(random, "base", Mount::World, JointKind::Prismatic),
        body(random, "shoulder", Mount::Body(0), JointKind::Revolute),
        body(random, "elbow", tip, JointKind::Helical { pitch: 0.1 }),
        body(random, "side", middle, JointKind::Revolute),
        body(random, "end", end, JointKind::Prismatic),
    ];
    for (name, on) in [("motor", section(&parts, 1, 0.5)), ("tool", section(&parts, 1, 1.0)), ("hub", Mount::Body(2))] {
        let (translation, rotation) = (random.vector(0.1), turn(random));
        parts.welds.push(Weld { name: name.to_owned(), on, translation, rotation, inertia: inertia(random) });
    }
    parts
}

/// The same with all axes of joints along that about which all beams bend.
fn in_a_plane(seed: u64, level: Level) -> Parts<f64> {
    let (mut parts, random) = (in_space(seed, level), &mut Random::new(seed));
    for body in &mut parts.bodies {
        let slides = body.joint.kind == JointKind::Prismatic;
        body.joint.axis = if slides { [0.6, 0.0, 0.8] } else { [0.0, 1.0, 0.0] };
        let (sin, cos) = random.symmetric().sin_cos();
        body.joint.rotation = [cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos];
    }
    for beam in &mut parts.beams {
        // About x of a beam whose x is y of what carries it.
        let about_y = beam.deforms[0] == Component::BendingY;
        beam.rotation = if about_y { UPRIGHT } else { [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0] };
    }
    parts
}

#[test]
fn beams_on_roots_that_move_in_space_are_the_sum_of_their_stations() -> Result<()> {
    for level in [Level::Strain(4), Level::Strain(1), Level::Bezier(5), Level::Elements(2)] {
        (0..4).try_for_each(|seed| agree(&in_space(seed, level), seed))?;
    }
    Ok(())
}

#[test]
fn beams_that_move_in_their_plane_are_the_sum_of_their_stations() -> Result<()> {
    for level in [Level::Strain(4), Level::Strain(1), Level::Bezier(5), Level::Elements(2)] {
        (0..4).try_for_each(|seed| agree(&in_a_plane(seed, level), seed))?;
    }
    Ok(())
}

#[test]
fn the_rates_of_a_planar_arm_are_few_operations() -> Result<()> {
    let description = two_link::arm(&json!({"strain": 4}))?;
    let program = description.program(&Kind::Rates, &description.parameters)?.program;
    let is_sine = |operation: &&Operation| matches!(operation, Operation::Apply(Function::Sine, _));
    let sines = program.operations().iter().filter(is_sine).count();
    // Three points between neighbouring ones of eight stations, a gauge and the tip, the tip, and the joint: for each link.
    assert_eq!(sines, 2 * (3 * 10 + 1 + 1));
    assert!(program.size() < 6_000, "{}", program.size());
    Ok(())
}
