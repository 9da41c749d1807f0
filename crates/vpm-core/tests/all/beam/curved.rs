//! Beams that are curved and twisted where nothing loads them.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use nalgebra::{DMatrix, DVector};
use vpm_core::Result;
use vpm_core::beam::{
    Beam, BeamEntry, Component, Level, Material, Properties, RestEntry, SectionEntry, Sections, Shape,
};

use Component::{BendingX, BendingY, Torsion};

use crate::common::entries::entry;

/// What a slender link may do.
const SLENDER: [Component; 3] = [BendingX, BendingY, Torsion];

/// A beam of that level and constant curvature.
fn arc(level: Level, length: f64, curvature: [f64; 3]) -> BeamEntry<f64> {
    let mut beam = entry(level, &SLENDER, length, [0.02, 0.01]);
    beam.rest = vec![RestEntry { at: 0.0, curvature }];
    beam
}

fn moved(beam: &Beam<f64>, q: &[f64]) -> Sections<f64> {
    let mut sections = beam.sections();
    beam.motion(q, &vec![0.0; q.len()], &mut sections);
    sections
}

/// The tip, and its displacement along the axes of the root per unit of each coordinate.
fn tip(beam: &Beam<f64>, q: &[f64]) -> ([f64; 3], DMatrix<f64>) {
    let (sections, n, station) = (moved(beam, q), beam.len(), beam.mark(0));
    let pose = sections.at[station].pose;
    let column = |k: usize| (pose.rotation * sections.columns[station * n + k].linear).to_array();
    (pose.translation.to_array(), DMatrix::from_fn(3, n, |row, k| column(k)[row]))
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() < tolerance * expected.abs().max(1e-300), "{what}: {found} is not {expected}");
}

const LEVELS: [Level; 6] =
    [Level::Rigid, Level::Lumped(7), Level::Strain(3), Level::Elements(5), Level::Bezier(4), Level::Lumped(1)];

#[test]
fn every_level_rests_on_the_same_arc() -> Result<()> {
    let radius = 0.5;
    for level in LEVELS {
        let mut entry = arc(level, radius * FRAC_PI_2, [1.0 / radius, 0.0, 0.0]);
        if level == Level::Rigid {
            entry.deforms.clear();
        }
        let beam = Beam::new(&entry, &[entry.length])?;
        let sections = moved(&beam, &vec![0.0; beam.len()]);
        let pose = sections.at[beam.mark(0)].pose;
        for (found, expected) in pose.translation.to_array().into_iter().zip([0.0, -radius, radius]) {
            assert!((found - expected).abs() < 1e-13, "{level:?}: {pose:?}");
        }
        // Mass and centre of an arc: 2 r / pi on each side.
        let total =
            sections.at.iter().enumerate().fold(vpm_core::spatial::SpatialInertia::zero(), |mut sum, (k, at)| {
                sum += at.pose.inertia(beam.inertia(k));
                sum
            });
        let centre = total.center_of_mass().to_array();
        let expected = [0.0, -radius + 2.0 * radius / PI, 2.0 * radius / PI];
        for (found, expected) in centre.into_iter().zip(expected) {
            assert!((found - expected).abs() < 2e-6, "{level:?}: {centre:?}");
        }
    }
    Ok(())
}

#[test]
fn a_twisted_beam_is_straight_and_turns_its_sections() -> Result<()> {
    for level in LEVELS {
        let mut entry = arc(level, 0.8, [0.0, 0.0, 2.0]);
        if level == Level::Rigid {
            entry.deforms.clear();
        }
        let beam = Beam::new(&entry, &[0.8])?;
        let pose = moved(&beam, &vec![0.0; beam.len()]).at[beam.mark(0)].pose;
        let [_, y, _] = (pose.rotation * vpm_core::spatial::Vector3::new(1.0, 0.0, 0.0)).to_array();
        assert!((y - 1.6_f64.sin()).abs() < 1e-13 && (pose.translation.z - 0.8).abs() < 1e-13, "{level:?}");
    }
    Ok(())
}

