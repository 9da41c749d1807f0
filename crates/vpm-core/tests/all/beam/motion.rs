//! Flexible trees in motion: a spin-up, a pendulum, energy, exact derivatives, and the allocator.

use std::f64::consts::TAU;

use allocation_counter::measure;
use nalgebra::{DMatrix, DVector};
use vpm_core::beam::witness::strain_tree::{Drive, FlexibleLink, FlexibleTree, StrainBeam, TreeMotion};
use vpm_core::beam::{Component, Section};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::spatial::Pose;
use vpm_core::{Result, Scalar};

use crate::common::beams::{along_x, body, fields, near, pin, spatial};

/// The spin-up of Kane, Ryan & Banerjee: `Omega / T (t^2 / 2 + (T / 2 pi)^2 (cos(2 pi t / T) - 1))` until T, then constant speed.
struct Spin;

impl Drive for Spin {
    fn motion<S: Scalar>(&self, t: S) -> [S; 3] {
        const TIME: f64 = 15.0;
        const SPEED: f64 = 6.0;
        if t.re() > TIME {
            return [(t - 0.5 * TIME) * SPEED, S::from_f64(SPEED), S::zero()];
        }
        let (sin, cos) = (t * (TAU / TIME)).sin_cos();
        let round = TIME / TAU;
        let angle = t * t * 0.5 + (cos - 1.0) * (round * round);
        [angle * (SPEED / TIME), (t - sin * round) * (SPEED / TIME), (S::one() - cos) * (SPEED / TIME)]
    }
}

/// The arm of Simo & Vu-Quoc 1986: 10 m, EJ = 1.4e4, aGA = 1e7, EA = 2.8e7, rhoA = 1.2, rhoJ = 6e-4.
fn spinner() -> Result<FlexibleTree> {
    let section = Section::given([1.4e4, 1.4e4, 1e4, 1e7, 1e7, 2.8e7], [6e-4, 6e-4, 6e-4, 1.2, 1.2, 1.2])?;
    let list = fields(10.0, &[(Component::BendingX, 4), (Component::ShearY, 2), (Component::Extension, 3)])?;
    let beam = Some((along_x(0.0), StrainBeam::new(section, list, 0.0, 8)?));
    FlexibleTree::new(
        vec![FlexibleLink { joint: Some(pin([0.0, 0.0, 1.0])), beam, ..FlexibleLink::welded() }],
        [0.0; 3],
    )
}

#[test]
fn a_spin_up_bends_back_and_stretches() -> Result<()> {
    // (t, axial, transverse) in the turning frame; converged, two independent codes.
    let exact = [
        (2.0, -0.000_605_901_462_028_768_4, -0.102_380_629_377_937_74),
        (5.0, -0.012_654_636_084_022_286, -0.468_476_175_652_631),
        (6.75, -0.018_822_857_756_592_98, -0.573_827_169_607_800_8),
        (10.0, -0.007_072_340_193_211_346, -0.362_813_810_446_613_87),
        (15.0, 0.000_513_989_770_979_606, 0.001_303_182_419_745_141_4),
    ];
    let tree = spinner()?;
    let mut motion = TreeMotion::new(&tree, Some(Spin))?;
    let (mut x, mut workspace) = (vec![0.0; 19], tree.workspace::<f64>());
    let mut method = Integrator::new(Method::LinearlyImplicit, 19);
    for (time, axial, transverse) in exact {
        let step = if time > 10.0 { 12.5e-3 } else { 6.25e-3 };
        while x[18] < time - 0.5 * step {
            method.step(&mut motion, &mut x, step);
        }
        let q: Vec<f64> = std::iter::once(0.0).chain(x[..9].iter().copied()).collect();
        tree.terms(&q, &[0.0; 10], &[], &mut workspace);
        let [along, across, _] = workspace.tips[0].pose.translation.to_array();
        near(&[along - 10.0, across], &[axial, transverse], 2e-4);
    }
    Ok(())
}

#[test]
fn a_pendulum_that_shears_and_stretches_falls_as_two_other_codes_say() -> Result<()> {
    // (t, tip x, tip y) of a rubber strip of 1 m on a pin, released from the horizontal; converged with the Reissner beam.
    let exact = [
        (0.1, 0.996_362_949_972_257_8, -0.044_747_226_814_434_58),
        (0.3, 0.806_442_036_277_403_9, -0.588_373_817_875_659_3),
        (0.5, -0.066_156_192_854_319_23, -0.996_761_283_515_603_8),
    ];
    let section = Section::given(
        [1.0 / 6.0, 1.0 / 6.0, 1.0, 6_535.947_712_418_301, 6_535.947_712_418_301, 2e4],
        [1.833e-6, 1.833e-6, 1.833e-6, 0.22, 0.22, 0.22],
    )?;
    let list = fields(1.0, &[(Component::BendingX, 10), (Component::ShearY, 2), (Component::Extension, 3)])?;
    let beam = Some((along_x(0.0), StrainBeam::new(section, list, 0.0, 12)?));
    let link = FlexibleLink { joint: Some(pin([0.0, 0.0, 1.0])), beam, ..FlexibleLink::welded() };
    let tree = FlexibleTree::new(vec![link], [0.0, -9.81, 0.0])?;
    let mut motion = TreeMotion::<Spin>::new(&tree, None)?;
    let (n, mut workspace, step) = (tree.len(), tree.workspace::<f64>(), 5e-4);
    let (mut x, mut method) = (vec![0.0; 2 * n + 1], Integrator::new(Method::LinearlyImplicit, 2 * n + 1));
    for (time, horizontal, vertical) in exact {
        while x[2 * n] < time - 0.5 * step {
            method.step(&mut motion, &mut x, step);
        }
        tree.terms(&x[..n], &vec![0.0; n], &[], &mut workspace);
        let found = workspace.tips[0].pose.translation.to_array();
        near(&found, &[horizontal, vertical, 0.0], 1e-4);
    }
    Ok(())
}

