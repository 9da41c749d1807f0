//! Layers, given moduli and sections that change along the axis, against closed forms.

use vpm_core::beam::{Beam, Component, Laminate, Layer, Level, Material, Moduli, Section, SectionEntry, Shape};
use vpm_core::{Dual, Result};

use crate::common::entries::{ALL, STEEL, entry};

/// A soft, light core.
const FOAM: Material = Material { young: 70e6, poisson: 0.25, density: 60.0 };
/// A stiff face.
const ALUMINIUM: Material = Material { young: 70e9, poisson: 0.33, density: 2700.0 };

fn laminate(width: f64, layers: &[(f64, Material)]) -> Laminate {
    let layers = layers.iter().map(|&(thickness, material)| Layer { thickness, material }).collect();
    Laminate { width, layers }
}

fn section(width: f64, layers: &[(f64, Material)]) -> Result<Section> {
    Section::of(&Shape::Layers(laminate(width, layers)), None)
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found} is not {expected}");
}

#[test]
fn layers_of_one_material_are_a_rectangle() -> Result<()> {
    let plain = Material { poisson: 0.0, ..STEEL };
    for (width, height) in [(0.02, 0.01), (0.01, 0.02), (0.05, 0.001), (0.001, 0.05)] {
        let whole = Section::new(Shape::Rectangle { width, height }, plain)?;
        let glued = section(width, &[(0.3 * height, plain), (0.2 * height, plain), (0.5 * height, plain)])?;
        for (k, (found, expected)) in glued.stiffness.into_iter().zip(whole.stiffness).enumerate() {
            close(found, expected, 1e-7, &format!("stiffness {k} of {width} x {height}"));
        }
        for (found, expected) in glued.inertia.into_iter().zip(whole.inertia) {
            close(found, expected, 1e-12, "inertia");
        }
        assert!(glued.center.is_some_and(|[x, y]| x == 0.0 && y.abs() < 1e-15));
    }
    Ok(())
}

#[test]
fn a_bimetal_bends_about_its_neutral_axis() -> Result<()> {
    // Timoshenko 1925: one material transformed into the other, here with widths 1 and 3.
    let soft = Material { young: 70e9, poisson: 0.3, density: 2700.0 };
    let (width, lower, upper) = (0.02, 0.003, 0.002);
    let found = section(width, &[(lower, soft), (upper, STEEL)])?;
    let [a, b] = [soft.young * lower * width, STEEL.young * upper * width];
    let neutral = (a * 0.5 * lower + b * (lower + 0.5 * upper)) / (a + b);
    let own = (a * lower * lower + b * upper * upper) / 12.0;
    let bending = own + a * b / (a + b) * (0.5 * (lower + upper)).powi(2);
    close(found.stiffness[0], bending, 1e-13, "EJx");
    close(found.stiffness[5], a + b, 1e-13, "EA");
    let masses = [soft.density * lower, STEEL.density * upper];
    let heavy = (masses[0] * 0.5 * lower + masses[1] * (lower + 0.5 * upper)) / (masses[0] + masses[1]);
    let offset = found.center.map_or(0.0, |[_, y]| y);
    assert!((offset - (heavy - neutral)).abs() < 1e-15, "{offset}");
    Ok(())
}

#[test]
fn a_sandwich_shears_in_its_core() -> Result<()> {
    // Allen 1969, "Analysis and Design of Structural Sandwich Panels": with thin faces and a soft core, GA = G b d^2 / c, d between the
    // middles of the faces and c the core; what the core bends by itself is a third of a per cent here.
    let (width, face, core) = (0.05, 1e-5, 0.02);
    let soft = Material { young: 0.01 * FOAM.young, ..FOAM };
    let found = section(width, &[(face, ALUMINIUM), (core, soft), (face, ALUMINIUM)])?;
    let (d, shear) = (core + face, soft.young / (2.0 * (1.0 + soft.poisson)));
    close(found.stiffness[4], shear * width * d * d / core, 1e-3, "GA through the core");
    close(found.stiffness[0], ALUMINIUM.young * width * face * d * d / 2.0, 4e-3, "EJ of the faces");
    Ok(())
}

