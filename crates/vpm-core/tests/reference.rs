//! The fixed-step methods against an adaptive solver that knows nothing of them; with the cargo feature `reference`.

use vpm_core::Result;
use vpm_core::Scalar;
use vpm_core::beam::Component;
use vpm_core::beam::Section;
use vpm_core::beam::witness::strain_tree::{Drive, FlexibleLink, FlexibleTree, StrainBeam, TreeMotion};
use vpm_core::error::Error;
use vpm_core::integrator::reference::{Tolerance, solve};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::samples::double_pendulum;

#[cfg(test)]
#[path = "all/common/mod.rs"]
#[expect(dead_code, reason = "it needs some of them")]
mod common;
use common::beams::{along_x, body, fields, pin};
use common::{Machine, close, distance};

const TIGHT: Tolerance = Tolerance { relative: 1e-10, absolute: 1e-11 };

fn fixed(ode: &mut impl Ode<f64>, start: &[f64], method: Method, end: f64, steps: usize) -> Vec<f64> {
    let (mut x, mut integrator) = (start.to_vec(), Integrator::new(method, start.len()));
    for _ in 0..steps {
        integrator.step(ode, &mut x, end / steps as f64);
    }
    x
}

/// Robertson's chemistry, a classic among stiff problems.
struct Robertson;
impl Ode<f64> for Robertson {
    fn dim(&self) -> usize {
        3
    }
    fn coordinates(&self) -> usize {
        0
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        let (slow, fast, product) = (0.04 * x[0], 3e7 * x[1] * x[1], 1e4 * x[1] * x[2]);
        dxdt.copy_from_slice(&[product - slow, slow - product - fast, fast]);
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        let (a, b, c) = (6e7 * x[1], 1e4 * x[2], 1e4 * x[1]);
        jacobian.copy_from_slice(&[-0.04, b, c, 0.04, -a - b, -c, 0.0, a, 0.0]);
    }
}

#[test]
fn the_reference_solves_a_stiff_classic() -> Result<()> {
    // Hairer & Wanner 1996, section IV.1: a published solution at t = 40.
    let found = solve(&mut Robertson, &[1.0, 0.0, 0.0], &[0.4, 40.0], TIGHT)?;
    let exact = [0.715_827_068_72, 9.185_534_76e-6, 0.284_163_745_75];
    for (found, exact) in found[1].iter().zip(exact) {
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} is not {exact}");
    }
    assert!((found[0].iter().sum::<f64>() - 1.0).abs() < 1e-9);
    Ok(())
}

#[test]
fn rigid_machines_with_friction_and_drives_converge_to_the_reference() -> Result<()> {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("viscous_friction", 0, &[("viscous", 0.3)])
        .effect("coulomb_friction", 1, &[("coulomb", 0.4), ("transition_velocity", 0.5)])
        .actuator(0, &[("gain", 1.5), ("lag", 0.02)]);
    let start = [0.6, -0.4, 0.5, 0.2, 0.3];
    let exact = &solve(&mut machine.system(), &start, &[0.25, 0.5], TIGHT)?[1];
    for (method, order, steps) in [
        (Method::SemiImplicit, 1.0, 800),
        (Method::LinearlyImplicit, 2.0, 400),
        (Method::Rk4, 4.0, 100),
        (Method::Rosenbrock, 4.0, 100),
    ] {
        let errors =
            [steps, 2 * steps].map(|steps| distance(&fixed(&mut machine.system(), &start, method, 0.5, steps), exact));
        let found = (errors[0] / errors[1]).log2();
        assert!((found - order).abs() < 0.2, "{}: order {found} from {errors:?}", method.name());
    }
    Ok(())
}

/// No joint is driven.
struct Still;
impl Drive for Still {
    fn motion<S: Scalar>(&self, _: S) -> [S; 3] {
        [S::zero(); 3]
    }
}

#[test]
fn a_flexible_pendulum_converges_to_the_reference() -> Result<()> {
    let section = Section::given([3.0, 2.0, 1.5, 200.0, 250.0, 400.0], [0.02, 0.03, 0.05, 1.0, 1.0, 1.0])?;
    let beam = StrainBeam::new(section, fields(0.7, &[(Component::BendingX, 2), (Component::Torsion, 1)])?, 1e-3, 6)?;
    let link = FlexibleLink {
        parent: None,
        joint: Some(pin([0.0, 0.0, 1.0])),
        hub: body(0.5, 0.02),
        beam: Some((along_x(0.1), beam)),
        tip: body(0.3, 0.01),
    };
    let tree = FlexibleTree::new(vec![link], [0.4, -9.0, 2.0])?;
    let mut motion = TreeMotion::<Still>::new(&tree, None)?;
    let start = vec![0.0; motion.dim()];
    let exact = &solve(&mut motion, &start, &[0.3], TIGHT)?[0];
    close(exact[start.len() - 1], 0.3, 1e-9);
    for (method, order, steps) in [
        (Method::SemiImplicit, 1.0, 2400),
        (Method::LinearlyImplicit, 2.0, 300),
        (Method::Rk4, 4.0, 150),
        (Method::Rosenbrock, 4.0, 75),
    ] {
        let errors = [steps, 2 * steps].map(|steps| distance(&fixed(&mut motion, &start, method, 0.3, steps), exact));
        let found = (errors[0] / errors[1]).log2();
        assert!((found - order).abs() < 0.2, "{}: order {found} from {errors:?}", method.name());
    }
    Ok(())
}

#[test]
fn senseless_questions_are_refused() {
    let refused = |start: &[f64], times: &[f64], absolute: f64| {
        solve(&mut Robertson, start, times, Tolerance { absolute, ..TIGHT }).unwrap_err()
    };
    let start = [1.0, 0.0, 0.0];
    assert!(matches!(refused(&start[..2], &[1.0], 1e-9), Error::Dimension { .. }));
    assert!(matches!(refused(&start, &[1.0, 1.0], 1e-9), Error::Setting { .. }));
    assert!(matches!(refused(&start, &[1.0], 0.0), Error::Setting { .. }));
    assert!(matches!(refused(&[f64::NAN, 0.0, 0.0], &[1.0], 1e-9), Error::ReferenceSolution { .. }));
}
