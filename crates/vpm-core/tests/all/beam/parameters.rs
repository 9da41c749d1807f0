//! Beams as data: derivatives by their parameters, damping, and what is refused.

use nalgebra::DMatrix;
use vpm_core::beam::{Beam, BeamEntry, Component, DampingEntry, Level, SectionEntry, Shape};
use vpm_core::mount::Mount;
use vpm_core::{Dual, Result};

use Component::{BendingX, BendingY, ShearX, Torsion};

use crate::common::entries;
use crate::common::entries::{ALL, entry};

/// A tapered beam with every kind of damping; `with` fills its parameters.
fn tapered<P>(level: Level, deforms: &[Component], mut with: impl FnMut(f64) -> P) -> BeamEntry<P> {
    let base = BeamEntry {
        sections: vec![
            SectionEntry::new(0.0, Shape::Rectangle { width: 0.02, height: 0.01 }),
            SectionEntry::new(0.8, Shape::Rectangle { width: 0.015, height: 0.008 }),
        ],
        damping: DampingEntry { stiffness: Some(1e-4), mass: Some(0.3), ratios: vec![0.01, 0.02, 0.03] },
        ..entry(level, deforms, 0.8, [1.0, 1.0])
    };
    base.map(&mut |&value| with(value))
}

/// Everything that depends on the parameters.
fn numbers<S: vpm_core::Scalar>(beam: &Beam<S>) -> Vec<S> {
    let inertia = (0..beam.stations()).flat_map(|k| [beam.inertia(k).mass, beam.inertia(k).rotational.xx]);
    beam.stiffness().iter().chain(beam.damping()).copied().chain(inertia).collect()
}

#[test]
fn derivatives_by_parameters_are_exact() -> Result<()> {
    // Young, Poisson, density, four sizes, two Rayleigh factors, three ratios, in the order of `map`.
    const COUNT: usize = 12;
    for level in [Level::Strain(2), Level::Elements(2), Level::Bezier(3), Level::Hermite(2), Level::Lumped(3)] {
        let deforms = [BendingX, BendingY, Torsion, ShearX];
        let mut lane = 0;
        let dual = tapered(level, &deforms, |value| {
            lane += 1;
            Dual::<f64, COUNT>::variable(value, lane - 1)
        });
        assert_eq!(lane, COUNT);
        let found = numbers(&Beam::new(&dual, &[])?);
        for parameter in 0..COUNT {
            let shifted = |part: f64| -> Result<(Vec<f64>, f64)> {
                let (mut place, mut step) = (0, 0.0);
                let entry = tapered(level, &deforms, |value| {
                    place += 1;
                    let here = place - 1 == parameter;
                    step = if here { value * part } else { step };
                    if here { value * (1.0 + part) } else { value }
                });
                Ok((numbers(&Beam::new(&entry, &[])?), step))
            };
            let ((up, step), (down, _)) = (shifted(1e-4)?, shifted(-1e-4)?);
            let scale = found.iter().fold(0.0_f64, |most, x| most.max(x.gradient[parameter].abs()));
            for (k, found) in found.iter().enumerate() {
                let expected = (up[k] - down[k]) / (2.0 * step);
                let error = (found.gradient[parameter] - expected).abs();
                assert!(
                    error < 1e-6 * expected.abs() + 1e-9 * scale,
                    "{level:?} {parameter} {k}: {found:?} {expected}"
                );
            }
        }
    }
    Ok(())
}

#[test]
fn modal_damping_has_second_derivatives() -> Result<()> {
    // omega goes with the square root of Young's modulus, and so does the damping: D'' = -D / (4 E^2).
    let mut steel = entry(Level::Strain(2), &[BendingX], 0.8, [0.02, 0.01]);
    steel.damping.ratios = vec![0.01, 0.02];
    let mut first = true;
    let beam = steel.map(&mut |&value| {
        let inner = Dual::<f64, 1>::variable(value, usize::from(!first));
        let mut number = Dual::<Dual<f64, 1>, 1>::constant(inner);
        if first {
            number = Dual::variable(inner, 0);
        }
        first = false;
        number
    });
    for entry in Beam::new(&beam, &[])?.damping() {
        let expected = -0.25 * entry.value.value / 210e9 / 210e9;
        let found = entry.gradient[0].gradient[0];
        assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found} is not {expected}");
    }
    Ok(())
}

