//! Sensors: what a measurement shows of a channel.

use serde::Deserialize;

use crate::delay::SampleDelay;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// A quantity of the model that can be recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Channel {
    /// Coordinate of a joint, m or rad.
    Position {
        /// Number of the joint.
        joint: usize,
    },
    /// Velocity of a joint, m/s or rad/s.
    Velocity {
        /// Number of the joint.
        joint: usize,
    },
    /// Acceleration of a joint, m/s^2 or rad/s^2.
    Acceleration {
        /// Number of the joint.
        joint: usize,
    },
    /// Total effort of the actuators on a joint, N or N m.
    Effort {
        /// Number of the joint.
        joint: usize,
    },
    /// Command of an actuator, as applied, in its command unit.
    Command {
        /// Number of the actuator.
        actuator: usize,
    },
    /// Effort that an actuator delivers, N or N m.
    Force {
        /// Number of the actuator.
        actuator: usize,
    },
    /// Distance of the ends of a line, m; angle of the shaft of a transmission, which count after the lines, rad.
    Length {
        /// Number of the line.
        line: usize,
    },
    /// How fast a line grows, m/s, or a shaft turns, rad/s.
    Rate {
        /// Number of the line.
        line: usize,
    },
    /// Force of the actuators on a line, N; positive pushes its ends apart. Their effort on a shaft, N m.
    Tension {
        /// Number of the line.
        line: usize,
    },
    /// Strain along a beam at a gauge.
    Strain {
        /// Number of the gauge.
        gauge: usize,
    },
    /// First coordinate of a marker in the world, m.
    X {
        /// Number of the marker.
        marker: usize,
    },
    /// Second coordinate of a marker in the world, m.
    Y {
        /// Number of the marker.
        marker: usize,
    },
    /// Third coordinate of a marker in the world, m.
    Z {
        /// Number of the marker.
        marker: usize,
    },
    /// First component of the rotation vector of a marker in the world, rad.
    Rx {
        /// Number of the marker.
        marker: usize,
    },
    /// Second component of the rotation vector of a marker in the world, rad.
    Ry {
        /// Number of the marker.
        marker: usize,
    },
    /// Third component of the rotation vector of a marker in the world, rad.
    Rz {
        /// Number of the marker.
        marker: usize,
    },
    /// A quantity of a hydraulic drive.
    Hydraulic {
        /// Number of the drive among the hydraulic ones.
        hydraulic: usize,
        /// Which.
        quantity: HydraulicQuantity,
    },
    /// Current of a motor, A.
    Current {
        /// Number of the drive among the motors.
        dc_motor: usize,
    },
    /// A quantity of a hydraulic supply.
    Supply {
        /// Number of the supply.
        supply: usize,
        /// Which.
        quantity: SupplyQuantity,
    },
    /// Depth of a contact, or a force in it.
    Contact {
        /// Number of the contact.
        contact: usize,
        /// Which one.
        quantity: ContactQuantity,
    },
    /// Wrench of a bushing on the body of A, in the axes of A.
    Bushing {
        /// Number of the bushing.
        bushing: usize,
        /// Which component.
        component: Component,
    },
    /// Orientation of a ball joint, or angular velocity of its child.
    Ball {
        /// Number of the ball joint.
        ball: usize,
        /// Which number.
        quantity: BallQuantity,
    },
    /// Wrench of a closed loop on the body of A, in the axes of A.
    Loop {
        /// Number of the loop.
        #[serde(rename = "loop")]
        closure: usize,
        /// Which component.
        component: Component,
    },
    /// Reaction wrench at a joint, on the child, in its axes.
    LoadCell {
        /// Number of the load cell.
        load_cell: usize,
        /// Which component.
        component: Component,
    },
    /// A reading of an inertial measurement unit, in its own axes.
    Imu {
        /// Number of the unit.
        imu: usize,
        /// Which.
        quantity: ImuQuantity,
    },
}

/// What a hydraulic drive shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HydraulicQuantity {
    /// Place of the spool, spool unit.
    Spool,
    /// Pressure in chamber a, Pa.
    PressureA,
    /// Pressure in chamber b, Pa.
    PressureB,
    /// Flow of the valve into chamber a, m^3/s.
    FlowA,
    /// Flow of the valve out of chamber b, m^3/s.
    FlowB,
}

/// What a supply shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SupplyQuantity {
    /// Its pressure, Pa.
    Pressure,
    /// The flow drawn from it, m^3/s.
    Flow,
}

/// What can be recorded of a contact; forces act on the machine, in world axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactQuantity {
    /// How deep the point is in the plane, m.
    Depth,
    /// Force along the normal, N.
    NormalForce,
    /// First component of the force, N.
    Fx,
    /// Second component of the force, N.
    Fy,
    /// Third component of the force, N.
    Fz,
}

/// What a ball joint shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BallQuantity {
    /// Real part of the unit quaternion of the child in the frame of the joint.
    Qw,
    /// First component of its vector.
    Qx,
    /// Second component of its vector.
    Qy,
    /// Third component of its vector.
    Qz,
    /// First component of the angular velocity of the child in the frame of the joint, in axes of the child, rad/s.
    Wx,
    /// Second component of it, rad/s.
    Wy,
    /// Third component of it, rad/s.
    Wz,
}

