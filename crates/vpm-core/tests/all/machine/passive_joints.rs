//! Motion prescribed at some joints only: the others rest in their springs and plays, then move freely.

use allocation_counter::measure;
use serde_json::json;
use vpm_core::Result;
use vpm_core::beam::{Component, Level};
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::motion::{JointMotion, StrainRates};
use vpm_core::mount::{Gauge, Mount};
use vpm_core::samples::Random;
use vpm_core::simulate::{Run, Setting, Stepping, free_run, observed, prescribed};
use vpm_core::table::Table;

use crate::common::entries::material;
use crate::common::trees::{beam, body, description, parameter, push, section};

const PLAY: usize = 1;

/// A driven joint, a joint that is the play of its gear, a beam, and a hand that a spring holds.
fn geared(gap: f64) -> Description {
    remembering(gap, &[])
}

/// The same with a hysteresis of some joints, each with its force.
fn remembering(gap: f64, forces: &[(usize, f64)]) -> Description {
    let random = &mut Random::new(5);
    let mut parts: Parts<f64> = Parts { gravity: [0.0, 0.0, -9.81], ..Parts::default() };
    for (name, on) in [("gear", Mount::World), ("hub", Mount::Body(0))] {
        parts.bodies.push(body(random, name, on, JointKind::Revolute));
    }
    parts.beams.push(beam(
        random,
        "link",
        Mount::Body(1),
        Level::Strain(2),
        &[Component::BendingX, Component::BendingY],
    ));
    let tip = section(&parts, 0, 1.0);
    parts.bodies.push(body(random, "hand", tip, JointKind::Revolute));
    parts.gauges.push(Gauge { name: "strip".into(), beam: 0, at: 0.1, x: 0.003, y: 0.005 });
    description(&parts, |content| {
        let [gap, stiffness, damping, impact, width] =
            [("gap", gap), ("contact", 3e4), ("grease", 0.5), ("impact", 1.0), ("width", 1e-3)]
                .map(|(name, value)| parameter(content, name, value));
        let entry = json!({"type": "backlash", "joint": PLAY, "gap": gap, "stiffness": stiffness, "damping": damping,
            "contact_damping": impact, "width": width});
        push(content, "effects", entry);
        let [stiffness, rest] = [("spring", 30.0), ("rest", 0.1)].map(|(name, value)| parameter(content, name, value));
        push(content, "effects", json!({"type": "spring", "joint": 2, "stiffness": stiffness, "rest": rest}));
        for &(joint, force) in forces {
            let [force, way, shape] = [("force", force), ("way", 0.05), ("shape", 0.8)]
                .map(|(name, value)| parameter(content, &format!("{name} {joint}"), value));
            let entry =
                json!({"type": "hysteresis", "joint": joint, "force": force, "displacement": way, "shape": shape});
            push(content, "effects", entry);
        }
    })
}

/// Position, velocity and acceleration of all joints, row by row.
fn guided(d: &Description, stepping: Stepping, motion: &[Vec<f64>; 3], passive: &[usize], by: &[usize]) -> Result<Run> {
    let (joints, rows) = (d.n_joints(), motion[0].len() / d.n_joints());
    let table = |k: usize| Table::new("motion", &motion[k], rows, joints);
    let setting = Setting { description: d, theta: &d.parameters, stepping, sensitivities: by, interrupt: &|| false };
    prescribed(setting, JointMotion { position: table(0)?, velocity: table(1)?, acceleration: table(2)? }, passive)
}

/// The first joint turns, the columns of the others are rubbish that nobody may read.
fn turning(rows: u32, step: f64) -> [Vec<f64>; 3] {
    let of =
        |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..rows).flat_map(|k| [f(step * f64::from(k)), 7.0, -3.0]).collect() };
    [of(&|t| 0.4 + (5.0 * t).sin()), of(&|t| 5.0 * (5.0 * t).cos()), of(&|t| -25.0 * (5.0 * t).sin())]
}

/// A free run from `start` with a push of the first joint; following that joint gives all others back, and needs no effort.
fn thrown(d: &Description, stepping: Stepping, mut start: Vec<f64>) -> Result<Run> {
    let setting = Setting { description: d, theta: &d.parameters, stepping, sensitivities: &[], interrupt: &|| false };
    start[d.n_coordinates()] = 4.0;
    let run = free_run(setting, &start, Table::new("inputs", &[], 601, 0)?)?;
    let column = |offset: usize| -> Vec<f64> {
        run.outputs.chunks(d.n_outputs()).flat_map(|row| [row[offset], 7.0, -3.0]).collect()
    };
    let followed = guided(d, stepping, &[column(0), column(1), column(2)], &[2, PLAY], &[])?;
    let state = followed.states.iter().zip(&run.states).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    let effort = followed.outputs.chunks(d.n_outputs()).fold(0.0_f64, |most, row| most.max(row[3].abs()));
    assert!(state < 2e-3 && effort < 2e-2, "state {state}, effort {effort} N m");
    Ok(run)
}