#[test]
fn modal_damping_gives_each_mode_its_ratio() -> Result<()> {
    // A round beam has both planes at one frequency.
    let mut beam = entry(Level::Bezier(4), &[BendingX, BendingY, Torsion], 0.8, [0.02, 0.01]);
    beam.sections[0].shape = Shape::Circle { diameter: 0.02 };
    let n = 10;
    beam.damping.ratios = (1..=n).map(|k| 0.01 * k as f64).collect();
    let beam = Beam::new(&beam, &[])?;
    let modes = beam.modes()?;
    let damping = modes.shapes.tr_mul(&(DMatrix::from_row_slice(n, n, beam.damping()) * &modes.shapes));
    let trace: f64 = (0..n).map(|k| damping[(k, k)] / (2.0 * modes.frequencies[k])).sum();
    assert!((trace - 0.55).abs() < 1e-8, "{trace}");
    for k in (0..n).filter(|&k| {
        let apart = |other: usize| (modes.frequencies[other] / modes.frequencies[k] - 1.0).abs() > 1e-6;
        (0..n).all(|other| other == k || apart(other))
    }) {
        let ratio = damping[(k, k)] / (2.0 * modes.frequencies[k]);
        assert!((ratio - 0.01 * (k + 1) as f64).abs() < 1e-9, "{k}: {ratio}");
    }
    Ok(())
}

#[test]
fn a_beam_may_change_its_level_with_all_its_ratios() -> Result<()> {
    for level in [Level::Rigid, Level::Bezier(2), Level::Lumped(1), Level::Modal(1), Level::Strain(6)] {
        let mut beam = entry(level, &[BendingX], 0.8, [0.02, 0.01]);
        beam.damping.ratios = vec![0.01, 0.02, 0.03];
        let beam = Beam::new(&beam, &[0.8])?;
        assert_eq!(beam.damping().len(), beam.len() * beam.len());
        if let (Some(found), Some(slowest)) = (beam.damping().first(), beam.modes()?.frequencies.first()) {
            assert!(beam.len() > 1 || (found / (0.02 * slowest * beam.mass()[0]) - 1.0).abs() < 1e-12);
        }
    }
    Ok(())
}

#[test]
fn modes_keep_their_shape_when_stiffness_or_mass_scales() -> Result<()> {
    // Young's modulus and density, the first and third parameters.
    for (parameter, lane) in [(0, 0), (2, 1)] {
        let make = |part: f64| {
            let mut beam = entry(Level::Modal(2), &[BendingX, Torsion], 0.8, [0.02, 0.01]);
            beam.damping.ratios = vec![0.01, 0.02];
            let mut place = 0;
            beam.map(&mut |&value| {
                place += 1;
                let scaled = if place - 1 == parameter { value * (1.0 + part) } else { value };
                let variable = if place - 1 == parameter { lane } else { usize::MAX };
                Dual::<f64, 2>::variable(scaled, variable)
            })
        };
        let [middle, up, down] =
            [Beam::new(&make(0.0), &[])?, Beam::new(&make(1e-4), &[])?, Beam::new(&make(-1e-4), &[])?];
        let value = if parameter == 0 { 210e9 } else { 7850.0 };
        let inertia = |beam: &Beam<_>| (0..beam.stations()).map(|k| beam.inertia(k).mass).collect();
        let groups = |beam: &Beam<Dual<f64, 2>>| [beam.stiffness().to_vec(), beam.damping().to_vec(), inertia(beam)];
        for ((middle, up), down) in groups(&middle).iter().zip(groups(&up)).zip(groups(&down)) {
            let scale = middle.iter().fold(0.0_f64, |most, x| most.max(x.value.abs()));
            for (k, found) in middle.iter().enumerate() {
                // How much the entry changes per relative change of the parameter; shapes are known to 1e-8 only.
                let (found, expected) = (found.gradient[lane] * value, (up[k].value - down[k].value) / 2e-4);
                assert!((found - expected).abs() < 1e-7 * scale, "{parameter} {k}: {found} is not {expected}");
            }
        }
    }
    Ok(())
}

