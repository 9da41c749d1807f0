//! Planar chains at large deflections: closed forms, converged motions, and the derivatives of the energies.
//!
//! Tip load: elliptic integrals, 30 digits (the case of Mattiasson 1981). Tip moment: a circle. Self weight and pendulum: converged
//! spectral series, the pendulum with two independent codes.

use std::f64::consts::{FRAC_PI_2, TAU};

use vpm_core::beam::Basis;
use vpm_core::beam::linear::TipBody;
use vpm_core::beam::planar::{Arm, Hub, LinkParameters, Load, Motion, PlanarChain, Servo, State};
use vpm_core::samples::Random;
use vpm_core::{Dual, Result, Scalar};

use crate::common::beams::near;

const UNIT: LinkParameters = LinkParameters {
    bending: 1.0,
    line: 1.0,
    rotary: 0.0,
    damping: 0.0,
    hub: Hub { radius: 0.0, mass: 0.0, inertia: 0.0 },
    tip: TipBody { mass: 0.0, inertia: 0.0 },
};

/// One link of length 1 with `EACH - 1` Legendre curvatures.
fn cantilever<const EACH: usize>(gravity: f64) -> Result<PlanarChain<1, EACH, EACH>> {
    PlanarChain::new([(UNIT, Basis::legendre(1.0, EACH - 1)?)], [0.0, -gravity], 16)
}

#[test]
fn a_tip_load_bends_the_elastica() -> Result<()> {
    // (P L^2 / EJ, w / L, u / L, tip rotation).
    let exact = [
        (1.0, [0.301_720_773_799_813_55, 0.056_433_236_283_376_88, 0.461_351_949_711_879]),
        (3.0, [0.603_253_441_129_977_4, 0.254_420_184_564_187_1, 0.986_016_946_711_354_1]),
        (10.0, [0.810_609_024_880_296_4, 0.554_995_597_753_751_3, 1.430_285_538_803_857_6]),
    ];
    let chain = cantilever::<10>(0.0)?;
    let mut x = [0.0; 10];
    let mut load = Load::default();
    for (target, [across, along, turn]) in exact {
        while load.force[1] < target {
            load.force[1] = (load.force[1] + 0.5).min(target);
            x = chain.equilibrium(&x, &load)?;
        }
        near(&chain.tips(&x)[0], &[1.0 - along, across, turn], 1e-6);
    }
    Ok(())
}

#[test]
fn a_tip_moment_rolls_the_beam_up() -> Result<()> {
    // Constant curvature M / EJ: x = sin(phi) / phi, y = (1 - cos phi) / phi. One coordinate is enough.
    let chain = cantilever::<2>(0.0)?;
    for turns in [0.125, 0.25, 0.5, 1.0, 2.0] {
        let phi = TAU * turns;
        let x = chain.equilibrium(&[0.0; 2], &Load { force: [0.0; 2], moment: phi })?;
        near(&chain.tips(&x)[0], &[phi.sin() / phi, (1.0 - phi.cos()) / phi, phi], 1e-8);
    }
    Ok(())
}

#[test]
fn a_beam_sags_under_its_own_weight() -> Result<()> {
    for (weight, x, y) in [
        (1.0, 0.991_246_395_346_635_1, -0.123_471_401_983_351_05),
        (5.0, 0.846_657_179_954_255_8, -0.495_905_044_622_395_43),
        (13.0, 0.573_885_661_304_281_6, -0.759_134_668_477_014_4),
        (50.0, 0.245_014_756_388_433_48, -0.907_917_123_442_316_9),
    ] {
        let mut start = [0.0; 12];
        for part in 1..=10 {
            start = cantilever::<12>(weight * f64::from(part) / 10.0)?.equilibrium(&start, &Load::default())?;
        }
        near(&cantilever::<12>(weight)?.tips(&start)[0], &[x, y], 1e-7);
    }
    Ok(())
}

/// A soft rubber strip: 1 m x 20 mm x 10 mm, E = 1e8 Pa, 1100 kg/m^3, on a pin.
fn pendulum(step: f64) -> Result<Arm<1, 12, 12>> {
    let link = LinkParameters { bending: 1.0 / 6.0, line: 0.22, ..UNIT };
    let chain = PlanarChain::new([(link, Basis::legendre(1.0, 11)?)], [0.0, -9.81], 14)?;
    Arm::new(chain, [Servo::default()], step)
}

#[test]
fn a_flexible_pendulum_falls_as_two_other_codes_say() -> Result<()> {
    // (t, tip x, tip y) of the inextensible Euler-Bernoulli pendulum released from the horizontal.
    let exact = [
        (0.1, 0.996_345_981_779_966_2, -0.044_736_973_304_761_79),
        (0.3, 0.806_274_615_887_900_3, -0.588_439_205_451_452_2),
        (0.5, -0.066_347_775_952_160_35, -0.996_572_901_892_317_2),
        (0.6, -0.565_242_107_937_489_6, -0.824_719_855_234_733_6),
        (0.8, -0.981_268_877_934_469_3, -0.167_110_160_247_642_64),
        (1.0, -0.998_787_859_020_077_9, 0.011_307_935_532_431_89),
    ];
    let step = 1e-4;
    let (mut arm, mut state) = (pendulum(step)?, State::default());
    for (time, x, y) in exact {
        while state.time < time - 0.5 * step {
            arm.step(&mut state, |_| Default::default());
        }
        near(&arm.chain().tips(&state.motion.position)[0], &[x, y], 5e-5);
    }
    Ok(())
}