#[test]
fn passive_joints_move_as_in_the_free_machine() -> Result<()> {
    // Rest, from a motion that stands still; then the machine falls freely, and following one joint gives back the others.
    let d = geared(0.02);
    let stepping = Stepping::new(0.002, 4, Method::Rosenbrock)?;
    let still = [vec![0.3, 0.0, 0.0], vec![0.0; 3], vec![0.0; 3]];
    let rest = guided(&d, stepping, &still, &[PLAY, 2], &[])?;
    let efforts: Vec<f64> = rest.outputs[..12].chunks(4).map(|channels| channels[3]).collect();
    assert!(efforts[0].abs() > 0.1 && efforts[1].abs() < 1e-8 && efforts[2].abs() < 1e-8, "{efforts:?}");
    assert!(rest.states[PLAY].abs() > 0.005, "gravity lays the play to one side: {} rad", rest.states[PLAY]);
    let run = thrown(&d, stepping, rest.states)?;
    let play: Vec<f64> = run.states.chunks(d.n_states()).map(|state| state[PLAY]).collect();
    let span = play.iter().fold(0.0_f64, |most, q| most.max((q - play[0]).abs()));
    assert!(span > 0.01, "the play must be crossed: {span} rad");
    Ok(())
}

#[test]
fn memories_go_along_as_in_the_free_machine() -> Result<()> {
    // One joint that follows and one that does not remember their way; a third one does not.
    let d = remembering(0.02, &[(0, 0.6), (2, 0.3)]);
    let stepping = Stepping::new(0.002, 4, Method::Rosenbrock)?;
    let rest = guided(&d, stepping, &[vec![0.3, 0.0, 0.0], vec![0.0; 3], vec![0.0; 3]], &[PLAY, 2], &[])?;
    let run = thrown(&d, stepping, rest.states)?;
    let memories: Vec<&[f64]> = run.states.chunks(d.n_states()).map(|state| &state[d.n_states() - 2..]).collect();
    for k in 0..2 {
        let most = memories.iter().fold(0.0_f64, |most, values| most.max(values[k].abs()));
        assert!(most > 0.1, "memory {k} must matter: {most}");
    }
    Ok(())
}

#[test]
fn passive_joints_begin_away_from_rest_as_in_the_free_machine() -> Result<()> {
    // The hand swings already where the motion begins; without its departure it would hang still.
    let d = geared(0.02);
    let (n, stepping) = (d.n_coordinates(), Stepping::new(0.002, 4, Method::Rosenbrock)?);
    let rest = guided(&d, stepping, &[vec![0.3, 0.0, 0.0], vec![0.0; 3], vec![0.0; 3]], &[PLAY, 2], &[])?;
    let setting = Setting { description: &d, theta: &d.parameters, stepping, sensitivities: &[], interrupt: &|| false };
    let (mut start, mut departure) = (rest.states, vec![0.0; 2 * n]);
    (departure[2], departure[n + 2]) = (0.3, -2.0);
    start.iter_mut().zip(&departure).for_each(|(state, away)| *state += away);
    let run = free_run(setting, &start, Table::new("inputs", &[], 301, 0)?)?;
    let columns = [0, 1, 2].map(|offset| -> Vec<f64> {
        run.outputs.chunks(d.n_outputs()).flat_map(|row| [row[offset], 7.0, -3.0]).collect()
    });
    let table = |k: usize| Table::new("motion", &columns[k], 301, 3);
    let moving = JointMotion { position: table(0)?, velocity: table(1)?, acceleration: table(2)? };
    let apart = |away: &[f64]| -> Result<f64> {
        let followed = observed(setting, (moving, 0), &[2, PLAY], None, away)?;
        Ok(followed.states.iter().zip(&run.states).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())))
    };
    let (begun, still) = (apart(&departure)?, apart(&[])?);
    assert!(begun < 2e-3 && still > 0.1, "{begun}, from rest {still}");
    assert!(apart(&[0.0]).is_err(), "a departure has the coordinates and rates of the machine");
    Ok(())
}

