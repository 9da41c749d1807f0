//! Runs by machine code: against runs by the direct evaluation of the same laws.

use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::samples::Random;
use vpm_core::simulate::{Run, Setting, Stepping, free_run};
use vpm_core::table::Table;

use super::machines::drawn;
use crate::common::two_beams;

/// A run of `rows` samples and its derivatives by some parameters; a short one is not worth machine code.
fn run(d: &Description, method: Method, rows: usize, sensitivities: &[usize]) -> Result<Run> {
    let random = &mut Random::new(3);
    let start = [random.numbers(d.n_joints(), 1.0), vec![0.0; d.n_states() - d.n_joints()]].concat();
    let inputs = vec![0.2; rows * d.n_inputs()];
    let stepping = Stepping::new(1e-3, 1, method)?;
    let setting = Setting { description: d, theta: &d.parameters, stepping, sensitivities, interrupt: &|| false };
    free_run(setting, &start, Table::new("inputs", &inputs, rows, d.n_inputs())?)
}

/// Asserts that a long run begins as a short one.
fn begins_as(long: &Run, short: &Run, what: &str) {
    let parts = |run: &Run| [run.states.clone(), run.outputs.clone(), run.jacobian.clone()];
    for (found, expected) in parts(long).into_iter().zip(parts(short)) {
        let size = expected.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        let apart = found.iter().zip(&expected).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(apart <= 1e-9 * size, "{what}: {apart} of {size}");
    }
}

#[test]
fn a_long_run_begins_as_a_short_one() -> Result<()> {
    let d = two_beams::machine(1, two_beams::hold);
    for method in [Method::Additive, Method::LinearlyImplicit, Method::Rosenbrock] {
        begins_as(&run(&d, method, 8_000, &[])?, &run(&d, method, 50, &[])?, &method.to_string());
    }
    let mut system = d.system::<f64>(&d.parameters)?;
    assert!(system.compile(Method::Additive).is_ok() && system.has_code());
    Ok(())
}

/// Derivatives by machine code are those of dual numbers operation by operation: through matrices of implicit steps, drives with a state of
/// their own and effects that remember.
#[test]
fn derivatives_of_a_long_run_begin_as_those_of_a_short_one() -> Result<()> {
    for seed in 0..30 {
        let d = drawn(seed).build();
        let random = &mut Random::new(seed);
        let sensitivities: Vec<usize> = (0..6)
            .map(|_| (random.unit() * d.parameters.len() as f64) as usize)
            .chain([d.parameters.len() - 1])
            .collect();
        for method in Method::FIXED {
            let short = run(&d, method, 6, &sensitivities)?;
            let what = format!("machine {seed}, {method}");
            begins_as(&run(&d, method, 120, &sensitivities)?, &short, &what);
        }
    }
    let d = two_beams::machine(1, two_beams::hold);
    let sensitivities = [0, d.parameters.len() / 2, d.parameters.len() - 1];
    for method in [Method::Additive, Method::LinearlyImplicit, Method::Rosenbrock] {
        begins_as(&run(&d, method, 120, &sensitivities)?, &run(&d, method, 6, &sensitivities)?, &method.to_string());
    }
    Ok(())
}
