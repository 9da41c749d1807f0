//! What oil keeps: mass, energy, the force's own rate; and what no choice of parameters may break.

use allocation_counter::measure;
use proptest::prelude::*;
use vpm_core::actuator::DeadZone;
use vpm_core::actuator::hydraulic::{
    Chambers, EntrainedAir, Fluid, Load, Orifice, PistonSize, PressedSeals, SealFriction, ServoCylinder, ServoRig,
    ServoState,
};
use vpm_core::effect::{CoulombFriction, StribeckFriction, ViscousFriction};
use vpm_core::error::Error;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::{Dual, Scalar};

use crate::common::hydraulics::{Chirp, Chirped, nominal};

const AIR: EntrainedAir<f64> = EntrainedAir { fraction: 0.005, exponent: 1.4, reference_pressure: 101_325.0 };

/// The nominal drive with everything that a model can have.
fn complete() -> ServoCylinder<f64> {
    let mut servo = nominal();
    servo.fluid.air = Some(AIR);
    servo.valve.overlap.width = 2e-4;
    servo.cylinder.external_leakage = 5e-14;
    servo.cylinder.seal = SealFriction {
        viscous: Some(ViscousFriction { viscous: 120.0 }),
        coulomb: Some(CoulombFriction { coulomb: 30.0, transition_velocity: 0.01 }),
        stribeck: Some(StribeckFriction { stribeck: 15.0, stribeck_velocity: 0.02, transition_velocity: 0.01 }),
        pressed: Some(PressedSeals { share: 0.02, transition_velocity: 0.01 }),
    };
    servo
}

#[test]
fn seals_resist_by_their_chord() {
    let (seal, area, held) = (complete().cylinder.seal, 2e-4, Chambers { a: 6e6, b: 9e6 });
    for v in [-0.3_f64, -0.004, 0.01, 0.05] {
        let (rounded, fading) = ((v / 0.01).tanh(), (-(v / 0.02) * (v / 0.02)).exp());
        let force = -(120.0 * v + (30.0 + 15.0 * fading + 0.02 * 2e-4 * 15e6) * rounded);
        let [told, chord] = [seal.force(v, area, held), seal.resistance(v, area, held)];
        assert!((told - force).abs() < 1e-12 && (chord * v + force).abs() < 1e-12, "{v}");
    }
    let none = nominal().cylinder.seal;
    let (viscous, coulomb, stribeck, pressed) = (seal.viscous, seal.coulomb, seal.stribeck, seal.pressed);
    let alone = [
        SealFriction { viscous, ..none },
        SealFriction { coulomb, ..none },
        SealFriction { stribeck, ..none },
        SealFriction { pressed, ..none },
    ];
    assert!(alone.iter().all(SealFriction::is_there) && !none.is_there());
}

#[test]
fn both_ends_of_a_stroke_push_alike_and_never_pull() {
    let stop = nominal().cylinder.stop;
    for (x, v) in [(0.041, 0.0), (0.041, 3.0), (0.041, -3.0), (0.0401, -30.0), (0.039, 5.0), (0.0, 1.0)] {
        let beyond: f64 = x - 0.04;
        let push = if beyond > 0.0 { (5e8 * beyond + 2e4 * v).max(0.0) } else { 0.0 };
        assert!((stop.force(x, v, 0.04) + push).abs() < 1e-6, "{x} {v}");
        assert!((stop.force(-x, -v, 0.04) - push).abs() < 1e-6, "{x} {v}");
    }
}

#[test]
fn a_valve_reversed_exchanges_its_chambers() {
    for clearance in [None, Some(1e-4)] {
        let mut valve = complete().valve;
        valve.clearance = clearance;
        for place in [4e-3, 1e-3, 1e-5, -7e-3] {
            for (a, b) in [(9e6, 3e6), (1e6, 15e6), (17e6, 5e4)] {
                let (found, mirror) = (valve.flows(place, 16e6, 1e5, [a, b]), valve.flows(-place, 16e6, 1e5, [b, a]));
                assert!(
                    (found.into_a + mirror.out_of_b).abs() < 1e-18 && (found.out_of_b + mirror.into_a).abs() < 1e-18
                );
                assert!((found.supply - mirror.supply).abs() < 1e-18 && (found.tank - mirror.tank).abs() < 1e-18);
                // What comes from the supply and does not go to the tank stays in the chambers.
                assert!((found.supply - found.tank - found.into_a + found.out_of_b).abs() < 1e-18, "{place} {a} {b}");
            }
        }
    }
}

