//! Bezier centrelines are a basis: the linear matrices of the deflection they interpolate, the geometry of the strain they span.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use vpm_core::beam::quadrature::gauss;
use vpm_core::beam::witness::linear::{LinearBeam, Plane, Theory, TipBody};
use vpm_core::beam::{Basis, Beam, Component, Level, Section, Shape};
use vpm_core::samples::Random;
use vpm_core::{Error, Result};

use crate::common::entries;
use crate::common::sums;
use entries::{ALL, entry};
use sums::{Load, Root, bias, mass};

use Component::{BendingX, BendingY, Extension, ShearX, Torsion};

const LENGTH: f64 = 0.8;
const SIZES: [f64; 2] = [0.02, 0.01];

/// Mixes of components: one bending has the closed map of the plane, the others the exponentials of space.
const MIXES: [&[Component]; 6] =
    [&[BendingX], &[BendingY], &[BendingY, ShearX], &[BendingX, BendingY, Torsion], &[Torsion, Extension], &ALL];

/// Legendre coefficients of strain of a beam with `count` of them for each component of `deforms`, per coordinate of `from`.
///
/// Law: `c_k = (2k + 1) / L int P_k e dmu`, P the shifted Legendre polynomials, which are orthogonal.
fn change_of_basis(from: &Beam<f64>, deforms: &[Component], count: usize) -> Result<DMatrix<f64>> {
    let legendre = Basis::legendre(LENGTH, count)?;
    let mut change = DMatrix::zeros(deforms.len() * count, from.len());
    for coordinate in 0..from.len() {
        let mut unit = vec![0.0; from.len()];
        unit[coordinate] = 1.0;
        for at in gauss(count + 8, 0.0, LENGTH) {
            let (row, strain) = (legendre.evaluate(at.place, 0), from.strain(at.place, &unit));
            for (place, &component) in deforms.iter().enumerate() {
                for (k, value) in row.iter().enumerate() {
                    let factor = at.weight * (2 * k + 1) as f64 / LENGTH;
                    change[(place * count + k, coordinate)] += factor * value * strain[component as usize];
                }
            }
        }
    }
    Ok(change)
}

fn square(n: usize, rows: &[f64]) -> DMatrix<f64> {
    DMatrix::from_row_slice(n, n, rows)
}

/// Largest difference over the largest entry.
fn apart(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    (found - expected).amax() / expected.amax()
}

