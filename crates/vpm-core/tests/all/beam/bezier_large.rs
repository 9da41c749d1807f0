//! Bezier centrelines at large deflection: closed forms, another element, energy.

use std::f64::consts::{FRAC_PI_2, TAU};

use vpm_core::beam::witness::two_node::{NodeLoad, TwoNodeChain, rotation};
use vpm_core::beam::{
    Beam, BeamEntry, Component, DampingEntry, Level, Material, Properties, Section, SectionEntry, Shape,
};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::Mount;
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::{Result, evaluate};

use crate::common::entries;
use crate::common::sums;
use crate::common::trees;
use entries::entry;
use sums::{Load, Root, equilibrium, tip};

use Component::{BendingX, BendingY, Extension, Torsion};

/// A beam of length 1 with `EJ = (1, ratio)`, `GJ` and next to no rotary inertia; it hardly stretches.
fn unit(level: Level, deforms: &[Component], [ratio, twist, stretch]: [f64; 3]) -> BeamEntry<f64> {
    let (young, small) = (1e10, 1e-10);
    let area = stretch / young;
    // The shear stiffness goes with the area; no beam of this page shears.
    let shear = 1e9 / (0.5 * stretch);
    let shape = Shape::Given(Properties {
        area,
        moment_x: small,
        moment_y: ratio * small,
        torsion: 2.0 * twist * small,
        shear_x: shear,
        shear_y: shear,
    });
    BeamEntry {
        material: Some(Material { young, poisson: 0.0, density: 1.0 / area }),
        sections: vec![SectionEntry::new(0.0, shape)],
        rest: Vec::new(),
        ..entry(level, deforms, 1.0, [1.0, 1.0])
    }
}

/// Alike in both planes and all but inextensible.
const EVEN: [f64; 3] = [1.0, 1.0, 1e9];
const STILL: [f64; 3] = [0.0; 3];

/// Error of the tip (in the plane of x and z), of a beam that a load bends.
fn error(beam: &BeamEntry<f64>, load: Load, exact: [f64; 2]) -> Result<f64> {
    let found = tip(beam, &equilibrium(beam, &load, &Root::resting(STILL), 12)?)?;
    Ok((found[0] - exact[0]).hypot(found[2] - exact[1]))
}

#[test]
fn a_moment_at_the_tip_bends_it_into_an_arc() -> Result<()> {
    // Constant curvature, which every degree holds: what is left is the integration along the axis. The plane has three Gauss points
    // between stations (sixth order), space one exponential, exact for a constant strain.
    for (deforms, degree, tolerance) in [
        (&[BendingY][..], 2, 1e-5),
        (&[BendingY], 4, 1e-6),
        (&[BendingY, Torsion], 2, 1e-11),
        (&[BendingY, Torsion], 5, 1e-11),
    ] {
        let beam = unit(Level::Bezier(degree), deforms, EVEN);
        for turns in [0.125, 0.25, 0.5, 0.75, 1.0] {
            let phi: f64 = turns * TAU;
            let load = Load { moment: [0.0, phi, 0.0], ..Load::default() };
            let found = error(&beam, load, [(1.0 - phi.cos()) / phi, phi.sin() / phi])?;
            assert!(found < tolerance, "degree {degree} of {deforms:?} at {turns}: {found:e}");
        }
    }
    // The same moment with the deflection of second order, an eighth of a turn: 4 % of the length.
    let phi: f64 = 0.125 * TAU;
    let second = unit(Level::Deflection(2), &[BendingY], EVEN);
    let load = Load { moment: [0.0, phi, 0.0], ..Load::default() };
    let found = error(&second, load, [(1.0 - phi.cos()) / phi, phi.sin() / phi])?;
    assert!((0.01..0.1).contains(&found), "{found}");
    Ok(())
}

/// `P L^2 / EJ`, tip across and shortening over the length: elliptic integrals (Mattiasson 1981).
const ELASTICA: [[f64; 3]; 4] = [
    [1.0, 0.301_720_773_799_813_55, 0.056_433_236_283_376_88],
    [3.0, 0.603_253_441_129_977_4, 0.254_420_184_564_187_1],
    [6.0, 0.744_571_148_889_515_3, 0.434_588_828_681_905_1],
    [10.0, 0.810_609_024_880_296_4, 0.554_995_597_753_751_3],
];

#[test]
fn a_force_at_the_tip_bends_the_elastica_the_closer_the_higher_the_degree() -> Result<()> {
    for [force, across, along] in ELASTICA {
        let load = Load { force: [force, 0.0, 0.0], ..Load::default() };
        let at = |degree| error(&unit(Level::Bezier(degree), &[BendingY], EVEN), load, [across, 1.0 - along]);
        let [coarse, middle, fine, finest] = [at(3)?, at(5)?, at(8)?, at(10)?];
        // The curvature is a smooth function: two or three degrees more are worth a decade until the integration is seen.
        assert!(middle < 0.1 * coarse && fine < 0.1 * middle.max(1e-6), "{force}: {coarse:e} {middle:e} {fine:e}");
        assert!(finest < 1e-6, "{force}: {finest:e}");
    }
    Ok(())
}

