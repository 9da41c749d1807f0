//! Levels against one another and against other derivations of the same sums.

use vpm_core::Result;
use vpm_core::beam::witness::strain_tree::{Field, FlexibleLink, FlexibleTree, StrainBeam};
use vpm_core::beam::{Basis, Beam, Component, Level, Section, SectionEntry, Shape};
use vpm_core::joint::{Joint, JointKind};
use vpm_core::samples::Random;
use vpm_core::spatial::{Pose, SpatialInertia, Twist, Vector3};

use Component::{BendingX, BendingY, Extension, ShearX, ShearY, Torsion};

use crate::common::entries;
use crate::common::entries::{ALL, entry};
use crate::common::sums::{Load, Root, bias, equilibrium, mass, tip};

const GRAVITY: [f64; 3] = [0.4, -9.0, 2.0];

fn near(found: &[f64], expected: &[f64], relative: f64) {
    let size = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= relative * size, "{found} is not {expected}, among {size}");
    }
}

/// One section that a beam entry of [`entry`] has.
fn section() -> Result<Section> {
    Section::new(Shape::Rectangle { width: 0.02, height: 0.01 }, entries::STEEL)
}

#[test]
fn in_a_plane_the_closed_map_is_the_product_of_exponentials() -> Result<()> {
    let (mut random, length) = (Random::new(8), 0.8);
    let marks: Vec<f64> = (1..=400).map(|k| length * f64::from(k) / 400.0).collect();
    for bending in [BendingX, BendingY] {
        // Places along an element follow a polynomial through its tangents, of sixth order in what it bends by, here up to 0.1 rad.
        // Each derivative by that has an order less.
        for (level, size, tolerance) in [(Level::Strain(3), 4.0, 1e-9), (Level::Elements(4), 0.5, 1e-7)] {
            let plane = Beam::new(&entry(level, &[bending], length, [0.02, 0.01]), &marks)?;
            let space = Beam::new(&entry(level, &[bending, Torsion], length, [0.02, 0.01]), &marks)?;
            let n = plane.len();
            let [q, v] = [size; 2].map(|size| random.numbers(n, size));
            let with_twist = |x: &[f64]| [x, &vec![0.0; n]].concat();
            let (mut flat, mut full) = (plane.sections(), space.sections());
            plane.motion(&q, &v, &mut flat);
            space.motion(&with_twist(&q), &with_twist(&v), &mut full);
            for (station, (a, b)) in flat.at.iter().zip(&full.at).enumerate() {
                near(&pose(a.pose), &pose(b.pose), tolerance);
                assert!(apart(&[a.twist, a.acceleration], &[b.twist, b.acceleration]) < 30.0 * tolerance);
                let columns = &full.columns[station * 2 * n..station * 2 * n + n];
                assert!(apart(&flat.columns[station * n..(station + 1) * n], columns) < 10.0 * tolerance);
            }
        }
    }
    Ok(())
}

#[test]
fn sums_are_those_of_the_flexible_tree() -> Result<()> {
    let (mut random, length) = (Random::new(8), 0.8);
    let beam = Beam::new(&entry(Level::Strain(2), &ALL, length, [0.02, 0.01]), &[length])?;
    let field = |strain| Ok(Field { strain, basis: Basis::legendre(length, 2)? });
    let fields = ALL.into_iter().map(field).collect::<Result<_>>()?;
    // As many stations as the beam has with inertia.
    let witness = StrainBeam::new(section()?, fields, 0.0, beam.stations() - 1)?;
    let link = FlexibleLink { beam: Some((Pose::identity(), witness)), ..FlexibleLink::welded() };
    let tree = FlexibleTree::new(vec![link], GRAVITY)?;
    let n = beam.len();
    let [q, v] = [0.6, 2.0].map(|size| random.numbers(n, size));
    let (mut workspace, mut out) = (tree.workspace(), beam.sections());
    tree.terms(&q, &v, &[], &mut workspace);
    beam.motion(&q, &v, &mut out);
    near(&mass(&beam, &out), &workspace.mass, 1e-13);
    near(&bias(&beam, &q, &v, &Root::resting(GRAVITY), &Load::default()), &workspace.bias, 1e-13);
    near(beam.stiffness(), tree.stiffness(), 1e-13);
    Ok(())
}

/// A joint between segments.
fn hinge(component: Component, along: f64) -> Joint {
    let axis = [0, 1, 2].map(|k| if k == component as usize % 3 { 1.0 } else { 0.0 });
    let kind = if (component as usize) < 3 { JointKind::Revolute } else { JointKind::Prismatic };
    let rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    Joint { name: "hinge".to_owned(), kind, axis, translation: [0.0, 0.0, along], rotation }
}

