//! Whole machines with elastic beams: energy, derivatives, rest, vibrations, prescribed motion, what is refused.

use serde_json::json;
use vpm_core::beam::{Component, Level, Properties, Shape};
use vpm_core::description::Description;
use vpm_core::evaluate;
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::motion::JointMotion;
use vpm_core::mount::{Gauge, Marker, Mount};
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::simulate::{Run, Setting, Stepping, free_run, prescribed};
use vpm_core::spatial::Matrix3;
use vpm_core::system::Build;
use vpm_core::table::Table;
use vpm_core::{Dual, Error, Result};

use crate::common::trees::{UPRIGHT, beam, body, description, everything, parameter, push, section};

/// One joint on the world, one beam on it that bends both ways and twists, gravity along -z.
fn arm(level: Level) -> Parts<f64> {
    let random = &mut Random::new(5);
    let deforms = [Component::BendingX, Component::BendingY, Component::Torsion];
    let mut parts = Parts { gravity: [0.0, 0.0, -9.81], ..Parts::default() };
    parts.bodies.push(body(random, "hub", Mount::World, JointKind::Revolute));
    parts.beams.push(beam(random, "link", Mount::Body(0), level, &deforms));
    let tip = section(&parts, 0, 1.0);
    parts.bodies.push(body(random, "hand", tip, JointKind::Revolute));
    parts.bodies[1].joint.axis = [0.0, 1.0, 0.0];
    parts.markers.push(Marker { name: "tip".into(), on: tip, translation: [0.0, 0.1, 0.2], rotation: UPRIGHT });
    parts.gauges.push(Gauge { name: "strip".into(), beam: 0, at: 0.1, x: 0.003, y: 0.005 });
    parts
}

fn free(
    d: &Description,
    theta: &[f64],
    (start, rows): (&[f64], usize),
    stepping: Stepping,
    by: &[usize],
) -> Result<Run> {
    let inputs = vec![0.0; rows * d.n_actuators()];
    let setting = Setting { description: d, theta, stepping, sensitivities: by, interrupt: &|| false };
    free_run(setting, start, Table::new("inputs", &inputs, rows, d.n_actuators())?)
}

fn undamped(parts: &mut Parts<f64>) {
    for beam in &mut parts.beams {
        beam.damping = vpm_core::beam::DampingEntry::default();
    }
}

#[test]
fn free_motion_conserves_energy() -> Result<()> {
    let mut parts = everything(3);
    undamped(&mut parts);
    let d = description(&parts, |_| ());
    let n = d.n_coordinates();
    let random = &mut Random::new(1);
    let start: Vec<f64> = [random.numbers(5, 1.0), random.numbers(n - 5, 0.001), random.numbers(n, 0.1)].concat();
    let total = |state: &[f64]| -> Result<f64> {
        let (kinetic, potential) = evaluate::energy(&d, &d.parameters, &state[..n], &state[n..2 * n])?;
        Ok(kinetic + potential)
    };
    let drift = |substeps: usize| -> Result<f64> {
        let run = free(&d, &d.parameters, (&start, 11), Stepping::new(0.01, substeps, Method::Rk4)?, &[])?;
        Ok((total(&run.states[10 * 2 * n..])? - total(&start)?).abs())
    };
    let (coarse, fine) = (drift(400)?, drift(800)?);
    assert!(fine < 1e-5, "{coarse} J and {fine} J");
    assert!(fine < coarse / 12.0, "the drift must shrink as the step to the fourth power: {coarse} J and {fine} J");
    Ok(())
}

