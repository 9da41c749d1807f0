//! Stable steps of explicit methods: closed forms, and what the methods then do.

use nalgebra::DMatrix;
use vpm_core::Result;
use vpm_core::beam::Component;
use vpm_core::beam::eigen::modes;
use vpm_core::beam::witness::strain_tree::{FlexibleLink, FlexibleTree, StrainBeam};
use vpm_core::beam::{Material, Section, Shape};
use vpm_core::error::Error;
use vpm_core::integrator::stability::{LinearSystem, check};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;

use crate::common::beams::{along_x, body, fields, pin};

/// Matrices that own their entries.
#[derive(Clone)]
struct Owned {
    mass: Vec<f64>,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    names: Vec<String>,
}

impl Owned {
    fn new(mass: &[f64], stiffness: &[f64], damping: &[f64], names: &[&str]) -> Self {
        let names = names.iter().map(|&name| name.to_owned()).collect();
        Self { mass: mass.to_vec(), stiffness: stiffness.to_vec(), damping: damping.to_vec(), names }
    }
    fn check(&self, method: Method, step: f64) -> Result<()> {
        let Self { mass, stiffness, damping, names } = self;
        check(method, step, &LinearSystem { mass, stiffness, damping, names })
    }
    /// Coordinate, frequency and limit that a far too long step is refused with.
    fn refusal(&self, method: Method, step: f64) -> (String, f64, f64) {
        match self.check(method, step) {
            Err(Error::StepTooLarge { coordinate, frequency, limit, .. }) => (coordinate, frequency, limit),
            other => (format!("a step of {step} s gives {other:?}"), f64::NAN, f64::NAN),
        }
    }
}

fn relative(found: f64, exact: f64, tolerance: f64) {
    assert!((found / exact - 1.0).abs() < tolerance, "{found} is not {exact}");
}

/// Where |R| = 1 on the negative real axis for the classical Runge-Kutta method: z^3 + 4 z^2 + 12 z + 24 = 0.
fn decay_limit() -> f64 {
    let (mut low, mut high) = (2.0_f64, 3.0_f64);
    for _ in 0..60 {
        let z = 0.5 * (low + high);
        if -z.powi(3) + 4.0 * z * z - 12.0 * z + 24.0 > 0.0 { low = z } else { high = z }
    }
    low
}

#[test]
fn a_single_oscillator_has_the_limits_of_the_books() {
    let (mass, omega) = (2.5, 400.0_f64);
    for zeta in [0.0, 0.05, 0.7] {
        let system = Owned::new(&[mass], &[mass * omega * omega], &[2.0 * zeta * omega * mass], &["slide"]);
        let (name, frequency, limit) = system.refusal(Method::SemiImplicit, 0.1);
        assert_eq!(name, "slide");
        relative(frequency, omega / std::f64::consts::TAU, 1e-9);
        relative(limit, 2.0 * ((1.0 + zeta * zeta).sqrt() - zeta) / omega, 2e-6);
        let (_, frequency, limit) = system.refusal(Method::Rk4, 0.1);
        relative(frequency, omega / std::f64::consts::TAU, 1e-9);
        if zeta == 0.0 {
            relative(limit, 8.0_f64.sqrt() / omega, 1e-8);
        }
    }
    relative(decay_limit(), 2.785_293_563_405_28, 1e-12);
    // Overdamped: rates of decay a and b with a + b = d, a b = k.
    let (fast, slow) = (5000.0, 3.0);
    let system = Owned::new(&[1.0], &[fast * slow], &[fast + slow], &["slide"]);
    relative(system.refusal(Method::Rk4, 1.0).2, decay_limit() / fast, 1e-8);
}

#[test]
fn a_chain_is_limited_by_its_fastest_mode_and_names_who_moves_most_in_it() {
    // Two masses, a stiff spring between the light one and the ground.
    let stiffness = [1e6 + 100.0, -100.0, -100.0, 100.0];
    let damping = [0.0; 4];
    let system = Owned::new(&[0.1, 0.0, 0.0, 5.0], &stiffness, &damping, &["light", "heavy"]);
    let (sum, product) = (stiffness[0] / 0.1 + 20.0, (stiffness[0] * 100.0 - 1e4) / 0.5);
    let omega = (0.5 * (sum + (sum * sum - 4.0 * product).sqrt())).sqrt();
    for (method, reach) in [(Method::Rk4, 8.0_f64.sqrt()), (Method::SemiImplicit, 2.0)] {
        let (name, frequency, limit) = system.refusal(method, 0.01);
        assert_eq!(name, "light");
        relative(frequency, omega / std::f64::consts::TAU, 1e-6);
        relative(limit, reach / omega, 2e-6);
        assert!(system.check(method, 0.999 * limit).is_ok() && system.check(method, 1.001 * limit).is_err());
    }
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        assert!(system.check(method, 1e3).is_ok());
    }
}

#[test]
fn rigid_and_growing_modes_are_no_fault_of_the_step() {
    let free = Owned::new(&[1.0, 0.2, 0.2, 1.0], &[0.0; 4], &[0.0; 4], &["a", "b"]);
    let falling = Owned::new(&[1.0], &[-9.81], &[0.0], &["top"]);
    for method in Method::ALL {
        assert!(free.check(method, 10.0).is_ok() && falling.check(method, 0.01).is_ok(), "{}", method.name());
    }
    let empty = Owned::new(&[], &[], &[], &[]);
    assert!(empty.check(Method::Rk4, 1.0).is_ok());
}

