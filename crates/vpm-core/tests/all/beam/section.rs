//! Sections, quadrature and shape functions against closed forms.

use std::f64::consts::PI;

use nalgebra::DMatrix;
use vpm_core::Result;
use vpm_core::beam::quadrature::gauss;
use vpm_core::beam::{Basis, Material, Properties, Section, Shape};

use crate::common::entries::STEEL;

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found} is not {expected}");
}

#[test]
fn a_steel_strip_has_the_stiffness_of_the_textbook() -> Result<()> {
    let section = Section::new(Shape::Rectangle { width: 0.015, height: 0.004 }, STEEL)?;
    close(section.stiffness[0], 16.8, 1e-12);
    close(section.stiffness[5], 12.6e6, 1e-12);
    close(section.line_density(), 0.471, 1e-12);
    close(section.inertia[0], 6.28e-7, 1e-12);
    close(section.stiffness[3] / (80_769_230_769.230_77 * 6e-5), 0.849_673_202_614_379_1, 1e-12);
    Ok(())
}

#[test]
fn torsion_of_rectangles_follows_the_tables() -> Result<()> {
    // Timoshenko & Goodier 1970, section 109: k1 with J = k1 a b^3, printed with three figures.
    for (ratio, factor) in [(1.0, 0.1406), (2.0, 0.229), (4.0, 0.281), (10.0, 0.312)] {
        for (width, height) in [(ratio, 1.0), (1.0, ratio)] {
            let torsion = Shape::Rectangle { width, height }.properties(0.3)?.torsion;
            assert!((torsion / ratio - factor).abs() < 6e-4, "{torsion}");
        }
    }
    Ok(())
}

#[test]
fn round_sections_agree_with_each_other() -> Result<()> {
    let circle = Shape::Circle { diameter: 0.02 }.properties(0.3)?;
    let thick = Shape::Tube { outer: 0.02, inner: 1e-9 }.properties(0.3)?;
    close(circle.area, PI * 1e-4, 1e-14);
    close(circle.moment_x, PI * 0.02_f64.powi(4) / 64.0, 1e-14);
    close(circle.shear_x, 6.0 * 1.3 / (7.0 + 6.0 * 0.3), 1e-14);
    close(thick.shear_x, circle.shear_x, 1e-12);
    close(thick.torsion, circle.torsion, 1e-12);
    // A tube and what was bored out of it are the full circle.
    let [tube, bore] = [Shape::Tube { outer: 0.02, inner: 0.013 }, Shape::Circle { diameter: 0.013 }]
        .map(|shape| shape.properties(0.3));
    let (tube, bore) = (tube?, bore?);
    close(tube.area + bore.area, circle.area, 1e-14);
    close(tube.moment_y + bore.moment_y, circle.moment_y, 1e-14);
    close(tube.torsion + bore.torsion, circle.torsion, 1e-14);
    close(circle.torsion, circle.moment_x + circle.moment_y, 1e-14);
    // Cowper's thin tube: 2 (1 + nu) / (4 + 3 nu).
    let thin = Shape::Tube { outer: 1.0, inner: 0.9999 }.properties(0.3)?;
    close(thin.shear_y, 2.6 / 4.9, 1e-3);
    Ok(())
}

