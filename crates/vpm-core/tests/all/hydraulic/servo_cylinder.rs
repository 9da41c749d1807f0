//! The servo-cylinder against published values and closed forms.

use std::f64::consts::TAU;

use vpm_core::actuator::hydraulic::{EntrainedAir, Fluid, Orifice, ServoCylinder, ServoRig, ServoState};
use vpm_core::error::Error;
use vpm_core::integrator::{Adaptive, Integrator, Method};
use vpm_core::ode::Ode;

use crate::common::hydraulics::{Chirp, Chirped, nominal};
use crate::common::values;

type TestResult = Result<(), Box<dyn std::error::Error>>;

fn advance(ode: &mut impl Ode<f64>, x: &mut [f64], method: Method, time: f64, steps: usize) {
    let mut integrator = Integrator::new(method, x.len());
    for _ in 0..steps {
        integrator.step(ode, x, time / steps as f64);
    }
}

/// Pressures, position and velocity, in the order of the published values.
fn shown(x: &[f64]) -> Vec<f64> {
    vec![x[4], x[5], x[0], x[2]]
}

fn law_values(servo: &ServoCylinder<f64>) -> Vec<(String, Vec<f64>)> {
    let (cylinder, rest) = (&servo.cylinder, servo.rest());
    let (areas, gain) = (cylinder.areas(), servo.valve.orifice.gain);
    let stiffness = cylinder.oil_stiffness(&servo.fluid, rest.chambers, 0.0);
    let air = EntrainedAir { fraction: 0.005, exponent: 1.4, reference_pressure: 101_325.0 };
    let fluid = Fluid { air: Some(air), ..servo.fluid };
    let mut found: Vec<(String, Vec<f64>)> = [200, 1000, 5000, 7000, 16_000]
        .map(|kilo| (format!("hyd.beta_eff.{kilo}kPa"), vec![fluid.effective_bulk_modulus(1e3 * f64::from(kilo))]))
        .to_vec();
    let own = [
        ("hyd.area_ratio", vec![areas.b / areas.a]),
        ("hyd.Ap", vec![areas.a]),
        ("hyd.Kv", vec![gain]),
        ("hyd.Kv_normalised", vec![Orifice::rated_gain(7.5 / 60e3, 35e5, 1.0)]),
        ("hyd.initial_pressures", vec![rest.chambers.a, rest.chambers.b]),
        ("hyd.oil_stiffness", vec![stiffness]),
        ("hyd.natural_frequency", vec![(stiffness / servo.load.mass).sqrt() / TAU]),
    ];
    found.extend(own.map(|(name, numbers)| (name.to_owned(), numbers)));
    found
}

/// Pressures and velocity per current of a piston that nothing resists, by simulation until it moves steadily.
fn no_load(mut servo: ServoCylinder<f64>, current: f64) -> vpm_core::Result<Vec<f64>> {
    servo.load.damping = 0.0;
    servo.load.stiffness = 0.0;
    servo.cylinder.internal_leakage = 0.0;
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
    rig.current = current;
    advance(&mut rig, &mut x, Method::Rosenbrock, 0.15, 15_000);
    Ok(vec![x[4], x[5], x[2] / current])
}

fn step_values(servo: ServoCylinder<f64>) -> vpm_core::Result<Vec<(String, Vec<f64>)>> {
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
    let mut found = Vec::new();
    for ms in 1..=100 {
        rig.current = if ms <= 50 { 2e-3 } else { -2e-3 };
        advance(&mut rig, &mut x, Method::Rosenbrock, 1e-3, 100);
        if [1, 2, 5, 10, 20, 50, 51, 55, 60, 100].contains(&ms) {
            found.push((format!("hyd.H1.step.t{ms:03}ms"), shown(&x)));
        }
    }
    Ok(found)
}

fn published_chirp() -> Chirp {
    Chirp { amplitude: 0.5e-3, start: TAU, slope: 0.5 * (20.0 - 1.0) * TAU }
}

fn chirp_values(servo: ServoCylinder<f64>, steps_per_ms: usize) -> Vec<(String, Vec<f64>)> {
    let mut ode = Chirped::new(servo, published_chirp());
    let (mut x, mut before) = (ode.rest(), 0);
    [100, 200, 300, 500, 750, 1000, 1250, 1500, 1750, 2000]
        .map(|ms: usize| {
            advance(&mut ode, &mut x, Method::Rosenbrock, 1e-3 * (ms - before) as f64, (ms - before) * steps_per_ms);
            before = ms;
            (format!("hyd.H2.chirp.t{ms:04}ms"), shown(&x))
        })
        .to_vec()
}

