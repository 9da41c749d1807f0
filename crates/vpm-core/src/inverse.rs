//! Inverse dynamics of a whole record: the effort that the motion needs against the effort that the actuators deliver.

mod course;
mod record;
mod sample_by_sample;

use crate::actuator::{Actuator, Drive, Target};
use crate::description::Description;
use crate::error::{DriveError, Error, Result};
use crate::motion::JointMotion;
use crate::sensitivity::{Interrupt, check_variables};
use crate::simulate::check_time_step;
use crate::system::Kind;
use crate::table::Table;
use course::{Course, Delivered};
use record::{Along, Numbers, Record};

/// A measured motion with its commands.
#[derive(Clone, Copy)]
pub struct Motion<'a> {
    /// Coordinates, N x joints, m or rad.
    pub position: Table<'a>,
    /// Velocities, N x joints.
    pub velocity: Table<'a>,
    /// Accelerations, N x joints.
    pub acceleration: Table<'a>,
    /// Inputs, N x inputs, held from each sample to the next.
    pub inputs: Table<'a>,
    /// Time between samples, s.
    pub time_step: f64,
}

/// What the inverse dynamics give, each table row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Efforts {
    /// Effort that the motion needs at each joint: that of the rigid tree minus those of the effects.
    pub required: Vec<f64>,
    /// Effort that the actuators deliver on each joint, mean over the two intervals that meet at the sample.
    pub applied: Vec<f64>,
    /// Derivative of required - applied with respect to each requested parameter.
    pub jacobian: Vec<f64>,
}

/// Required and applied efforts of `motion`.
///
/// Law: `required = M(q) a + h(q, v) - effects(q, v)`, where offset, gain and delay of position sensors have been undone first:
/// `q(t) = (y(t + delay) - offset) / gain`, velocities and accelerations likewise without the offset.
/// `applied[k] = (m[k-1] + m[k]) / 2` with m the mean effort over a sample interval, which is what a central difference of the motion
/// sees; the lag is solved exactly in each interval, from rest at its first input.
/// Hystereses begin relaxed and move on exactly along the way from sample to sample.
/// Source: inverse dynamic identification model, Khalil & Dombre 2002, "Modeling, Identification and Control of Robots", section 12.4.
/// Checked: recovers the efforts of a simulated run.
pub fn inverse_dynamics(
    description: &Description,
    theta: &[f64],
    motion: Motion<'_>,
    sensitivities: &[usize],
    interrupt: Interrupt<'_>,
) -> Result<Efforts> {
    description.refuse_loops(
        "the balance of efforts along a log",
        "compare simulated motion instead, or ask model.loops.efforts",
    )?;
    if let Some((beam, _)) = description.beams.iter().zip(description.elastic()).find(|(_, len)| **len > 0) {
        return Err(Error::Flexible { beam: beam.name.clone() });
    }
    description.actuators.iter().try_for_each(by_command)?;
    let (joints, Motion { position, velocity, acceleration, inputs, time_step }) = (description.n_joints(), motion);
    let motion = JointMotion { position, velocity, acceleration };
    motion.expect(joints)?;
    inputs.expect("inputs", position.rows(), description.n_inputs())?;
    check_time_step(time_step)?;
    check_parameters(description, theta, sensitivities)?;
    let along = Along::new(Record { description, motion, time_step, interrupt }, theta, sensitivities)?;
    let Numbers { values: required, mut jacobian } = along.follow(Kind::Required, joints)?;
    let pulls = drives(description, inputs, time_step).any(|drive| matches!(drive.on, Target::Line(_)));
    let levers = if pulls { Some(along.follow(Kind::Levers, description.n_wires() * joints)?) } else { None };
    let mut applied = vec![0.0; required.len()];
    for drive in drives(description, inputs, time_step) {
        let course = Course::new(&drive, theta, sensitivities, &drive.parameters())?;
        let total =
            Total { joints, count: sensitivities.len(), values: &mut applied, jacobian: &mut jacobian, sign: -1.0 };
        total.add(&course, drive.on, levers.as_ref());
    }
    Ok(Efforts { required, applied, jacobian })
}