#[test]
fn chambers_trade_volume_along_the_stroke() {
    let cylinder = complete().cylinder;
    let [full, rod] = [0.016_f64, 0.010].map(|diameter| std::f64::consts::FRAC_PI_4 * diameter * diameter);
    let ratio = (full - rod) / full;
    let areas = PistonSize::Areas { area: full, area_ratio: ratio }.areas();
    assert!((areas.a - full).abs() < 1e-18 && (areas.b - (full - rod)).abs() < 1e-18);
    // From end to end; beyond an end nothing is left but the line.
    for way in [0.0, 0.013, 0.04, 0.08, 0.09] {
        let found = cylinder.volumes(way - 0.04);
        assert!((found.a - 2.9e-6 - full * way).abs() < 1e-18, "{way}");
        assert!((found.b - 2.9e-6 - (full - rod) * (0.08 - way).max(0.0)).abs() < 1e-18, "{way}");
    }
}

#[test]
fn every_number_has_its_domain() {
    type Spoil = fn(&mut ServoCylinder<f64>);
    let spoiled: [(&str, Spoil); 27] = [
        ("fluid.bulk_modulus", |servo| servo.fluid.bulk_modulus = 0.0),
        ("fluid.vapour_pressure", |servo| servo.fluid.vapour_pressure = 0.0),
        ("fluid.air.fraction", |servo| servo.fluid.air = Some(EntrainedAir { fraction: -0.1, ..AIR })),
        ("fluid.air.exponent", |servo| servo.fluid.air = Some(EntrainedAir { exponent: 0.0, ..AIR })),
        ("fluid.air.exponent", |servo| servo.fluid.more_air = Some(EntrainedAir { exponent: 0.0, ..AIR })),
        ("fluid.air.reference_pressure", |servo| {
            servo.fluid.air = Some(EntrainedAir { reference_pressure: 0.0, ..AIR });
        }),
        ("valve.stroke", |servo| servo.valve.stroke = 0.0),
        ("valve.overlap", |servo| servo.valve.overlap.width = -1e-4),
        ("valve.frequency", |servo| servo.valve.frequency = Some(0.0)),
        ("valve.damping", |servo| servo.valve.damping = Some(-0.1)),
        ("valve.clearance", |servo| servo.valve.clearance = Some(0.0)),
        ("valve.delay", |servo| servo.valve.delay = Some(-1e-3)),
        ("valve.orifice.gain", |servo| servo.valve.orifice.gain = -1.0),
        ("valve.orifice.transition_pressure", |servo| servo.valve.orifice.transition_pressure = 0.0),
        ("cylinder.bore", |servo| servo.cylinder.size = PistonSize::Diameters { bore: 0.0, rod: 0.01 }),
        ("cylinder.rod", |servo| servo.cylinder.size = PistonSize::Diameters { bore: 0.02, rod: 0.0 }),
        ("cylinder.area", |servo| servo.cylinder.size = PistonSize::Areas { area: 0.0, area_ratio: 0.6 }),
        ("cylinder.area_ratio", |servo| servo.cylinder.size = PistonSize::Areas { area: 2e-4, area_ratio: 1.1 }),
        ("cylinder.stroke", |servo| servo.cylinder.stroke = 0.0),
        ("cylinder.line_a", |servo| servo.cylinder.line_a = 0.0),
        ("cylinder.line_b", |servo| servo.cylinder.line_b = 0.0),
        ("cylinder.internal_leakage", |servo| servo.cylinder.internal_leakage = -1e-13),
        ("cylinder.external_leakage", |servo| servo.cylinder.external_leakage = -1e-13),
        ("cylinder.stop.stiffness", |servo| servo.cylinder.stop.stiffness = 0.0),
        ("cylinder.stop.damping", |servo| servo.cylinder.stop.damping = -1.0),
        ("cylinder.seal.pressed", |servo| {
            servo.cylinder.seal.pressed = Some(PressedSeals { share: 0.02, transition_velocity: 0.0 });
        }),
        ("cylinder.seal.coulomb", |servo| {
            servo.cylinder.seal.coulomb = Some(CoulombFriction { coulomb: 30.0, transition_velocity: 0.0 });
        }),
    ];
    let outside = |servo: &ServoCylinder<f64>| -> Vec<&str> {
        let (oil, valve, cylinder) = (servo.fluid.domains(), servo.valve.domains(), servo.cylinder.domains());
        let all = oil.into_iter().chain(valve).chain(cylinder);
        all.filter(|(_, number, domain)| !domain.contains(**number)).map(|(name, ..)| name).collect()
    };
    assert!(outside(&complete()).is_empty());
    for (name, spoil) in spoiled {
        let mut servo = complete();
        spoil(&mut servo);
        assert_eq!(outside(&servo), [name]);
    }
}

