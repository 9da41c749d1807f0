//! Reduced solids: their map, their matrices, and what is refused.

use vpm_core::beam::{Beam, BeamEntry, Level, Material, Reduced, ReducedField, Solid};
use vpm_core::samples::Random;
use vpm_core::{Dual, Result};

use crate::common::derivatives;
use crate::common::entries::{entry, lift};

const MARKS: [f64; 3] = [2.0, 0.0, 1.0];

fn field<const D: usize>(random: &mut Random, modes: usize) -> ReducedField<D> {
    let mut some = |count: usize| (0..count).map(|_| [0.0; D].map(|_| random.symmetric())).collect::<Vec<_>>();
    let mut rest = some(1)[0];
    if D == 6 {
        rest[..3].fill(0.0);
    }
    ReducedField { rest, shapes: some(modes), curved: some(modes * (modes + 1) / 2) }
}

/// A solid of random numbers with two interfaces beside its root.
fn solid(modes: usize) -> Solid {
    let random = &mut Random::new(7);
    Solid {
        squares: (1..=modes).map(|k| 100.0 * k as f64).collect(),
        masses: vec![0.1; 5],
        points: (0..5).map(|_| field(random, modes)).collect(),
        interfaces: (0..2).map(|_| field(random, modes)).collect(),
    }
}

fn link(level: Level, solid: Solid) -> BeamEntry<f64> {
    let mut link = entry(level, &[], 2.0, [0.02, 0.01]);
    link.material = link.material.map(|material| Material { young: 1.5, density: 2.0, ..material });
    (link.sections, link.reduced) = (Vec::new(), Some(Reduced::new(solid)));
    link
}

#[test]
fn columns_twists_and_accelerations_are_derivatives_of_poses() -> Result<()> {
    let mut random = Random::new(3);
    for level in [Level::Reduced(3), Level::Reduced(1)] {
        let entry = link(level, solid(3));
        let moving = lift::<Dual<f64, 1>>(&entry);
        for (beam, moving) in [
            (Beam::new(&entry, &MARKS)?, Beam::new(&moving, &MARKS)?),
            (Beam::first_order(&entry, &MARKS)?, Beam::first_order(&moving, &MARKS)?),
        ] {
            derivatives::are_those_of_poses(&beam, &moving, &mut random, &format!("{level:?}"));
        }
    }
    Ok(())
}

#[test]
fn motions_allocate_nothing() -> Result<()> {
    let beam = Beam::new(&link(Level::Reduced(3), solid(3)), &MARKS)?;
    let (mut out, q, v) = (beam.sections(), [0.1; 3], [0.2; 3]);
    let counted = allocation_counter::measure(|| {
        beam.motion(&q, &v, &mut out);
        std::hint::black_box(beam.slope(&q));
    });
    assert_eq!(counted.count_total, 0);
    Ok(())
}

/// Fewer modes are the first of more, at rest or not.
#[test]
fn the_first_modes_of_a_solid_are_a_solid() -> Result<()> {
    let [few, more] = [2, 3].map(|n| Beam::new(&link(Level::Reduced(n), solid(3)), &MARKS));
    let (few, more) = (few?, more?);
    let (mut one, mut other) = (few.sections(), more.sections());
    few.motion(&[0.1, -0.2], &[0.3, 0.1], &mut one);
    more.motion(&[0.1, -0.2, 0.0], &[0.3, 0.1, 0.0], &mut other);
    assert_eq!(one.at, other.at);
    Ok(())
}

#[test]
fn factors_scale_stiffness_and_mass() -> Result<()> {
    let solid = solid(3);
    let beam = Beam::new(&link(Level::Reduced(3), solid.clone()), &MARKS)?;
    assert_eq!(beam.stiffness(), [150.0, 0.0, 0.0, 0.0, 300.0, 0.0, 0.0, 0.0, 450.0]);
    let mass = beam.mass();
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let product = |point: &ReducedField<3>| (0..3).map(|k| point.shapes[i][k] * point.shapes[j][k]).sum::<f64>();
        let expected: f64 = solid.points.iter().map(|point| 0.2 * product(point)).sum();
        assert!((mass[3 * i + j] - expected).abs() < 1e-14);
    }
    Ok(())
}

fn refusal(level: Level, change: impl FnOnce(&mut Solid, &mut f64), marks: &[f64]) -> String {
    let (mut numbers, mut length) = (solid(3), 2.0);
    change(&mut numbers, &mut length);
    let mut entry = link(level, numbers);
    entry.length = length;
    Beam::new(&entry, marks).err().map_or_else(String::new, |error| error.to_string())
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let cases = [
        (refusal(Level::Reduced(4), |_, _| (), &[]), "number of modes of the reduced solid"),
        (refusal(Level::Strain(2), |_, _| (), &[]), "rigid or reduced"),
        (refusal(Level::Reduced(2), |_, length| *length = 3.0, &[]), "number of interfaces"),
        (refusal(Level::Reduced(2), |_, _| (), &[0.5]), "number of an interface"),
        (refusal(Level::Reduced(2), |solid, _| solid.masses[1] = 0.0, &[]), "positive"),
        (refusal(Level::Reduced(2), |solid, _| solid.points.truncate(4), &[]), "points"),
        (refusal(Level::Reduced(2), |solid, _| solid.points[0].shapes.truncate(2), &[]), "shapes"),
        (refusal(Level::Reduced(2), |solid, _| solid.interfaces[1].curved.truncate(2), &[]), "curved"),
        (refusal(Level::Reduced(2), |solid, _| solid.points[0].rest[1] = f64::NAN, &[]), "finite"),
    ];
    for (message, part) in cases {
        assert!(message.contains(part), "{message:?} does not say {part:?}");
    }
    let mut plain = entry(Level::Reduced(2), &[], 0.8, [0.02, 0.01]);
    plain.reduced = None;
    assert!(Beam::new(&plain, &[]).is_err_and(|error| error.to_string().contains("without a reduced solid")));
}