#[test]
fn a_stiff_beam_on_a_joint_is_limited_by_its_fastest_vibration() -> Result<()> {
    use Component::{BendingX, BendingY, Extension, Torsion};
    let steel = Material { young: 206e9, poisson: 0.3, density: 7850.0 };
    let section = Section::new(Shape::Rectangle { width: 0.015, height: 0.004 }, steel)?;
    let list = fields(0.44, &[(BendingX, 4), (BendingY, 3), (Torsion, 2), (Extension, 2)])?;
    let link = FlexibleLink {
        joint: Some(pin([0.0, 0.0, 1.0])),
        hub: body(0.5, 0.02),
        beam: Some((along_x(0.1), StrainBeam::new(section, list, 1e-9, 12)?)),
        ..FlexibleLink::welded()
    };
    let tree = FlexibleTree::new(vec![link], [0.0; 3])?;
    let (n, mut workspace) = (tree.len(), tree.workspace());
    tree.terms(&vec![0.0; n], &vec![0.0; n], &[], &mut workspace);
    let names: Vec<String> = (0..n).map(|k| format!("coordinate {k}")).collect();
    let [mass, stiffness] = [&workspace.mass[..], tree.stiffness()].map(|m| DMatrix::from_row_slice(n, n, m));
    // The symmetric eigenproblem is solved in another way than the companion form; damping of 1e-9 K shifts little, by a known share.
    let omega = modes(&stiffness, &mass)?.frequencies[n - 1];
    let zeta = 0.5 * 1e-9 * omega;
    let system =
        LinearSystem { mass: &workspace.mass, stiffness: tree.stiffness(), damping: tree.damping(), names: &names };
    for (method, reach) in
        [(Method::SemiImplicit, 2.0 * ((1.0 + zeta * zeta).sqrt() - zeta)), (Method::Rk4, 8.0_f64.sqrt())]
    {
        match check(method, 1e-3, &system) {
            Err(Error::StepTooLarge { coordinate, frequency, limit, .. }) => {
                relative(frequency, omega / std::f64::consts::TAU, 1e-6);
                relative(limit, reach / omega, 1e-3);
                assert!(names[n - 2..].contains(&coordinate), "{coordinate} is no extension");
            }
            other => panic!("{other:?}"),
        }
    }
    Ok(())
}

/// The system in motion.
struct Moving<'a>(&'a Owned);
impl Ode<f64> for Moving<'_> {
    fn dim(&self) -> usize {
        2 * self.0.names.len()
    }
    fn coordinates(&self) -> usize {
        self.0.names.len()
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        // The mass matrix of the test is diagonal.
        let n = self.0.names.len();
        let (q, v) = x.split_at(n);
        for i in 0..n {
            dxdt[i] = v[i];
            let row = |matrix: &[f64], x: &[f64]| (0..n).map(|j| matrix[i * n + j] * x[j]).sum::<f64>();
            dxdt[n + i] = -(row(&self.0.stiffness, q) + row(&self.0.damping, v)) / self.0.mass[i * n + i];
        }
    }
    fn jacobian(&mut self, _: &[f64], _: &mut [f64]) {}
}

#[test]
fn runs_stay_bounded_just_below_the_limit_and_grow_just_above() {
    // Damping that no modal coordinates decouple.
    let stiffness = [900.0, -300.0, 0.0, -300.0, 700.0, -400.0, 0.0, -400.0, 500.0];
    let damping = [6.0, 0.0, 0.0, 0.0, 9.0, -9.0, 0.0, -9.0, 9.0];
    let mass = [0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.2];
    let system = Owned::new(&mass, &stiffness, &damping, &["a", "b", "c"]);
    for method in [Method::Rk4, Method::SemiImplicit] {
        let (name, _, limit) = system.refusal(method, 1.0);
        assert_eq!(name, "c");
        for (factor, bounded) in [(0.98, true), (1.02, false)] {
            let (mut x, mut integrator) = (vec![1.0, -0.5, 0.3, 0.0, 0.0, 0.0], Integrator::new(method, 6));
            for _ in 0..2000 {
                integrator.step(&mut Moving(&system), &mut x, factor * limit);
            }
            let size = x.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
            assert_eq!(size < 10.0, bounded, "{}: {size} at {factor} of the limit", method.name());
        }
    }
}

#[test]
fn what_cannot_be_judged_is_refused_and_the_sentence_says_all() {
    let system = Owned::new(&[1.0], &[1e6], &[0.0], &["elbow"]);
    let text = system.check(Method::Rk4, 0.01).unwrap_err().to_string();
    for word in ["1.000e-2 s", "rk4", "`elbow`", "159.1549 Hz", "2.828e-3 s", "linearly_implicit"] {
        assert!(text.contains(word), "{text}");
    }
    let broken = |change: fn(&mut Owned)| {
        let mut other = system.clone();
        change(&mut other);
        other.check(Method::Rk4, 1e-3).unwrap_err()
    };
    assert!(matches!(broken(|s| s.mass[0] = -1.0), Error::Domain { .. }));
    assert!(matches!(broken(|s| s.stiffness[0] = f64::NAN), Error::NonFinite { .. }));
    assert!(matches!(broken(|s| s.damping.push(0.0)), Error::Dimension { .. }));
}
