//! Runs by machine code: against runs by the direct evaluation of the same laws.

use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::samples::Random;
use vpm_core::simulate::{Run, Setting, Stepping, free_run};
use vpm_core::table::Table;

use crate::common::two_beams;

/// A run of `rows` samples, simulated whole or in the first `begin` samples only.
fn run(d: &Description, method: Method, rows: usize) -> Result<Run> {
    let n = d.n_coordinates();
    let random = &mut Random::new(3);
    let start = [random.numbers(d.n_joints(), 1.0), vec![0.0; d.n_states() - d.n_joints()]].concat();
    assert_eq!(start.len(), d.n_states(), "{n} coordinates");
    let inputs = vec![0.2; rows * d.n_inputs()];
    let stepping = Stepping::new(1e-3, 1, method)?;
    let setting = Setting { description: d, theta: &d.parameters, stepping, sensitivities: &[], interrupt: &|| false };
    free_run(setting, &start, Table::new("inputs", &inputs, rows, d.n_inputs())?)
}

#[test]
fn a_long_run_begins_as_a_short_one() -> Result<()> {
    let d = two_beams::machine(1, two_beams::hold);
    for method in [Method::Additive, Method::LinearlyImplicit, Method::Rosenbrock] {
        let (short, long) = (run(&d, method, 50)?, run(&d, method, 8_000)?);
        let (states, outputs) = (&long.states[..short.states.len()], &long.outputs[..short.outputs.len()]);
        for (found, expected) in [(states, &short.states), (outputs, &short.outputs)] {
            let size = expected.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
            let apart = found.iter().zip(expected).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            assert!(apart < 1e-9 * size, "{method}: {apart} of {size}");
        }
    }
    let mut system = d.system::<f64>(&d.parameters)?;
    assert!(system.compile(Method::Additive).is_ok() && system.has_code());
    Ok(())
}