#[test]
fn torsion_of_layers_is_that_of_plates_and_walls() -> Result<()> {
    // Wide: GJ = 4 b D66 less what lies in the edges, 0.63 of the height on each of two halves; two widths leave the edges out.
    let stiff = |width: f64| -> Result<f64> {
        Ok(section(width, &[(0.002, ALUMINIUM), (0.006, FOAM), (0.002, ALUMINIUM)])?.stiffness[2])
    };
    let per_width = (stiff(2.0)? - stiff(1.0)?) / 1.0;
    let shear = |material: Material| material.young / (2.0 * (1.0 + material.poisson));
    let cubes = shear(ALUMINIUM) * (0.005_f64.powi(3) - 0.003_f64.powi(3)) + shear(FOAM) * 0.003_f64.powi(3);
    close(per_width, 4.0 * cubes * 2.0 / 3.0, 1e-6, "GJ per width");
    // Tall: each layer is a wall of its own, GJ = sum G t b^3 / 3.
    let narrow = |height: f64| -> Result<f64> {
        Ok(section(0.001, &[(height, STEEL), (2.0 * height, ALUMINIUM)])?.stiffness[2])
    };
    let walls = (shear(STEEL) + 2.0 * shear(ALUMINIUM)) * 1e-9 / 3.0;
    close(narrow(0.2)? - narrow(0.1)?, walls * 0.1, 1e-8, "GJ per height");
    Ok(())
}

#[test]
fn torsion_of_two_layers_agrees_with_finite_differences() -> Result<()> {
    // div(grad phi / G) = -2 on half a section of width 2 and layers of 1, G = 1 below and 3 above, by cells; order 2 in the mesh.
    let [low, high] = [1.0, 3.0].map(|shear| Material { young: 2.0 * shear, poisson: 0.0, density: 1.0 });
    let found = section(2.0, &[(1.0, low), (1.0, high)])?.stiffness[2];
    let rigid = |n: usize| {
        let h = 2.0 / n as f64;
        let weight = |row: usize| if row < n / 2 { 1.0 } else { 1.0 / 3.0 };
        let mut phi = vec![0.0; (n + 1) * (n + 1)];
        let relax = 2.0 / (1.0 + (std::f64::consts::PI / n as f64).sin());
        for _ in 0..20 * n {
            for j in 1..n {
                let (below, above) = (weight(j - 1), weight(j));
                let side = 0.5 * (below + above);
                for i in 1..n {
                    let at = |i: usize, j: usize| phi[j * (n + 1) + i];
                    let around = side * (at(i - 1, j) + at(i + 1, j)) + below * at(i, j - 1) + above * at(i, j + 1);
                    let next = (around + 2.0 * h * h) / (2.0 * side + below + above);
                    let old = at(i, j);
                    phi[j * (n + 1) + i] = old + relax * (next - old);
                }
            }
        }
        2.0 * h * h * phi.iter().sum::<f64>()
    };
    let (coarse, fine) = (rigid(24), rigid(48));
    close(found, fine + (fine - coarse) / 3.0, 1e-4, "GJ");
    Ok(())
}

/// A beam of given moduli that go as the powers of a taper, `1 - mu / (2 L)`.
fn wedge(level: Level, stations: usize) -> vpm_core::beam::BeamEntry<f64> {
    let mut beam = entry(level, &[Component::BendingX], 1.0, [1.0, 1.0]);
    beam.material = None;
    let at = |k: usize| k as f64 / stations as f64;
    let moduli = |mu: f64| {
        let size = 1.0 - 0.5 * mu;
        let numbers = Moduli {
            bending_x: size.powi(3),
            bending_y: 1.0,
            torsion: 1.0,
            extension: 1.0,
            shear_x: None,
            shear_y: None,
            mass: size,
            inertia_x: 0.0,
            inertia_y: 0.0,
        };
        SectionEntry::new(mu, Shape::Stiffness(numbers))
    };
    beam.sections = (0..=stations).map(|k| moduli(at(k))).collect();
    beam
}

