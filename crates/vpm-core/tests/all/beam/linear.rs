//! Linear beams against closed forms and converged values, and what each basis is worth.
//!
//! Cantilever roots: `cos x cosh x = -1`, with a tip mass `1 + cos x cosh x = mu x (sin x cosh x - cos x sinh x)`. Timoshenko: the
//! determinant of the transfer matrix, 30 digits. Rotating cantilever: a Ritz series of 16 Legendre terms, converged.

use nalgebra::DMatrix;
use vpm_core::Result;
use vpm_core::beam::eigen::modes;
use vpm_core::beam::witness::linear::{LinearBeam, Plane, Theory, TipBody};
use vpm_core::beam::{Basis, Material, Section, Shape};

use super::ROOTS;

/// A beam of length 1, `EJ = 1` and `rhoA = 1`.
fn unit(basis: Basis, tip: TipBody) -> Result<LinearBeam> {
    let section = Section::given([1.0, 1.0, 1.0, 1e6, 1e6, 1e6], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])?;
    LinearBeam::new(&section, Plane::X, basis, Theory::EulerBernoulli, tip)
}

fn bezier(degree: usize) -> Result<LinearBeam> {
    unit(Basis::bernstein(1.0, degree, 2)?, TipBody::default())
}

fn close(found: &[f64], expected: &[f64], relative: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= relative * expected.abs(), "{found} is not {expected}");
    }
}

#[test]
fn a_cantilever_vibrates_at_the_roots_of_its_equation() -> Result<()> {
    let exact = ROOTS.map(|root| root * root);
    close(&bezier(12)?.modes(None)?.frequencies, &exact, 1e-6);
    // Hermite elements converge with the fourth power of their size.
    close(&unit(Basis::hermite(1.0, 40)?, TipBody::default())?.modes(None)?.frequencies, &exact, 1e-5);
    close(&unit(Basis::hermite(1.0, 80)?, TipBody::default())?.modes(None)?.frequencies, &exact, 6.5e-7);
    Ok(())
}

#[test]
fn a_steel_strip_rings_at_17_hertz() -> Result<()> {
    let steel = Material { young: 210e9, poisson: 0.3, density: 7850.0 };
    let section = Section::new(Shape::Rectangle { width: 0.015, height: 0.004 }, steel)?;
    let basis = Basis::bernstein(0.44, 12, 2)?;
    let strip = LinearBeam::new(&section, Plane::Y, basis, Theory::EulerBernoulli, TipBody::default())?;
    let hertz: Vec<f64> = strip.modes(None)?.frequencies.iter().map(|f| f / std::f64::consts::TAU).collect();
    close(
        &hertz,
        &[17.262_739_554_629_76, 108.183_742_120_604_65, 302.917_610_514_694_45, 593.597_618_066_366_2],
        1e-6,
    );
    Ok(())
}

#[test]
fn a_tip_mass_slows_it_down() -> Result<()> {
    for (mass, roots) in [
        (0.1, [1.722_741_520_593_259, 4.399_522_816_156_012, 7.451_056_673_303_896]),
        (1.0, [1.247_917_409_606_469_4, 4.031_139_436_714_96, 7.134_132_240_939_746]),
        (10.0, [0.735_781_919_389_650_5, 3.938_465_833_251_812_8, 7.075_616_367_031_705]),
    ] {
        let beam = unit(Basis::bernstein(1.0, 12, 2)?, TipBody { mass, inertia: 0.0 })?;
        close(&beam.modes(None)?.frequencies, &roots.map(|root: f64| root * root), 1e-6);
    }
    Ok(())
}

#[test]
fn a_thick_beam_shears() -> Result<()> {
    let steel = Material { young: 210e9, poisson: 0.3, density: 7850.0 };
    let section = Section::new(Shape::Rectangle { width: 0.1, height: 0.1 }, steel)?;
    let theory = Theory::Timoshenko(Basis::bernstein(1.0, 11, 1)?);
    let beam = LinearBeam::new(&section, Plane::Y, Basis::bernstein(1.0, 12, 1)?, theory, TipBody::default())?;
    let exact = [520.900_091_701_654_9, 3_123.849_610_606_452_6, 8_222.485_833_074_745, 14_927.644_093_018_023];
    close(&beam.modes(None)?.frequencies, &exact, 1e-6);
    let euler =
        LinearBeam::new(&section, Plane::Y, Basis::bernstein(1.0, 12, 2)?, Theory::EulerBernoulli, TipBody::default())?;
    close(&euler.modes(None)?.frequencies, &[524.970_520_537_173, 3_289.934_148_610_118, 9_211.910_373_698_296], 1e-6);
    let rayleigh =
        LinearBeam::new(&section, Plane::Y, Basis::bernstein(1.0, 12, 2)?, Theory::Rayleigh, TipBody::default())?;
    let [slow, middle, fast] = [&beam, &rayleigh, &euler].map(|b| b.modes(None).map(|modes| modes.frequencies[0]));
    assert!(slow? < middle.clone()? && middle? < fast?);
    Ok(())
}