#[test]
fn all_published_and_recomputed_values() -> TestResult {
    let servo = nominal();
    let (extend, retract) = (no_load(servo, 2e-3)?, no_load(servo, -2e-3)?);
    let ratio = extend[2] / retract[2];
    let mut found = law_values(&servo);
    found.push(("hyd.noload.extend".to_owned(), extend));
    found.push(("hyd.noload.retract".to_owned(), retract));
    found.push(("hyd.speed_ratio".to_owned(), vec![ratio]));
    found.extend(step_values(servo)?);
    found.extend(chirp_values(servo, 40));
    let found: Vec<(&str, Vec<f64>)> = found.iter().map(|(name, numbers)| (name.as_str(), numbers.clone())).collect();
    values::check_all("hyd.", &found)?;
    Ok(())
}

/// Largest error of the piston's place along the chirp, in m, at a number of steps per ms.
fn chirp_error(method: Method, per_second: usize) -> f64 {
    let mut fine = Chirped::new(nominal(), published_chirp());
    let (mut exact, mut x, mut worst) = (fine.rest(), fine.rest(), 0.0_f64);
    for _ in 0..50 {
        advance(&mut fine, &mut exact, Method::Rosenbrock, 0.02, 800);
        advance(&mut fine.clone(), &mut x, method, 0.02, per_second / 50);
        worst = worst.max((x[0] - exact[0]).abs());
    }
    worst
}

#[test]
fn a_chirp_in_steps_of_a_controller() {
    for (method, per_second, bound) in [
        (Method::LinearlyImplicit, 1000, 6e-7),
        (Method::Rosenbrock, 1000, 1e-7),
        (Method::LinearlyImplicit, 4000, 5e-8),
        (Method::Rosenbrock, 4000, 5e-9),
    ] {
        let error = chirp_error(method, per_second);
        println!("{} at {per_second} Hz: {error:.2e} m", method.name());
        assert!(error < bound, "{} at {per_second} Hz: {error} m", method.name());
    }
}

/// Largest error of the step response at 1 kHz relative to the largest of each state: pressures, place, velocity.
fn step_error(method: Method) -> vpm_core::Result<[f64; 4]> {
    let servo = nominal();
    let (mut fine, mut coarse) = (ServoRig::new(servo)?, ServoRig::new(servo)?);
    let (mut exact, mut x) = (servo.rest().to_array(), servo.rest().to_array());
    let (mut worst, mut size) = ([0.0_f64; 4], [0.0_f64; 4]);
    for ms in 1..=100 {
        let current = if ms <= 50 { 2e-3 } else { -2e-3 };
        (fine.current, coarse.current) = (current, current);
        advance(&mut fine, &mut exact, Method::Rosenbrock, 1e-3, 100);
        advance(&mut coarse, &mut x, method, 1e-3, 1);
        for (k, (found, exact)) in shown(&x).into_iter().zip(shown(&exact)).enumerate() {
            worst[k] = worst[k].max((found - exact).abs());
            size[k] = size[k].max(exact.abs());
        }
    }
    Ok(std::array::from_fn(|k| worst[k] / size[k]))
}

#[test]
fn a_jump_of_current_in_steps_of_a_controller() -> TestResult {
    for (method, pressure, place) in [(Method::LinearlyImplicit, 0.12, 0.008), (Method::Rosenbrock, 0.013, 6e-4)] {
        let error = step_error(method)?;
        println!("{} at 1 kHz after a jump: {}", method.name(), error.map(|part| format!("{part:.1e}")).join(" "));
        assert!(error[0].max(error[1]) < pressure && error[2] < place, "{}: {error:?}", method.name());
    }
    Ok(())
}

