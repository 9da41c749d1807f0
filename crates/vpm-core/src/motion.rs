//! Measured motions of joints, and the true ones behind them.

use crate::description::Description;
use crate::scalar::Scalar;
use crate::sensor::{Channel, Sensor};
use crate::table::Table;

/// Motion of the joints, sample by sample.
#[derive(Clone, Copy)]
pub struct JointMotion<'a> {
    /// Coordinates, N x joints, m or rad.
    pub position: Table<'a>,
    /// Velocities, N x joints.
    pub velocity: Table<'a>,
    /// Accelerations, N x joints.
    pub acceleration: Table<'a>,
}

/// The sensor on the position of each joint, if there is one.
pub(crate) fn position_sensors<S: Scalar>(description: &Description, theta: &[S]) -> Vec<Option<Sensor<S>>> {
    let sensors = description.sensors(theta);
    let on = |joint| sensors.iter().find(|sensor| sensor.channel == Channel::Position { joint }).cloned();
    (0..description.n_joints()).map(on).collect()
}

impl JointMotion<'_> {
    /// Position, velocity and acceleration of a joint behind what was measured at sample `k`, `time_step` (s) after the one before.
    #[inline]
    pub(crate) fn behind<S: Scalar>(
        &self,
        time_step: f64,
        k: usize,
        joint: usize,
        sensor: Option<&Sensor<S>>,
    ) -> [S; 3] {
        let Self { position, velocity, acceleration } = *self;
        let last = position.rows() - 1;
        let at = |table: Table<'_>, sample| S::from_f64(table.at(sample, joint));
        match sensor {
            Some(sensor) => [
                sensor.undo(k, last, time_step, |sample| at(position, sample)),
                sensor.undo_rate(k, last, time_step, |sample| at(velocity, sample)),
                sensor.undo_rate(k, last, time_step, |sample| at(acceleration, sample)),
            ],
            None => [at(position, k), at(velocity, k), at(acceleration, k)],
        }
    }
}