/// What an inertial measurement unit reads in its own axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImuQuantity {
    /// First component of the specific force, acceleration less that of gravity, m/s^2.
    Ax,
    /// Second component of it, m/s^2.
    Ay,
    /// Third component of it, m/s^2.
    Az,
    /// First component of the angular velocity, rad/s.
    Wx,
    /// Second component of it, rad/s.
    Wy,
    /// Third component of it, rad/s.
    Wz,
}

/// A component of a wrench.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// First component of the moment, N m.
    Mx,
    /// Second component of the moment, N m.
    My,
    /// Third component of the moment, N m.
    Mz,
    /// First component of the force, N.
    Fx,
    /// Second component of the force, N.
    Fy,
    /// Third component of the force, N.
    Fz,
}

/// How many parts of each kind a model has, which decides where its outputs are.
///
/// In this order: position, velocity, acceleration, effort of each joint; command, force of each actuator; length, rate, force of each
/// line; strain of each gauge; x, y, z, rx, ry, rz of each marker; spool, pressure a, pressure b, flow a, flow b of each hydraulic drive;
/// current of each motor; pressure, flow of each supply; depth, normal force, fx, fy, fz of each contact; mx, my, mz, fx, fy, fz of each
/// bushing and of each load cell; qw, qx, qy, qz, wx, wy, wz of each ball joint; mx, my, mz, fx, fy, fz of each closed loop; ax, ay, az,
/// wx, wy, wz of each inertial measurement unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Joints.
    pub joints: usize,
    /// Actuators.
    pub actuators: usize,
    /// Lines, then transmissions.
    pub lines: usize,
    /// Strain gauges.
    pub gauges: usize,
    /// Markers.
    pub markers: usize,
    /// Hydraulic drives.
    pub hydraulics: usize,
    /// Direct-current motors.
    pub dc_motors: usize,
    /// Hydraulic supplies.
    pub supplies: usize,
    /// Contacts.
    pub contacts: usize,
    /// Bushings.
    pub bushings: usize,
    /// Load cells.
    pub load_cells: usize,
    /// Ball joints.
    pub balls: usize,
    /// Closed loops.
    pub loops: usize,
    /// Inertial measurement units.
    pub imus: usize,
}

impl Layout {
    /// Where the outputs of the actuators begin.
    pub fn actuators(self) -> usize {
        4 * self.joints
    }

    /// Where the outputs of the lines begin.
    pub fn lines(self) -> usize {
        self.actuators() + 2 * self.actuators
    }

    /// Where the outputs of the gauges begin.
    pub fn gauges(self) -> usize {
        self.lines() + 3 * self.lines
    }

    /// Where the outputs of the markers begin.
    pub fn markers(self) -> usize {
        self.gauges() + self.gauges
    }

    /// Where the outputs of the hydraulic drives begin.
    pub fn hydraulics(self) -> usize {
        self.markers() + 6 * self.markers
    }

    /// Where the outputs of the motors begin.
    pub fn dc_motors(self) -> usize {
        self.hydraulics() + 5 * self.hydraulics
    }

    /// Where the outputs of the supplies begin.
    pub fn supplies(self) -> usize {
        self.dc_motors() + self.dc_motors
    }

    /// Where the outputs of the contacts begin.
    pub fn contacts(self) -> usize {
        self.supplies() + 2 * self.supplies
    }

    /// Where the outputs of the bushings begin.
    pub fn bushings(self) -> usize {
        self.contacts() + 5 * self.contacts
    }

    /// Where the outputs of the load cells begin.
    pub fn load_cells(self) -> usize {
        self.bushings() + 6 * self.bushings
    }

    /// Where the outputs of the ball joints begin.
    pub fn balls(self) -> usize {
        self.load_cells() + 6 * self.load_cells
    }

    /// Where the outputs of the closed loops begin.
    pub fn loops(self) -> usize {
        self.balls() + 7 * self.balls
    }

    /// Where the outputs of the inertial measurement units begin.
    pub fn imus(self) -> usize {
        self.loops() + 6 * self.loops
    }

    /// Whether the state alone decides an output, so that its sensor needs no rates. See
    /// [`crate::system::Dynamics::observe_motion`]; not said of contacts and bushings.
    pub(crate) fn is_of_motion(self, column: usize) -> bool {
        match column {
            _ if column < self.actuators() => column % 4 < 2,
            _ if column < self.lines() => false,
            _ if column < self.gauges() => (column - self.lines()) % 3 < 2,
            _ => column < self.hydraulics() || (self.balls()..self.loops()).contains(&column),
        }
    }

    /// Number of all outputs that sensors may show.
    pub fn count(self) -> usize {
        self.imus() + 6 * self.imus
    }
}

