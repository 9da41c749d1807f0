//! Beams whose deflection is linear in their coordinates: a map of its own, and what it leaves out.

use vpm_core::beam::{Beam, BeamEntry, Component, Level};
use vpm_core::body::{Body, Inertia};
use vpm_core::data::Data;
use vpm_core::dynamics::flexible;
use vpm_core::joint::{Joint, JointKind};
use vpm_core::model::{Model, Omissions, Parts};
use vpm_core::mount::Mount;
use vpm_core::samples::Random;
use vpm_core::{Dual, Result};

use Component::{BendingX, BendingY, Extension, Torsion};

use crate::common::derivatives;
use crate::common::entries::{STEEL, entry, lift, mixes};

/// Levels that integrate the strain: their exponentials round.
const EXACT: [Level; 3] = [Level::Strain(3), Level::Elements(2), Level::Bezier(3)];

/// Beams of all levels that have terms of second order, with all that they can do.
fn levels() -> Vec<BeamEntry<f64>> {
    mixes(&[EXACT[0], EXACT[1], EXACT[2], Level::Deflection(3), Level::Hermite(2), Level::Modal(2)])
}

#[test]
fn columns_twists_and_accelerations_are_derivatives_of_the_map_itself() -> Result<()> {
    let mut random = Random::new(3);
    for entry in levels() {
        let moving = Beam::first_order(&lift::<Dual<f64, 1>>(&entry), &[0.8])?;
        let what = format!("{:?} {:?}", entry.level, entry.deforms);
        derivatives::are_those_of_poses(&Beam::first_order(&entry, &[0.8])?, &moving, &mut random, &what);
    }
    Ok(())
}

#[test]
fn what_it_leaves_out_vanishes_with_the_square_of_the_deflection() -> Result<()> {
    let mut random = Random::new(5);
    for entry in levels() {
        let what = format!("{:?} {:?}", entry.level, entry.deforms);
        let (first, second) = (Beam::first_order(&entry, &[])?, Beam::new(&entry, &[])?);
        let n = first.len();
        assert_eq!((n, first.stiffness()), (second.len(), second.stiffness()), "{what}");
        let (one, zero) = (random.numbers(n, 1.0), vec![0.0; n]);
        let gap = |size: f64| -> f64 {
            let q: Vec<f64> = one.iter().map(|entry| size * entry).collect();
            let (mut left, mut right) = (first.sections(), second.sections());
            first.motion(&q, &zero, &mut left);
            second.motion(&q, &zero, &mut right);
            let tips = (left.at[left.at.len() - 1].pose, right.at[right.at.len() - 1].pose);
            let place = (tips.0.translation - tips.1.translation).to_array();
            let turn = tips.0.rotation.columns.iter().zip(&tips.1.rotation.columns);
            let turn = turn.flat_map(|(left, right)| (*left - *right).to_array());
            place.into_iter().chain(turn).map(|entry| entry * entry).sum::<f64>().sqrt()
        };
        let (coarse, fine) = (gap(2e-3), gap(1e-3));
        // Torsion alone turns sections by any angle, and extension alone is linear: there is nothing to leave out.
        let none = entry.deforms.iter().all(|component| matches!(component, Torsion | Extension));
        if none && !EXACT.contains(&entry.level) {
            assert!(coarse < 1e-15, "{what}: {coarse}");
        } else if coarse > 1e-13 {
            assert!((3.9..4.1).contains(&(coarse / fine)), "{what}: {coarse} {fine}");
        }
        if entry.deforms.contains(&BendingX) || entry.deforms.contains(&BendingY) {
            assert!(coarse > 1e-9, "{what}: {coarse}");
        }
    }
    Ok(())
}

/// A beam of one quadratic Bezier curve along z on a hub that turns about x.
fn rotor(deforms: Component, level: Level, omissions: Omissions) -> Result<Model<f64>> {
    let mut link = entry(level, &[deforms], 0.5, [0.002, 0.002]);
    link.on = Mount::Body(0);
    let joint = Joint {
        name: "spin".to_owned(),
        kind: JointKind::Revolute,
        axis: [1.0, 0.0, 0.0],
        translation: [0.0; 3],
        rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    };
    let inertia = Inertia { mass: 1.0, center_of_mass: [0.0; 3], moments: [0.01, 0.01, 0.01, 0.0, 0.0, 0.0] };
    let hub = Body { name: "hub".to_owned(), on: Mount::World, joint, inertia: Some(inertia), rotor_inertia: None };
    Model::assemble(Parts { bodies: vec![hub], beams: vec![link], omissions, ..Parts::default() })
}