#[test]
fn iteration_matrix_of_a_beam_at_rest_is_the_jacobian() -> Result<()> {
    let mut parts = arm(Level::Strain(2));
    parts.gravity = [0.0; 3];
    let d = description(&parts, |content| {
        let [stiffness, rest, viscous, gain, time] = [("k", 3.0), ("r", 0.1), ("c", 0.4), ("g", 2.0), ("t", 0.05)]
            .map(|(name, value)| parameter(content, name, value));
        push(content, "effects", json!({"type": "spring", "joint": 1, "stiffness": stiffness, "rest": rest}));
        push(content, "effects", json!({"type": "viscous_friction", "joint": 0, "viscous": viscous}));
        let actuator =
            json!({"name": "motor", "on": {"joint": 1}, "drive": {"type": "ideal", "gain": gain}, "lag": time});
        push(content, "actuators", actuator);
    });
    let mut system = d.system::<f64>(&d.parameters)?;
    let mut x = vec![0.0; system.dim()];
    x[1] = 0.1;
    let size = x.len();
    let (mut exact, mut found) = (vec![0.0; size * size], vec![0.0; size * size]);
    system.jacobian(&x, &mut exact);
    system.iteration_matrix(&x, &mut found);
    let scale = exact.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    for (place, (found, exact)) in found.iter().zip(&exact).enumerate() {
        assert!((found - exact).abs() < 1e-11 * scale, "{} {}: {found} {exact}", place / size, place % size);
    }
    let n = d.n_coordinates();
    let mut block = vec![0.0; 2 * n * n];
    assert!(system.elasticity(&x, &mut block));
    assert!((block[2 * 2 * n + 3] - found[(n + 2) * size + 3]).abs() < 1e-11 * scale);
    Ok(())
}

#[test]
fn markers_move_as_their_jacobian_says() -> Result<()> {
    let d = description(&everything(8), |_| ());
    const N: usize = 13;
    let theta: Vec<_> = d.parameters.iter().map(|&value| Dual::<f64, N>::constant(value)).collect();
    let mut dynamics = Build::dynamics(&&d, &theta)?;
    let q = Random::new(4).numbers(N, 0.3);
    let mut x: Vec<Dual<f64, N>> = (0..N).map(|k| Dual::variable(q[k], k)).collect();
    x.resize(2 * N, Dual::constant(0.0));
    let (mut rate, mut outputs) = (x.clone(), vec![Dual::constant(0.0); d.n_outputs()]);
    dynamics.rhs(&x, &mut rate);
    dynamics.observe(&x, &rate, &mut outputs);
    for marker in 0..3 {
        let jacobian = evaluate::marker_jacobian(&d, &d.parameters, &q, marker)?;
        let first = d.layout().markers() + 6 * marker;
        for axis in 0..3 {
            for k in 0..N {
                let (found, expected) = (jacobian[(3 + axis) * N + k], outputs[first + axis].gradient[k]);
                assert!((found - expected).abs() < 1e-12, "{marker} {axis} {k}: {found} {expected}");
            }
        }
    }
    Ok(())
}

#[test]
fn poses_of_markers_are_their_outputs() -> Result<()> {
    let d = description(&everything(8), |_| ());
    let n = d.n_coordinates();
    let q = Random::new(4).numbers(2 * n, 0.3);
    let poses = evaluate::marker_poses(&d, &d.parameters, Table::new("positions", &q, 2, n)?)?;
    let mut dynamics = Build::dynamics(&&d, &d.parameters)?;
    assert!(!d.markers.is_empty());
    for (q, row) in q.chunks_exact(n).zip(poses.chunks_exact(12 * d.markers.len())) {
        let mut outputs = vec![0.0; d.n_outputs()];
        dynamics.observe_motion(&[q, &vec![0.0; n]].concat(), &mut outputs);
        for (pose, seen) in row.chunks_exact(12).zip(outputs[d.layout().markers()..].chunks_exact(6)) {
            let angles =
                Matrix3::from_rows_f64(pose[3..].try_into().expect("nine numbers")).rotation_vector().to_array();
            for (found, expected) in pose[..3].iter().chain(&angles).zip(seen) {
                assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            }
        }
    }
    Ok(())
}