#[test]
fn sensitivities_of_partly_prescribed_motion_are_slopes() -> Result<()> {
    let d = geared(0.01);
    let stepping = Stepping::new(0.005, 8, Method::LinearlyImplicit)?;
    let motion = turning(30, 0.005);
    let names = ["gap", "contact", "grease", "spring", "rest"];
    let named = (0..d.n_parameters()).filter(|&k| names.contains(&d.parameter_names[k].as_str()));
    let by: Vec<usize> = named.chain([material(&d.beams[0]).young]).collect();
    assert!(by.len() > names.len());
    let run = guided(&d, stepping, &motion, &[PLAY, 2], &by)?;
    let moved = |place: usize, sign: f64| {
        let mut other = d.clone();
        other.parameters[place] *= 1.0 + sign * 1e-6;
        guided(&other, stepping, &motion, &[PLAY, 2], &[])
    };
    for (lane, &place) in by.iter().enumerate() {
        let (up, down) = (moved(place, 1.0)?, moved(place, -1.0)?);
        let mut largest = 0.0_f64;
        for (output, (up, down)) in up.outputs.iter().zip(&down.outputs).enumerate() {
            let (expected, found) = ((up - down) / 2e-6, run.jacobian[output * by.len() + lane] * d.parameters[place]);
            assert!((found - expected).abs() < 1e-4 * (1.0 + expected.abs()), "{place} {output}: {found} {expected}");
            largest = largest.max(found.abs());
        }
        assert!(largest > 1e-4, "{} must matter: {largest}", d.parameter_names[place]);
    }
    Ok(())
}

#[test]
fn gauges_that_hold_agree_with_and_without_derivatives() -> Result<()> {
    let (d, rows) = (geared(0.01), 12);
    let motion = turning(rows as u32, 0.005);
    let rate: Vec<f64> = (0..rows).map(|k| 2e-3 * (k as f64).sin()).collect();
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let run = |by: &[usize], gain: f64, substeps: usize| -> Result<Run> {
            let table = |k: usize| Table::new("motion", &motion[k], rows, 3);
            let stepping = Stepping::new(0.005, substeps, method)?;
            let setting =
                Setting { description: &d, theta: &d.parameters, stepping, sensitivities: by, interrupt: &|| false };
            let moving = JointMotion { position: table(0)?, velocity: table(1)?, acceleration: table(2)? };
            let strains = StrainRates { rate: Table::new("rate", &rate, rows, 1)?, gain: &[gain] };
            observed(setting, (moving, 0), &[PLAY, 2], Some(strains), &[])
        };
        let (plain, lifted) = (run(&[], 50.0, 20)?, run(&[material(&d.beams[0]).young], 50.0, 20)?);
        let apart =
            |a: &Run, b: &Run| a.outputs.iter().zip(&b.outputs).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        let (rounding, fine, free) =
            (apart(&plain, &lifted), apart(&plain, &run(&[], 50.0, 40)?), apart(&plain, &run(&[], 0.0, 20)?));
        assert!(rounding < 1e-6 && fine < 0.1 * free, "{method}: {rounding}, finer {fine}, without gauges {free}");
    }
    Ok(())
}

#[test]
fn steps_along_a_motion_allocate_nothing() -> Result<()> {
    let d = geared(0.01);
    let (motion, young) = (turning(3, 0.005), [material(&d.beams[0]).young]);
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        for by in [&[][..], &young] {
            let allocations = |substeps: usize| -> Result<u64> {
                let stepping = Stepping::new(0.005, substeps, method)?;
                let mut run = Ok(());
                let counted = measure(|| run = guided(&d, stepping, &motion, &[PLAY, 2], by).map(|_| ()));
                run.map(|()| counted.count_total)
            };
            // The first run records what all share.
            allocations(4)?;
            assert_eq!(allocations(4)?, allocations(12)?, "{method}, {} derivatives", by.len());
        }
    }
    Ok(())
}

#[test]
fn joints_that_nothing_holds_are_refused_by_name() -> Result<()> {
    let mut d = geared(0.01);
    d.gravity = [0.0; 3];
    d.effects.clear();
    let stepping = Stepping::new(0.005, 1, Method::LinearlyImplicit)?;
    let message = guided(&d, stepping, &turning(3, 0.005), &[PLAY, 2], &[]).map_err(|error| error.to_string()).err();
    assert!(message.as_ref().is_some_and(|text| text.contains("hub") && text.contains("spring")), "{message:?}");
    let message = guided(&d, stepping, &turning(3, 0.005), &[9], &[]).map_err(|error| error.to_string()).err();
    assert!(message.is_some_and(|text| text.contains("passive")));
    Ok(())
}