#[test]
fn segments_are_a_rigid_tree_with_springs() -> Result<()> {
    let mut random = Random::new(9);
    for deforms in [&[BendingX][..], &[BendingY, Torsion], &ALL] {
        let (count, length) = (4, 0.8);
        let beam = Beam::new(&entry(Level::Lumped(count), deforms, length, [0.02, 0.01]), &[0.5])?;
        let size = length / count as f64;
        // The inertia of a prism about its end, from the textbook.
        let (section, m) = (section()?, 7850.0 * 2e-4 * size);
        let [x, y, z] = [0, 1, 2].map(|k| section.inertia[k] * size);
        let lateral = m * size * size / 12.0;
        let central = vpm_core::spatial::Symmetric3::from_array([x + lateral, y + lateral, z, 0.0, 0.0, 0.0]);
        let inertia = SpatialInertia::new(m, Vector3::from_f64([0.0, 0.0, 0.5 * size]), central);
        let mut links = Vec::new();
        for segment in 0..count {
            for (place, &component) in deforms.iter().enumerate() {
                let along = if segment > 0 && place == 0 { size } else { 0.0 };
                let hub = if place + 1 == deforms.len() { inertia } else { SpatialInertia::zero() };
                let parent = links.len().checked_sub(1);
                links.push(FlexibleLink {
                    parent,
                    joint: Some(hinge(component, along)),
                    hub,
                    ..FlexibleLink::welded()
                });
            }
        }
        let tree = FlexibleTree::new(links, GRAVITY)?;
        let n = beam.len();
        assert_eq!(n, tree.len());
        let [q, v] = [0.7, 2.0].map(|size| random.numbers(n, size));
        let (mut workspace, mut out) = (tree.workspace(), beam.sections());
        tree.terms(&q, &v, &[], &mut workspace);
        beam.motion(&q, &v, &mut out);
        near(&mass(&beam, &out), &workspace.mass, 1e-12);
        near(&bias(&beam, &q, &v, &Root::resting(GRAVITY), &Load::default()), &workspace.bias, 1e-12);
        for k in 0..n {
            let spring = section.stiffness[deforms[k % deforms.len()] as usize] / size;
            let expected = if k < deforms.len() { 2.0 * spring } else { spring };
            assert!((beam.stiffness()[k * n + k] / expected - 1.0).abs() < 1e-12);
        }
    }
    Ok(())
}

/// The strain coordinates that have the strains of a deflection beam: Legendre coefficients of each component.
fn projected(from: &Beam<f64>, q: &[f64], count: usize, length: f64) -> Result<Vec<f64>> {
    let basis = Basis::legendre(length, count)?;
    let mut found = vec![0.0; 6 * count];
    for at in vpm_core::beam::quadrature::gauss(12, 0.0, length) {
        let (row, strain) = (basis.evaluate(at.place, 0), from.strain(at.place, q));
        for (component, strain) in strain.into_iter().enumerate() {
            for (k, row) in row.iter().enumerate() {
                found[component * count + k] += at.weight * row * strain * (2 * k + 1) as f64 / length;
            }
        }
    }
    Ok(found)
}

/// The entries of a pose.
fn pose(pose: Pose<f64>) -> Vec<f64> {
    [pose.rotation.columns.map(Vector3::to_array).concat(), pose.translation.to_array().to_vec()].concat()
}