#[test]
fn sensitivities_are_slopes() -> Result<()> {
    let parts = arm(Level::Bezier(3));
    let d = description(&parts, |_| ());
    let by: Vec<usize> =
        d.parameter_names.iter().enumerate().filter(|(_, name)| name.starts_with("link")).map(|(k, _)| k).collect();
    assert!(by.len() >= 7, "{:?}", d.parameter_names);
    let start = vec![0.01; d.n_states()];
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let stepping = Stepping::new(0.01, 4, method)?;
        let run = free(&d, &d.parameters, (&start, 6), stepping, &by)?;
        for (lane, &place) in by.iter().enumerate() {
            let mut theta = d.parameters.clone();
            let step = 1e-6 * theta[place].abs();
            let mut at = |sign: f64| {
                theta[place] = d.parameters[place] + sign * step;
                free(&d, &theta, (&start, 6), stepping, &[])
            };
            let (up, down) = (at(1.0)?, at(-1.0)?);
            // Relative changes of the parameter, so that all slopes are of one size.
            let pairs = up.outputs.iter().zip(&down.outputs).zip(&run.outputs);
            for (output, ((up, down), value)) in pairs.enumerate() {
                let (expected, found) =
                    ((up - down) / 2e-6, run.jacobian[output * by.len() + lane] * d.parameters[place]);
                assert!(
                    (found - expected).abs() < 2e-6 * (1.0 + expected.abs() + value.abs()),
                    "{} of output {output}: {found} {expected}",
                    d.parameter_names[place]
                );
            }
        }
    }
    Ok(())
}

/// A steel strip along x that bends in the vertical plane, clamped to a joint about y at the origin.
fn strip(level: Level) -> Parts<f64> {
    let mut parts = arm(level);
    parts.bodies.truncate(1);
    parts.bodies[0].joint.translation = [0.0; 3];
    parts.bodies[0].joint.rotation = UPRIGHT;
    parts.bodies[0].joint.axis = [0.0, 1.0, 0.0];
    let link = &mut parts.beams[0];
    // z along x of the world, x along -z of it: bending about y is a turn about y.
    link.translation = [0.0; 3];
    link.rotation = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0];
    (link.length, link.deforms) = (0.44, vec![Component::BendingY]);
    link.material = Some(vpm_core::beam::Material { young: 210e9, poisson: 0.3, density: 7850.0 });
    link.sections[0].shape = Shape::Rectangle { width: 0.004, height: 0.015 };
    let tip = section(&parts, 0, 1.0);
    parts.markers[0] = Marker { name: "tip".into(), on: tip, translation: [0.0; 3], rotation: UPRIGHT };
    parts
}

#[test]
fn a_clamped_strip_vibrates_as_the_closed_form_says() -> Result<()> {
    // Roots of cos x cosh x + 1 = 0; the rotary inertia of the sections takes off 1e-4 of the third.
    let expected = [17.262_739_554_629_76, 108.183_742_120_604_65, 302.917_610_514_694_5];
    for level in [Level::Strain(6), Level::Elements(12), Level::Hermite(8), Level::Bezier(9), Level::Modal(4)] {
        let mut parts = strip(level);
        parts.gravity = [0.0; 3];
        let found = evaluate::natural_frequencies(
            &description(&parts, |_| ()),
            &description(&parts, |_| ()).parameters,
            &[0.3],
        )?;
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-3, "{level:?}: {found} Hz, {expected} Hz");
        }
    }
    Ok(())
}

