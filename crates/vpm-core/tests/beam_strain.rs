//! Beams in strain coordinates, in space: closed forms, rigid-body algorithms, the planar chain, and a spin-up manoeuvre.

use std::f64::consts::TAU;

use allocation_counter::measure;
use nalgebra::{DMatrix, DVector};
use vpm_core::beam::eigen::modes;
use vpm_core::beam::linear::TipBody;
use vpm_core::beam::planar::{Hub, LinkParameters, Load, Motion, PlanarChain};
use vpm_core::beam::strain::{
    Drive, Field, FlexibleLink, FlexibleTree, Strain, StrainBeam, TipLoad, TreeMotion, exponential, tangent,
};
use vpm_core::beam::{Basis, Material, Section, Shape};
use vpm_core::data::Data;
use vpm_core::dynamics::{crba, rnea};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::joint::{Joint, JointKind};
use vpm_core::samples::{Random, random_tree};
use vpm_core::spatial::{Matrix3, Pose, SpatialInertia, Symmetric3, Twist, Vector3};
use vpm_core::{Dual, Result, Scalar};

fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
    }
}

fn fields(length: f64, list: &[(Strain, usize)]) -> Result<Vec<Field>> {
    list.iter().map(|&(strain, count)| Ok(Field { strain, basis: Basis::legendre(length, count)? })).collect()
}

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
    for (angle, list) in [(0.0, vec![(Strain::BendingY, 9)]), (0.7, vec![(Strain::BendingX, 9), (Strain::BendingY, 9)])]
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
    let tree = clamped(StrainBeam::new(unit()?, fields(1.0, &[(Strain::BendingY, 1)])?, 0.0, 8)?)?;
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
    let list = [(Strain::BendingY, 3), (Strain::ShearX, 2), (Strain::Extension, 2), (Strain::Torsion, 1)];
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
    let list = fields(1.0, &[(Strain::BendingX, 9), (Strain::ShearY, 9)])?;
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

#[test]
fn without_beams_the_tree_is_the_rigid_one() -> Result<()> {
    for seed in 0..5 {
        let (sample, mut random) = (random_tree(seed, 7), Random::new(seed));
        let bodies = sample.bodies.iter();
        let links = bodies.map(|body| FlexibleLink {
            parent: body.parent,
            joint: Some(body.joint.clone()),
            hub: body.spatial_inertia(),
            ..FlexibleLink::welded()
        });
        let tree = FlexibleTree::new(links.collect(), sample.gravity)?;
        let [q, v] = [2.0, 3.0].map(|size| random.numbers(7, size));
        let (model, mut workspace) = (sample.model::<f64>()?, tree.workspace());
        let mut data = Data::new(&model);
        tree.terms(&q, &v, &[], &mut workspace);
        near(&workspace.bias, rnea(&model, &mut data, &q, &v, &[0.0; 7]), 1e-9);
        near(&workspace.mass, crba(&model, &mut data, &q), 1e-10);
    }
    Ok(())
}

fn pin(axis: [f64; 3]) -> Joint {
    let rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    Joint { name: "pin".to_owned(), kind: JointKind::Revolute, axis, translation: [0.0; 3], rotation }
}

/// The root of a beam along x of the joint's frame, whose bending about its x is a turn about z of the joint's frame.
fn along_x(radius: f64) -> Pose<f64> {
    let columns = [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]].map(Vector3::from_f64);
    Pose::new(Matrix3 { columns }, Vector3::from_f64([radius, 0.0, 0.0]))
}

fn body(mass: f64, inertia: f64) -> SpatialInertia<f64> {
    SpatialInertia::new(mass, Vector3::zero(), Symmetric3::diagonal(inertia))
}

