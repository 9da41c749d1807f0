//! Joints that follow a given motion, and what answers to it: beams, and joints that nobody drives.

use super::guide::Guide;
use super::{Run, Setting, check_structure};
use crate::error::{Error, Result};
use crate::motion::{JointMotion, StrainRates};
use crate::table::Table;

/// What closed loops take away.
pub(super) const PRESCRIBED: &str = "a run in which some of its joints follow a log";

/// Prescribed `motion` of joints; `passive` joints and beams move freely. The motion is that of the model's position
/// sensors. Columns of passive joints mean nothing.
///
/// Law: `M_ff a_f = (effects - bias - K q - D v)_f - M_fj a_j`, j the joints that follow and f the free coordinates. Between samples the
/// joints follow the polynomial of degree 5 with position, velocity and acceleration of both. The free coordinates begin at rest under
/// gravity. The outputs `effort` of the joints are the efforts that the motion needs, with those of the effects taken off; the actuators
/// do nothing. Checked: a motion simulated from efforts gives those efforts back, with all joints or some of them following.
pub fn prescribed(setting: Setting<'_>, motion: JointMotion<'_>, passive: &[usize]) -> Result<Run> {
    observed(setting, (motion, 0), passive, None, &[])
}

/// As [`prescribed`], of a motion that begins at the sample `first` of its record, with beams held to what their gauges showed.
///
/// Law: a force `c C^T (e' - C v)` more on the elastic coordinates, `C v` being the rate of strain at a gauge, `e'` the measured one and
/// `c` its gain: a damper between the beam and the measured one, which takes the energy out of whatever they differ by and nothing where
/// they agree (a natural observer: M. Demetriou, *Systems & Control Letters* 51, 2004). A damped error no longer rings with the noise
/// of the motion. Checked: a free motion gives its own efforts back, with gauges that hold.
///
/// The free coordinates begin away from rest by what `departure` has for them, coordinates then rates of all; empty, they begin at rest.
pub fn observed(
    setting: Setting<'_>,
    (motion, first): (JointMotion<'_>, usize),
    passive: &[usize],
    strains: Option<StrainRates<'_>>,
    departure: &[f64],
) -> Result<Run> {
    setting.description.refuse_loops(PRESCRIBED, "simulate it freely or with its controllers")?;
    let (rows, joints) = (motion.position.rows(), setting.description.n_joints());
    motion.expect(joints)?;
    if let Some(StrainRates { rate, gain }) = strains {
        rate.expect("strain_rate", rows, setting.description.gauges.len())?;
        Table::new("strain_gain", gain, 1, gain.len())?.expect("strain_gain", 1, setting.description.gauges.len())?;
    }
    if !departure.is_empty() {
        Table::vector("departure", departure, 2 * setting.description.n_coordinates(), "coordinate and rate")?;
    }
    let mut passive = passive.to_vec();
    passive.sort_unstable();
    passive.dedup();
    if let Some(&index) = passive.iter().find(|&&joint| joint >= joints) {
        let what = "the list of passive joints".to_owned();
        return Err(Error::Reference { what, target: "joint", index, count: joints });
    }
    if rows > 0 {
        let mut state = motion.position.row(0).to_vec();
        state.resize(setting.description.n_states(), 0.0);
        let driven: Vec<usize> = (0..joints).filter(|joint| !passive.contains(joint)).collect();
        check_structure(setting.description, setting.theta, setting.stepping, &state, &driven)?;
    }
    Guide { setting, motion, first, passive: &passive, strains, departure, drives: None }.run()
}
