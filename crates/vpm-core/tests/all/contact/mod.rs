//! Contacts and bushings, alone and in machines.

mod bushing;
mod machine_bushing;
mod machine_contact;
mod point_and_plane;

use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::simulate::{Run, Setting, Stepping, free_run};
use vpm_core::table::Table;

const G: f64 = 9.81;

/// A machine left to itself for so many rows of so many substeps.
fn run(
    d: &Description,
    state: &[f64],
    (step, substeps, rows): (f64, usize, usize),
    method: Method,
    by: &[usize],
) -> Result<Run> {
    let stepping = Stepping::new(step, substeps, method)?;
    let setting = Setting { description: d, theta: &d.parameters, stepping, sensitivities: by, interrupt: &|| false };
    free_run(setting, state, Table::new("inputs", &[], rows, 0)?)
}
