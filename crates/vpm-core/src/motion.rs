//! Measured motions of joints, and the true ones behind them.

use crate::actuator::Drive;
use crate::description::Description;
use crate::error::Result;
use crate::scalar::Scalar;
use crate::sensor::{Channel, HydraulicQuantity, Sensor};
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

/// Rates of strain that gauges showed along a motion, to which beams are held.
#[derive(Clone, Copy)]
pub struct StrainRates<'a> {
    /// Readings, N x gauges, 1/s.
    pub rate: Table<'a>,
    /// How firmly each gauge holds its beam, J s; 0 for one that does not.
    pub gain: &'a [f64],
}

/// Sensors on the gauges in a measured motion, where there are any.
pub(crate) fn strain_sensors<S: Scalar>(description: &Description, theta: &[S]) -> Vec<Option<Sensor<S>>> {
    let sensors = description.sensors(theta);
    let on = |gauge| sensors.iter().find(|sensor| sensor.channel == Channel::Strain { gauge }).cloned();
    (0..description.gauges.len()).map(on).collect()
}

/// Sensors on the joint positions of a measured motion, where there are any.
pub(crate) fn position_sensors<S: Scalar>(description: &Description, theta: &[S]) -> Vec<Option<Sensor<S>>> {
    let sensors = description.sensors(theta);
    let on = |joint| sensors.iter().find(|sensor| sensor.channel == Channel::Position { joint }).cloned();
    (0..description.n_joints()).map(on).collect()
}

/// Sensors beside a measured motion on the states of drives and supplies at `places`, if any.
pub(crate) fn state_sensors<S: Scalar>(
    description: &Description,
    theta: &[S],
    places: &[usize],
) -> Vec<Option<Sensor<S>>> {
    let (sensors, channels) = (description.sensors(theta), state_channels(description));
    let on = |&place: &usize| {
        let channel = channels.get(place).copied().flatten()?;
        sensors.iter().find(|sensor| sensor.channel == channel).cloned()
    };
    places.iter().map(on).collect()
}

/// Channels beside a measured motion that show each state of the drives, if one does.
fn state_channels(description: &Description) -> Vec<Option<Channel>> {
    let (mut hydraulic, mut dc_motor, mut channels) = (0, 0, Vec::new());
    for actuator in &description.actuators {
        if actuator.lag.is_some() {
            channels.push(None);
        }
        match &actuator.drive {
            Drive::Ideal(_) | Drive::SpringDamper(_) | Drive::Table(_) | Drive::Narx(_) | Drive::MaxwellNarx(_) => {}
            Drive::Maxwell(_) => channels.push(None),
            Drive::DcMotor(_) => {
                channels.push(Some(Channel::Current { dc_motor }));
                dc_motor += 1;
            }
            Drive::Hydraulic(law) => {
                let shown = |state: &&str| match *state {
                    "spool" => Some(HydraulicQuantity::Spool),
                    "chamber_a" => Some(HydraulicQuantity::PressureA),
                    "chamber_b" => Some(HydraulicQuantity::PressureB),
                    _ => None,
                };
                let one = |quantity| Channel::Hydraulic { hydraulic, quantity };
                channels.extend(law.states().iter().map(|state| shown(state).map(one)));
                hydraulic += 1;
            }
        }
    }
    channels
}

impl JointMotion<'_> {
    /// Checks that the three tables of a motion have the same rows and so many joints.
    pub(crate) fn expect(&self, joints: usize) -> Result<()> {
        let rows = self.position.rows();
        let tables = [("position", self.position), ("velocity", self.velocity), ("acceleration", self.acceleration)];
        tables.iter().try_for_each(|(name, table)| table.expect(name, rows, joints))
    }

    /// True motion of a joint behind what was measured at sample `k`. Position, velocity and acceleration; `time_step`
    /// (s) after the sample before.
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