#[test]
fn rayleigh_damping_is_what_it_says() -> Result<()> {
    let mut beam = entry(Level::Strain(3), &[BendingX], 0.8, [0.02, 0.01]);
    (beam.damping.stiffness, beam.damping.mass) = (Some(2e-4), Some(0.5));
    let beam = Beam::new(&beam, &[])?;
    for (k, found) in beam.damping().iter().enumerate() {
        let expected = 2e-4 * beam.stiffness()[k] + 0.5 * beam.mass()[k];
        assert!((found - expected).abs() <= 1e-14 * expected.abs().max(1e-3), "{found} is not {expected}");
    }
    Ok(())
}

#[test]
fn surfaces_strain_by_their_distance() -> Result<()> {
    for level in [Level::Strain(3), Level::Elements(3), Level::Bezier(4), Level::Hermite(3), Level::Modal(2)] {
        let beam = Beam::new(&entry(level, &ALL, 0.8, [0.02, 0.01]), &[])?;
        let n = beam.len();
        let q: Vec<f64> = (0..n).map(|k| 1e-3 * (k as f64 + 1.0).sin()).collect();
        // The strains hold the energy that the stiffness says.
        let section = vpm_core::beam::Section::new(Shape::Rectangle { width: 0.02, height: 0.01 }, entries::STEEL)?;
        let breaks: Vec<f64> = (0..=3).map(|k| 0.8 * f64::from(k) / 3.0).collect();
        let mut energy = 0.0;
        for at in vpm_core::beam::quadrature::composite(12, &breaks) {
            let strain = beam.strain(at.place, &q);
            energy += (0..6).map(|k| 0.5 * at.weight * section.stiffness[k] * strain[k] * strain[k]).sum::<f64>();
        }
        let mut work = 0.0;
        for i in 0..n {
            work += (0..n).map(|j| 0.5 * q[i] * beam.stiffness()[i * n + j] * q[j]).sum::<f64>();
        }
        assert!((energy / work - 1.0).abs() < 1e-10, "{level:?}: {energy} is not {work}");
    }
    Ok(())
}

fn message(change: impl FnOnce(&mut BeamEntry<f64>)) -> String {
    let mut beam = entry(Level::Strain(3), &[BendingX], 0.8, [0.02, 0.01]);
    change(&mut beam);
    Beam::new(&beam, &[0.4]).map_or_else(|error| error.to_string(), |_| "no error".to_owned())
}