#[test]
fn an_i_is_a_rectangle_less_two() -> Result<()> {
    let (width, height, flange, web) = (0.1, 0.2, 0.01, 0.006);
    let i = Shape::I { width, height, flange, web }.properties(0.3)?;
    let [full, cut] = [(width, height), (width - web, height - 2.0 * flange)].map(|(w, h)| w * h.powi(3) / 12.0);
    close(i.moment_x, full - cut, 1e-12);
    close(i.area, width * height - (width - web) * (height - 2.0 * flange), 1e-12);
    // As wide in the web as in the flanges it is the full rectangle, about y too.
    let filled = Shape::I { width, height, flange, web: width * (1.0 - 1e-12) }.properties(0.3)?;
    close(filled.moment_y, height * width.powi(3) / 12.0, 1e-11);
    // Of thin plates each turns for itself, as Saint-Venant's rectangle; across, those along the force carry it.
    let (flange, web) = (2e-5, 1e-5);
    let thin = Shape::I { width, height, flange, web }.properties(0.3)?;
    let plate = |width: f64, height: f64| Shape::Rectangle { width, height }.properties(0.0);
    let (top, middle) = (plate(width, flange)?, plate(web, height - 2.0 * flange)?);
    close(thin.torsion, 2.0 * top.torsion + middle.torsion, 1e-3);
    close(thin.moment_y, 2.0 * top.moment_y + middle.moment_y, 1e-12);
    close(thin.shear_x * thin.area, 2.0 * top.shear_x * top.area, 1e-12);
    close(thin.shear_y * thin.area, middle.area, 1e-12);
    Ok(())
}

#[test]
fn a_rectangle_on_its_side_swaps_its_moments() -> Result<()> {
    let [upright, lying] =
        [(0.02, 0.05), (0.05, 0.02)].map(|(width, height)| Shape::Rectangle { width, height }.properties(0.3));
    let (upright, lying) = (upright?, lying?);
    close(upright.moment_x, 0.02 * 0.05_f64.powi(3) / 12.0, 1e-14);
    close(upright.moment_y, lying.moment_x, 1e-14);
    close(upright.moment_x, lying.moment_y, 1e-14);
    // Cowper 1966: 10 (1 + nu)/(12 + 11 nu) both ways.
    close(upright.shear_x, 13.0 / 15.3, 1e-14);
    close(upright.shear_y, lying.shear_x, 1e-14);
    Ok(())
}

#[test]
fn ratios_of_poisson_reach_from_minus_one_to_a_half() {
    let refused = |poisson| Section::new(Shape::Circle { diameter: 0.01 }, Material { poisson, ..STEEL }).is_err();
    // E = 2 G (1 + nu) and K = E/(3 (1 - 2 nu)) are positive in between; at a half the solid keeps its volume.
    assert!([-0.999, 0.0, 0.5].map(refused).iter().all(|refused| !refused));
    assert!([-1.05, -1.0, 0.501, f64::NAN].map(refused).iter().all(|&refused| refused));
}

#[test]
fn sections_that_cannot_be_are_refused() {
    let section = |shape| Section::new(shape, STEEL).map_err(|error| error.to_string()).unwrap_err();
    assert!(section(Shape::Rectangle { width: 0.0, height: 1.0 }).contains("`section.width` must be positive, got 0"));
    assert!(section(Shape::Tube { outer: 0.01, inner: 0.02 }).contains("`section.inner` must be smaller"));
    assert!(section(Shape::I { width: 0.1, height: 0.02, flange: 0.01, web: 0.01 }).contains("`section.flange`"));
    assert!(section(Shape::Circle { diameter: f64::NAN }).contains("finite"));
    let given = Properties { area: 1.0, moment_x: 1.0, moment_y: -1.0, torsion: 1.0, shear_x: 1.0, shear_y: 1.0 };
    assert!(section(Shape::Given(given)).contains("`section.moment_y`"));
    let soft = Material { poisson: 0.7, ..STEEL };
    assert!(Section::new(Shape::Circle { diameter: 0.01 }, soft).is_err());
    assert!(Section::given([1.0; 6], [1.0, 1.0, 1.0, 2.0, 1.0, 2.0]).is_err());
}

#[test]
fn gauss_rules_are_exact_to_their_degree() {
    for count in 1..=20 {
        for power in 0..2 * count {
            let sum: f64 = gauss(count, 0.0, 2.0).iter().map(|at| at.weight * at.place.powi(power as i32)).sum();
            close(sum, 2.0_f64.powi(power as i32 + 1) / (power + 1) as f64, 1e-13);
        }
    }
}