#[test]
fn in_a_plane_the_tree_is_the_planar_chain() -> Result<()> {
    let lengths = [0.8, 0.5];
    let (hub, tip) = (Hub { radius: 0.1, mass: 0.4, inertia: 0.02 }, TipBody { mass: 0.7, inertia: 0.03 });
    let link = LinkParameters { bending: 1.0, line: 1.0, rotary: 0.01, damping: 0.0, hub, tip };
    let planar = [0, 1].map(|k| Basis::legendre(lengths[k], 2).map(|basis| (link, basis)));
    let [first, second] = planar;
    let chain = PlanarChain::<2, 3, 6>::new([first?, second?], [1.3, -9.81], 16)?;
    let section = Section::given([1.0; 6], [0.01, 0.01, 0.01, 1.0, 1.0, 1.0])?;
    let spatial = lengths.iter().enumerate().map(|(k, &length)| {
        let beam = StrainBeam::new(section, fields(length, &[(Strain::BendingX, 2)])?, 0.0, 30)?;
        // The next joint's frame has to stand as the planar hub does: turned back from the beam's axes.
        let rotation = [0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0];
        let joint = if k == 0 { pin([0.0, 0.0, 1.0]) } else { Joint { rotation, ..pin([0.0, 0.0, 1.0]) } };
        let beam = Some((along_x(0.1), beam));
        Ok(FlexibleLink {
            parent: k.checked_sub(1),
            joint: Some(joint),
            hub: body(0.4, 0.02),
            beam,
            tip: body(0.7, 0.03),
        })
    });
    let tree = FlexibleTree::new(spatial.collect::<Result<_>>()?, [1.3, -9.81, 0.0])?;
    // Absolute hub angles from relative ones: a constant matrix, so that bias transforms like a force.
    let mut change = DMatrix::<f64>::identity(6, 6);
    let joint = chain.joint_row(1);
    for k in 0..3 {
        change[(3, k)] = -joint[k];
    }
    let mut random = Random::new(2);
    let [q, v] = [0.6, 1.0].map(|size| DVector::from_vec(random.numbers(6, size)));
    let mut workspace = tree.workspace();
    tree.terms(q.as_slice(), v.as_slice(), &[], &mut workspace);
    let array = |v: DVector<f64>| std::array::from_fn(|k| v[k]);
    let motion = Motion { position: array(&change * &q), velocity: array(&change * &v) };
    let terms = chain.terms(&motion, &Load::default(), &mut chain.workspace());
    let mass = change.transpose() * DMatrix::from_row_slice(6, 6, terms.mass.as_flattened()) * &change;
    near(mass.as_slice(), &workspace.mass, 1e-6);
    near((change.transpose() * DVector::from_row_slice(&terms.bias)).as_slice(), &workspace.bias, 1e-5);
    Ok(())
}

/// Two links in space with every strain there is.
fn spatial() -> Result<FlexibleTree> {
    use Strain::{BendingX, BendingY, Extension, ShearX, ShearY, Torsion};
    let section = Section::given([3.0, 2.0, 1.5, 20.0, 25.0, 40.0], [0.02, 0.03, 0.05, 1.0, 1.0, 1.0])?;
    let all = fields(0.7, &[(BendingX, 2), (BendingY, 1), (Torsion, 1), (ShearX, 1), (ShearY, 1), (Extension, 1)])?;
    let beam = StrainBeam::new(section, all, 1e-3, 6)?;
    let link = |parent, axis| FlexibleLink {
        parent,
        joint: Some(pin(axis)),
        hub: body(0.5, 0.02),
        beam: Some((along_x(0.1), beam.clone())),
        tip: body(0.3, 0.01),
    };
    FlexibleTree::new(vec![link(None, [0.0, 0.0, 1.0]), link(Some(0), [0.6, 0.8, 0.0])], [0.4, -9.0, 2.0])
}

#[test]
fn velocity_terms_are_the_christoffel_symbols_of_the_mass_matrix() -> Result<()> {
    let (tree, mut random) = (spatial()?, Random::new(11));
    const N: usize = 16;
    assert_eq!(tree.len(), N);
    let [q, v] = [0.5, 1.0].map(|size| random.numbers(N, size));
    let variables: Vec<Dual<f64, N>> = (0..N).map(|k| Dual::variable(q[k], k)).collect();
    let mut derived = tree.workspace();
    tree.terms(&variables, &[Dual::zero(); N], &[], &mut derived);
    let [mut moving, mut resting] = [tree.workspace(), tree.workspace()];
    tree.terms(&q, &v, &[], &mut moving);
    tree.terms(&q, &[0.0; N], &[], &mut resting);
    for i in 0..N {
        let mut sum = 0.0;
        for j in 0..N {
            for k in 0..N {
                let slopes = derived.mass[i * N + j].gradient[k] - 0.5 * derived.mass[j * N + k].gradient[i];
                sum += slopes * v[j] * v[k];
            }
        }
        let found = moving.bias[i] - resting.bias[i];
        assert!((found - sum).abs() < 1e-11 * (1.0 + sum.abs()), "{i}: {found} is not {sum}");
    }
    Ok(())
}

#[test]
fn a_free_motion_keeps_its_energy() -> Result<()> {
    let section = Section::given([3.0, 2.0, 1.5, 20.0, 25.0, 40.0], [0.02, 0.03, 0.05, 1.0, 1.0, 1.0])?;
    let list = fields(0.7, &[(Strain::BendingX, 2), (Strain::BendingY, 2), (Strain::Torsion, 1)])?;
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
    let list = fields(10.0, &[(Strain::BendingX, 4), (Strain::ShearY, 2), (Strain::Extension, 3)])?;
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
fn the_exact_jacobian_is_the_derivative_of_the_motion() -> Result<()> {
    use vpm_core::ode::Ode;
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
    assert!(StrainBeam::new(unit()?, vec![], 0.0, 6).is_err());
    let tree = clamped(StrainBeam::new(unit()?, fields(1.0, &[(Strain::Torsion, 1)])?, 0.0, 6)?)?;
    assert!(
        TreeMotion::new(&tree, Some(Spin)).map_err(|error| error.to_string()).is_err_and(|text| text.contains("drive"))
    );
    assert!(tree.equilibrium(&[0.0, 0.0], &[]).is_err());
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
    let list = fields(1.0, &[(Strain::BendingX, 10), (Strain::ShearY, 2), (Strain::Extension, 3)])?;
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
