//! Textbook machines with known equations of motion, and the models that must be refused.

use std::f64::consts::{FRAC_PI_2, PI};

use vpm_core::body::{Body, Inertia, PointMass, Site};
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, check_regular, crba, energy, kinematics, rnea};
use vpm_core::joint::JointKind;
use vpm_core::model::Model;
use vpm_core::mount::Mount;
use vpm_core::samples::{self, GRAVITY, Random, Sample};
use vpm_core::spatial::{Twist, Vector3};
use vpm_core::{Dual, Error, Result};

fn close(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance * (1.0 + expected.abs())
}

fn accelerations(sample: &Sample, q: &[f64], v: &[f64], tau: &[f64]) -> Result<Vec<f64>> {
    let model = sample.model::<f64>()?;
    Ok(aba(&model, &mut Data::new(&model), q, v, tau).to_vec())
}

#[test]
fn slider_is_newton() -> Result<()> {
    let slider = samples::slider(2.5);
    let model = slider.model::<f64>()?;
    let mut data = Data::new(&model);
    assert_eq!(aba(&model, &mut data, &[0.3], &[4.0], &[10.0]), [4.0]);
    assert_eq!(rnea(&model, &mut data, &[0.3], &[4.0], &[4.0]), [10.0]);
    assert_eq!(crba(&model, &mut data, &[0.3]), [2.5]);
    Ok(())
}

#[test]
fn tilted_slider_feels_its_share_of_gravity() -> Result<()> {
    let (mut slider, tilt) = (samples::slider(2.5), 0.4_f64);
    slider.gravity = GRAVITY;
    slider.bodies[0].joint.axis = [tilt.cos(), 0.0, tilt.sin()];
    let found = accelerations(&slider, &[0.0], &[1.0], &[0.0])?;
    assert!(close(found[0], GRAVITY[2] * tilt.sin(), 1e-14));
    Ok(())
}

#[test]
fn pendulum_accelerates_as_in_the_textbook() -> Result<()> {
    let (mass, length) = (1.3, 0.7);
    let pendulum = samples::pendulum(mass, length);
    for q in [-2.0, -0.1, 0.0, 0.5, 3.0] {
        let found = accelerations(&pendulum, &[q], &[1.5], &[0.8])?;
        let expected = 0.8 / (mass * length * length) + GRAVITY[2] / length * q.sin();
        assert!(close(found[0], expected, 1e-13), "{q}: {} {expected}", found[0]);
    }
    Ok(())
}

/// One Runge-Kutta step of a one-coordinate model without effort.
fn step(model: &Model<f64>, data: &mut Data<f64>, [q, v]: [f64; 2], h: f64) -> [f64; 2] {
    let mut rate = |[q, v]: [f64; 2]| [v, aba(model, data, &[q], &[v], &[0.0])[0]];
    let k1 = rate([q, v]);
    let k2 = rate([q + 0.5 * h * k1[0], v + 0.5 * h * k1[1]]);
    let k3 = rate([q + 0.5 * h * k2[0], v + 0.5 * h * k2[1]]);
    let k4 = rate([q + h * k3[0], v + h * k3[1]]);
    let mean = |i: usize| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0;
    [q + h * mean(0), v + h * mean(1)]
}

#[test]
fn pendulum_period_is_the_elliptic_integral() -> Result<()> {
    // T = 2 pi sqrt(l/g) / agm(1, cos(A/2)) (Gauss); a quarter period after the turning point the pendulum hangs down.
    const STEPS: usize = 2000;
    let (length, amplitude) = (0.7, 2.5_f64);
    let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
    }
    let period = 2.0 * PI * (length / -GRAVITY[2]).sqrt() / a;
    let model = samples::pendulum(1.3, length).model::<f64>()?;
    let mut data = Data::new(&model);
    let mut state = [amplitude, 0.0];
    for _ in 0..STEPS {
        state = step(&model, &mut data, state, 0.25 * period / STEPS as f64);
    }
    assert!(state[0].abs() < 1e-10, "{state:?}");
    Ok(())
}

#[test]
fn payload_adds_its_moment_of_inertia() -> Result<()> {
    let (mass, length, payload, at) = (1.3, 0.7, 0.4, 0.9);
    let sample = samples::pendulum(mass, length);
    let point = PointMass { on: Site::Body(0), mass: payload, position: [0.0, 0.0, -at] };
    let model = Model::new(sample.gravity, &sample.bodies, &[point])?;
    let found = aba(&model, &mut Data::new(&model), &[0.6], &[0.0], &[0.0])[0];
    let inertia = mass * length * length + payload * at * at;
    let expected = GRAVITY[2] * (mass * length + payload * at) * 0.6_f64.sin() / inertia;
    assert!(close(found, expected, 1e-13));
    Ok(())
}