#[test]
fn a_free_motion_keeps_its_energy() -> Result<()> {
    let section = Section::given([3.0, 2.0, 1.5, 20.0, 25.0, 40.0], [0.02, 0.03, 0.05, 1.0, 1.0, 1.0])?;
    let list = fields(0.7, &[(Component::BendingX, 2), (Component::BendingY, 2), (Component::Torsion, 1)])?;
    let beam = Some((along_x(0.1), StrainBeam::new(section, list, 0.0, 6)?));
    let joint = Some(pin([0.0, 0.0, 1.0]));
    let link = FlexibleLink { parent: None, joint, hub: body(0.5, 0.02), beam, tip: body(0.3, 0.01) };
    let tree = FlexibleTree::new(vec![link], [0.0; 3])?;
    let mut motion = TreeMotion::<Spin>::new(&tree, None)?;
    let (n, mut x) = (tree.len(), vec![0.0; 13]);
    x[..12].copy_from_slice(&Random::new(5).numbers(12, 0.8));
    let energy = |x: &[f64]| {
        let mut workspace = tree.workspace();
        tree.terms(&x[..n], &x[n..2 * n], &[], &mut workspace);
        let form = |matrix: &[f64], x: &[f64]| {
            let x = DVector::from_column_slice(x);
            0.5 * (x.transpose() * DMatrix::from_row_slice(n, n, matrix) * &x)[0]
        };
        form(&workspace.mass, &x[n..2 * n]) + form(tree.stiffness(), &x[..n])
    };
    let before = energy(&x);
    let mut rk4 = Integrator::new(Method::Rk4, 13);
    for _ in 0..500 {
        rk4.step(&mut motion, &mut x, 1e-3);
    }
    assert!((energy(&x) / before - 1.0).abs() < 1e-7, "{} {before}", energy(&x));
    Ok(())
}

#[test]
fn the_exact_jacobian_is_the_derivative_of_the_motion() -> Result<()> {
    let tree = spinner()?;
    let mut motion = TreeMotion::new(&tree, Some(Spin))?;
    let mut x: Vec<f64> = Random::new(9).numbers(19, 0.01);
    x[18] = 3.0;
    let mut jacobian = vec![0.0; 19 * 19];
    motion.jacobian(&x, &mut jacobian);
    let [mut before, mut after] = [vec![0.0; 19], vec![0.0; 19]];
    for j in 0..19 {
        let (mut low, mut high) = (x.clone(), x.clone());
        (low[j], high[j]) = (x[j] - 1e-6, x[j] + 1e-6);
        motion.rhs(&low, &mut before);
        motion.rhs(&high, &mut after);
        for i in 0..19 {
            let (slope, exact) = ((after[i] - before[i]) / 2e-6, jacobian[i * 19 + j]);
            let size = (0..19).map(|k| jacobian[i * 19 + k].abs()).fold(1.0, f64::max);
            assert!((slope - exact).abs() < 1e-6 * size, "({i}, {j}): {slope} is not {exact}");
        }
    }
    Ok(())
}

#[test]
fn evaluations_allocate_nothing() -> Result<()> {
    let tree = spatial()?;
    let mut motion = TreeMotion::<Spin>::new(&tree, None)?;
    let (mut x, mut method) = (vec![0.1; 33], Integrator::new(Method::LinearlyImplicit, 33));
    assert_eq!(measure(|| method.step(&mut motion, &mut x, 1e-4)).count_total, 0);
    assert!(x.iter().all(|entry| entry.is_finite()));
    Ok(())
}

#[test]
fn trees_that_cannot_be_are_refused() -> Result<()> {
    let orphan = FlexibleLink { parent: Some(3), ..FlexibleLink::welded() };
    assert!(FlexibleTree::new(vec![orphan], [0.0; 3]).is_err());
    assert!(FlexibleTree::new(vec![], [f64::NAN, 0.0, 0.0]).is_err());
    let section = Section::given([1.0; 6], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])?;
    assert!(StrainBeam::new(section, vec![], 0.0, 6).is_err());
    let beam = StrainBeam::new(section, fields(1.0, &[(Component::Torsion, 1)])?, 0.0, 6)?;
    let link = FlexibleLink { beam: Some((Pose::identity(), beam)), ..FlexibleLink::welded() };
    let tree = FlexibleTree::new(vec![link], [0.0; 3])?;
    assert!(
        TreeMotion::new(&tree, Some(Spin)).map_err(|error| error.to_string()).is_err_and(|text| text.contains("drive"))
    );
    assert!(tree.equilibrium(&[0.0, 0.0], &[]).is_err());
    Ok(())
}