#[test]
fn impossible_beams_are_refused_by_name() {
    let rectangle = |width, height| Shape::Rectangle { width, height };
    type Change = Box<dyn FnOnce(&mut BeamEntry<f64>)>;
    let cases: Vec<(&str, Change)> = vec![
        ("`arm.length` must be positive, got 0", Box::new(|beam| beam.length = 0.0)),
        ("`arm.at` must lie between 0 and the length", Box::new(|beam| beam.length = 0.3)),
        ("`arm.level` must lie between 1 and 12", Box::new(|beam| beam.level = Level::Strain(0))),
        ("`arm.level` must lie between 2 and 12", Box::new(|beam| beam.level = Level::Bezier(1))),
        ("`arm.deforms` must name at least one component", Box::new(|beam| beam.deforms.clear())),
        ("`arm.deforms` must name every component once", Box::new(|beam| beam.deforms.push(BendingX))),
        ("`arm.section.width` must be positive", Box::new(move |beam| beam.sections[0].shape = rectangle(-1.0, 0.1))),
        ("`arm.young` must be positive", Box::new(|beam| beam.material.iter_mut().for_each(|of| of.young = 0.0))),
        ("`arm.poisson` must lie above -1", Box::new(|beam| beam.material.iter_mut().for_each(|of| of.poisson = 0.6))),
        (
            "`arm.density` must be a finite number",
            Box::new(|beam| beam.material.iter_mut().for_each(|of| of.density = f64::NAN)),
        ),
        ("`arm.sections` must hold at least one section", Box::new(|beam| beam.sections.clear())),
        ("`arm.damping.mass` must be zero or positive", Box::new(|beam| beam.damping.mass = Some(-1.0))),
        ("`arm.damping.ratios.1` must be zero or positive", Box::new(|beam| beam.damping.ratios = vec![0.1, -0.1])),
        (
            "`arm.section.1.at` must lie between 0 and the length",
            Box::new(move |beam| beam.sections.push(SectionEntry::new(0.9, rectangle(0.1, 0.1)))),
        ),
        (
            "`arm.section.1.at` must lie beyond the section before it",
            Box::new(move |beam| beam.sections.push(SectionEntry::new(0.0, rectangle(0.1, 0.1)))),
        ),
        (
            "`arm.section.1.shape` must have the same kind of shape",
            Box::new(|beam| beam.sections.push(SectionEntry::new(0.8, Shape::Circle { diameter: 0.1 }))),
        ),
    ];
    for (expected, change) in cases {
        let found = message(change);
        assert!(found.starts_with(expected), "{found}");
    }
    assert_eq!(message(|_| ()), "no error");
}

const JSON: &str = r#"{"name": "upper", "on": {"body": 2}, "translation": [0, 0, 0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
    "length": 0.44, "level": {"strain": 3}, "deforms": ["bending_x", "torsion"],
    "material": {"young": 0, "poisson": 1, "density": 2},
    "sections": [{"at": 0, "shape": {"shape": "rectangle", "width": 3, "height": 4}}],
    "damping": {"stiffness": 5, "mass": null, "ratios": [6]}}"#;

fn read(text: &str) -> std::result::Result<BeamEntry<usize>, serde_json::Error> {
    serde_json::from_str(text)
}

#[test]
fn beams_are_read_from_a_description() -> std::result::Result<(), serde_json::Error> {
    let beam = read(JSON)?;
    assert_eq!((beam.on, beam.level), (Mount::Body(2), Level::Strain(3)));
    assert_eq!(beam.deforms, [BendingX, Torsion]);
    assert_eq!(beam.sections[0].shape, Shape::Rectangle { width: 3, height: 4 });
    assert_eq!((beam.damping.stiffness, beam.damping.mass, &beam.damping.ratios[..]), (Some(5), None, &[6][..]));
    let mut places = Vec::new();
    beam.map(&mut |&place| places.push(place));
    assert_eq!(places, [0, 1, 2, 3, 4, 5, 6]);
    for (from, to, expected) in [
        ("bending_x", "bending", "beam `upper`: unknown variant `bending`"),
        ("\"width\"", "\"breadth\"", "beam `upper`: "),
        ("\"length\"", "\"size\"", "beam `upper`: unknown field `size`"),
        ("{\"strain\": 3}", "\"rigid\"", ""),
        ("{\"body\": 2}", "\"world\"", ""),
        ("{\"body\": 2}", "{\"section\": {\"beam\": 1, \"at\": 0.2}}", ""),
    ] {
        let found = read(&JSON.replace(from, to)).map_or_else(|error| error.to_string(), |_| String::new());
        assert!(found.starts_with(expected) && found.is_empty() == expected.is_empty(), "{to}: {found}");
    }
    Ok(())
}
