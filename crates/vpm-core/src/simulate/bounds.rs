//! How large each state of a machine may be before its numbers mean nothing.

use nalgebra::{Cholesky, DMatrix};

use super::names::state_name;
use crate::actuator::Drive;
use crate::actuator::hydraulic::HydraulicDrive;
use crate::beam::{BeamEntry, Section, SectionEntry};
use crate::body::Body;
use crate::description::Description;
use crate::error::Diverged;
use crate::integrator::Method;
use crate::joint::JointKind;
use crate::scalar::Scalar;
use crate::system::Dynamics;

/// Speed of light, m/s.
const LIGHT: f64 = 299_792_458.0;

/// Why a state cannot be larger: the end of a sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Why {
    Rounding,
    Light,
    Strain,
    Oil,
}

impl Why {
    fn text(self) -> &'static str {
        match self {
            Self::Rounding => "where rounding hides a change of its natural size",
            Self::Light => "at which its body is as fast as light",
            Self::Strain => "at which its beam is strained by 1",
            Self::Oil => "to which its stroke and its supply can press or stretch the oil",
        }
    }
}

/// The largest magnitude of each state.
///
/// Law, with all quantities those of the model:
/// - a rate of a sliding joint stays below the speed of light c, that of a turning joint below `c / r`, r being the radius of gyration of
///   its body about the axis (m): beyond, Newton's laws are not those of the machine.
/// - a beam of length L with coordinates q and stiffness K stores `1/2 q^T K q`. Stretched by 1, its strongest section stores `1/2 EA L`.
///   At a given `q_i` no beam stores less than `q_i^2 / (2 (K^-1)_ii)`, so that `|q_i| <= sqrt(EA L (K^-1)_ii)`.
/// - oil of bulk modulus beta in a chamber whose volume goes from `line + A stroke` to `line` changes its pressure by
///   `beta ln(1 + A stroke / line)`; the supply adds its own pressure. Another beta covers stops that yield and logged pressures. A supply
///   that sags is pressed no further than by its source and by what its cylinders send back, and its lines lose or gain no more than that.
/// - every other state stays below its natural size (of [`crate::ode::Ode::scales`]) over the rounding error of a number: beyond, two
///   numbers that follow each other differ by more than that size.
///
/// These are necessary conditions: no motion of the machine breaks them, whatever drives and gravity do. Commands and springs of joints,
/// whose energy has no limit in a model, do not enter; strokes of pistons are checked on their own.
/// Source: Merritt 1967, "Hydraulic Control Systems", section 2-4 (compression); the rest are definitions.
/// Checked: closed forms of a slider, a rotor, a beam and a cylinder; unstable steps of each; that examples and random machines run.
#[derive(Clone, Debug)]
pub(crate) struct Bounds {
    most: Vec<f64>,
    why: Vec<Why>,
}

impl Bounds {
    /// The bounds of a machine with the parameters `theta`; its `dynamics` were built with them.
    pub(crate) fn new<S: Scalar>(description: &Description, theta: &[S], dynamics: &Dynamics<f64>) -> Self {
        let mut most = vec![0.0; dynamics.dim()];
        dynamics.scales(&mut most);
        most.iter_mut().for_each(|size| *size /= f64::EPSILON);
        let mut bounds = Self { why: vec![Why::Rounding; most.len()], most };
        let value = |place: &usize| theta[*place].inspect();
        let n = description.n_coordinates();
        for (place, body) in description.bodies.iter().enumerate() {
            bounds.limit(n + place, fastest(&body.map(&mut { value })), Why::Light);
        }
        for (number, entry) in description.beams.iter().enumerate() {
            let Some((beam, first)) = dynamics.model.beam(number) else { continue };
            let energy = largest_energy(&entry.map(&mut { value }));
            for (place, softness) in inverse_diagonal(beam.stiffness(), beam.len()).into_iter().enumerate() {
                bounds.limit(first + place, (2.0 * energy * softness).sqrt(), Why::Strain);
            }
        }
        let (mut place, mut pressures) = (2 * n, vec![0.0_f64; dynamics.supplies.len()]);
        for actuator in &dynamics.actuators {
            if let Drive::Hydraulic(law) = &actuator.drive {
                let pressure = bounds.oil(place + usize::from(actuator.lag.is_some()), law, dynamics);
                pressures[law.supply] = pressures[law.supply].max(pressure);
            }
            place += actuator.n_states();
        }
        for (supply, pressed) in dynamics.supplies.iter().zip(pressures) {
            // No line loses more than all of its pressure, nor gains more than its cylinders send back.
            for state in place..place + supply.states().count() {
                bounds.limit(state, pressed.max(supply.pressure), Why::Oil);
            }
            place += supply.states().count();
        }
        bounds
    }

