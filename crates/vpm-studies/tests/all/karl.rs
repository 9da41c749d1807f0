//! KARL, the limb with two linear actuators: every published and recomputed value, and three ways to assemble it.

use std::f64::consts::FRAC_PI_2;

use proptest::prelude::*;
use vpm_core::{Dual, Scalar};
use vpm_studies::Result;
use vpm_studies::algebra::{Conic, degree, resultant};
use vpm_studies::linkage::karl::{Karl, KarlGeometry, KarlPose};
use vpm_studies::linkage::{ClosedLinkage, LinkageMotion, Newton};
use vpm_studies::linkage::{acceleration, velocity};

use crate::values::check_all;

fn karl() -> Result<Karl> {
    Ok(Karl::new(KarlGeometry::default())?)
}

/// The mode that the prototype is built in: |q1| < 90 deg, q2 > 0.
fn built(poses: &[KarlPose]) -> Option<&KarlPose> {
    poses.iter().find(|pose| pose.angles[0].abs() < FRAC_PI_2 && pose.angles[1] > 0.0)
}

fn ascending_degrees(angles: [f64; 2]) -> Vec<f64> {
    let mut degrees = angles.map(f64::to_degrees).to_vec();
    degrees.sort_by(f64::total_cmp);
    degrees
}

/// How many of the poses differ from all before them.
fn distinct(poses: &[KarlPose]) -> f64 {
    let numbers = |pose: &KarlPose| [pose.angles, pose.strokes].concat();
    let apart = |a: &KarlPose, b: &KarlPose| numbers(a).iter().zip(numbers(b)).any(|(l, r)| (l - r).abs() > 1e-6);
    (0..poses.len()).filter(|&k| poses[..k].iter().all(|before| apart(before, &poses[k]))).count() as f64
}

#[test]
fn every_value_of_the_limb_is_met() {
    let (karl, geometry) = (karl().unwrap(), KarlGeometry::default());
    let [first, second] = karl.linkages();
    let mut found = vec![
        ("karl.alpha_deg", vec![geometry.stroke_direction.to_degrees()]),
        ("karl.L1", vec![geometry.medial]),
        ("karl.count.direct", vec![distinct(&karl.direct([0.20, 0.18]).unwrap())]),
        ("karl.sylvester_degree", vec![degree(&resultant(&first.polynomial(0.2), &Conic::CIRCLE)) as f64]),
    ];
    for (linkage, [extended, folded]) in [
        (first, [["outer", "outer.published"], ["inner", "inner.published"]]),
        (second, [["extended", "extended.published"], ["folded", "folded.published"]]),
    ] {
        let strokes: Vec<f64> = linkage.alignments().iter().map(|alignment| alignment.stroke).collect();
        let stroke = if linkage == first { 1 } else { 2 };
        for (names, pair) in [(extended, &strokes[..2]), (folded, &strokes[2..])] {
            for name in names {
                found.push((format!("karl.singular_delta{stroke}.{name}").leak(), pair.to_vec()));
            }
        }
    }
    for (strokes, name) in
        [([0.20, 0.18], "d1_200_d2_180"), ([0.21, 0.16], "d1_210_d2_160"), ([0.19, 0.22], "d1_190_d2_220")]
    {
        for (k, linkage) in karl.linkages().iter().enumerate() {
            let angles = ascending_degrees(linkage.angles(strokes[k]).unwrap());
            found.push((format!("karl.direct.{name}.q{}_deg", k + 1).leak(), angles));
        }
        found.push((
            format!("karl.lambda.{name}").leak(),
            karl.lambda(built(&karl.direct(strokes).unwrap()).unwrap()).to_vec(),
        ));
    }
    let target = karl.end_point([20.0_f64.to_radians(), FRAC_PI_2]);
    let poses = karl.inverse(target).unwrap();
    let rows = poses
        .iter()
        .flat_map(|pose| [pose.angles[0].to_degrees(), pose.angles[1].to_degrees(), pose.strokes[0], pose.strokes[1]]);
    found.push(("karl.inverse.target", target.to_vec()));
    found.push(("karl.inverse.solutions", rows.collect()));
    found.push(("karl.count.inverse", vec![distinct(&poses)]));
    let alignments = first.alignments();
    let span = first.span(&alignments[0], &alignments[2], 1.0).to_degrees();
    found.push(("karl.q1_span_between_singularities_deg", vec![span]));
    check_all("karl.", &found).unwrap();
}