/// A wedge of height 1 at the root and 1/2 at the tip, thin against its length 1, by its sizes.
fn thin_wedge(level: Level) -> vpm_core::beam::BeamEntry<f64> {
    let height = 1e-4_f64;
    let mut beam = entry(level, &[Component::BendingX], 1.0, [1.0, 1.0]);
    beam.material = Some(Material { young: 12.0 / height * height.powi(-2), poisson: 0.0, density: 1.0 / height });
    let shape = |size: f64| Shape::Rectangle { width: 1.0, height: height * size };
    beam.sections = vec![SectionEntry::new(0.0, shape(1.0)), SectionEntry::new(1.0, shape(0.5))];
    beam
}

#[test]
fn a_wedge_vibrates_as_bessel_functions_say() -> Result<()> {
    // The wedge of Mabie & Rogers 1972 and Downs 1977: `w = s^(-1/2) C1(2 k s^(1/2))` with `s = 1 - mu / 2`, C the four Bessel functions of
    // Kirchhoff 1879; roots of its determinant for a clamp at the thick end, in double precision by SciPy.
    const ROOTS: [f64; 3] = [3.823_784_847_290_28, 18.317_260_904_174_73, 47.264_827_010_480_6];
    for (level, tolerance) in [(Level::Strain(8), 1e-5), (Level::Bezier(9), 1e-5), (Level::Elements(24), 1e-3)] {
        let modes = Beam::new(&thin_wedge(level), &[])?.modes()?;
        for (k, expected) in ROOTS.into_iter().enumerate() {
            close(modes.frequencies[k], expected, tolerance, &format!("{level:?} mode {k}"));
        }
    }
    let modal = Beam::new(&thin_wedge(Level::Modal(3)), &[])?.modes()?;
    close(modal.frequencies[0], ROOTS[0], 1e-6, "first mode of modal(3)");
    Ok(())
}

#[test]
fn tables_of_moduli_converge_to_the_taper_with_order_two() -> Result<()> {
    let error = |stations: usize| -> Result<f64> {
        let found = Beam::new(&wedge(Level::Strain(8), stations), &[])?.modes()?.frequencies[0];
        Ok(found - Beam::new(&thin_wedge(Level::Strain(8)), &[])?.modes()?.frequencies[0])
    };
    let (coarse, fine) = (error(4)?, error(8)?);
    let order = (coarse / fine).log2();
    assert!((1.9..2.1).contains(&order), "{coarse} {fine}: order {order}");
    Ok(())
}

/// The tip under a force across it, at small deflection, by the stiffness matrix and the column of the tip.
fn tip_flexibility(beam: &vpm_core::beam::BeamEntry<f64>) -> Result<f64> {
    let beam = Beam::new(beam, &[1.0])?;
    let n = beam.len();
    let mut sections = beam.sections();
    let zero = vec![0.0; n];
    beam.motion(&zero, &zero, &mut sections);
    let tip = beam.mark(0);
    let column: Vec<f64> = (0..n).map(|k| sections.columns[tip * n + k].linear.y).collect();
    let stiffness = nalgebra::DMatrix::from_row_slice(n, n, beam.stiffness());
    let load = nalgebra::DVector::from_vec(column);
    let moved = stiffness.lu().solve(&load).unwrap_or_else(|| load.clone() * f64::NAN);
    Ok(load.dot(&moved))
}

#[test]
fn the_tip_of_a_wedge_gives_way_as_its_integral_says() -> Result<()> {
    // v = F int (1 - mu)^2 / (1 - mu / 2)^3 dmu = 8 ln 2 - 5.
    let expected = 8.0 * 2.0_f64.ln() - 5.0;
    for (level, tolerance) in [(Level::Strain(8), 1e-7), (Level::Bezier(9), 1e-7), (Level::Elements(40), 1e-4)] {
        close(tip_flexibility(&thin_wedge(level))?, expected, tolerance, &format!("{level:?}"));
    }
    let order = (tip_flexibility(&thin_wedge(Level::Lumped(20)))? - expected)
        / (tip_flexibility(&thin_wedge(Level::Lumped(40)))? - expected);
    assert!((order.log2() - 2.0).abs() < 0.1, "order {}", order.log2());
    Ok(())
}

