//! A torque on a joint by way of the measured force of an actuator along a line.

use serde::Deserialize;

use super::{domains, limit, none};
use crate::actuator::Saturation;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Impedance of a joint around an inner force loop, as in hydraulic legs: a joint torque is asked for, turned into a force along the
/// actuator's line, and that force itself and its difference to the force that is there drive the actuator.
///
/// Law: `tau = proportional (r - q) - derivative dq`, `F_d = tau / (ds/dq)`,
/// `u = feed_forward F_d + force_gain (F_d - F) + velocity_gain ds/dt`, limited to ±limit, with s the length of the line. Units: N m/rad
/// (N/m), N m s/rad (N s/m), command per N twice, command per m/s. The velocity term gives a valve the flow that the moving piston takes
/// anyway. An actuator that integrates its command, such as a cylinder behind a valve, comes to rest at `F = F_d` without feed forward; one
/// whose force is g times its command comes to `F = F_d g (feed_forward + force_gain) / (1 + g force_gain)`, which is F_d for
/// `feed_forward = 1 / g`. At a dead centre, `ds/dq = 0`, no force gives a torque and the command has no finite value without a limit.
/// Source: torque control with velocity compensation, Boaventura, Semini, Buchli, Frigerio, Focchi & Caldwell 2012, "Dynamic torque control
/// of a hydraulic quadruped robot", IEEE ICRA. Checked: the limit must be positive; the fixed point above, the lever arm by differences.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceLoop<P> {
    /// Torque per error of the joint.
    pub proportional: P,
    /// Torque per rate of the joint.
    pub derivative: P,
    /// Command per force that is asked for; nothing if none.
    #[serde(default = "none")]
    pub feed_forward: Option<P>,
    /// Command per force that is missing.
    pub force_gain: P,
    /// Command per rate of the line.
    pub velocity_gain: P,
    /// Largest command.
    #[serde(default = "none")]
    pub limit: Option<Saturation<P>>,
}

/// What a force loop sees of its actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke<S> {
    /// `ds/dq`, growth of the line per motion of the joint alone, m/rad.
    pub arm: S,
    /// `ds/dt`, m/s.
    pub rate: S,
    /// Force that the actuator delivers, N; positive pushes apart.
    pub force: S,
}

impl<P> ForceLoop<P> {
    /// Force-loop law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> ForceLoop<T> {
        ForceLoop {
            proportional: f(&self.proportional),
            derivative: f(&self.derivative),
            feed_forward: self.feed_forward.as_ref().map(&mut *f),
            force_gain: f(&self.force_gain),
            velocity_gain: f(&self.velocity_gain),
            limit: limit(self.limit.as_ref(), f),
        }
    }

    /// Parameters of the force loop and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut free = vec![&self.proportional, &self.derivative, &self.force_gain, &self.velocity_gain];
        free.extend(self.feed_forward.as_ref());
        domains(free, self.limit.as_ref())
    }
}

impl<S: Scalar> ForceLoop<S> {
    /// Command of the force loop for `reference` at the measured joint position `q` and rate `dq`. It has what is seen
    /// of the actuator.
    #[inline]
    pub fn command(&self, reference: S, q: S, dq: S, stroke: Stroke<S>) -> S {
        let wanted = (self.proportional * (reference - q) - self.derivative * dq) / stroke.arm;
        let command = self.force_gain * (wanted - stroke.force) + self.velocity_gain * stroke.rate;
        let command = self.feed_forward.map_or(command, |gain| command + gain * wanted);
        self.limit.map_or(command, |limit| limit.apply(command))
    }
}