    /// The pressures of a drive whose states begin at `first`, and the bound of them.
    fn oil(&mut self, first: usize, law: &HydraulicDrive<f64>, dynamics: &Dynamics<f64>) -> f64 {
        let (supply, cylinder) = (&dynamics.supplies[law.supply], &law.cylinder);
        let areas = cylinder.areas();
        let ratio = |area: f64, line: f64| area * cylinder.stroke / line;
        let most = ratio(areas.a, cylinder.line_a).max(ratio(areas.b, cylinder.line_b));
        let pressure = supply.pressure + supply.oil.bulk_modulus * (1.0 + most.ln_1p());
        for (place, name) in law.states().iter().enumerate() {
            if !name.starts_with("spool") {
                self.limit(first + place, pressure, Why::Oil);
            }
        }
        pressure
    }

    /// Lowers a bound; a `most` that is no number says nothing.
    fn limit(&mut self, place: usize, most: f64, why: Why) {
        if most < self.most[place] {
            (self.most[place], self.why[place]) = (most, why);
        }
    }

    /// The first state that is beyond its bound or no finite number.
    #[inline]
    pub(crate) fn outside<S: Scalar>(&self, state: &[S]) -> Option<usize> {
        // Written so that a value that is no number is beyond any bound.
        let wrong = |(state, most): (&S, &f64)| !(state.is_finite() && state.is_within(*most));
        state.iter().zip(&self.most).position(wrong)
    }

    /// Complaint about a state beyond its bounds: what it is and does, as the beginning of a sentence.
    #[cold]
    pub(crate) fn complaint<S: Scalar>(&self, description: &Description, place: usize, state: S) -> (String, String) {
        let (name, most, value) = (state_name(description, place), self.most[place], state.inspect());
        if !value.is_finite() || value.abs() <= most {
            return (of_what(&name, state), Diverged::NOT_FINITE.to_owned());
        }
        (format!("the {name}"), format!("is {value:.4e}, beyond {most:.4e}, {},", self.why[place].text()))
    }
}

/// Name of the quantity beyond its bounds, or of its derivative by a parameter.
pub(crate) fn of_what<S: Scalar>(name: &str, number: S) -> String {
    if number.inspect().is_finite() && !number.is_finite() {
        return format!("the derivative of the {name} with respect to a parameter");
    }
    format!("the {name}")
}

/// What helps against a state that left its bounds.
pub(crate) fn repair(method: Method) -> &'static str {
    match method {
        Method::LinearlyImplicit | Method::Rosenbrock | Method::Guarded | Method::Additive | Method::CrankNicolson => {
            "use more substeps or the integrator adaptive, or check signs and units of parameters and commands"
        }
        Method::Rk4 | Method::SemiImplicit => {
            "use more substeps or the integrator linearly_implicit, or check signs and units of parameters and commands"
        }
        Method::Adaptive { .. } => "check signs and units of parameters and commands",
    }
}

/// Repair against a state beyond its bounds along a prescribed motion, with drives that answer or without.
pub(super) fn repair_along(method: Method, drives: bool) -> &'static str {
    match method {
        Method::Adaptive { .. } => "check units and jumps of the motion",
        _ if drives => "use the integrator adaptive, and check units and jumps of the motion",
        Method::LinearlyImplicit | Method::Rosenbrock | Method::Guarded | Method::Additive | Method::CrankNicolson => {
            "use more substeps or the integrator adaptive, and check units and jumps of the motion"
        }
        Method::Rk4 | Method::SemiImplicit => {
            "use more substeps or the integrator linearly_implicit, and check units and jumps of the motion"
        }
    }
}

/// Bound on the rate of a joint, m/s or rad/s: its body is as fast as light; infinite if no rate moves it.
fn fastest(body: &Body<f64>) -> f64 {
    let Some(inertia) = body.inertia.filter(|_| body.joint.kind != JointKind::Prismatic) else {
        return if body.joint.kind == JointKind::Prismatic { LIGHT } else { f64::INFINITY };
    };
    let ([x, y, z], [xx, yy, zz, xy, xz, yz], [a, b, c]) = (body.joint.axis, inertia.moments, inertia.center_of_mass);
    let own = xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z);
    let along = a * x + b * y + c * z;
    LIGHT / (own / inertia.mass + a * a + b * b + c * c - along * along).max(0.0).sqrt()
}

/// Bound on the energy of a beam, J: its strongest section stretched by 1 from end to end. A reduced solid is moved as
/// far as it is large.
fn largest_energy(beam: &BeamEntry<f64>) -> f64 {
    if let Some(reduced) = &beam.reduced {
        return beam.factors().0 * reduced.largest_energy();
    }
    let material = |entry: &'_ SectionEntry<f64>| entry.material.or(beam.material);
    let sections = beam.sections.iter().filter_map(|entry| Section::of(&entry.shape, material(entry).as_ref()).ok());
    0.5 * beam.length * sections.map(|section| section.stiffness[5]).fold(0.0, f64::max)
}

/// Diagonal of an inverse stiffness matrix, row by row, for bounds of beams; empty without one.
fn inverse_diagonal(stiffness: &[f64], len: usize) -> Vec<f64> {
    let inverse = Cholesky::new(DMatrix::from_row_slice(len, len, stiffness)).map(|factors| factors.inverse());
    inverse.map_or_else(Vec::new, |inverse| inverse.diagonal().iter().copied().collect())
}