fn first_order() -> Omissions {
    Omissions { second_order: vec![0], ..Omissions::default() }
}

/// Stiffness of the first elastic coordinate in steady rotation.
fn stiffness(model: &Model<f64>, spin: f64) -> f64 {
    let (n, step) = (model.n_coordinates(), 1e-6);
    let (mut v, a) = (vec![0.0; n], vec![0.0; n]);
    v[0] = spin;
    let at = |deflection: f64| {
        let (mut data, mut q, mut efforts) = (Data::new(model), vec![0.0; n], vec![0.0; n]);
        q[1] = deflection;
        flexible::terms(model, &mut data, &q, &v);
        flexible::required(model, &data, (&q, &v), &a, &mut efforts);
        efforts[1]
    };
    (at(step) - at(-step)) / (2.0 * step)
}

#[test]
fn a_spinning_beam_stiffens_by_the_terms_of_second_order_alone() -> Result<()> {
    // v = q (mu/L)^2: int v'^2 shortens by S(mu) = 4 mu^3 / (3 L^4), and Omega^2 int rho A mu S = 4/15 rho A Omega^2 L; in the plane of
    // rotation less Omega^2 M = Omega^2 rho A L/5 (Kane, Ryan & Banerjee 1987).
    let (spin, length) = (40.0, 0.5);
    let weight = STEEL.density * 0.002 * 0.002 * spin * spin * length;
    for (deforms, softening) in [(BendingY, 0.0), (BendingX, weight / 5.0)] {
        let [second, first] =
            [rotor(deforms, Level::Bezier(2), Omissions::default())?, rotor(deforms, Level::Bezier(2), first_order())?];
        let [elastic, same] = [stiffness(&second, 0.0), stiffness(&first, 0.0)];
        assert!((elastic - same).abs() < 1e-9 * elastic, "{elastic} {same}");
        let [full, linear] = [stiffness(&second, spin), stiffness(&first, spin)];
        let (expected, stiffening) = (elastic - softening, 4.0 / 15.0 * weight);
        assert!((linear - expected).abs() < 1e-4 * weight, "{deforms:?}: {linear} {expected}");
        assert!((full - linear - stiffening).abs() < 1e-4 * weight, "{deforms:?}: {full} {linear} {stiffening}");
        // Interpolated strain has the exact geometry, and can be linear all the same: constant strain is the same curve.
        let strain = rotor(deforms, Level::Strain(1), first_order())?;
        let scale = stiffness(&strain, 0.0) / elastic;
        assert!((stiffness(&strain, spin) - scale * linear).abs() < 1e-4 * scale * weight);
    }
    Ok(())
}

#[test]
fn its_motion_conserves_energy() -> Result<()> {
    for level in [Level::Bezier(3), Level::Deflection(3), Level::Strain(2)] {
        let model = rotor(BendingX, level, first_order())?;
        let (n, mut random) = (model.n_coordinates(), Random::new(2));
        let q: Vec<f64> = random.numbers(n, 0.05);
        let v: Vec<f64> = random.numbers(n, 1.0);
        let mut data = Data::new(&model);
        flexible::terms(&model, &mut data, &q, &v);
        let a = flexible::solve(&model, &mut data, &q, &v, &vec![0.0; n]).to_vec();
        let total = |time: f64| {
            let step =
                |x: &[f64], rate: &[f64]| -> Vec<f64> { x.iter().zip(rate).map(|(x, r)| x + time * r).collect() };
            let found = flexible::energy(&model, &mut Data::new(&model), &step(&q, &v), &step(&v, &a));
            (found.kinetic + found.potential, found.kinetic)
        };
        let power = (total(1e-6).0 - total(-1e-6).0) / 2e-6;
        assert!(power.abs() < 1e-5 * total(0.0).1, "{level:?}: {power}");
    }
    Ok(())
}