/// Largest difference of two motions.
fn apart(one: &[Twist<f64>], two: &[Twist<f64>]) -> f64 {
    let numbers = |twist: &Twist<f64>| [twist.angular.to_array(), twist.linear.to_array()].concat();
    let pairs = one.iter().zip(two).flat_map(|(a, b)| numbers(a).into_iter().zip(numbers(b)).collect::<Vec<_>>());
    pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

#[test]
fn interpolated_deflection_is_the_second_order_of_exact_geometry() -> Result<()> {
    let (length, marks) = (0.8, [0.3, 0.8]);
    for deforms in [&[BendingY][..], &[BendingX, BendingY], &[BendingX, BendingY, Torsion], &ALL] {
        let bent = Beam::new(&entry(Level::Deflection(4), deforms, length, [0.02, 0.01]), &marks)?;
        let exact = Beam::new(&entry(Level::Strain(5), &ALL, length, [0.02, 0.01]), &marks)?;
        let (n, m) = (bent.len(), exact.len());
        let direction = Random::new(5).numbers(n, 1.0);
        let difference = |size: f64| -> Result<f64> {
            let q: Vec<f64> = direction.iter().map(|x| x * size).collect();
            let c = projected(&bent, &q, 5, length)?;
            let (mut here, mut there) = (bent.sections(), exact.sections());
            // Rates along the coordinates themselves, so that twists and accelerations are compared at the same order.
            bent.motion(&q, &q, &mut here);
            exact.motion(&c, &c, &mut there);
            let mut most = 0.0_f64;
            for i in 0..marks.len() {
                let (a, b) = (here.at[bent.mark(i)], there.at[exact.mark(i)]);
                for (a, b) in pose(a.pose).into_iter().zip(pose(b.pose)) {
                    most = most.max((a - b).abs());
                }
                most = most.max(apart(&[a.twist, a.acceleration], &[b.twist, b.acceleration]));
            }
            Ok(most)
        };
        assert_eq!(m, 30);
        let [coarse, fine] = [difference(0.02)?, difference(0.01)?];
        let order = (coarse / fine).log2();
        assert!(order > 2.9, "{deforms:?}: order {order}, from {coarse:e} to {fine:e}");
    }
    Ok(())
}

#[test]
fn bases_of_one_kinematics_agree() -> Result<()> {
    // Beyond convergence a basis is a choice of words: the same sag under gravity and a tip load, stiff enough to stay small.
    let deforms = [BendingX, BendingY, Torsion, ShearX, ShearY, Extension];
    let sag = |level, deforms: &[Component], moment| -> Result<[f64; 3]> {
        let beam = entry(level, deforms, 0.8, [0.02, 0.01]);
        let load = Load { force: [30.0, 40.0, 500.0], moment };
        tip(&beam, &equilibrium(&beam, &load, &Root::resting(GRAVITY), 1)?)
    };
    let moment = [3.0, 2.0, 9.0];
    let exact = sag(Level::Deflection(8), &deforms, moment)?;
    for (level, tolerance) in [(Level::Deflection(5), 1e-9), (Level::Hermite(8), 1e-6), (Level::Hermite(16), 2e-7)] {
        let found = sag(level, &deforms, moment)?;
        let error = (0..3).fold(0.0_f64, |most, k| most.max((found[k] - exact[k]).abs()));
        assert!(error < tolerance, "{level:?}: {error:e}");
    }
    // What modes leave out of the sag under a force goes with the third power of their number.
    let shear_rigid = sag(Level::Deflection(8), &[BendingX, BendingY, Torsion], [0.0; 3])?;
    let error = |count| -> Result<f64> {
        let found = sag(Level::Modal(count), &[BendingX, BendingY, Torsion], [0.0; 3])?;
        Ok((0..3).fold(0.0_f64, |most, k| most.max((found[k] - shear_rigid[k]).abs())))
    };
    let [two, six] = [error(2)?, error(6)?];
    assert!(two < 1e-3 && six < 0.1 * two, "{two:e} {six:e}");
    Ok(())
}

#[test]
fn all_levels_have_the_mass_of_the_rigid_beam() -> Result<()> {
    let taper = |level, deforms: &[Component]| {
        let mut beam = entry(level, deforms, 0.8, [0.02, 0.01]);
        beam.sections.push(SectionEntry::new(0.5, Shape::Rectangle { width: 0.012, height: 0.008 }));
        beam.sections.push(SectionEntry::new(0.8, Shape::Rectangle { width: 0.01, height: 0.008 }));
        beam
    };
    let whole = |level, deforms: &[Component]| -> Result<Vec<f64>> {
        let beam = Beam::new(&taper(level, deforms), &[0.8])?;
        let (n, mut out) = (beam.len(), beam.sections());
        beam.motion(&vec![0.0; n], &vec![0.0; n], &mut out);
        let mut sum = SpatialInertia::zero();
        for (station, at) in out.at.iter().enumerate() {
            sum += at.pose.inertia(beam.inertia(station));
        }
        Ok([&[sum.mass][..], &sum.first_moment.to_array(), &sum.rotational.to_array()].concat())
    };
    // Two frustums with linear sizes, integrated by hand: m = rho int (a + b s)(c + d s) ds.
    let frustum = |l: f64, [a0, a1]: [f64; 2], [b0, b1]: [f64; 2]| {
        l * (a0 * b0 + 0.5 * (a0 * (b1 - b0) + b0 * (a1 - a0)) + (a1 - a0) * (b1 - b0) / 3.0)
    };
    let volume = frustum(0.5, [0.02, 0.012], [0.01, 0.008]) + frustum(0.3, [0.012, 0.01], [0.008, 0.008]);
    let rigid = whole(Level::Rigid, &[])?;
    assert!((rigid[0] / (7850.0 * volume) - 1.0).abs() < 1e-14, "{}", rigid[0]);
    for level in
        [Level::Strain(2), Level::Elements(3), Level::Bezier(3), Level::Hermite(2), Level::Modal(1), Level::Lumped(5)]
    {
        near(&whole(level, &[BendingX, BendingY])?, &rigid, 1e-12);
    }
    Ok(())
}
