//! One beam in strain coordinates, in space: its exponentials, static closed forms, natural frequencies.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use vpm_core::beam::eigen::modes;
use vpm_core::beam::strain::{exponential, tangent};
use vpm_core::beam::witness::strain_tree::{FlexibleLink, FlexibleTree, StrainBeam, TipLoad};
use vpm_core::beam::{Component, Material, Section, Shape};
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};
use vpm_core::{Dual, Result};

use crate::common::beams::{fields, near};

fn clamped(beam: StrainBeam) -> Result<FlexibleTree> {
    FlexibleTree::new(vec![FlexibleLink { beam: Some((Pose::identity(), beam)), ..FlexibleLink::welded() }], [0.0; 3])
}

/// All stiffnesses 1 and one mass per length; nothing turns.
fn unit() -> Result<Section> {
    Section::given([1.0; 6], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
}

fn twist(random: &mut Random, size: f64) -> Twist<f64> {
    Twist::new(random.vector(size).into(), random.vector(size).into())
}

#[test]
fn the_tangent_is_the_derivative_of_the_exponential() {
    let mut random = Random::new(7);
    for size in [0.0, 1e-6, 0.3, 2.0] {
        let (screw, rate) = (twist(&mut random, size), twist(&mut random, 1.0));
        let lift = |v: Vector3<f64>, r: Vector3<f64>| {
            let [v, r] = [v.to_array(), r.to_array()];
            Vector3::from([0, 1, 2].map(|k| Dual::<f64, 1> { value: v[k], gradient: [r[k]] }))
        };
        let moving = Twist::new(lift(screw.angular, rate.angular), lift(screw.linear, rate.linear));
        let [here, pose] = [exponential(screw), exponential(-screw)];
        let found = tangent(screw, rate);
        // R^T dR/dt is the matrix of the angular part, R^T dt/dt the linear part.
        let change = exponential(moving);
        let column = |v: Vector3<Dual<f64, 1>>| Vector3::from(v.to_array().map(|number| number.gradient[0]));
        let turned = here.rotation.transpose_mul(column(change.rotation.columns[0]));
        near(&[turned.y, turned.z], &[found.angular.z, -found.angular.y], 1e-13);
        let moved = here.rotation.transpose_mul(column(change.translation));
        near(&moved.to_array(), &found.linear.to_array(), 1e-13);
        near(&(here * pose).translation.to_array(), &[0.0; 3], 1e-14);
    }
    let turn = exponential(Twist::new(Vector3::from_f64([0.0, 0.0, 2.0]), Vector3::zero())).rotation;
    let known = Matrix3::rotation(Vector3::from_f64([0.0, 0.0, 1.0]), 2.0);
    near(&turn.columns[0].to_array(), &known.columns[0].to_array(), 1e-15);
}

#[test]
fn a_tip_load_bends_the_elastica_in_any_plane() -> Result<()> {
    // Elliptic integrals at P L^2 / EJ = 10: w / L, u / L.
    let (across, along) = (0.810_609_024_880_296_4, 0.554_995_597_753_751_3);
    for (angle, list) in
        [(0.0, vec![(Component::BendingY, 9)]), (0.7, vec![(Component::BendingX, 9), (Component::BendingY, 9)])]
    {
        let tree = clamped(StrainBeam::new(unit()?, fields(1.0, &list)?, 0.0, 24)?)?;
        let (mut q, (sin, cos)) = (vec![0.0; tree.len()], f64::sin_cos(angle));
        for stage in 1..=5 {
            let force = [cos, sin, 0.0].map(|direction| 2.0 * f64::from(stage) * direction);
            q = tree.equilibrium(&q, &[TipLoad { link: 0, force, moment: [0.0; 3] }])?;
        }
        let mut workspace = tree.workspace();
        tree.terms(&q, &vec![0.0; tree.len()], &[], &mut workspace);
        near(&workspace.tips[0].pose.translation.to_array(), &[across * cos, across * sin, 1.0 - along], 1e-6);
    }
    Ok(())
}

#[test]
fn a_tip_moment_rolls_the_beam_up() -> Result<()> {
    let tree = clamped(StrainBeam::new(unit()?, fields(1.0, &[(Component::BendingY, 1)])?, 0.0, 8)?)?;
    for phi in [0.25 * TAU, 0.5 * TAU, TAU, 2.0 * TAU] {
        let q = tree.equilibrium(&[0.0], &[TipLoad { link: 0, force: [0.0; 3], moment: [0.0, phi, 0.0] }])?;
        let mut workspace = tree.workspace();
        tree.terms(&q, &[0.0], &[], &mut workspace);
        let exact = [(1.0 - phi.cos()) / phi, 0.0, phi.sin() / phi];
        near(&workspace.tips[0].pose.translation.to_array(), &exact, 1e-8);
    }
    Ok(())
}

#[test]
fn shear_and_extension_have_their_closed_forms() -> Result<()> {
    let list = [(Component::BendingY, 3), (Component::ShearX, 2), (Component::Extension, 2), (Component::Torsion, 1)];
    let section = Section::given([5.0, 6.0, 7.0, 8.0, 9.0, 10.0], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])?;
    let tree = clamped(StrainBeam::new(section, fields(2.0, &list)?, 0.0, 12)?)?;
    let tip = |load| -> Result<[f64; 3]> {
        let q = tree.equilibrium(&vec![0.0; tree.len()], &[load])?;
        let mut workspace = tree.workspace();
        tree.terms(&q, &vec![0.0; tree.len()], &[], &mut workspace);
        Ok(workspace.tips[0].pose.translation.to_array())
    };
    // Small force across: F L^3 / 3 EJ + F L / aGA. A pull along: F L / EA.
    let across = tip(TipLoad { link: 0, force: [1e-5, 0.0, 0.0], moment: [0.0; 3] })?;
    near(&across, &[1e-5 * (8.0 / 18.0 + 2.0 / 8.0), 0.0, 2.0], 1e-10);
    near(&tip(TipLoad { link: 0, force: [0.0, 0.0, 0.5], moment: [0.0; 3] })?, &[0.0, 0.0, 2.1], 1e-12);
    Ok(())
}

#[test]
fn a_thick_beam_vibrates_as_timoshenko_says() -> Result<()> {
    let steel = Material { young: 210e9, poisson: 0.3, density: 7850.0 };
    let section = Section::new(Shape::Rectangle { width: 0.1, height: 0.1 }, steel)?;
    let list = fields(1.0, &[(Component::BendingX, 9), (Component::ShearY, 9)])?;
    let tree = clamped(StrainBeam::new(section, list, 0.0, 60)?)?;
    let mut workspace = tree.workspace();
    tree.terms(&[0.0; 18], &[0.0; 18], &[], &mut workspace);
    let [mass, stiffness] = [&workspace.mass[..], tree.stiffness()].map(|m| DMatrix::from_row_slice(18, 18, m));
    let found = modes(&stiffness, &mass)?.frequencies;
    for (found, exact) in found.iter().zip([520.900_091_701_654_9, 3_123.849_610_606_452_6, 8_222.485_833_074_745]) {
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} is not {exact}");
    }
    Ok(())
}
