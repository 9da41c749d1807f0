//! The map from coordinates to sections at every level: Jacobian and acceleration are the derivatives of the poses.

use vpm_core::beam::{Beam, BeamEntry, Component, Level};
use vpm_core::samples::Random;
use vpm_core::spatial::{Pose, Twist, Vector3};
use vpm_core::{Dual, Result};

#[path = "common/entries.rs"]
mod entries;
use entries::{ALL, entry, lift};

use Component::{BendingX, BendingY, Extension, Torsion};

/// Beams of all levels, with all that they can do.
fn levels() -> Vec<BeamEntry<f64>> {
    let mut all = Vec::new();
    for level in
        [Level::Strain(3), Level::Elements(2), Level::Bezier(3), Level::Hermite(2), Level::Modal(2), Level::Lumped(3)]
    {
        for deforms in [&[BendingX][..], &[BendingY], &[BendingX, BendingY, Torsion], &[Torsion, Extension], &ALL] {
            all.push(entry(level, deforms, 0.8, [0.02, 0.01]));
        }
    }
    all.push(entry(Level::Rigid, &[], 0.8, [0.02, 0.01]));
    all
}

/// `R^T dR/dt` as a vector and `R^T dr/dt`, from a pose that carries its time derivative.
fn velocity(pose: &Pose<Dual<f64, 1>>) -> Twist<f64> {
    let value = |v: Vector3<Dual<f64, 1>>| Vector3::from(v.to_array().map(|number| number.value));
    let rate = |v: Vector3<Dual<f64, 1>>| Vector3::from(v.to_array().map(|number| number.gradient[0]));
    let [x, y, z] = pose.rotation.columns;
    let angular = Vector3::new(value(z).dot(rate(y)), value(x).dot(rate(z)), value(y).dot(rate(x)));
    let [a, b, c] = [x, y, z].map(|axis| value(axis).dot(rate(pose.translation)));
    Twist::new(angular, Vector3::new(a, b, c))
}

fn parts(twist: Twist<f64>) -> [f64; 6] {
    let [[a, b, c], [d, e, f]] = [twist.angular, twist.linear].map(Vector3::to_array);
    [a, b, c, d, e, f]
}

fn same(found: Twist<f64>, expected: Twist<f64>, what: &str) {
    for (found, expected) in parts(found).into_iter().zip(parts(expected)) {
        assert!((found - expected).abs() < 1e-10 * (1.0 + expected.abs()), "{what}: {found} is not {expected}");
    }
}

#[test]
fn columns_and_twists_are_the_derivatives_of_poses() -> Result<()> {
    let mut random = Random::new(3);
    for entry in levels() {
        let what = format!("{:?} {:?}", entry.level, entry.deforms);
        let marks = [0.0, 0.31, 0.8];
        let (beam, moving) = (Beam::new(&entry, &marks)?, Beam::new(&lift::<Dual<f64, 1>>(&entry), &marks)?);
        let (n, mut out, mut change) = (beam.len(), beam.sections(), moving.sections());
        let [q, v] = [0.3, 1.0].map(|size| random.numbers(n, size));
        beam.motion(&q, &v, &mut out);
        for k in 0..=n {
            // Along coordinate k, and last along the motion itself.
            let rate = |i: usize| if k == n { v[i] } else { f64::from(u8::from(i == k)) };
            let along: Vec<_> = (0..n).map(|i| Dual { value: q[i], gradient: [rate(i)] }).collect();
            moving.motion(&along, &vec![Dual::constant(0.0); n], &mut change);
            for (station, at) in change.at.iter().enumerate() {
                let found = if k == n { out.at[station].twist } else { out.columns[station * n + k] };
                same(found, velocity(&at.pose), &what);
            }
        }
    }
    Ok(())
}

#[test]
fn accelerations_are_the_derivatives_of_twists() -> Result<()> {
    let mut random = Random::new(4);
    for entry in levels() {
        let what = format!("{:?} {:?}", entry.level, entry.deforms);
        let (beam, moving) = (Beam::new(&entry, &[0.8])?, Beam::new(&lift::<Dual<f64, 1>>(&entry), &[0.8])?);
        let (n, mut out, mut change) = (beam.len(), beam.sections(), moving.sections());
        let [q, v] = [0.3, 1.0].map(|size| random.numbers(n, size));
        beam.motion(&q, &v, &mut out);
        let along: Vec<_> = (0..n).map(|i| Dual { value: q[i], gradient: [v[i]] }).collect();
        let rates: Vec<_> = v.iter().map(|&v| Dual::constant(v)).collect();
        moving.motion(&along, &rates, &mut change);
        for (at, change) in out.at.iter().zip(&change.at) {
            let rate = |v: Vector3<Dual<f64, 1>>| Vector3::from(v.to_array().map(|number| number.gradient[0]));
            same(at.acceleration, Twist::new(rate(change.twist.angular), rate(change.twist.linear)), &what);
        }
    }
    Ok(())
}

#[test]
fn motions_allocate_nothing() -> Result<()> {
    for entry in levels() {
        let beam = Beam::new(&entry, &[0.8])?;
        let (n, mut out, gauge) = (beam.len(), beam.sections(), beam.gauge(0.3));
        let (q, v) = (vec![0.1; n], vec![0.2; n]);
        let counted = allocation_counter::measure(|| {
            beam.motion(&q, &v, &mut out);
            std::hint::black_box((gauge.strain(&q), beam.slope(&q)));
        });
        assert_eq!(counted.count_total, 0, "{:?}", entry.level);
    }
    Ok(())
}