#[test]
fn the_chirp_helper_is_an_ordinary_rig() {
    // Without amplitude it rests as the rig does, while its clock runs.
    let chirp = Chirp { amplitude: 0.0, start: 1.0, slope: 0.0 };
    let (mut with_time, mut rates) = (Chirped::new(nominal(), chirp), [0.0; 7]);
    with_time.rhs(&with_time.rest(), &mut rates);
    assert!(rates[6] == 1.0 && rates[..4].iter().all(|rate| rate.abs() < 1e-9));
}

#[test]
fn an_orifice_is_odd_with_a_finite_continuous_slope() {
    let orifice = Orifice { gain: 2.0, transition_pressure: 1e4 };
    let lifted = orifice.map(&mut |&number| Dual::<f64, 1>::constant(number));
    let slope = |drop: f64| lifted.flow(Dual::constant(0.5), Dual::variable(drop, 0)).gradient[0];
    assert!((slope(0.0) - 1.5 / 100.0).abs() < 1e-15);
    for drop in [1e4 - 1e-6, 1e4 + 1e-6] {
        assert!((slope(drop) - 0.5 / 100.0).abs() < 1e-12, "slope {} at {drop}", slope(drop));
        assert!((orifice.flow(0.5, drop) - 100.0).abs() < 1e-7);
    }
    for drop in [3.0, 5e3, 1e4, 4e6] {
        assert_eq!(orifice.flow(0.5, -drop), -orifice.flow(0.5, drop));
        assert_eq!(slope(-drop), slope(drop));
    }
    assert!((orifice.flow(0.5, 4e6) - 2000.0).abs() < 1e-9);
}

#[test]
fn a_spool_rings_as_its_closed_form_and_stops_at_its_stroke() -> vpm_core::Result<()> {
    let servo = nominal();
    let run = |current| -> vpm_core::Result<(Vec<f64>, Vec<f64>)> {
        let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
        let mut integrator = Integrator::new(Method::Rosenbrock, 6);
        rig.current = current;
        let mut places = Vec::new();
        for _ in 0..500 {
            integrator.step(&mut rig, &mut x, 1e-5);
            places.push(x[1]);
        }
        let times = (1..=500).map(|k| 1e-5 * f64::from(k)).collect();
        Ok((times, places))
    };
    let (w, d) = (servo.valve.frequency.unwrap_or_default(), servo.valve.damping.unwrap_or_default());
    let damped = w * (1.0 - d * d).sqrt();
    let (times, places) = run(4e-3)?;
    for (t, z) in times.into_iter().zip(places) {
        let exact = 1.0 - (-d * w * t).exp() * ((damped * t).cos() + d * w / damped * (damped * t).sin());
        assert!((z - 4e-3 * exact).abs() < 1e-8, "{z} at {t} s");
    }
    let (_, places) = run(0.05)?;
    let most = places.iter().copied().fold(0.0, f64::max);
    // Driven by five times its stroke it overshoots as by a step to the stroke, and opens no further.
    let overshoot = (-std::f64::consts::PI * d / (1.0 - d * d).sqrt()).exp();
    assert!((most - 0.01 * (1.0 + overshoot)).abs() < 1e-7, "the spool went to {most}");
    assert_eq!(servo.valve.opening(most), 0.01);
    assert!((places[499] - 0.01).abs() < 1e-5, "the spool rests at {}", places[499]);
    assert_eq!(servo.valve.opening(0.012), 0.01);
    let lapped = vpm_core::actuator::hydraulic::Valve { overlap: DeadZone { width: 1e-3 }, ..servo.valve };
    assert_eq!(lapped.opening(-9e-4), 0.0);
    assert!((lapped.opening(-0.02) + 9e-3).abs() < 1e-15);
    Ok(())
}