/// Strokes between the singular ones, and the mode to look at.
fn strokes() -> impl Strategy<Value = ([f64; 2], usize)> {
    ((0.175..0.250, 0.135..0.245), 0..4_usize).prop_map(|((first, second), mode)| ([first, second], mode))
}

fn nearest(angle: f64, others: [f64; 2]) -> f64 {
    others.iter().map(|other| (angle - other).sin().abs().max(1.0 - (angle - other).cos())).fold(f64::MAX, f64::min)
}

proptest! {
    #[test]
    fn closed_form_resultant_and_newton_find_the_same_modes((strokes, mode) in strokes(), off in -0.1..0.1) {
        let karl = karl().unwrap();
        let pose = karl.direct(strokes).unwrap()[mode];
        for (k, linkage) in karl.linkages().iter().enumerate() {
            prop_assert!(linkage.constraint(strokes[k], pose.angles[k]).abs() < 1e-15);
            prop_assert!(nearest(pose.angles[k], linkage.angles_by_resultant(strokes[k]).unwrap()) < 1e-12);
            prop_assert!(linkage.strokes(pose.angles[k]).unwrap().iter().any(|stroke| (stroke - strokes[k]).abs() < 1e-12));
        }
        let found = Newton::default().solve(&karl, pose.angles.map(|angle| angle + off), &strokes).unwrap();
        prop_assert!(found.iterations <= 8, "{} steps", found.iterations);
        prop_assert!((0..2).all(|k| (found.q[k] - pose.angles[k]).abs() < 1e-11));
    }

    #[test]
    fn the_polynomial_is_the_constraint((strokes, _) in strokes(), angle in -3.0..3.0_f64) {
        for (linkage, stroke) in karl().unwrap().linkages().iter().zip(strokes) {
            let polynomial = linkage.polynomial(stroke).at(angle.cos(), angle.sin());
            prop_assert!((polynomial - linkage.constraint(stroke, angle)).abs() < 1e-15);
            // The rows of Psi and Omega by hand: dPi/d(c, s) and d(c^2 + s^2 - 1)/d(c, s).
            let pi = linkage.polynomial(stroke);
            let (c, s) = (angle.cos(), angle.sin());
            let determinant = (pi.c + 2.0 * pi.cc * c) * 2.0 * s - (pi.s + 2.0 * pi.ss * s) * 2.0 * c;
            prop_assert!((determinant - linkage.determinant(stroke, angle)).abs() < 1e-15);
        }
    }

    #[test]
    fn the_printed_determinants_are_those_of_the_linkages((strokes, mode) in strokes()) {
        let (karl, g) = (karl().unwrap(), KarlGeometry::default());
        let pose = karl.direct(strokes).unwrap()[mode];
        let ([q1, q2], (sine, cosine)) = (pose.angles, g.stroke_direction.sin_cos());
        let point = |k: usize| [strokes[k] * cosine + g.sliders[k][0], strokes[k] * sine + g.sliders[k][1]];
        let ([x, y], [ox, oy]) = (point(0), g.ground_anchor);
        let psi = 4.0 * (oy * q1.cos() - ox * q1.sin()) * x - 4.0 * (ox * q1.cos() + oy * q1.sin()) * y;
        let [x, y] = point(1);
        let omega = 4.0 * g.distal_anchor[0] * ((g.medial - x) * q2.sin() + y * q2.cos());
        let found = karl.determinants(&pose);
        prop_assert!((found[0] - psi).abs() < 1e-15 && (found[1] - omega).abs() < 1e-15);
    }

    #[test]
    fn lambda_is_the_velocity_of_the_constraints((strokes, mode) in strokes(), du in -1.0..1.0, forces in (-300.0..300.0, -600.0..600.0)) {
        let karl = karl().unwrap();
        let pose = karl.direct(strokes).unwrap()[mode];
        let lambda = karl.lambda(&pose);
        let rates = velocity(&karl, &pose.angles, &strokes, &[du, -du]).unwrap();
        prop_assert!((rates[0] - lambda[0] * du).abs() < 1e-10 && (rates[1] + lambda[1] * du).abs() < 1e-10);
        // Power is preserved: F . delta_dot = tau . q_dot.
        let torques = karl.torques(&pose, [forces.0, forces.1]);
        let power = [torques[0] * rates[0] - forces.0 * du, torques[1] * rates[1] + forces.1 * du];
        prop_assert!(power.iter().all(|left| left.abs() < 1e-9));
    }

    #[test]
    fn acceleration_is_that_of_the_closed_form((strokes, mode) in strokes(), v in -0.1..0.1, a in -0.5..0.5) {
        let karl = karl().unwrap();
        let at = |t: f64| karl.direct(strokes.map(|stroke| stroke + v * t + 0.5 * a * t * t)).unwrap()[mode].angles;
        let motion = LinkageMotion { q: strokes, v: [v; 2], a: [a; 2] };
        let found = acceleration(&karl, &at(0.0), &motion).unwrap();
        let h = 1e-4;
        for k in 0..2 {
            let turn = |t: f64| (at(t)[k] - at(0.0)[k] + 3.0).rem_euclid(std::f64::consts::TAU) - 3.0;
            // Second differences: rounding 1e-16/h^2 and h^2/12 times the fourth derivative.
            prop_assert!((((turn(h) + turn(-h)) / (h * h)) - found.a[k]).abs() < 2e-5 * (1.0 + found.a[k].abs()));
        }
    }

    #[test]
    fn every_inverse_solution_reaches_the_target(q1 in -0.3..0.8_f64, q2 in 0.8..1.9_f64) {
        let karl = karl().unwrap();
        let target = karl.end_point([q1, q2]);
        if let Ok(poses) = karl.inverse(target) {
            for pose in poses {
                let reached = karl.end_point(pose.angles);
                prop_assert!((reached[0] - target[0]).hypot(reached[1] - target[1]) < 1e-14);
                let left = karl.constraints(&pose.angles, &pose.strokes);
                prop_assert!(left.iter().all(|entry| entry.abs() < 1e-15));
            }
        }
    }
}