#[test]
fn a_heavy_strip_hangs_as_the_elastica_does() -> Result<()> {
    // rho A g L^3 / EI = 13: a converged solution by another beam.
    let mut parts = strip(Level::Strain(8));
    let stiffness = 13.0 * 16.8 / (7850.0 * 0.015 * 0.004 * 0.44_f64.powi(3));
    parts.gravity = [0.0, 0.0, -stiffness];
    let d = description(&parts, |_| ());
    let (coordinates, efforts) = evaluate::equilibrium(&d, &d.parameters, &[0.0])?;
    let mut system = d.system::<f64>(&d.parameters)?;
    let mut x = coordinates;
    x.resize(d.n_states(), 0.0);
    let (mut rate, mut outputs) = (x.clone(), vec![0.0; d.n_outputs()]);
    system.rhs(&x, &mut rate);
    system.dynamics().observe(&x, &rate, &mut outputs);
    let tip = &outputs[d.layout().markers()..];
    let (found, expected) = ([tip[0] / 0.44, tip[2] / 0.44], [0.573_885_661_304_281_6, -0.759_134_668_477_014_4]);
    assert!((found[0] - expected[0]).abs() < 1e-6 && (found[1] - expected[1]).abs() < 1e-6, "{found:?}");
    // Held joints carry the moment of the weight, found here from the acceleration that its efforts undo.
    let found =
        evaluate::accelerations(&d, &d.parameters, &x[..d.n_coordinates()], &vec![0.0; d.n_coordinates()], &efforts)?;
    assert!(found.iter().all(|a| a.abs() < 1e-4 * stiffness), "{found:?}");
    assert!(evaluate::slopes(&d, &d.parameters, Table::new("states", &x, 1, x.len())?)?[0].is_nan());
    Ok(())
}

#[test]
fn slopes_are_those_of_beams_with_interpolated_deflection() -> Result<()> {
    let d = description(&strip(Level::Deflection(3)), |_| ());
    let mut x = vec![0.0; d.n_states()];
    assert_eq!(evaluate::slopes(&d, &d.parameters, Table::new("states", &x, 1, x.len())?)?, [0.0]);
    x[1] = 0.1;
    assert!(evaluate::slopes(&d, &d.parameters, Table::new("states", &x, 1, x.len())?)?[0] > 0.01);
    Ok(())
}

/// Position, velocity and acceleration of joints over time, row by row.
fn guided(d: &Description, stepping: Stepping, motion: &[Vec<f64>; 3], by: &[usize]) -> Result<Run> {
    let (joints, rows) = (d.n_joints(), motion[0].len() / d.n_joints());
    let table = |k: usize| Table::new("motion", &motion[k], rows, joints);
    let setting = Setting { description: d, theta: &d.parameters, stepping, sensitivities: by, interrupt: &|| false };
    prescribed(setting, JointMotion { position: table(0)?, velocity: table(1)?, acceleration: table(2)? }, &[])
}

#[test]
fn prescribed_motion_needs_the_efforts_that_cause_it() -> Result<()> {
    // A free run from rest of the beams, with friction, gives the motion; following it needs no efforts.
    let parts = arm(Level::Strain(2));
    let d = description(&parts, |content| {
        let viscous = parameter(content, "viscous", 0.1);
        push(content, "effects", json!({"type": "viscous_friction", "joint": 0, "viscous": viscous}));
    });
    let (n, stepping) = (d.n_coordinates(), Stepping::new(0.005, 4, Method::Rosenbrock)?);
    let mut start = evaluate::equilibrium(&d, &d.parameters, &[0.2, -0.3])?.0;
    start.resize(2 * n, 0.0);
    let run = free(&d, &d.parameters, (&start, 61), stepping, &[])?;
    let column = |offset: usize| -> Vec<f64> {
        run.outputs.chunks(d.n_outputs()).flat_map(|row| [row[offset], row[4 + offset]]).collect()
    };
    let motion = [column(0), column(1), column(2)];
    let followed = guided(&d, stepping, &motion, &[])?;
    let efforts = followed.outputs.chunks(d.n_outputs()).flat_map(|row| [row[3], row[7]]);
    let worst = efforts.fold(0.0_f64, |most, effort| most.max(effort.abs()));
    let state = followed.states.iter().zip(&run.states).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    assert!(worst < 2e-3 && state < 1e-3, "{worst} N m, state {state}");
    let swing = motion[0].iter().fold(0.0_f64, |most, q| most.max((q - 0.2).abs()));
    assert!(swing > 0.5, "it must move: {swing} rad");
    Ok(())
}