impl Channel {
    /// Column of a sensor's channel among the outputs of a model.
    pub fn column(self, layout: Layout) -> usize {
        match self {
            Self::Position { joint } => 4 * joint,
            Self::Velocity { joint } => 4 * joint + 1,
            Self::Acceleration { joint } => 4 * joint + 2,
            Self::Effort { joint } => 4 * joint + 3,
            Self::Command { actuator } => layout.actuators() + 2 * actuator,
            Self::Force { actuator } => layout.actuators() + 2 * actuator + 1,
            Self::Length { line } => layout.lines() + 3 * line,
            Self::Rate { line } => layout.lines() + 3 * line + 1,
            Self::Tension { line } => layout.lines() + 3 * line + 2,
            Self::Strain { gauge } => layout.gauges() + gauge,
            Self::X { marker } => layout.markers() + 6 * marker,
            Self::Y { marker } => layout.markers() + 6 * marker + 1,
            Self::Z { marker } => layout.markers() + 6 * marker + 2,
            Self::Rx { marker } => layout.markers() + 6 * marker + 3,
            Self::Ry { marker } => layout.markers() + 6 * marker + 4,
            Self::Rz { marker } => layout.markers() + 6 * marker + 5,
            Self::Hydraulic { hydraulic, quantity } => layout.hydraulics() + 5 * hydraulic + quantity as usize,
            Self::Current { dc_motor } => layout.dc_motors() + dc_motor,
            Self::Supply { supply, quantity } => layout.supplies() + 2 * supply + quantity as usize,
            Self::Contact { contact, quantity } => layout.contacts() + 5 * contact + quantity as usize,
            Self::Bushing { bushing, component } => layout.bushings() + 6 * bushing + component as usize,
            Self::Ball { ball, quantity } => layout.balls() + 7 * ball + quantity as usize,
            Self::Loop { closure, component } => layout.loops() + 6 * closure + component as usize,
            Self::LoadCell { load_cell, component } => layout.load_cells() + 6 * load_cell + component as usize,
            Self::Imu { imu, quantity } => layout.imus() + 6 * imu + quantity as usize,
        }
    }
}

/// A sensor on a channel, with what it does to the true value.
///
/// Law: `y(t) = gain x(t - delay) + offset`, y in the channel's unit, delay in s; see [`SampleDelay`] for delays between samples.
/// Source: the linear measurement model, Doebelin 2004, "Measurement Systems", section 3.2. Checked: the gain must not be zero (the
/// inverse dynamics undo it), the delay not negative.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor<P> {
    /// Name, unique in the model.
    pub name: String,
    /// What it measures.
    pub channel: Channel,
    /// Reading per true value (1 if none).
    #[serde(default = "none")]
    pub gain: Option<P>,
    /// Reading at a true value of zero.
    #[serde(default = "none")]
    pub offset: Option<P>,
    /// Age of the reading in s.
    #[serde(default = "none")]
    pub delay: Option<P>,
}

fn none<T>() -> Option<T> {
    None
}

impl<P> Sensor<P> {
    /// The same sensor over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Sensor<T> {
        Sensor {
            name: self.name.clone(),
            channel: self.channel,
            gain: self.gain.as_ref().map(&mut *f),
            offset: self.offset.as_ref().map(&mut *f),
            delay: self.delay.as_ref().map(&mut *f),
        }
    }

    /// Parameters of a sensor and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut domains = Vec::new();
        domains.extend(self.gain.as_ref().map(|gain| (gain, Domain::NonZero)));
        domains.extend(self.offset.as_ref().map(|offset| (offset, Domain::Any)));
        domains.extend(self.delay.as_ref().map(|delay| (delay, Domain::NonNegative)));
        domains
    }
}

impl<S: Scalar> Sensor<S> {
    /// Sensor reading at sample `k` of a true signal given sample by sample. Before the record starts the signal is at
    /// its first value.
    #[inline]
    pub fn read(&self, k: usize, time_step: f64, truth: impl Fn(usize) -> S) -> S {
        let arrived = match self.delay {
            Some(delay) => SampleDelay::new(delay, time_step).delayed(k, truth),
            None => truth(k),
        };
        self.show(arrived)
    }

    /// Sensor reading of a true value that has arrived.
    #[inline]
    pub fn show(&self, arrived: S) -> S {
        let scaled = self.gain.map_or(arrived, |gain| gain * arrived);
        self.offset.map_or(scaled, |offset| scaled + offset)
    }

    /// True signal at sample `k` behind sensor readings given sample by sample. Of these `last` is the last; past it
    /// they hold.
    #[inline]
    pub fn undo(&self, k: usize, last: usize, time_step: f64, reading: impl Fn(usize) -> S) -> S {
        let shifted = self.undo_rate(k, last, time_step, reading);
        match (self.offset, self.gain) {
            (Some(offset), Some(gain)) => shifted - offset / gain,
            (Some(offset), None) => shifted - offset,
            (None, _) => shifted,
        }
    }

    /// As [`Sensor::undo`] for a time derivative of the reading, which no offset touches.
    #[inline]
    pub fn undo_rate(&self, k: usize, last: usize, time_step: f64, reading: impl Fn(usize) -> S) -> S {
        let shifted = match self.delay {
            Some(delay) => SampleDelay::new(delay, time_step).advanced(k, last, reading),
            None => reading(k),
        };
        self.gain.map_or(shifted, |gain| shifted / gain)
    }
}