/// Coordinates of any Bezier beam whose strains turn the tip by about a radian: random control points, scaled.
fn bent(beam: &Beam<f64>, seed: u64) -> Vec<f64> {
    let q = Random::new(seed).numbers(beam.len(), 1.0);
    let mean = |q: &[f64]| {
        let points = gauss(12, 0.0, LENGTH);
        let strains = points.iter().map(|at| at.weight * beam.strain(at.place, q).map(f64::abs).iter().sum::<f64>());
        strains.sum::<f64>()
    };
    let scale = 1.0 / mean(&q);
    q.iter().map(|x| x * scale).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Mass matrix, Coriolis and centrifugal terms with gravity, stiffness and poses are those of Legendre coefficients that span all of the
    /// strains: exactly theirs for one bending or none, a part of theirs where bending has one coefficient less than the others.
    #[test]
    fn same_strains_are_the_same_beam(degree in 2_usize..=8, mix in 0_usize..MIXES.len(), seed in 0_u64..1000) {
        let deforms = MIXES[mix];
        let bends = deforms.iter().all(|part| matches!(part, BendingX | BendingY));
        let count = if bends { degree - 1 } else { degree };
        let bezier = Beam::new(&entry(Level::Bezier(degree), deforms, LENGTH, SIZES), &[0.3, LENGTH])?;
        let strain = Beam::new(&entry(Level::Strain(count), deforms, LENGTH, SIZES), &[0.3, LENGTH])?;
        prop_assert_eq!(bezier.stations(), strain.stations());
        let change = change_of_basis(&bezier, deforms, count)?;
        let q = DVector::from_vec(bent(&bezier, seed));
        let v = DVector::from_vec(bent(&bezier, seed + 1));
        let (c, c_rate) = (&change * &q, &change * &v);
        let (mut here, mut there) = (bezier.sections(), strain.sections());
        bezier.motion(q.as_slice(), v.as_slice(), &mut here);
        strain.motion(c.as_slice(), c_rate.as_slice(), &mut there);
        for (a, b) in here.at.iter().zip(&there.at) {
            let gap = a.pose.translation - b.pose.translation;
            prop_assert!(gap.dot(gap).sqrt() < 1e-12);
        }
        let congruent = |matrix: &[f64]| change.transpose() * square(strain.len(), matrix) * &change;
        let [own, other] = [mass(&bezier, &here), mass(&strain, &there)];
        let error = apart(&square(bezier.len(), &own), &congruent(&other));
        prop_assert!(error < 1e-12, "mass {error:e}");
        let error = apart(&square(bezier.len(), bezier.stiffness()), &congruent(strain.stiffness()));
        prop_assert!(error < 1e-12, "stiffness {error:e}");
        let root = Root::turning([0.3, -2.0, 1.0], [0.1, 0.0, 0.2]);
        let load = Load { force: [3.0, -20.0, 5.0], moment: [1.0, 2.0, 0.5] };
        let own = DVector::from_vec(bias(&bezier, q.as_slice(), v.as_slice(), &root, &load));
        let other = change.transpose() * DVector::from_vec(bias(&strain, c.as_slice(), c_rate.as_slice(), &root, &load));
        let error = (&own - &other).amax() / own.amax();
        prop_assert!(error < 1e-11, "bias {error:e}");
    }

    /// A straight beam is that of the deflection of second order, entry by entry: the coordinates are its control points. The mass is
    /// integrated with other stations, exact for both but for the closed map of the plane, whose angle is exact up to its fifth degree.
    #[test]
    fn straight_it_has_the_matrices_of_its_deflection(degree in 2_usize..=12, mix in 0_usize..MIXES.len()) {
        let [bezier, second] =
            [Level::Bezier(degree), Level::Deflection(degree)].map(|level| Beam::new(&entry(level, MIXES[mix], LENGTH, SIZES), &[]));
        let (bezier, second) = (bezier?, second?);
        prop_assert_eq!(bezier.len(), second.len());
        prop_assert_eq!(bezier.stiffness(), second.stiffness());
        let error = apart(&square(bezier.len(), &bezier.mass()), &square(second.len(), &second.mass()));
        prop_assert!(error < if degree > 6 { 1e-5 } else { 1e-9 }, "{error:e}");
        let rest = vec![0.0; bezier.len()];
        prop_assert!(bezier.slope(&rest).is_none() && second.slope(&rest) == Some(0.0));
    }
}

#[test]
fn frequencies_of_low_degrees_are_those_of_the_polynomial() -> Result<()> {
    // Ritz's method with the same polynomials of the deflection and consistent rotary inertia: an independent integration.
    let section = Section::new(Shape::Rectangle { width: SIZES[0], height: SIZES[1] }, entries::STEEL)?;
    for degree in 2..=8 {
        let found = Beam::new(&entry(Level::Bezier(degree), &[BendingX], LENGTH, SIZES), &[])?.modes()?.frequencies;
        let basis = Basis::bernstein(LENGTH, degree, 2)?;
        let ritz = LinearBeam::new(&section, Plane::Y, basis, Theory::Rayleigh, TipBody::default())?.modes(None)?;
        assert_eq!(found.len(), degree - 1);
        for (found, expected) in found.iter().zip(&ritz.frequencies) {
            let tolerance = if degree > 6 { 1e-5 } else { 1e-9 };
            assert!((found / expected - 1.0).abs() < tolerance, "degree {degree}: {found} {expected}");
        }
    }
    Ok(())
}

#[test]
fn a_control_point_moves_the_tip_by_as_much() -> Result<()> {
    // The last control point of a Bezier curve is its end; what is of second order in the deflection is as small as its square.
    let beam = Beam::new(&entry(Level::Bezier(4), &[BendingY, Torsion], LENGTH, SIZES), &[LENGTH])?;
    let (mut q, mut out) = (vec![0.0; beam.len()], beam.sections());
    (q[2], q[6]) = (1e-6, 2e-6);
    beam.motion(&q, &vec![0.0; q.len()], &mut out);
    let tip = out.at[beam.mark(0)].pose;
    assert!((tip.translation.x - 1e-6).abs() < 1e-11, "{}", tip.translation.x);
    assert!((tip.rotation.columns[0].y - 2e-6).abs() < 1e-11, "{}", tip.rotation.columns[0].y);
    Ok(())
}

#[test]
fn degrees_out_of_range_are_refused() {
    for (level, what) in [(Level::Bezier(1), "a Bezier centreline"), (Level::Deflection(13), "the deflection")] {
        let refused = Beam::new(&entry(level, &[BendingY], LENGTH, SIZES), &[]);
        let told = matches!(&refused, Err(Error::Domain { condition, .. }) if condition.contains(what));
        assert!(told, "{:?}", refused.err());
    }
}
