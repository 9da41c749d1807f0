//! Drives along a given motion: what motors and cylinders do to their commands while the joints move as they were seen to.

use super::guide::{Drives, Guide};
use super::prescribed::PRESCRIBED;
use super::{Run, Setting, check_starts};
use crate::error::{Error, Result};
use crate::motion::JointMotion;
use crate::table::Table;

/// What a sampled drive takes away.
const NO_STATES: &str = "its effort cannot be worked out along a given motion";

/// What drives do along a motion, each table row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Along {
    /// Outputs of each sample, in the order of [`crate::sensor::Layout`], then the effort of the drives on each joint.
    pub outputs: Vec<f64>,
    /// State of each sample.
    pub states: Vec<f64>,
    /// Derivative of each number of `outputs` with respect to each requested parameter.
    pub jacobian: Vec<f64>,
}

/// Drives along a given `motion` that all joints follow: they answer to it and to `inputs`. The motion is that of the
/// model's position sensors. `inputs` are N x inputs, each row held until the next. States of drives and supplies begin
/// with `internal`.
///
/// Law: `ds/dt = f(s, l(q(t)), dl(q(t), v(t)), u)`, s the states of drives and supplies; q(t) between samples is the polynomial of degree 5
/// with position, velocity and acceleration of both. The outputs `effort` of the joints are the efforts that the motion needs, as in
/// [`super::prescribed`]; those of the drives follow after all outputs. Unlike in a free run no error of a force moves the machine, so that
/// what is wrong with a drive and what is wrong with the machine show apart. Where states of drives were measured too, as pressures of
/// chambers, `seen` gives their readings (N x their number) and `places` which states they are: the efforts of the drives are those of what
/// is behind these readings. Checked: a free run gives its drives' states back.
pub fn drives_along(
    setting: Setting<'_>,
    motion: JointMotion<'_>,
    inputs: Table<'_>,
    internal: &[f64],
    (places, seen): (&[usize], Table<'_>),
) -> Result<Along> {
    let Setting { description, theta, .. } = setting;
    let (rows, joints) = (motion.position.rows(), description.n_joints());
    description.refuse_sampled(NO_STATES, "simulate it in the mode free_run or closed_loop")?;
    if let Some((beam, _)) = description.beams.iter().zip(description.elastic()).find(|(_, len)| **len > 0) {
        return Err(Error::Flexible { beam: beam.name.clone() });
    }
    description.refuse_loops(PRESCRIBED, "simulate it freely or with its controllers")?;
    motion.expect(joints)?;
    inputs.expect("inputs", rows, description.n_inputs())?;
    let states = description.n_states() - 2 * joints;
    Table::vector("internal", internal, states, "state of drives and supplies")?;
    seen.expect("seen", rows, places.len())?;
    if let Some(&index) = places.iter().find(|&&place| place >= states) {
        let what = "the list of measured states".to_owned();
        return Err(Error::Reference { what, target: "state of drives and supplies", index, count: states });
    }
    if rows > 0 {
        let mut first = motion.position.row(0).to_vec();
        first.extend_from_slice(motion.velocity.row(0));
        first.extend_from_slice(internal);
        description.check_values(theta)?;
        check_starts(setting, &first)?;
    }
    let drives = Drives { inputs, internal, places, seen };
    let Run { outputs, states, jacobian } =
        Guide { setting, motion, first: 0, passive: &[], strains: None, departure: &[], drives: Some(drives) }.run()?;
    Ok(Along { outputs, states, jacobian })
}