#[test]
fn static_deflections_are_those_of_the_textbook() -> Result<()> {
    // Strip of 15 mm x 4 mm of E = 206 GPa, 0.44 m, with shear factor 5/6, under 1 N: tip 1.7230884e-3 m, 5.8737864e-3 rad.
    let young: f64 = 206e9;
    let (bending, shear) = (young * 8e-11, 5.0 / 6.0 * young / 2.6 * 6e-5);
    let section = Section::given([bending, bending, 1.0, shear, shear, 1e7], [0.0, 0.0, 0.0, 0.471, 0.471, 0.471])?;
    let theory = Theory::Timoshenko(Basis::bernstein(0.44, 2, 1)?);
    let beam = LinearBeam::new(&section, Plane::X, Basis::bernstein(0.44, 3, 1)?, theory, TipBody::default())?;
    let [deflection, rotation, _] = beam.at(0.44, &beam.static_deflection(1.0, 0.0)?);
    close(&[deflection, rotation], &[1.723_088_4e-3, 5.873_786_4e-3], 1e-7);
    let moment = unit(Basis::hermite(1.0, 3)?, TipBody::default())?;
    close(&moment.at(1.0, &moment.static_deflection(0.0, 1.0)?), &[0.5, 1.0, 1.0], 1e-12);
    Ok(())
}

#[test]
fn the_order_of_a_bezier_curve_decides_what_it_can_tell() -> Result<()> {
    let exact = ROOTS.map(|root| root * root);
    let error = |degree: usize, mode: usize| -> Result<f64> {
        Ok(100.0 * (bezier(degree)?.modes(None)?.frequencies[mode] / exact[mode] - 1.0))
    };
    // Percent, to the printed digits.
    close(&[bezier(2)?.modes(None)?.frequencies[0]], &[20.0_f64.sqrt()], 1e-12);
    for (degree, mode, percent, digit) in
        [(2, 0, 27.2, 0.05), (3, 0, 0.48, 0.005), (3, 1, 58.0, 0.5), (4, 0, 0.03, 0.02), (4, 1, 0.9, 0.05)]
    {
        let found = error(degree, mode)?;
        assert!((found - percent).abs() < digit, "degree {degree}, mode {mode}: {found} %");
    }
    close(&bezier(3)?.modes(None)?.frequencies, &[3.5327, 34.81], 1e-4);
    // A tip load of 1: deflection 1/3 and root curvature 1 in truth; a quadratic shows 75 % and 50 % of them.
    let quadratic = bezier(2)?;
    let load = quadratic.static_deflection(1.0, 0.0)?;
    close(&[quadratic.at(1.0, &load)[0], quadratic.at(0.0, &load)[2]], &[0.25, 0.5], 1e-12);
    let cubic = bezier(3)?;
    let load = cubic.static_deflection(1.0, 0.0)?;
    close(&[cubic.at(1.0, &load)[0], cubic.at(0.0, &load)[2]], &[1.0 / 3.0, 1.0], 1e-12);
    Ok(())
}