#[test]
fn sensitivities_of_prescribed_motion_are_slopes() -> Result<()> {
    let d = description(&arm(Level::Strain(1)), |_| ());
    let stepping = Stepping::new(0.01, 4, Method::LinearlyImplicit)?;
    let rows: Vec<f64> = (0..8).map(f64::from).collect();
    let of =
        |f: &dyn Fn(f64) -> f64| -> Vec<f64> { rows.iter().flat_map(|k| [f(0.01 * k), -0.5 * f(0.01 * k)]).collect() };
    let motion = [of(&|t| 0.4 + (5.0 * t).sin()), of(&|t| 5.0 * (5.0 * t).cos()), of(&|t| -25.0 * (5.0 * t).sin())];
    let by: Vec<usize> = (0..d.n_parameters()).filter(|&k| d.parameter_names[k].starts_with("link")).collect();
    let run = guided(&d, stepping, &motion, &by)?;
    let moved = |place: usize, sign: f64| {
        let mut other = d.clone();
        other.parameters[place] *= 1.0 + sign * 1e-6;
        guided(&other, stepping, &motion, &[])
    };
    for (lane, &place) in by.iter().enumerate() {
        let (up, down) = (moved(place, 1.0)?, moved(place, -1.0)?);
        for (output, (up, down)) in up.outputs.iter().zip(&down.outputs).enumerate() {
            let (expected, found) = ((up - down) / 2e-6, run.jacobian[output * by.len() + lane] * d.parameters[place]);
            assert!((found - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{place} {output}: {found} {expected}");
        }
    }
    Ok(())
}

#[test]
fn spin_up_follows_two_other_codes() -> Result<()> {
    // Parameters of Simo & Vu-Quoc; converged by a spectral beam and two general codes.
    let (span, speed) = (15.0, 6.0);
    let mut parts = strip(Level::Strain(4));
    parts.gravity = [0.0; 3];
    parts.bodies[0].joint.axis = [0.0, -1.0, 0.0];
    let link = &mut parts.beams[0];
    (link.length, link.deforms) = (10.0, vec![Component::BendingY, Component::ShearX, Component::Extension]);
    link.material = Some(vpm_core::beam::Material { young: 2.8e7, poisson: 0.3, density: 1.2 });
    let shear = 1e7 / (2.8e7 / 2.6);
    let (moment_x, moment_y, torsion) = (5e-4, 5e-4, 1e-3);
    link.sections[0].shape =
        Shape::Given(Properties { area: 1.0, moment_x, moment_y, torsion, shear_x: shear, shear_y: shear });
    link.damping = vpm_core::beam::DampingEntry::default();
    parts.gauges.clear();
    parts.markers[0].on = section(&parts, 0, 1.0);
    let d = description(&parts, |_| ());
    let wave = std::f64::consts::TAU / span;
    let motion = |t: f64| {
        let (sine, cosine) = (wave * t).sin_cos();
        [t * t / 2.0 + (cosine - 1.0) / wave / wave, t - sine / wave, 1.0 - cosine].map(|part| part * speed / span)
    };
    let samples: Vec<[f64; 3]> = (0..=1350).map(|k| motion(0.005 * f64::from(k))).collect();
    let of = |k: usize| samples.iter().map(|sample| sample[k]).collect::<Vec<_>>();
    let run = guided(&d, Stepping::new(0.005, 1, Method::Rosenbrock)?, &[of(0), of(1), of(2)], &[])?;
    // Axial and transverse displacement of the tip in the turning frame.
    for (time, axial, across) in
        [(0.25, -7.82e-10, -0.000_119_341_154), (1.0, -2.436_34e-5, -0.020_543_535), (6.75, f64::NAN, -0.573_827_169_6)]
    {
        let row = (time / 0.005_f64).round() as usize;
        let tip = &run.outputs[row * d.n_outputs() + d.layout().markers()..];
        let (sine, cosine) = samples[row][0].sin_cos();
        let found = [tip[0] * cosine + tip[2] * sine - 10.0, tip[2] * cosine - tip[0] * sine];
        assert!((found[1] - across).abs() < 2e-4, "{time}: {found:?}");
        assert!(axial.is_nan() || (found[0] - axial).abs() < 2e-4, "{time}: {found:?}");
    }
    Ok(())
}

#[test]
fn a_falling_pendulum_follows_two_other_codes() -> Result<()> {
    let mut parts = strip(Level::Strain(8));
    let link = &mut parts.beams[0];
    link.length = 1.0;
    link.material = Some(vpm_core::beam::Material { young: 1e8, poisson: 0.3, density: 1100.0 });
    link.sections[0].shape = Shape::Rectangle { width: 0.01, height: 0.02 };
    link.damping = vpm_core::beam::DampingEntry::default();
    // Hanging on a massless carrier: all inertia is the beam's.
    parts.bodies[0].inertia = None;
    parts.bodies[0].joint.axis = [0.0, -1.0, 0.0];
    parts.gauges.clear();
    parts.markers[0].on = section(&parts, 0, 1.0);
    let d = description(&parts, |_| ());
    let run =
        free(&d, &d.parameters, (&vec![0.0; d.n_states()], 4), Stepping::new(0.1, 400, Method::Rosenbrock)?, &[])?;
    for (row, x, y) in [
        (1, 0.996_345_981_779_966, -0.044_736_973_304_761_79),
        (2, 0.961_211_027_577_790_1, -0.226_004_912_870_181_12),
        (3, 0.806_274_615_887_900_3, -0.588_439_205_451_452_2),
    ] {
        let tip = &run.outputs[row * d.n_outputs() + d.layout().markers()..];
        assert!((tip[0] - x).abs() < 1e-4 && (tip[2] - y).abs() < 1e-4, "{row}: {} {}", tip[0], tip[2]);
    }
    Ok(())
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let parts = arm(Level::Strain(1));
    let refused = |change: &dyn Fn(&mut Parts<f64>)| {
        let mut parts = parts.clone();
        change(&mut parts);
        vpm_core::model::Model::<f64>::assemble(parts).map(|_| ()).unwrap_err()
    };
    let ring = refused(&|p| p.bodies[0].on = Mount::Section { beam: 0, at: 0.2 });
    assert_eq!(ring, Error::Loop { names: vec!["hub".into(), "link".into()] });
    assert!(ring.to_string().contains("`hub`, `link` hang on each other"));
    let outside = refused(&|p| p.markers[0].on = Mount::Section { beam: 0, at: 2.0 }).to_string();
    assert!(outside.contains("marker `tip` sits on beam `link` at 2 m"), "{outside}");
    let unknown = refused(&|p| p.bodies[1].on = Mount::Section { beam: 3, at: 0.2 }).to_string();
    assert!(unknown.contains("joint `hand.joint` refers to beam number 3"), "{unknown}");
    let idle = refused(&|p| p.bodies[1].inertia = None);
    assert_eq!(idle, Error::Carrier { body: "hand".into() });
    let d = description(&parts, |_| ());
    let zeros = vec![0.0; 2];
    let table = Table::new("motion", &zeros, 1, 2).unwrap();
    let none = Table::new("inputs", &[], 1, 0).unwrap();
    let motion = Motion { position: table, velocity: table, acceleration: table, inputs: none, time_step: 0.01 };
    let refused = inverse_dynamics(&d, &d.parameters, motion, &[], &|| false).unwrap_err().to_string();
    assert!(refused.contains("elastic beam `link`") && refused.contains("prescribed"), "{refused}");
}