/// ln(density) of a chamber in a state, up to a constant: the integral of 1/beta_e by Simpson's rule in ln(p).
fn log_density(fluid: &Fluid<f64>, state: f64) -> f64 {
    let floor = fluid.vapour_pressure;
    let below = (state.min(floor) - floor) / fluid.bulk_modulus;
    let (panels, span) = (4000, (state.max(floor) / floor).ln());
    let term = |k: usize| {
        let p = floor * (span * k as f64 / panels as f64).exp();
        p / fluid.effective_bulk_modulus(p)
    };
    let weight = |k: usize| if k == 0 || k == panels { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
    below + (0..=panels).map(|k| weight(k) * term(k)).sum::<f64>() * span / (3.0 * panels as f64)
}

fn masses(servo: &ServoCylinder<f64>, x: &[f64; 6]) -> [f64; 2] {
    let volumes = servo.cylinder.volumes(x[0]);
    [(volumes.a, x[4]), (volumes.b, x[5])].map(|(volume, state)| volume * log_density(&servo.fluid, state).exp())
}

/// Shuts the valve, throws the piston with `velocity` under a `force`; largest change of the oil's mass and lowest state.
fn shut(mut servo: ServoCylinder<f64>, velocity: f64, force: f64, step: f64) -> vpm_core::Result<(f64, f64)> {
    servo.cylinder.internal_leakage = 0.0;
    servo.cylinder.external_leakage = 0.0;
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
    (x[2], rig.force) = (velocity, force);
    let (start, mut integrator) = (masses(&servo, &x), Integrator::new(Method::Rosenbrock, 6));
    let (mut worst, mut lowest) = (0.0_f64, f64::INFINITY);
    for k in 0..(0.01 / step) as usize {
        integrator.step(&mut rig, &mut x, step);
        lowest = lowest.min(x[4]).min(x[5]);
        if k % 50 == 0 {
            for (now, then) in masses(&servo, &x).into_iter().zip(start) {
                worst = worst.max((now / then - 1.0).abs());
            }
        }
    }
    Ok((worst, lowest))
}

#[test]
fn shut_valves_keep_the_oil() -> vpm_core::Result<()> {
    let (plain, airy) = (nominal(), complete());
    for (servo, velocity, force) in [(plain, 0.2, 0.0), (plain, 0.1, 200.0), (airy, 0.2, 0.0)] {
        let (worst, lowest) = shut(servo, velocity, force, 5e-6)?;
        println!("mass {worst:.1e}, lowest {lowest:.3e} Pa");
        assert!(worst < 1e-10 && lowest > servo.fluid.vapour_pressure, "mass changes by {worst}, lowest {lowest} Pa");
    }
    // Pulled hard enough for a void, and back: nothing is lost there either.
    let (worst, lowest) = shut(plain, -2.0, 0.0, 1e-6)?;
    println!("with a void: mass {worst:.1e}, lowest {lowest:.3e} Pa");
    assert!(worst < 1e-10 && lowest < 0.0, "mass changes by {worst}, lowest state {lowest} Pa");
    Ok(())
}

/// The rig with the energy that has come in as the last state.
struct Metered(ServoRig<f64>);

impl Metered {
    /// Energy in J of mass, spring and oil: oil of constant bulk modulus holds `V beta (e^y - 1 - y)`, `y = p / beta`.
    fn stored(&self, x: &[f64]) -> f64 {
        let servo = self.0.servo();
        let (volumes, beta) = (servo.cylinder.volumes(x[0]), servo.fluid.bulk_modulus);
        let oil = |volume: f64, p: f64| volume * beta * ((p / beta).exp_m1() - p / beta);
        let load = servo.load.mass * x[2] * x[2] + servo.load.stiffness * x[0] * x[0];
        0.5 * load + oil(volumes.a, x[4]) + oil(volumes.b, x[5])
    }

    /// Power in W: oil of pressure p carries the enthalpy `beta (e^y - 1)` per volume.
    fn power(&self, x: &[f64]) -> f64 {
        let servo = self.0.servo();
        let state = ServoState::from_array(std::array::from_fn(|k| x[k]));
        let (flows, pressures) = (servo.flows(&state), servo.pressures(&state));
        let leakage = servo.cylinder.leakage(pressures, servo.tank_pressure);
        let enthalpy = |p: f64| servo.fluid.bulk_modulus * (p / servo.fluid.bulk_modulus).exp_m1();
        let oil =
            (flows.into_a - leakage.a) * enthalpy(pressures.a) - (flows.out_of_b + leakage.b) * enthalpy(pressures.b);
        let resisted = servo.cylinder.resistance(x[0], x[2], pressures) - servo.load.damping * x[2] - self.0.force;
        oil + resisted * x[2]
    }
}

impl Ode<f64> for Metered {
    fn dim(&self) -> usize {
        7
    }
    fn coordinates(&self) -> usize {
        0
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        self.0.rhs(&x[..6], &mut dxdt[..6]);
        dxdt[6] = self.power(x);
    }
    fn jacobian(&mut self, _x: &[f64], jacobian: &mut [f64]) {
        jacobian.fill(0.0);
    }
}

#[test]
fn energy_is_balanced() -> vpm_core::Result<()> {
    let mut servo = complete();
    servo.fluid.air = None;
    for current in [0.0, 3e-3, -2e-3] {
        let mut rig = ServoRig::new(servo)?;
        (rig.current, rig.force) = (current, 80.0);
        let mut ode = Metered(rig);
        let mut x = [servo.rest().to_array().as_slice(), &[0.0]].concat();
        x[2] = 0.2;
        let (start, mut integrator) = (ode.stored(&x), Integrator::new(Method::Rk4, 7));
        for _ in 0..20_000 {
            integrator.step(&mut ode, &mut x, 1e-6);
        }
        let (gained, came) = (ode.stored(&x) - start, x[6]);
        println!("{current} A: stored {gained:.6} J of {came:.6} J");
        assert!((gained - came).abs() < 1e-8 && came.abs() > 1e-3, "{gained} J stored, {came} J came");
    }
    Ok(())
}

#[test]
fn a_step_allocates_nothing() -> vpm_core::Result<()> {
    let servo = complete();
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo)?);
    for method in Method::ALL {
        let mut integrator = Integrator::new(method, 6);
        assert_eq!(measure(|| integrator.step(&mut rig, &mut x, 1e-6)).count_total, 0, "{}", method.name());
    }
    Ok(())
}