#[test]
fn linear_curvature_is_a_clothoid() -> Result<()> {
    // y' = -sin(a s^2 / 2), z' = cos(a s^2 / 2): Fresnel's integrals, here by Simpson's rule.
    let (length, slope) = (1.0, 2.0);
    let mut entry = arc(Level::Lumped(3), length, [0.0; 3]);
    entry.rest.push(RestEntry { at: length, curvature: [slope * length, 0.0, 0.0] });
    let beam = Beam::new(&entry, &[length])?;
    let found = moved(&beam, &vec![0.0; beam.len()]).at[beam.mark(0)].pose.translation;
    let steps = 2000;
    let simpson = |f: &dyn Fn(f64) -> f64| {
        let weight = |k: usize| if k == 0 || k == steps { 1.0 } else { [2.0, 4.0][k % 2] };
        (0..=steps).map(|k| weight(k) * f(length * k as f64 / steps as f64)).sum::<f64>() * length / (3 * steps) as f64
    };
    let turn = |s: f64| 0.5 * slope * s * s;
    assert!((found.y + simpson(&|s| turn(s).sin())).abs() < 1e-9, "{found:?}");
    assert!((found.z - simpson(&|s| turn(s).cos())).abs() < 1e-9, "{found:?}");
    // The strain levels integrate the same with an error of fourth order in their stations, here 8 and 16.
    let error = |level: Level| -> Result<f64> {
        let beam = Beam::new(&BeamEntry { level, ..entry.clone() }, &[length])?;
        let other = moved(&beam, &vec![0.0; beam.len()]).at[beam.mark(0)].pose.translation;
        Ok((other - found).dot(other - found).sqrt())
    };
    let (coarse, fine) = (error(Level::Strain(4))?, error(Level::Strain(12))?);
    assert!(coarse < 1e-4 && (coarse / fine).log2() > 3.5, "{coarse} {fine}");
    Ok(())
}

/// Flexibility of the tip of a quarter of a circle along x, y and z of the root.
fn quarter(level: Level) -> Result<[f64; 3]> {
    let beam = Beam::new(&arc(level, FRAC_PI_2, [1.0, 0.0, 0.0]), &[FRAC_PI_2])?;
    let n = beam.len();
    let (_, columns) = tip(&beam, &vec![0.0; n]);
    let moved = DMatrix::from_row_slice(n, n, beam.stiffness()).lu().solve(&columns.transpose());
    let flexibility = columns * moved.unwrap_or_else(|| DMatrix::from_element(n, 3, f64::NAN));
    Ok([0, 1, 2].map(|k| flexibility[(k, k)]))
}

/// By Castigliano (Timoshenko 1955, "Strength of Materials" I, sections 79 and 80), R = 1: the bending moments `cos`, `1 - sin` in the
/// plane; across it `sin` and the torque `1 - cos`.
fn castigliano() -> Result<[f64; 3]> {
    let section =
        vpm_core::beam::Section::new(Shape::Rectangle { width: 0.02, height: 0.01 }, crate::common::entries::STEEL)?;
    let [about_x, about_y, torsion, ..] = section.stiffness;
    let steep = 3.0 * FRAC_PI_4 - 2.0;
    Ok([FRAC_PI_4 / about_y + steep / torsion, steep / about_x, FRAC_PI_4 / about_x])
}

#[test]
fn a_quarter_circle_gives_way_as_castigliano_says() -> Result<()> {
    let expected = castigliano()?;
    // Poses are of fourth order in the turn from station to station, here up to 0.2 rad.
    for (level, tolerance) in [(Level::Strain(7), 2e-5), (Level::Bezier(8), 2e-5), (Level::Elements(30), 1e-3)] {
        for (found, expected) in quarter(level)?.into_iter().zip(expected) {
            close(found, expected, tolerance, &format!("{level:?}"));
        }
    }
    for level in [Level::Elements, Level::Lumped] {
        let [coarse, fine] = [quarter(level(12))?, quarter(level(24))?];
        for k in 0..3 {
            let errors = [&coarse, &fine].map(|found| (found[k] / expected[k] - 1.0).abs());
            assert!(errors[1] < 0.3 * errors[0] || errors[1] < 1e-5, "{:?} along {k}: {errors:?}", level(12));
        }
    }
    Ok(())
}

/// The tip under a force along x of the root that grows to `force`, by Newton's method with differences.
fn loaded(beam: &Beam<f64>, force: f64, steps: usize) -> [f64; 3] {
    let n = beam.len();
    let stiffness = DMatrix::from_row_slice(n, n, beam.stiffness());
    let missing = |q: &DVector<f64>, force: f64| {
        &stiffness * q - tip(beam, q.as_slice()).1.transpose() * DVector::from_vec(vec![force, 0.0, 0.0])
    };
    let mut q = DVector::zeros(n);
    for step in 1..=steps {
        let force = force * step as f64 / steps as f64;
        for _ in 0..12 {
            let here = missing(&q, force);
            let mut slope = DMatrix::zeros(n, n);
            for k in 0..n {
                let mut other = q.clone();
                other[k] += 1e-6;
                slope.set_column(k, &((missing(&other, force) - &here) / 1e-6));
            }
            let Some(change) = slope.lu().solve(&here) else { return [f64::NAN; 3] };
            q -= &change;
            if change.norm() < 1e-10 * (1e-3 + q.norm()) {
                break;
            }
        }
    }
    tip(beam, q.as_slice()).0
}