fn every_basis() -> Result<Vec<Basis>> {
    let base = Basis::bernstein(0.7, 5, 2)?;
    let mixed =
        Basis::combination(base, DMatrix::from_fn(4, 2, |row, column| (row as f64 - 1.3) * (column as f64 + 0.4)))?;
    Ok(vec![
        Basis::bernstein(0.7, 6, 0)?,
        Basis::hermite(0.7, 3)?,
        Basis::legendre(0.7, 6)?,
        Basis::monomial(0.7, 6)?,
        mixed,
    ])
}

#[test]
fn derivatives_are_those_of_the_functions() -> Result<()> {
    for basis in every_basis()? {
        for mu in [0.05, 0.31, 0.6] {
            for order in 0..2 {
                let [before, after] = [mu - 1e-5, mu + 1e-5].map(|place| basis.evaluate(place, order));
                let slopes = basis.evaluate(mu, order + 1);
                assert_eq!(slopes.len(), basis.len());
                for ((a, b), slope) in before.iter().zip(&after).zip(&slopes) {
                    // The difference quotient itself is good to about 1e-6 of the largest third derivative.
                    assert!(
                        ((b - a) / 2e-5 - slope).abs() < 2e-5 * slope.abs().max(10.0),
                        "{slope} {}",
                        (b - a) / 2e-5
                    );
                }
            }
        }
    }
    Ok(())
}

#[test]
fn bernstein_polynomials_share_out_one_and_clamp_the_root() -> Result<()> {
    let all = Basis::bernstein(2.0, 7, 0)?;
    close(all.evaluate(0.83, 0).iter().sum(), 1.0, 1e-14);
    let clamped = Basis::bernstein(2.0, 7, 2)?;
    assert_eq!(clamped.len(), 6);
    assert!(clamped.evaluate(0.0, 0).iter().chain(&clamped.evaluate(0.0, 1)).all(|value| value.abs() < 1e-15));
    Ok(())
}

#[test]
fn functions_of_nodes_are_one_at_their_own() -> Result<()> {
    let (length, elements) = (0.7, 3);
    let unit = |count: usize, own: Option<usize>| -> Vec<f64> {
        (0..count).map(|k| if Some(k) == own { 1.0 } else { 0.0 }).collect()
    };
    let check = |found: Vec<f64>, expected: Vec<f64>| {
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-13), "{found:?} {expected:?}");
    };
    let cubic = Basis::hermite(length, elements)?;
    for node in 0..=elements {
        let mu = length * node as f64 / elements as f64;
        // Deflection and slope of each node but the root; hats of all nodes, or of those but the root.
        check(cubic.evaluate(mu, 0), unit(6, node.checked_sub(1).map(|k| 2 * k)));
        check(cubic.evaluate(mu, 1), unit(6, node.checked_sub(1).map(|k| 2 * k + 1)));
        check(Basis::linear(length, elements, 0)?.evaluate(mu, 0), unit(4, Some(node)));
        check(Basis::linear(length, elements, 1)?.evaluate(mu, 0), unit(3, node.checked_sub(1)));
    }
    assert_eq!([0, 1].map(|clamped| Basis::linear(length, elements, clamped).map(|basis| basis.len())), [Ok(4), Ok(3)]);
    // Between them a hat falls evenly, by the same on every element.
    check(Basis::linear(length, elements, 0)?.evaluate(0.25 * length, 0), vec![0.25, 0.75, 0.0, 0.0]);
    let slope = elements as f64 / length;
    check(Basis::linear(length, elements, 0)?.evaluate(0.25 * length, 1), vec![-slope, slope, 0.0, 0.0]);
    Ok(())
}

#[test]
fn bases_of_impossible_size_are_refused() {
    assert!(Basis::bernstein(1.0, 1, 2).is_err());
    assert!(Basis::hermite(1.0, 0).is_err());
    assert!(Basis::legendre(-1.0, 3).is_err());
    assert!(Basis::monomial(1.0, 40).is_err());
    assert!(Basis::legendre(1.0, 2).and_then(|base| Basis::combination(base, DMatrix::zeros(3, 1))).is_err());
}