#[test]
fn meaningless_parameters_are_named() {
    let with = |change: fn(&mut ServoCylinder<f64>)| {
        let mut servo = complete();
        change(&mut servo);
        ServoRig::new(servo).map(|_| ())
    };
    let path = |result| match result {
        Err(Error::Domain { path, .. }) => path,
        other => format!("{other:?}"),
    };
    assert_eq!(path(with(|servo| servo.fluid.vapour_pressure = 0.0)), "fluid.vapour_pressure");
    assert_eq!(path(with(|servo| servo.valve.overlap.width = -1.0)), "valve.overlap");
    assert_eq!(path(with(|servo| servo.cylinder.line_b = f64::NAN)), "cylinder.line_b");
    assert_eq!(path(with(|servo| servo.load.mass = 0.0)), "load.mass");
    assert!(matches!(
        with(|servo| servo.cylinder.size = PistonSize::Diameters { bore: 0.016, rod: 0.016 }),
        Err(Error::Setting { .. })
    ));
    assert_eq!(with(|_| ()), Ok(()));
}

prop_compose! {
    /// A drive of any size, with everything.
    fn drives()(
        size in 0.3..4.0_f64, slim in 0.3..0.9_f64, beta in 0.6e9..2e9_f64, air in 0.0..0.05_f64, lap in 0.0..1e-3_f64,
        mass in 0.2..50.0_f64, dry in 0.0..200.0_f64, supply in 5e6..25e6_f64, leak in 0.0..1e-11_f64,
    ) -> ServoCylinder<f64> {
        let mut servo = complete();
        servo.cylinder.size = PistonSize::Diameters { bore: 0.016 * size, rod: slim * 0.016 * size };
        servo.fluid = Fluid { bulk_modulus: beta, air: Some(EntrainedAir { fraction: air, ..AIR }), ..servo.fluid };
        servo.valve.overlap.width = lap;
        servo.load = Load { mass, ..servo.load };
        servo.cylinder.seal.coulomb = Some(CoulombFriction { coulomb: dry, transition_velocity: 0.01 });
        servo.supply_pressure = supply;
        servo.cylinder.internal_leakage = leak;
        servo
    }
}

prop_compose! {
    /// Any state, with voids and beyond the ends.
    fn states()(
        x in -0.041..0.041_f64, z in -0.011..0.011_f64, v in -2.0..2.0_f64, w in -10.0..10.0_f64, a in -1e6..30e6_f64,
        b in -1e6..30e6_f64,
    ) -> [f64; 6] {
        [x, z, v, w, a, b]
    }
}