/// Two different links with everything a link can have.
fn rich() -> Result<PlanarChain<2, 3, 6>> {
    let hub = Hub { radius: 0.1, mass: 0.4, inertia: 0.02 };
    let first = LinkParameters { rotary: 0.01, hub, tip: TipBody { mass: 0.7, inertia: 0.03 }, ..UNIT };
    let second = LinkParameters {
        line: 0.6,
        hub: Hub { radius: 0.05, ..hub },
        tip: TipBody { mass: 0.2, inertia: 0.01 },
        ..first
    };
    let links = [(first, Basis::legendre(0.8, 2)?), (second, Basis::bernstein(0.5, 1, 0)?)];
    PlanarChain::new(links, [1.3, -9.81], 12)
}

#[test]
fn velocity_terms_are_the_christoffel_symbols_of_the_mass_matrix() -> Result<()> {
    // bias(v) - bias(0) = dM/dt v - 1/2 d(v^T M v)/dx, with exact derivatives of M.
    let (chain, mut random) = (rich()?, Random::new(3));
    let position: [f64; 6] = random.numbers(6, 1.0).try_into().unwrap();
    let velocity: [f64; 6] = random.numbers(6, 2.0).try_into().unwrap();
    let variables: [Dual<f64, 6>; 6] = std::array::from_fn(|k| Dual::variable(position[k], k));
    let rest = Motion { position: variables, velocity: [Dual::zero(); 6] };
    let mass = chain.terms(&rest, &Load::default(), &mut chain.workspace()).mass;
    let bias = |velocity| {
        let motion = Motion { position, velocity };
        chain.terms(&motion, &Load::default(), &mut chain.workspace::<f64>()).bias
    };
    let (moving, resting) = (bias(velocity), bias([0.0; 6]));
    for i in 0..6 {
        let mut sum = 0.0;
        for j in 0..6 {
            assert!((mass[i][j].value - mass[j][i].value).abs() < 1e-14);
            for k in 0..6 {
                sum += (mass[i][j].gradient[k] - 0.5 * mass[j][k].gradient[i]) * velocity[j] * velocity[k];
            }
        }
        assert!(
            (moving[i] - resting[i] - sum).abs() < 1e-9 * (1.0 + sum.abs()),
            "{i}: {} {sum}",
            moving[i] - resting[i]
        );
    }
    Ok(())
}

#[test]
fn a_tip_load_does_the_work_of_its_point() -> Result<()> {
    let (chain, mut random) = (rich()?, Random::new(4));
    let position: [f64; 6] = random.numbers(6, 1.0).try_into().unwrap();
    let load = Load { force: [2.0, -3.0], moment: 0.7 };
    let motion = Motion { position, velocity: [0.0; 6] };
    let [with, without] = [load, Load::default()].map(|load| chain.terms(&motion, &load, &mut chain.workspace()).bias);
    let variables: [Dual<f64, 6>; 6] = std::array::from_fn(|k| Dual::variable(position[k], k));
    let [x, y, angle] = chain.tips(&variables)[1];
    for k in 0..6 {
        let work = 2.0 * x.gradient[k] - 3.0 * y.gradient[k] + 0.7 * angle.gradient[k];
        assert!((without[k] - with[k] - work).abs() < 1e-12, "{k}");
    }
    Ok(())
}

#[test]
fn a_stretched_chain_moves_like_rigid_rods() -> Result<()> {
    let chain = rich()?;
    for angle in [0.0, 0.9, FRAC_PI_2] {
        let position = [0.3, 0.0, 0.0, 0.3 + angle, 0.0, 0.0];
        let motion = Motion { position, velocity: [0.0; 6] };
        let mass = chain.terms(&motion, &Load::default(), &mut chain.workspace()).mass;
        // Rods: rhoA int (radius + s)^2 ds, and the bodies that the tips carry.
        let rod = |line: f64, [from, to]: [f64; 2]| line * (to.powi(3) - from.powi(3)) / 3.0 + 0.01 * (to - from);
        let beyond = 0.7 + 0.4 + 0.6 * 0.5 + 0.2;
        let first = 0.02 + rod(1.0, [0.1, 0.9]) + 0.03 + beyond * 0.9_f64.powi(2);
        let second = 0.02 + rod(0.6, [0.05, 0.55]) + 0.01 + 0.2 * 0.55_f64.powi(2);
        let coupling = 0.9 * (0.6 * (0.55_f64.powi(2) - 0.05_f64.powi(2)) / 2.0 + 0.2 * 0.55) * angle.cos();
        near(&[mass[0][0], mass[3][3], mass[0][3]], &[first, second, coupling], 1e-12);
    }
    Ok(())
}

#[test]
fn chains_that_cannot_be_are_refused() -> Result<()> {
    let chain = |link, basis| PlanarChain::<1, 3, 3>::new([(link, basis)], [0.0; 2], 6);
    let basis = Basis::legendre(1.0, 2)?;
    assert!(chain(UNIT, basis.clone()).is_ok());
    assert!(chain(LinkParameters { line: 0.0, ..UNIT }, basis.clone()).is_err());
    assert!(chain(LinkParameters { damping: -1.0, ..UNIT }, basis).is_err());
    assert!(chain(UNIT, Basis::legendre(1.0, 3)?).is_err());
    assert!(chain(UNIT, Basis::hermite(1.0, 1)?).is_ok());
    let message = cantilever::<4>(0.0)?.equilibrium(&[f64::NAN; 4], &Load::default()).map_err(|e| e.to_string());
    assert!(message.is_err_and(|text| text.contains("raise the load in stages")));
    Ok(())
}