#[test]
fn in_space_chains_of_two_node_elements_tend_to_it() -> Result<()> {
    // Unequal bending, soft twist: a force across, a pull and a moment about all axes give a space curve, half a radian and more from the root.
    let load = Load { force: [1.2, -0.8, 0.5], moment: [0.3, 0.2, 0.6] };
    let beam = unit(Level::Bezier(9), &[BendingX, BendingY, Torsion, Extension], [2.0, 0.7, 400.0]);
    let bent = Beam::new(&beam, &[1.0])?;
    let q = equilibrium(&beam, &load, &Root::resting(STILL), 4)?;
    let mut out = bent.sections();
    bent.motion(&q, &vec![0.0; q.len()], &mut out);
    let exact = out.at[bent.mark(0)].pose;
    assert!(exact.rotation.columns[2].z < 0.5_f64.cos(), "the tip leans {}", exact.rotation.columns[2].z);
    let section = Section::of(&beam.sections[0].shape, beam.material.as_ref())?;
    let solved = |count: usize| -> Result<[f64; 6]> {
        let chain = TwoNodeChain::new(&section, 1.0, count)?;
        let mut x = chain.straight();
        for stage in (1..=20).map(|k| f64::from(k) / 20.0) {
            let [force, moment] = [load.force, load.moment].map(|load| load.map(|entry| stage * entry));
            x = chain.equilibrium(&x, &NodeLoad { force, moment })?;
        }
        let end = &x[x.len() - 7..];
        let turn = rotation([3, 4, 5, 6].map(|k| end[k])).columns[0].to_array();
        Ok(std::array::from_fn(|k| if k < 3 { end[k] } else { turn[k - 3] }))
    };
    let [coarse, middle, fine] = [solved(8)?, solved(16)?, solved(32)?];
    let goal = [exact.translation.to_array(), exact.rotation.columns[0].to_array()].concat();
    let gap = |found: &[f64; 6]| found.iter().zip(&goal).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    for order in [(gap(&coarse) / gap(&middle)).log2(), (gap(&middle) / gap(&fine)).log2()] {
        assert!((order - 2.0).abs() < 0.1, "order {order}");
    }
    // Richardson's extrapolation takes the square of the element's length away.
    let limit: [f64; 6] = std::array::from_fn(|k| (4.0 * fine[k] - middle[k]) / 3.0);
    assert!(gap(&limit) < 2e-5, "{:e} of {:e}", gap(&limit), gap(&fine));
    Ok(())
}

#[test]
fn a_soft_swing_keeps_its_energy() -> Result<()> {
    // A rubber strip on a pin, let go from the horizontal: it bends by more than half a radian. Nothing damps it.
    for deforms in [&[BendingY][..], &[BendingX, BendingY, Torsion]] {
        let mut parts = Parts { gravity: [0.0, 1.0, -9.81], ..Parts::default() };
        parts.bodies.push(trees::body(&mut Random::new(1), "pin", Mount::World, JointKind::Revolute));
        let mut strip = entry(Level::Bezier(4), deforms, 0.8, [0.02, 0.02]);
        (strip.on, strip.damping) = (Mount::Body(0), DampingEntry::default());
        strip.material = Some(Material { young: 2e7, poisson: 0.3, density: 1100.0 });
        parts.beams.push(strip);
        let joint = &mut parts.bodies[0].joint;
        (joint.axis, joint.rotation, joint.translation) = ([0.0, 1.0, 0.0], trees::UPRIGHT, STILL);
        let d = trees::description(&parts, |_| ());
        let (n, mut x) = (d.n_coordinates(), vec![0.0; d.n_states()]);
        x[0] = FRAC_PI_2;
        let mut system = d.system::<f64>(&d.parameters)?;
        let mut integrator = Integrator::new(Method::Rk4, system.dim());
        let (mut drift, mut size, mut slope, mut first) = (0.0_f64, 0.0_f64, 0.0_f64, None);
        for _ in 0..40 {
            for _ in 0..200 {
                integrator.step(&mut system, &mut x, 1e-4);
            }
            let (kinetic, potential) = evaluate::energy(&d, &d.parameters, &x[..n], &x[n..2 * n])?;
            let begin = *first.get_or_insert(kinetic + potential);
            (drift, size) = (drift.max((kinetic + potential - begin).abs()), size.max(kinetic));
            // The slope that the same control points have as a small deflection: 4 (b_4 - b_3) / L at the tip.
            slope = slope.max((4.0 * (x[1 + n_bending(deforms) - 1] - x[1 + n_bending(deforms) - 2]) / 0.8).abs());
        }
        assert!(slope > 0.5, "it only bends by {slope} rad");
        assert!(drift < 1e-8 * size, "{drift:e} of {size:e}");
    }
    Ok(())
}

/// Coordinates of the bendings before the last control point of bending about y.
fn n_bending(deforms: &[Component]) -> usize {
    3 * deforms.iter().filter(|part| matches!(part, BendingX | BendingY)).count()
}
