//! Every level against closed forms: clamped and turning frequencies, large deflections, and where interpolated deflection ends.

use nalgebra::DMatrix;
use vpm_core::Result;
use vpm_core::beam::eigen::modes;
use vpm_core::beam::{Beam, BeamEntry, Component, Level, Material, Properties, SectionEntry, Shape};

use Component::{BendingX, BendingY, Extension, ShearX, ShearY, Torsion};

use super::ROOTS;
use crate::common::entries;
use crate::common::entries::entry;
use crate::common::sums::{Load, Root, equilibrium, linearised, tip};

/// A beam of length 1 with `EJ = GJ = 1`, `rhoA = 1` and next to no rotary inertia.
fn unit(level: Level, deforms: &[Component]) -> BeamEntry<f64> {
    let small = 1e-10;
    let shape = Shape::Given(Properties {
        area: 1.0,
        moment_x: small,
        moment_y: small,
        torsion: 2.0 * small,
        shear_x: 1.0,
        shear_y: 1.0,
    });
    BeamEntry {
        material: Some(Material { young: 1.0 / small, poisson: 0.0, density: 1.0 }),
        sections: vec![SectionEntry::new(0.0, shape)],
        rest: Vec::new(),
        ..entry(level, deforms, 1.0, [1.0, 1.0])
    }
}

fn close(found: &[f64], expected: &[f64], relative: f64, what: &str) {
    assert!(found.len() >= expected.len(), "{what}: only {} numbers", found.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= relative * expected.abs(), "{what}: {found} is not {expected}");
    }
}

#[test]
fn clamped_frequencies_converge_to_euler_bernoulli() -> Result<()> {
    let exact = ROOTS.map(|root| root * root);
    for bending in [BendingX, BendingY] {
        for (level, count, relative) in [
            (Level::Strain(9), 3, 1e-6),
            (Level::Bezier(11), 3, 1e-6),
            (Level::Modal(4), 4, 1e-6),
            (Level::Hermite(40), 3, 1e-5),
            (Level::Hermite(80), 3, 1e-6),
            (Level::Elements(40), 3, 1e-5),
        ] {
            let found = Beam::new(&unit(level, &[bending]), &[])?.modes()?.frequencies;
            close(&found, &exact[..count], relative, &format!("{level:?}"));
        }
    }
    Ok(())
}

#[test]
fn segments_and_elements_converge_at_their_order() -> Result<()> {
    let exact = ROOTS[0] * ROOTS[0];
    let error = |level| -> Result<f64> {
        let found = Beam::new(&unit(level, &[BendingY]), &[])?.modes()?.frequencies;
        Ok((found[0] / exact - 1.0).abs())
    };
    for (coarse, fine, order) in [
        (Level::Lumped(10), Level::Lumped(20), 2.0),
        (Level::Hermite(2), Level::Hermite(4), 4.0),
        (Level::Elements(2), Level::Elements(4), 4.0),
    ] {
        let found = (error(coarse)? / error(fine)?).log2();
        assert!((found - order).abs() < 0.35, "{coarse:?}: order {found}, error {}", error(fine)?);
    }
    Ok(())
}

#[test]
fn thick_beams_shear_as_timoshenko_says() -> Result<()> {
    let exact = [520.900_091_701_654_9, 3_123.849_610_606_452_6, 8_222.485_833_074_745];
    for pair in [[BendingX, ShearY], [BendingY, ShearX]] {
        for (level, count, relative) in
            [(Level::Strain(9), 3, 1e-6), (Level::Bezier(11), 3, 1e-6), (Level::Bezier(8), 1, 1e-6)]
        {
            let found = Beam::new(&entry(level, &pair, 1.0, [0.1, 0.1]), &[])?.modes()?.frequencies;
            close(&found, &exact[..count], relative, &format!("{level:?}"));
        }
    }
    Ok(())
}

