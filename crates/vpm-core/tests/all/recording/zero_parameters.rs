//! Parameters that happen to be zero: what they scale is there all the same, with its derivatives.

use crate::common::trees;

use serde_json::json;
use trees::{beam, body, description, parameter, push};
use vpm_core::beam::{Component, DampingEntry, Level};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::Mount;
use vpm_core::ode::Ode;
use vpm_core::samples::Random;
use vpm_core::{Dual, Result};

/// The iteration matrix is linear in a stiffness, a resistance and a damping by stiffness, so that differences of any size are its slopes.
#[test]
fn iteration_matrices_have_slopes_by_parameters_that_are_zero() -> Result<()> {
    let random = &mut Random::new(6);
    let mut parts = Parts { gravity: [0.0, 0.0, -9.81], ..Parts::default() };
    parts.bodies.push(body(random, "hub", Mount::World, JointKind::Revolute));
    parts.beams.push(beam(random, "link", Mount::Body(0), Level::Bezier(3), &[Component::BendingX]));
    parts.beams[0].damping = DampingEntry::default();
    let mut places = [0; 3];
    let d = description(&parts, |content| {
        places = ["stiffness", "viscous", "time"].map(|name| parameter(content, name, 0.0));
        let rest = parameter(content, "rest", 0.0);
        push(content, "effects", json!({"type": "spring", "joint": 0, "stiffness": places[0], "rest": rest}));
        push(content, "effects", json!({"type": "viscous_friction", "joint": 0, "viscous": places[1]}));
        push(content, "effects", json!({"type": "structural_damping", "beam": 0, "time": places[2]}));
    });
    let matrix = |theta: &[f64]| -> Result<Vec<f64>> {
        let mut system = d.system::<f64>(theta)?;
        let mut found = vec![0.0; system.dim() * system.dim()];
        system.iteration_matrix(&vec![0.1; system.dim()], &mut found);
        Ok(found)
    };
    let theta = vpm_core::scalar::seed::<f64, 3>(&d.parameters, &places);
    let mut system = d.system::<Dual<f64, 3>>(&theta)?;
    let mut exact = vec![Dual::constant(0.0); system.dim() * system.dim()];
    system.iteration_matrix(&vec![Dual::constant(0.1); system.dim()], &mut exact);
    let at_zero = matrix(&d.parameters)?;
    for (lane, &place) in places.iter().enumerate() {
        let mut theta = d.parameters.clone();
        theta[place] = 1.0;
        let at_one = matrix(&theta)?;
        let size = at_one.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        let slopes: Vec<f64> = at_one.iter().zip(&at_zero).map(|(one, zero)| one - zero).collect();
        assert!(slopes.iter().any(|slope| slope.abs() > 1e-3), "the matrix depends on {}", d.parameter_names[place]);
        for (exact, slope) in exact.iter().zip(slopes) {
            // Rounding of the difference.
            assert!((exact.gradient[lane] - slope).abs() <= 1e-13 * size, "{exact:?}, {slope}");
        }
    }
    Ok(())
}