#[test]
fn materials_change_along_the_axis() -> Result<()> {
    // E falls linearly to half: v = F int (1 - mu)^2 / (1 - mu / 2) dmu.
    let mut beam = thin_wedge(Level::Strain(10));
    beam.sections[1].shape = beam.sections[0].shape.clone();
    beam.sections[1].material = beam.material.map(|material| Material { young: 0.5 * material.young, ..material });
    // With s = 1 - mu / 2: (1 - mu)^2 / s = (2 s - 1)^2 / s, dmu = -2 ds, s from 1/2 to 1: int 8 s - 8 + 2 / s ds = 2 ln 2 - 1.
    close(tip_flexibility(&beam)?, 2.0 * 2.0_f64.ln() - 1.0, 1e-9, "tip");
    Ok(())
}

#[test]
fn derivatives_by_layers_are_exact() -> Result<()> {
    let base = Shape::Layers(laminate(0.02, &[(0.002, STEEL), (0.006, FOAM), (0.001, ALUMINIUM)]));
    const COUNT: usize = 13;
    let numbers = |section: &Section| -> Vec<f64> {
        section.stiffness.iter().chain(&section.inertia).copied().chain(section.center.into_iter().flatten()).collect()
    };
    let mut lane = 0;
    let dual = base.map(&mut |&value| {
        lane += 1;
        Dual::<f64, COUNT>::variable(value, lane - 1)
    });
    assert_eq!(lane, COUNT);
    let found = Section::of(&dual, None)?;
    let found: Vec<_> =
        found.stiffness.into_iter().chain(found.inertia).chain(found.center.into_iter().flatten()).collect();
    for parameter in 0..COUNT {
        let shifted = |part: f64| -> Result<(Vec<f64>, f64)> {
            let (mut place, mut step) = (0, 0.0);
            let shape = base.map(&mut |&value| {
                place += 1;
                if place - 1 == parameter {
                    step = value * part;
                    return value * (1.0 + part);
                }
                value
            });
            Ok((numbers(&Section::of(&shape, None)?), step))
        };
        let ((up, step), (down, _)) = (shifted(1e-5)?, shifted(-1e-5)?);
        for (k, found) in found.iter().enumerate() {
            let expected = (up[k] - down[k]) / (2.0 * step);
            let scale = (found.value / step * 1e-5).abs();
            let error = (found.gradient[parameter] - expected).abs();
            assert!(error <= 1e-6 * scale + 1e-6 * expected.abs(), "{parameter} {k}: {found:?} {expected}");
        }
    }
    Ok(())
}

#[test]
fn mass_beside_the_axis_couples_and_keeps_the_first_moment() -> Result<()> {
    let mut beam = entry(Level::Strain(3), &ALL, 0.8, [0.02, 0.01]);
    beam.material = None;
    beam.sections = vec![SectionEntry::new(0.0, Shape::Layers(laminate(0.02, &[(0.002, STEEL), (0.02, FOAM)])))];
    let of = section(0.02, &[(0.002, STEEL), (0.02, FOAM)])?;
    let beam = Beam::new(&beam, &[])?;
    let first: f64 = (0..beam.stations()).map(|k| beam.inertia(k).first_moment.y).sum();
    close(first, of.center.map_or(0.0, |[_, y]| y) * of.inertia[3] * 0.8, 1e-12, "first moment");
    Ok(())
}

#[test]
fn a_uniform_laminate_vibrates_with_its_bending_stiffness() -> Result<()> {
    let mut beam = entry(Level::Bezier(7), &[Component::BendingX], 1.0, [1.0, 1.0]);
    beam.material = None;
    let thin = [(1e-5, STEEL), (1e-5, ALUMINIUM)];
    beam.sections = vec![SectionEntry::new(0.0, Shape::Layers(laminate(1e-3, &thin)))];
    let of = section(1e-3, &thin)?;
    let expected = super::ROOTS[0].powi(2) * (of.stiffness[0] / of.inertia[3]).sqrt();
    close(Beam::new(&beam, &[])?.modes()?.frequencies[0], expected, 1e-5, "first frequency");
    Ok(())
}