#[test]
fn rods_ring_and_twist_at_the_roots_of_a_cosine() -> Result<()> {
    let rod = |level, part| entry(level, &[part], 2.0, [0.1, 0.1]);
    // (2 k - 1) pi / 2 times the speed of the wave over the length: sqrt(E / rho), sqrt(G Jt / rho Jp).
    let torsion = Shape::Rectangle { width: 0.1, height: 0.1 }.properties(0.3)?.torsion;
    let shear = entries::STEEL.shear() * torsion / (2.0 / 12.0 * 1e-4) / 7850.0;
    for (part, square) in [(Extension, 210e9 / 7850.0), (Torsion, shear)] {
        let exact = [1.0, 3.0].map(|odd| odd * std::f64::consts::FRAC_PI_2 * square.sqrt() / 2.0);
        for (level, relative) in
            [(Level::Strain(8), 1e-6), (Level::Bezier(9), 1e-6), (Level::Modal(3), 1e-6), (Level::Lumped(150), 3e-4)]
        {
            close(
                &Beam::new(&rod(level, part), &[])?.modes()?.frequencies,
                &exact,
                relative,
                &format!("{level:?} {part:?}"),
            );
        }
    }
    Ok(())
}

/// `P L^2 / EJ`, tip across and shortening over the length.
const ELASTICA: [[f64; 3]; 4] = [
    [1.0, 0.301_720_773_799_813_55, 0.056_433_236_283_376_88],
    [3.0, 0.603_253_441_129_977_4, 0.254_420_184_564_187_1],
    [6.0, 0.744_571_148_889_515_3, 0.434_588_828_681_905_1],
    [10.0, 0.810_609_024_880_296_4, 0.554_995_597_753_751_3],
];

#[test]
fn strain_levels_bend_as_the_elastica() -> Result<()> {
    for (level, deforms, tolerance) in [
        (Level::Strain(9), &[BendingY][..], 1e-6),
        (Level::Elements(8), &[BendingY, Torsion], 1e-5),
        (Level::Strain(4), &[BendingX], 3e-5),
        (Level::Elements(8), &[BendingX], 1e-5),
        (Level::Elements(16), &[BendingX], 1e-6),
        (Level::Lumped(32), &[BendingY], 5e-4),
    ] {
        let beam = unit(level, deforms);
        let plane = usize::from(deforms[0] == BendingX);
        for [force, across, along] in ELASTICA {
            let mut load = Load::default();
            load.force[plane] = force;
            let stages = force.ceil() as usize;
            let found = tip(&beam, &equilibrium(&beam, &load, &Root::resting([0.0; 3]), stages)?)?;
            let error = (found[plane] - across).abs().max((found[2] - 1.0 + along).abs());
            assert!(error < tolerance, "{level:?} at {force}: {error:e}");
        }
    }
    Ok(())
}

#[test]
fn a_tip_moment_rolls_strain_levels_up() -> Result<()> {
    for level in [Level::Strain(1), Level::Strain(3), Level::Elements(4)] {
        for turns in [0.125, 0.25, 0.5, 0.75, 1.0] {
            let phi = turns * std::f64::consts::TAU;
            let beam = unit(level, &[BendingY]);
            let load = Load { moment: [0.0, phi, 0.0], ..Load::default() };
            let q = equilibrium(&beam, &load, &Root::resting([0.0; 3]), 1)?;
            let found = tip(&beam, &q)?;
            let error = (found[0] - (1.0 - phi.cos()) / phi).abs().max((found[2] - phi.sin() / phi).abs());
            assert!(error < 1e-5, "{level:?} at {turns}: {error:e}");
        }
    }
    Ok(())
}

#[test]
fn a_beam_sags_under_its_own_weight() -> Result<()> {
    for [weight, along, across] in [
        [1.0, 0.991_246_395_346_635_1, -0.123_471_401_983_351_05],
        [5.0, 0.846_657_179_954_255_8, -0.495_905_044_622_395_43],
        [13.0, 0.573_885_661_304_281_6, -0.759_134_668_477_014_4],
    ] {
        let beam = unit(Level::Strain(9), &[BendingX]);
        let found = tip(&beam, &equilibrium(&beam, &Load::default(), &Root::resting([0.0, -weight, 0.0]), 1)?)?;
        assert!((found[1] - across).abs() < 1e-6 && (found[2] - along).abs() < 1e-6, "{found:?}");
    }
    Ok(())
}