#[test]
fn the_table_of_bases_holds() -> Result<()> {
    // Basis, errors of the first frequencies in percent, tip deflection and root curvature under a tip load (1 is exact).
    let modal = |count| bezier(12)?.modal_basis(count);
    let table: [(Basis, &[f64], [f64; 2]); 7] = [
        (Basis::bernstein(1.0, 4, 2)?, &[0.0302, 0.9025, 91.49], [1.0, 1.0]),
        (Basis::bernstein(1.0, 5, 2)?, &[0.000_154, 0.5598, 2.673], [1.0, 1.0]),
        (Basis::bernstein(1.0, 6, 2)?, &[3.85e-6, 0.002_83, 2.500], [1.0, 1.0]),
        (Basis::hermite(1.0, 2)?, &[0.0483, 0.8486, 21.82], [1.0, 1.0]),
        (Basis::hermite(1.0, 4)?, &[0.003_27, 0.1165, 0.7742], [1.0, 1.0]),
        (modal(1)?, &[0.0], [0.9707, 1.1377]),
        (modal(2)?, &[0.0, 0.0], [0.9954, 0.9561]),
    ];
    for (basis, percents, [deflection, curvature]) in table {
        let beam = unit(basis, TipBody::default())?;
        let frequencies = beam.modes(None)?.frequencies;
        for ((found, root), percent) in frequencies.iter().zip(ROOTS).zip(percents) {
            let error = 100.0 * (found / (root * root) - 1.0);
            assert!((error - percent).abs() < 3e-3 * percent + 1e-8, "{error} is not {percent}");
        }
        let load = beam.static_deflection(1.0, 0.0)?;
        close(&[3.0 * beam.at(1.0, &load)[0], beam.at(0.0, &load)[2]], &[deflection, curvature], 1e-4);
    }
    Ok(())
}

/// Flap and lag frequencies of a beam on a hub of that radius, at that speed.
fn rotating(hub: f64, speed: f64) -> Result<[Vec<f64>; 2]> {
    let beam = bezier(14)?;
    let stiffening = beam.centrifugal(hub) * speed.powi(2);
    let flap = beam.modes(Some(&stiffening))?.frequencies;
    let lag = beam.modes(Some(&(stiffening - beam.mass() * speed.powi(2))))?.frequencies;
    Ok([flap, lag])
}

#[test]
fn rotation_stiffens() -> Result<()> {
    // (hub / L, Omega L^2 sqrt(rhoA / EJ), flap, lag).
    let cases = [
        (0.0, 2.0, [4.137_319_573_007_255, 22.614_921_956_175_763], [3.621_796_964_137_335, 22.526_311_174_016_666]),
        (0.0, 12.0, [13.170_150_487_536_521, 37.603_112_331_549_305], [5.427_049_277_693_205, 35.636_975_979_409_165]),
        (1.0, 3.0, [6.081_749_685_017_106, 24.927_745_231_517_61], [5.290_338_290_613_742, 24.746_565_057_749_706]),
        (1.0, 12.0, [19.721_541_935_238_01, 51.070_134_014_008_19], [15.650_534_058_103_63, 49.640_291_983_718_78]),
    ];
    for (hub, speed, flap, lag) in cases {
        let [found_flap, found_lag] = rotating(hub, speed)?;
        close(&found_flap, &flap, 1e-6);
        close(&found_lag, &lag, 1e-6);
    }
    Ok(())
}

#[test]
fn shortening_and_tension_are_two_views_of_one_stiffness() -> Result<()> {
    // int rhoA (hub + mu) S(mu) dmu + m (hub + L) S(L) is int N v'^2 dmu with N the centrifugal force beyond mu.
    let tip = TipBody { mass: 0.7, inertia: 0.0 };
    let beam = unit(Basis::hermite(1.0, 2)?, tip)?;
    let mut sum = beam.shortening(1.0) * (tip.mass * 1.3);
    for at in vpm_core::beam::quadrature::composite(6, &[0.0, 0.5, 1.0]) {
        sum += beam.shortening(at.place) * (at.weight * (0.3 + at.place));
    }
    assert!((sum - beam.centrifugal(0.3)).abs().max() < 1e-12);
    Ok(())
}

#[test]
fn modes_are_a_basis_like_any_other() -> Result<()> {
    let fine = bezier(10)?;
    let coarse = unit(fine.modal_basis(2)?, TipBody::default())?;
    close(&coarse.modes(None)?.frequencies, &fine.modes(None)?.frequencies[..2], 1e-10);
    assert!((coarse.mass() - DMatrix::identity(2, 2)).abs().max() < 1e-9);
    assert!(fine.modal_basis(10).is_err());
    Ok(())
}

#[test]
fn beams_that_cannot_be_are_refused() -> Result<()> {
    let message = unit(Basis::legendre(1.0, 3)?, TipBody::default()).map_err(|error| error.to_string()).unwrap_err();
    assert!(message.contains("vanish at the clamped root"), "{message}");
    assert!(bezier(4)?.modes(Some(&DMatrix::zeros(2, 2))).is_err());
    assert!(bezier(4)?.modes(Some(&DMatrix::repeat(3, 3, f64::NAN))).is_err());
    assert!(modes(&DMatrix::identity(2, 2), &DMatrix::repeat(2, 2, 1.0)).is_err());
    Ok(())
}
