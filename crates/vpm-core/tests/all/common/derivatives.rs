//! Derivatives of maps from coordinates to sections, by numbers that carry one.

use vpm_core::Dual;
use vpm_core::beam::Beam;
use vpm_core::samples::Random;
use vpm_core::spatial::{Pose, Twist, Vector3};

fn rate(v: Vector3<Dual<f64, 1>>) -> Vector3<f64> {
    Vector3::from(v.to_array().map(|number| number.gradient[0]))
}

/// `R^T dR/dt` as a vector and `R^T dr/dt`, from a pose that carries its time derivative.
fn velocity(pose: &Pose<Dual<f64, 1>>) -> Twist<f64> {
    let value = |v: Vector3<Dual<f64, 1>>| Vector3::from(v.to_array().map(|number| number.value));
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

/// Columns and twists of a beam are the derivatives of its poses, and its accelerations those of its twists, at random coordinates and rates.
/// `moving` is the same beam over numbers that carry a derivative.
pub fn are_those_of_poses(beam: &Beam<f64>, moving: &Beam<Dual<f64, 1>>, random: &mut Random, what: &str) {
    let (n, mut out, mut change) = (beam.len(), beam.sections(), moving.sections());
    let [q, v] = [0.3, 1.0].map(|size| random.numbers(n, size));
    beam.motion(&q, &v, &mut out);
    // Along each coordinate, and last along the motion itself.
    for k in 0..=n {
        let step = |i: usize| if k == n { v[i] } else { f64::from(u8::from(i == k)) };
        let along: Vec<_> = (0..n).map(|i| Dual { value: q[i], gradient: [step(i)] }).collect();
        let rates: Vec<_> = v.iter().map(|&v| Dual::constant(if k == n { v } else { 0.0 })).collect();
        moving.motion(&along, &rates, &mut change);
        for (station, at) in change.at.iter().enumerate() {
            let found = if k == n { out.at[station].twist } else { out.columns[station * n + k] };
            same(found, velocity(&at.pose), what);
            if k == n {
                same(out.at[station].acceleration, Twist::new(rate(at.twist.angular), rate(at.twist.linear)), what);
            }
        }
    }
}