proptest! {
    #[test]
    fn pressures_volumes_and_slopes_stay_within_limits(servo in drives(), x in states(), held in -0.02..0.02_f64) {
        let mut rig = ServoRig::new(servo).unwrap();
        rig.current = held;
        let (mut rates, mut jacobian) = ([0.0; 6], [0.0; 36]);
        rig.rhs(&x, &mut rates);
        rig.jacobian(&x, &mut jacobian);
        prop_assert!(rates.iter().chain(&jacobian).all(|number| number.is_finite()));
        let state = ServoState::from_array(x);
        let (pressures, volumes) = (servo.pressures(&state), servo.cylinder.volumes(x[0]));
        prop_assert!(pressures.a.min(pressures.b) >= servo.fluid.vapour_pressure);
        prop_assert!(volumes.a >= servo.cylinder.line_a && volumes.b >= servo.cylinder.line_b);
        let beta = servo.fluid.effective_bulk_modulus(x[4]);
        prop_assert!(beta > 0.0 && beta <= servo.fluid.bulk_modulus * 1.0000001);
    }

    #[test]
    fn the_jacobian_is_that_of_differences(servo in drives(), x in states(), held in -0.02..0.02_f64) {
        let mut rig = ServoRig::new(servo).unwrap();
        rig.current = held;
        let mut jacobian = [0.0; 36];
        rig.jacobian(&x, &mut jacobian);
        // Half a step of each state; far from the edges of the laws, where slopes jump.
        let reach = [1e-8, 1e-8, 1e-6, 1e-5, 10.0, 10.0];
        let half = servo.cylinder.stroke * 0.5;
        let smooth = (x[0].abs() - half).abs() > 1e-6
            && (x[1].abs() - servo.valve.overlap.width).abs() > 1e-6
            && (x[1].abs() - servo.valve.stroke).abs() > 1e-6
            && x[4..].iter().all(|p| [servo.fluid.vapour_pressure, servo.tank_pressure, servo.supply_pressure].iter()
                .all(|edge| (p - edge).abs() > 3e4));
        prop_assume!(smooth);
        for j in 0..6 {
            let (mut up, mut down, mut above, mut below) = (x, x, [0.0; 6], [0.0; 6]);
            up[j] += reach[j];
            down[j] -= reach[j];
            rig.rhs(&up, &mut above);
            rig.rhs(&down, &mut below);
            for i in 0..6 {
                let (found, slope) = ((above[i] - below[i]) / (up[j] - down[j]), jacobian[6 * i + j]);
                let rounding = 1e-15 * above[i].abs().max(below[i].abs()).max(1e6) / reach[j];
                prop_assert!(
                    (found - slope).abs() <= 1e-4 * slope.abs() + 20.0 * rounding,
                    "entry ({i}, {j}): {slope} instead of {found}"
                );
            }
        }
    }

    /// 4.19 to 4.21 against the rates of the pressures.
    #[test]
    fn the_force_has_the_rate_of_the_second_derivation(servo in drives(), mut x in states()) {
        x[0] *= 0.9;
        x[4] = x[4].abs() + 1e4;
        x[5] = x[5].abs() + 1e4;
        let state = ServoState::from_array(x);
        let (flows, areas) = (servo.flows(&state), servo.cylinder.areas());
        let inflow = Chambers { a: flows.into_a, b: -flows.out_of_b };
        let rates = servo.rates(&state, 0.0, 0.0).chambers;
        let (motion, tank) = ([x[0], x[2]], servo.tank_pressure);
        let found = servo.cylinder.force_rate(&servo.fluid, state.chambers, motion, inflow, tank);
        let scale = (areas.a * rates.a).abs() + (areas.b * rates.b).abs() + 1.0;
        let parts = servo.cylinder.oil_stiffness(&servo.fluid, state.chambers, x[0]) * x[2].abs();
        prop_assert!((found - (areas.a * rates.a - areas.b * rates.b)).abs() < 1e-12 * (scale + parts));
    }

    /// A current that jumps every millisecond, between the ends, with voids: what 1 ms a step does not always survive.
    #[test]
    fn ten_steps_per_jump_stay_finite_and_within_the_stroke(servo in drives(), currents in prop::collection::vec(-0.003..0.003_f64, 50)) {
        for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
            let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(servo).unwrap());
            let mut integrator = Integrator::new(method, 6);
            for &current in &currents {
                rig.current = current * (servo.cylinder.areas().a / nominal().cylinder.areas().a);
                (0..10).for_each(|_| integrator.step(&mut rig, &mut x, 1e-4));
                prop_assert!(x.iter().all(|number| Scalar::is_finite(*number)), "{}: {x:?}", method.name());
                prop_assert!(x[0].abs() < 0.5 * servo.cylinder.stroke, "{}: {x:?}", method.name());
            }
        }
    }
}