#[test]
fn the_bend_of_bathe_and_bolourchi_ends_where_others_say() -> Result<()> {
    // Bathe & Bolourchi 1979, "Large displacement analysis of three-dimensional beam structures", Int. J. Num. Meth. Eng. 14: 45 degrees of
    // radius 100, section 1 x 1, E = 1e7, no Poisson's ratio, 600 across the plane. The tip moves from (29.3, 70.7, 0); published: (15.9,
    // 47.2, 53.4) there, (15.79, 47.23, 53.37) by Simo & Vu-Quoc 1986, (15.7, 47.0, 53.5) by Cardona & Geradin 1988.
    for level in [Level::Strain(5), Level::Elements(16), Level::Bezier(6)] {
        let mut entry = arc(level, 100.0 * FRAC_PI_4, [0.01, 0.0, 0.0]);
        // All of them twist with the polar moment.
        let square = Properties {
            area: 1.0,
            moment_x: 1.0 / 12.0,
            moment_y: 1.0 / 12.0,
            torsion: 1.0 / 6.0,
            shear_x: 1.0,
            shear_y: 1.0,
        };
        entry.material = Some(Material { young: 1e7, poisson: 0.0, density: 1.0 });
        entry.sections = vec![SectionEntry::new(0.0, Shape::Given(square))];
        let beam = Beam::new(&entry, &[entry.length])?;
        let ([x, y, z], _) = tip(&beam, &vec![0.0; beam.len()]);
        assert!(x.abs() < 1e-9 && (y + 29.29).abs() < 0.01 && (z - 70.71).abs() < 0.01, "{x} {y} {z}");
        let [up, side, along] = loaded(&beam, 600.0, 4);
        let found = [-side, along, up];
        for (found, [least, most]) in found.into_iter().zip([[15.65, 15.95], [46.95, 47.25], [53.35, 53.55]]) {
            assert!((least..most).contains(&found), "{level:?}: {side} {along} {up}");
        }
    }
    Ok(())
}

#[test]
fn all_levels_vibrate_alike_on_a_twisted_arc() -> Result<()> {
    let frequencies = |level: Level| -> Result<Vec<f64>> {
        let beam = Beam::new(&arc(level, 1.0, [0.7, -0.4, 1.1]), &[])?;
        Ok(beam.modes()?.frequencies.iter().take(3).copied().collect())
    };
    let exact = frequencies(Level::Strain(10))?;
    for (level, tolerance) in [(Level::Bezier(9), 5e-6), (Level::Elements(20), 2e-3), (Level::Lumped(60), 2e-3)] {
        for (found, expected) in frequencies(level)?.into_iter().zip(&exact) {
            close(found, *expected, tolerance, &format!("{level:?}"));
        }
    }
    Ok(())
}

#[test]
fn a_curve_cut_out_of_a_polygon_of_straight_beams_is_the_same() -> Result<()> {
    // The curve at rest against the same curve as a deflection of a straight beam: one geometry, by two ways.
    let mut bent = entry(Level::Strain(4), &SLENDER, 0.8, [0.02, 0.01]);
    let straight = Beam::new(&bent, &[0.8])?;
    bent.rest = vec![RestEntry { at: 0.0, curvature: [0.9, -0.3, 0.5] }];
    let curved = Beam::new(&bent, &[0.8])?;
    // The first Legendre polynomial is one; the others add to it alike.
    let extra = [0.0, 0.1, -0.05, 0.02, 0.0, 0.05, 0.0, 0.01, 0.0, -0.1, 0.03, 0.0];
    let mut all = extra;
    for (k, curvature) in [0.9, -0.3, 0.5].into_iter().enumerate() {
        all[4 * k] += curvature;
    }
    let (here, there) = (moved(&curved, &extra), moved(&straight, &all));
    for (one, other) in here.at.iter().zip(&there.at) {
        let apart = one.pose.translation - other.pose.translation;
        assert!(apart.dot(apart).sqrt() < 1e-13, "{apart:?}");
    }
    for (one, other) in here.columns.iter().zip(&there.columns) {
        assert!((one.linear - other.linear).dot(one.linear - other.linear) < 1e-26);
    }
    Ok(())
}

#[test]
fn what_cannot_be_curved_is_refused() {
    let refused = |change: &dyn Fn(&mut BeamEntry<f64>)| {
        let mut beam = arc(Level::Strain(3), 0.8, [1.0, 0.0, 0.0]);
        change(&mut beam);
        Beam::new(&beam, &[]).map_or_else(|error| error.to_string(), |_| "no error".to_owned())
    };
    for level in [Level::Modal(2), Level::Deflection(4), Level::Hermite(3)] {
        let found = refused(&|beam| beam.level = level);
        assert!(found.starts_with("`arm.rest` must be straight and untwisted at levels"), "{found}");
    }
    let found = refused(&|beam| beam.rest.push(RestEntry { at: 0.0, curvature: [0.0; 3] }));
    assert!(found.starts_with("`arm.rest.1.at` must lie beyond"), "{found}");
    let found = refused(&|beam| beam.rest[0].curvature[1] = f64::NAN);
    assert!(found.starts_with("`arm.rest.0` must be a finite number"), "{found}");
    let linear = Beam::first_order(&arc(Level::Strain(3), 0.8, [1.0, 0.0, 0.0]), &[]);
    assert!(linear.is_err_and(|error| error.to_string().contains("second_order")));
}
