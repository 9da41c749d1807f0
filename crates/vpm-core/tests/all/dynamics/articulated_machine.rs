//! Machines whose accelerations come from articulated bodies: what contacts, bushings, effects and drives on lines do to them.

use serde_json::{Value, json};
use vpm_core::beam::Level;
use vpm_core::description::Description;
use vpm_core::mount::Mount;
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::{Error, Result};

use crate::common::connections;
use crate::common::trees;
use connections::{bushing, contact};
use trees::{description, everything, model, parameter, push};

/// Joints of the machine.
const JOINTS: usize = 5;

/// Bodies and beams of elements and of rigid segments on each other, with lines that weigh nothing; on one of them a spring, if asked for.
fn machine(seed: u64, spring: bool) -> Result<Description> {
    let mut parts = everything(seed);
    parts.beams[0].level = Level::Elements(4);
    parts.beams[1].level = Level::Lumped(3);
    parts.beams.iter_mut().for_each(|beam| beam.damping.mass = None);
    parts.lines.iter_mut().for_each(|line| (line.barrel, line.rod) = (None, None));
    assert!(model::<f64>(&parts)?.is_articulated());
    let description = description(&parts, |content| {
        let ([stiffness, rest], zero) = (["stiffness", "rest"].map(|name| parameter(content, name, 3.0)), [0.0; 3]);
        push(content, "effects", json!({"type": "spring", "joint": 1, "stiffness": stiffness, "rest": rest}));
        let hand = ("hand", Mount::Body(4), [0.05, 0.02, 0.1]);
        // So far out that the hand is behind the plane wherever it is.
        contact(content, hand, [[0.0, 0.0, 9.0], [0.0, 0.0, 1.0]], [50.0, 1.0, 0.2, 0.1], Some([0.5, 0.1, 0.4, 0.2]));
        let ends = [(Mount::Body(0), [0.1, 0.0, 0.0]), (Mount::World, zero)];
        bushing(content, "mount", ends, [40.0; 6], [0.3; 6], [0.5; 6]);
        if spring {
            put_spring(content);
        }
    });
    Ok(description)
}

fn put_spring(content: &mut Value) {
    let [stiffness, length, damping] = [("line.stiffness", 80.0), ("line.length", 0.4), ("line.damping", 2.0)]
        .map(|(name, value)| parameter(content, name, value));
    let drive = json!({"type": "spring_damper", "stiffness": stiffness, "free_length": length, "damping": damping});
    push(content, "actuators", json!({"name": "strut", "on": {"line": 1}, "drive": drive}));
}

fn state(random: &mut Random, n: usize) -> [Vec<f64>; 3] {
    [0.2, 1.0, 3.0].map(|size| random.numbers(n, size))
}

#[test]
fn inverse_dynamics_undoes_forward_dynamics() -> Result<()> {
    for seed in 0..10 {
        let description = machine(seed, false)?;
        let mut system = description.system::<f64>(&description.parameters)?;
        let (dynamics, random) = (system.dynamics(), &mut Random::new(seed));
        let n = dynamics.coordinates();
        let ([q, v, efforts], mut back) = (state(random, n), vec![0.0; n]);
        let a = dynamics.forward_dynamics(&q, &v, &efforts).to_vec();
        dynamics.inverse_dynamics(&q, &v, &a, &mut back);
        let size = a.iter().fold(1.0_f64, |most, a| most.max(a.abs()));
        for (k, (back, effort)) in back.iter().zip(&efforts).enumerate() {
            assert!((back - effort).abs() < 1e-9 * size.max(10.0), "seed {seed}, {k}: {back} is not {effort}");
        }
    }
    Ok(())
}

/// The Jacobian with drives goes by the residual of inverse dynamics and a mass matrix; the rates by articulated bodies.
#[test]
fn the_jacobian_with_a_drive_on_a_line_is_that_of_the_rates() -> Result<()> {
    for seed in 0..4 {
        let description = machine(seed, true)?;
        let mut system = description.system::<f64>(&description.parameters)?;
        let (dim, n) = (system.dim(), system.coordinates());
        let [mut q, v, _] = state(&mut Random::new(seed), n);
        // Beams are so stiff that the accelerations at large strains would drown the differences in rounding.
        q.iter_mut().skip(JOINTS).for_each(|strain| *strain *= 1e-2);
        let x = [q, v].concat();
        assert_eq!(x.len(), dim);
        let mut jacobian = vec![0.0; dim * dim];
        system.jacobian(&x, &mut jacobian);
        let h = 1e-4;
        let mut here = vec![0.0; dim];
        system.rhs(&x, &mut here);
        // Accelerations come from a matrix of condition 1e6 or so; what that makes of rounding, differences divide by the step.
        let rounding = 1e-10 * here.iter().fold(0.0_f64, |most, rate| most.max(rate.abs())) / h;
        for column in 0..dim {
            let mut rates = |sign: f64| {
                let (mut at, mut rates) = (x.clone(), vec![0.0; dim]);
                at[column] += sign * h;
                system.rhs(&at, &mut rates);
                rates
            };
            let (plus, minus) = (rates(1.0), rates(-1.0));
            let own: Vec<f64> = (0..dim).map(|row| jacobian[row * dim + column]).collect();
            let size = own.iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
            for (row, &entry) in own.iter().enumerate() {
                let expected = (plus[row] - minus[row]) / (2.0 * h);
                assert!(
                    (entry - expected).abs() < 1e-5 * size + rounding,
                    "seed {seed}, {row} {column}: {entry} is not {expected}"
                );
            }
        }
    }
    Ok::<_, Error>(())
}