#[test]
fn every_integrator_finds_the_same_motion() -> TestResult {
    let servo = nominal();
    let run = |method, steps| -> vpm_core::Result<[f64; 6]> {
        let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
        (rig.current, rig.force) = (1e-3, 50.0);
        // Away from the closed valve, where the slope of the flow jumps.
        advance(&mut rig, &mut x, Method::Rk4, 1e-3, 4000);
        advance(&mut rig, &mut x, method, 0.01, steps);
        Ok(x)
    };
    let exact = run(Method::Rosenbrock, 4000)?;
    for (method, order) in
        [(Method::SemiImplicit, 1.0), (Method::LinearlyImplicit, 2.0), (Method::Rk4, 4.0), (Method::Rosenbrock, 4.0)]
    {
        let off = |steps| run(method, steps).map(|x| (x[4] - exact[4]).abs() / exact[4]);
        let (coarse, fine) = (off(400)?, off(800)?);
        let found = (coarse / fine).log2();
        println!("{}: {coarse:.2e} {fine:.2e}, order {found:.2}", method.name());
        assert!(fine < 2e-2 && (found - order).abs() < 0.4, "{}: order {found}", method.name());
    }
    Ok(())
}

#[test]
fn a_piston_driven_into_its_end_stalls_there() -> TestResult {
    let mut servo = nominal();
    // The independent solution below lets the spool overshoot its 10 mA.
    servo.valve.stroke = 0.02;
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
    rig.current = 0.01;
    let mut contact = None;
    for k in 1..=30_000 {
        advance(&mut rig, &mut x, Method::Rosenbrock, 5e-6, 1);
        if x[0] >= 0.04 && contact.is_none() {
            contact = Some(5e-6 * f64::from(k));
        }
    }
    let contact = contact.ok_or("no contact")?;
    // An independent solution of the same stop (backward differentiation, 1e-7): contact at 39.67 ms, rest at 40.006 mm.
    assert!((contact - 39.67e-3).abs() < 1e-5, "contact at {contact} s");
    assert!((x[0] - 40.006e-3).abs() < 1e-6, "rest at {} m", x[0]);
    assert!(x[2].abs() < 1e-9, "still moving with {} m/s", x[2]);
    // Steps of 0.1 ms are enough to come to rest there.
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let (mut coarse, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
        rig.current = 0.01;
        advance(&mut rig, &mut coarse, method, 0.15, 1500);
        assert!((coarse[0] - x[0]).abs() < 1e-7, "{}: rest at {} m", method.name(), coarse[0]);
        assert!(coarse[2].abs() < 1e-3, "{}: still moving with {} m/s", method.name(), coarse[2]);
    }
    // Without leakage the closed form of the stall is exact.
    servo.cylinder.internal_leakage = 0.0;
    for (current, sign) in [(0.01, 1.0), (-0.01, -1.0)] {
        let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
        rig.current = current;
        advance(&mut rig, &mut x, Method::LinearlyImplicit, 0.3, 60_000);
        let found = servo.cylinder.force(servo.pressures(&ServoState::from_array(x)));
        let (areas, high, low) = (servo.cylinder.areas(), servo.supply_pressure, servo.tank_pressure);
        let stall = if sign > 0.0 { areas.a * high - areas.b * low } else { areas.a * low - areas.b * high };
        assert!((found - stall).abs() < 1e-6, "{found} N instead of {stall} N");
        let beyond = (stall - servo.load.stiffness * x[0]) / servo.cylinder.stop.stiffness;
        assert!((x[0] - (sign * 0.04 + beyond)).abs() < 1e-12, "rest at {} m", x[0]);
    }
    Ok(())
}

#[test]
fn controlled_steps_are_as_exact_as_asked() -> TestResult {
    let mut ode = Chirped::new(nominal(), published_chirp());
    let mut exact = ode.rest();
    advance(&mut ode, &mut exact, Method::Rosenbrock, 0.5, 20_000);
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let mut adaptive = Adaptive::new(tolerance, 7)?;
        let mut x = ode.rest();
        // In two parts, so that the step goes on where it was.
        let first = adaptive.advance(&mut ode, &mut x, 0.2, &|| false).map_err(Error::from)?;
        let second = adaptive.advance(&mut ode, &mut x, 0.3, &|| false).map_err(Error::from)?;
        let error = (4..6).map(|k| (x[k] - exact[k]).abs() / 1e7).fold((x[0] - exact[0]).abs() / 1e-2, f64::max);
        println!("{tolerance:.0e}: error {error:.2e} after {first:?} {second:?}");
        assert!((x[6] - 0.5).abs() < 1e-12, "the time is {} s", x[6]);
        assert!(error < 10.0 * tolerance, "{error} with a tolerance of {tolerance}");
    }
    Ok(())
}