#[test]
fn double_pendulum_follows_goldstein() -> Result<()> {
    let ([m1, m2], [l1, l2], g) = ([1.3, 0.8], [0.7, 0.45], -GRAVITY[2]);
    let sample = samples::double_pendulum([m1, m2], [l1, l2]);
    let mut random = Random::new(1);
    for _ in 0..50 {
        let ([a1, a2], [w1, w2]) =
            ([3.0 * random.symmetric(), 3.0 * random.symmetric()], [random.symmetric(), 2.0 * random.unit()]);
        // In absolute angles: [ (m1+m2) l1, m2 l2 c; l1 c, l2 ] [a1''; a2''] = right-hand side, c and s of a1 - a2.
        let (s, c) = (a1 - a2).sin_cos();
        let right1 = -m2 * l2 * w2 * w2 * s - (m1 + m2) * g * a1.sin();
        let right2 = l1 * w1 * w1 * s - g * a2.sin();
        let determinant = (m1 + m2) * l1 * l2 - m2 * l2 * c * l1 * c;
        let first = (right1 * l2 - m2 * l2 * c * right2) / determinant;
        let second = ((m1 + m2) * l1 * right2 - l1 * c * right1) / determinant;
        let found = accelerations(&sample, &[a1, a2 - a1], &[w1, w2 - w1], &[0.0, 0.0])?;
        assert!(close(found[0], first, 1e-12), "{} {first}", found[0]);
        assert!(close(found[1], second - first, 1e-12), "{} {}", found[1], second - first);
    }
    Ok(())
}

/// The inertia of a body that has one.
fn inertia_of(body: &mut Body<f64>) -> &mut Inertia<f64> {
    body.inertia.get_or_insert_default()
}

/// A turntable about z (inertia kg m^2) that carries a radial slider (kg) along its x axis.
fn polar(inertia: f64, mass: f64) -> Sample {
    let mut sample = samples::slider(mass);
    let mut table = sample.bodies[0].clone();
    table.name = "table".to_owned();
    table.joint.kind = JointKind::Revolute;
    table.joint.axis = [0.0, 0.0, 1.0];
    inertia_of(&mut table).moments = [0.5 * inertia, 0.5 * inertia, inertia, 0.0, 0.0, 0.0];
    sample.bodies[0].on = Mount::Body(0);
    sample.bodies.insert(0, table);
    sample
}

#[test]
fn polar_slider_has_coriolis_and_centrifugal_force() -> Result<()> {
    // (I + m r^2) th'' + 2 m r r' th' = tau, m r'' - m r th'^2 = F.
    let (inertia, mass) = (0.6, 1.7);
    let (r, [turn, slide], [tau, force]) = (0.4, [2.0, -0.9], [3.0, 1.1]);
    let found = accelerations(&polar(inertia, mass), &[0.3, r], &[turn, slide], &[tau, force])?;
    let angular = (tau - 2.0 * mass * r * slide * turn) / (inertia + mass * r * r);
    assert!(close(found[0], angular, 1e-13) && close(found[1], force / mass + r * turn * turn, 1e-13), "{found:?}");
    Ok(())
}

#[test]
fn body_reaches_where_its_frames_lead() -> Result<()> {
    // Table turned by a quarter: the slider at radius r stands on the y axis and moves sideways along -x.
    let model = polar(0.6, 1.7).model::<f64>()?;
    let mut data = Data::new(&model);
    kinematics(&model, &mut data, &[FRAC_PI_2, 0.4], &[2.0, 0.0]);
    let (pose, twist) = data.pose(1).zip(data.twist(1)).unwrap_or_default();
    let velocity = pose.rotation * twist.linear;
    let near = |found: Vector3<f64>, expected: [f64; 3]| {
        found.to_array().iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-15)
    };
    assert!(near(pose.translation, [0.0, 0.4, 0.0]) && near(velocity, [-0.8, 0.0, 0.0]), "{pose:?} {twist:?}");
    Ok(())
}