/// Frequencies of the straight beam that turns about y at `eta`, its root `hub` off the axis.
fn turning(level: Level, bending: Component, eta: f64, hub: f64) -> Result<Vec<f64>> {
    let entry = unit(level, &[bending]);
    let beam = Beam::new(&entry, &[])?;
    let n = beam.len();
    let root = Root::turning([0.0, eta, 0.0], [0.0, 0.0, hub]);
    let (_, slope) = linearised(&entry, &[], &vec![0.0; n], &root, &Load::default())?;
    let stiffness = DMatrix::from_row_slice(n, n, beam.stiffness()) + slope;
    Ok(modes(&stiffness, &DMatrix::from_row_slice(n, n, &beam.mass()))?.frequencies)
}

#[test]
fn turning_beams_stiffen_at_every_level() -> Result<()> {
    // Converged flap frequencies; in the plane of rotation lag^2 = flap^2 - eta^2.
    for (hub, eta, flap) in [
        (0.0, 4.0, [5.585_001_420_726_533, 24.273_349_391_610_413]),
        (1.0, 6.0, [10.443_865_869_456_042, 32.027_243_982_581_55]),
        (1.0, 12.0, [19.721_541_935_238_01, 51.070_134_014_008_19]),
    ] {
        let lag = flap.map(|flap: f64| (flap * flap - eta * eta).sqrt());
        for (level, relative) in
            [(Level::Strain(10), 2e-6), (Level::Bezier(11), 2e-6), (Level::Hermite(40), 1e-5), (Level::Modal(6), 2e-3)]
        {
            close(&turning(level, BendingX, eta, hub)?, &flap, relative, &format!("flap of {level:?} at {eta}"));
            close(&turning(level, BendingY, eta, hub)?, &lag, relative, &format!("lag of {level:?} at {eta}"));
        }
    }
    Ok(())
}

/// Slope at the tip (rad) and error of the tip's deflection over the deflection, for a force across the tip.
const VALIDITY: [[f64; 2]; 8] = [
    [0.05, 0.00114],
    [0.10, 0.00456],
    [0.15, 0.01023],
    [0.20, 0.01811],
    [0.30, 0.04027],
    [0.40, 0.07051],
    [0.50, 0.10825],
    [0.60, 0.15290],
];

#[test]
fn interpolated_deflection_is_good_up_to_its_limit() -> Result<()> {
    // A force across the tip is the hardest of the usual loads.
    let error = |force: f64| -> Result<[f64; 2]> {
        let (bent, exact) = (unit(Level::Deflection(4), &[BendingY]), unit(Level::Strain(6), &[BendingY]));
        let (load, root) = (Load { force: [force, 0.0, 0.0], ..Load::default() }, Root::resting([0.0; 3]));
        let (q, truth) = (equilibrium(&bent, &load, &root, 1)?, tip(&exact, &equilibrium(&exact, &load, &root, 1)?)?);
        let found = tip(&bent, &q)?;
        let slope = Beam::new(&bent, &[1.0])?.slope(&q).unwrap_or(f64::NAN);
        Ok([slope, (found[0] - truth[0]).hypot(found[2] - truth[2]) / truth[0].hypot(truth[2] - 1.0)])
    };
    for [slope, expected] in VALIDITY {
        let [found, wrong] = error(2.0 * slope)?;
        assert!((found - slope).abs() < 1e-6 && (wrong / expected - 1.0).abs() < 0.01, "{found} {wrong:.5}");
    }
    let limit = Beam::<f64>::slope_limit();
    let [slope, wrong] = error(2.0 * limit)?;
    assert!((slope - limit).abs() < 0.01 * limit, "{slope} is not {limit}");
    assert!((0.0095..=0.01).contains(&wrong), "{wrong}");
    Ok(())
}