/// Efforts of ideal drives on the joints as in [`inverse_dynamics`], N x joints, and their derivatives; of a machine of which not every
/// coordinate was measured, as long as all drives act on joints or shafts.
pub fn delivered(
    description: &Description,
    theta: &[f64],
    (inputs, time_step): (Table<'_>, f64),
    sensitivities: &[usize],
) -> Result<(Vec<f64>, Vec<f64>)> {
    for actuator in &description.actuators {
        by_command(actuator)?;
        let (name, drive) = (actuator.name.clone(), actuator.drive.name());
        if let Target::Line(line) = actuator.on
            && let Some(line) = description.lines.get(line)
        {
            let found = format!("the line `{}`", line.name);
            return Err(DriveError::Target { actuator: name, drive, found, needed: "a joint" }.into());
        }
    }
    inputs.expect("inputs", inputs.rows(), description.n_inputs())?;
    check_time_step(time_step)?;
    check_parameters(description, theta, sensitivities)?;
    let joints = description.n_joints();
    let (mut values, count) = (vec![0.0; inputs.rows() * joints], sensitivities.len());
    let mut jacobian = vec![0.0; values.len() * count];
    for drive in drives(description, inputs, time_step) {
        let course = Course::new(&drive, theta, sensitivities, &drive.parameters())?;
        let total = Total { joints, count, values: &mut values, jacobian: &mut jacobian, sign: 1.0 };
        total.add(&course, drive.on, None);
    }
    Ok((values, jacobian))
}

/// Efforts that a measured motion needs as in [`inverse_dynamics`], N x joints, and their derivatives; of a machine with any drives, for
/// what these deliver does not enter.
pub fn required(
    description: &Description,
    theta: &[f64],
    (motion, time_step): (JointMotion<'_>, f64),
    sensitivities: &[usize],
    interrupt: Interrupt<'_>,
) -> Result<(Vec<f64>, Vec<f64>)> {
    description.refuse_loops(
        "the balance of efforts along a log",
        "compare simulated motion instead, or ask model.loops.efforts",
    )?;
    if let Some((beam, _)) = description.beams.iter().zip(description.elastic()).find(|(_, len)| **len > 0) {
        return Err(Error::Flexible { beam: beam.name.clone() });
    }
    motion.expect(description.n_joints())?;
    check_time_step(time_step)?;
    check_parameters(description, theta, sensitivities)?;
    let along = Along::new(Record { description, motion, time_step, interrupt }, theta, sensitivities)?;
    let Numbers { values, jacobian } = along.follow(Kind::Required, description.n_joints())?;
    Ok((values, jacobian))
}

/// Whether the machine exists with these parameters, and the parameters that are asked for.
fn check_parameters(description: &Description, theta: &[f64], sensitivities: &[usize]) -> Result<()> {
    check_variables(theta, sensitivities)?;
    description.check_values(theta)
}

/// Whether the effort of an actuator follows from its command alone.
fn by_command(actuator: &Actuator<usize>) -> Result<()> {
    let drive = match (&actuator.drive, &actuator.friction) {
        (Drive::Ideal(_), None) => return Ok(()),
        (Drive::Ideal(_), Some(_)) => "ideal with friction",
        (drive, _) => drive.name(),
    };
    Err(DriveError::Effort { actuator: actuator.name.clone(), drive }.into())
}

/// The drives of a machine with their inputs; one on a shaft acts on each of its joints by the ratio.
fn drives<'a>(description: &'a Description, inputs: Table<'a>, time_step: f64) -> impl Iterator<Item = Delivered<'a>> {
    let of_shaft = |on: Target| match on {
        Target::Line(line) => line.checked_sub(description.lines.len()).map(|shaft| &description.transmissions[shaft]),
        Target::Joint(_) => None,
    };
    description.actuators.iter().enumerate().flat_map(move |(number, actuator)| {
        let one = move |on, ratio| Delivered { actuator, on, ratio, number, inputs, time_step };
        let whole = of_shaft(actuator.on).is_none().then(|| one(actuator.on, None));
        let ratios = of_shaft(actuator.on).into_iter().flat_map(|shaft| &shaft.ratios);
        whole.into_iter().chain(ratios.map(move |entry| one(Target::Joint(entry.joint), Some(entry.ratio))))
    })
}

/// Efforts on all joints along a record, and `sign` times their derivatives by `count` parameters.
struct Total<'a> {
    joints: usize,
    count: usize,
    values: &'a mut [f64],
    jacobian: &'a mut [f64],
    sign: f64,
}

impl Total<'_> {
    /// Adds the efforts of a drive, by the levers if it acts on a line.
    fn add(self, efforts: &Course, on: Target, levers: Option<&Numbers>) {
        let Self { joints, count, values, jacobian, sign } = self;
        let lines = levers.map_or(0, |levers| levers.values.len() / values.len().max(1));
        for (k, &effort) in efforts.values.iter().enumerate() {
            match (on, levers) {
                (Target::Joint(joint), _) => {
                    let place = k * joints + joint;
                    values[place] += effort;
                    efforts.add_slopes(k, sign, &mut jacobian[place * count..][..count]);
                }
                (Target::Line(line), Some(levers)) => {
                    for joint in 0..joints {
                        let (place, arm) = (k * joints + joint, (k * lines + line) * joints + joint);
                        let (length, turned) = (levers.values[arm], &levers.jacobian[arm * count..][..count]);
                        let slopes = &mut jacobian[place * count..][..count];
                        values[place] += length * effort;
                        efforts.add_slopes(k, sign * length, slopes);
                        slopes.iter_mut().zip(turned).for_each(|(slope, &turn)| *slope += sign * effort * turn);
                    }
                }
                (Target::Line(_), None) => {}
            }
        }
    }
}