#[test]
fn joint_motion_is_the_derivative_of_the_joint_pose() {
    for body in samples::random_tree(7, 10).bodies {
        let pose = body.joint.pose(Dual::<f64, 1>::variable(0.7, 0));
        let motion: Twist<f64> = body.joint.motion();
        // X' = X [V]x: the columns turn with w, the origin moves with v, both seen in the body.
        let rate = pose.translation.to_array().map(|number| number.gradient[0]);
        let turned = body.joint.pose(0.7).rotation * motion.linear;
        assert!(turned.to_array().iter().zip(rate).all(|(a, b)| (a - b).abs() < 1e-14));
        for (column, unit) in pose.rotation.columns.into_iter().zip([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        {
            let expected = body.joint.pose(0.7).rotation * motion.angular.cross(Vector3::from(unit));
            let found = column.to_array().map(|number| number.gradient[0]);
            assert!(expected.to_array().iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-14));
        }
    }
}

#[test]
fn potential_energy_is_height_times_weight() -> Result<()> {
    let model = samples::pendulum(2.0, 0.5).model::<f64>()?;
    let found = energy(&model, &mut Data::new(&model), &[PI / 3.0], &[3.0]);
    assert!(close(found.potential, 2.0 * GRAVITY[2] * 0.5 * 0.5, 1e-14));
    assert!(close(found.kinetic, 0.5 * 2.0 * 0.25 * 9.0, 1e-14));
    Ok(())
}

/// The error of building a changed pendulum, judged up to the check of its joint inertias.
fn refusal(change: impl FnOnce(&mut Sample)) -> Result<()> {
    let mut sample = samples::double_pendulum([1.0, 1.0], [0.5, 0.5]);
    change(&mut sample);
    let model = sample.model::<f64>()?;
    check_regular(&model, &mut Data::new(&model))
}

#[test]
fn unphysical_bodies_are_refused_with_numbers() {
    assert_eq!(refusal(|_| ()), Ok(()));
    assert_eq!(
        refusal(|s| inertia_of(&mut s.bodies[1]).moments = [1.0, 1.0, 2.0, 0.0, 0.0, 0.0]),
        Ok(()),
        "a thin plate is physical"
    );
    assert_eq!(
        refusal(|s| inertia_of(&mut s.bodies[0]).mass = 0.0),
        Err(Error::Mass { body: "upper".into(), mass: 0.0 })
    );
    let refused = refusal(|s| inertia_of(&mut s.bodies[1]).moments = [1.0, 1.0, 2.1, 0.0, 0.0, 0.0]);
    assert_eq!(refused, Err(Error::Inertia { body: "lower".into(), moments: [1.0, 1.0, 2.1] }));
    let refused = refusal(|s| inertia_of(&mut s.bodies[1]).moments = [1.0, 1.0, 1.0, 1.5, 0.0, 0.0]);
    assert!(matches!(refused, Err(Error::Inertia { moments: [low, ..], .. }) if close(low, -0.5, 1e-14)));
    let refused = refusal(|s| inertia_of(&mut s.bodies[0]).center_of_mass[1] = f64::INFINITY);
    assert_eq!(refused, Err(Error::NonFinite { path: "upper.center_of_mass.y".into(), value: f64::INFINITY }));
}

#[test]
fn bad_geometry_is_refused_with_numbers() {
    let refused = refusal(|s| s.bodies[1].on = Mount::Body(1));
    assert_eq!(refused, Err(Error::Loop { names: vec!["lower".into()] }));
    let refused = refusal(|s| s.bodies[0].on = Mount::Body(1));
    assert_eq!(refused, Err(Error::Loop { names: vec!["upper".into(), "lower".into()] }));
    let refused = refusal(|s| s.bodies[1].joint.axis = [0.0, 2.0, 0.0]);
    assert_eq!(refused, Err(Error::Axis { joint: "elbow".into(), axis: [0.0, 2.0, 0.0], length: 2.0 }));
    assert_eq!(refusal(|s| s.bodies[1].joint.axis = [0.0, 1.0005, 0.0]), Ok(()), "rounded axes are normalised");
    let refused = refusal(|s| s.bodies[1].joint.rotation[0] = -1.0);
    assert_eq!(refused, Err(Error::Rotation { joint: "elbow".into(), defect: 0.0, determinant: -1.0 }));
    assert!(matches!(refusal(|s| s.gravity[2] = f64::NAN), Err(Error::NonFinite { path, .. }) if path == "gravity.z"));
}

#[test]
fn joints_without_inertia_are_refused() {
    let refused = refusal(|s| inertia_of(&mut s.bodies[1]).center_of_mass = [0.0; 3]);
    assert!(matches!(refused, Err(Error::SingularJoint { joint, .. }) if joint == "elbow"));
    // Two bodies on one axis: each joint alone moves inertia, both together do not.
    let coaxial = refusal(|s| {
        inertia_of(&mut s.bodies[0]).center_of_mass = [0.0; 3];
        s.bodies[1].joint.translation = [0.0; 3];
    });
    assert!(matches!(coaxial, Err(Error::SingularJoint { joint, .. }) if joint == "shoulder"));
}

#[test]
fn payloads_must_leave_a_physical_body() {
    let sample = samples::pendulum(1.0, 0.5);
    let build = |body, mass, position| {
        Model::new(sample.gravity, &sample.bodies, &[PointMass { on: Site::Body(body), mass, position }])
            .map(|model| model.n_joints())
    };
    assert_eq!(build(0, 0.5, [0.1, 0.2, 0.3]), Ok(1));
    assert_eq!(build(0, -0.5, [0.0, 0.0, -0.5]), Ok(1), "less mass in the same point");
    assert_eq!(build(2, 0.5, [0.0; 3]), Err(Error::PayloadBody { payload: 0, body: 2, bodies: 1 }));
    assert_eq!(build(0, -1.5, [0.0; 3]), Err(Error::Mass { body: "bob".into(), mass: -0.5 }));
    assert!(matches!(build(0, -0.5, [0.0, 0.0, 0.1]), Err(Error::Inertia { .. })), "mass taken where there is none");
    assert!(
        matches!(build(0, 0.5, [0.0, f64::NAN, 0.1]), Err(Error::NonFinite { path, .. }) if path == "bob.payload.y")
    );
}

#[test]
fn messages_are_one_sentence_with_numbers_and_repair() {
    let error = Error::Mass { body: "upper".into(), mass: -1.0 };
    let expected =
        "`upper.mass` must be positive with all payloads included, got -1 kg; give every body the mass it moves with";
    assert_eq!(error.to_string(), expected);
}