#[test]
fn alignments_are_the_zeros_of_the_determinants_whatever_the_direction_of_the_anchor() {
    for turn in [0.0_f64, 0.7, 1.9, 3.0] {
        let ground_anchor = [0.040 * turn.sin(), -0.040 * turn.cos()];
        let karl = Karl::new(KarlGeometry { ground_anchor, ..KarlGeometry::default() }).unwrap();
        for linkage in karl.linkages() {
            let alignments = linkage.alignments();
            assert_eq!(alignments.len(), 4);
            for alignment in &alignments {
                assert!(linkage.constraint(alignment.stroke, alignment.angle).abs() < 1e-15);
                assert!(linkage.determinant(alignment.stroke, alignment.angle).abs() < 1e-15);
            }
        }
        let first = &karl.linkages()[0];
        let [outer, _, inner, _] = first.alignments()[..] else { panic!("four alignments") };
        // The same sweep in the other mode turns the other way round; the span does not depend on where O lies.
        let spans = [1.0, -1.0].map(|mode| first.span(&outer, &inner, mode).to_degrees());
        assert!((spans[0] - 176.107_884_3).abs() < 1e-7 && (spans[0] - spans[1] - 360.0).abs() < 1e-12);
        let between = |k: i32| inner.stroke + (outer.stroke - inner.stroke) * f64::from(k) / 1000.0;
        let way = (1..1000).map(|k| first.angles(between(k)).unwrap()[0]);
        let angles: Vec<f64> = [inner.angle].into_iter().chain(way).chain([outer.angle]).collect();
        let turned: f64 = angles.windows(2).map(|pair| (pair[0] - pair[1]).sin().asin()).sum();
        assert!((turned.to_degrees() - spans[0]).abs() < 1e-9, "{turned} rad counted along the way");
    }
}

#[test]
fn the_end_point_determinant_is_that_of_its_jacobian() {
    // det dC/dq by dual numbers on eq 2.72.
    let (g, q) = (KarlGeometry::default(), [0.4, 1.3]);
    let [q1, q2]: [Dual<f64, 2>; 2] = std::array::from_fn(|k| Dual::variable(q[k], k));
    let x = q1.cos() * g.medial + (q1 + q2).cos() * g.distal;
    let y = q1.sin() * g.medial + (q1 + q2).sin() * g.distal;
    let determinant = x.gradient[0] * y.gradient[1] - x.gradient[1] * y.gradient[0];
    assert!((determinant - karl().unwrap().end_point_determinant(q)).abs() < 1e-16);
    assert!(
        (x.value - karl().unwrap().end_point(q)[0]).abs() < 1e-16
            && (y.value - karl().unwrap().end_point(q)[1]).abs() < 1e-16
    );
}
