//! Control by the inverted model of the machine.

use serde::Deserialize;

use super::none;
use crate::actuator::Saturation;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Computed torque (inverse dynamics control) of several joints: the efforts that would give the joints the accelerations that an error
/// is to die away with.
///
/// Law: `a = r'' + derivative (r' - dq) + proportional (r - q)` for each joint, `tau = M(q) a + h(q, dq) - effects(q, dq)` over all joints
/// with their payloads, all at the measured q and dq; the command is the tau of the joint divided by the actuator's gain, limited to
/// ±limit. r' and r'' are backward differences of the sampled reference, see [`Differences`]. Units: 1/s^2, 1/s, command.
/// If the model is right and the efforts are not limited, the error obeys `e'' + derivative e' + proportional e = 0` up to the time between
/// samples.
/// Joints that it does not command count as not accelerating, `a = 0`, at their measured positions and rates: what moves them (another
/// controller, a contact, a load) is unknown to it. So its torques are exact where it commands every joint, or where the others are held.
/// The forces of contacts, of bushings and of other actuators are no part of its model either: where they act they leave an error, which
/// the gains have to hold. For a leg under a slider that means: with the foot in the air, the slider falls with an acceleration that the
/// controller does not know; on the ground the slider rests, and the load on the foot is left to the gains.
/// Source: Siciliano, Sciavicco, Villani & Oriolo 2009, "Robotics", section 8.5.2. Checked: limits must be positive; each actuator drives the
/// joint that it is listed with; no elastic coordinates; the linear error dynamics on trees.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComputedTorque<P> {
    /// Acceleration per error of each joint, 1/s^2.
    pub proportional: Vec<P>,
    /// Acceleration per error of the rate of each joint, 1/s.
    pub derivative: Vec<P>,
    /// Largest command of each actuator.
    #[serde(default = "none")]
    pub limit: Option<Vec<Saturation<P>>>,
}

/// First and second rate of a sampled reference.
///
/// Law: `r' = (r[k] - r[k-1]) / h`, `r'' = (r[k] - 2 r[k-1] + r[k-2]) / h^2`; what there are not yet samples for is zero. They are half a
/// sample and a whole sample late. Source: backward differences, Hairer, Nørsett & Wanner 1993, section III.1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differences<S> {
    seen: usize,
    /// r[k-1] and r[k-2].
    last: [S; 2],
}

impl<P> ComputedTorque<P> {
    /// Computed-torque law over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> ComputedTorque<T> {
        ComputedTorque {
            proportional: self.proportional.iter().map(&mut *f).collect(),
            derivative: self.derivative.iter().map(&mut *f).collect(),
            limit: self.limit.as_ref().map(|limits| limits.iter().map(|limit| limit.map(f)).collect()),
        }
    }

    /// Parameters of computed torque and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let free = self.proportional.iter().chain(&self.derivative).map(|gain| (gain, Domain::Any));
        let limits = self.limit.iter().flatten().map(|limit| (&limit.limit, Domain::Positive));
        free.chain(limits).collect()
    }
}

impl<S: Scalar> ComputedTorque<S> {
    /// Acceleration that computed torque wants of joint number `place`, for its reference with its rates.
    #[inline]
    pub fn acceleration(&self, place: usize, [r, dr, ddr]: [S; 3], q: S, dq: S) -> S {
        ddr + self.derivative[place] * (dr - dq) + self.proportional[place] * (r - q)
    }

    /// Computed-torque command within the limits of actuator number `place` of the controller.
    #[inline]
    pub fn limited(&self, place: usize, command: S) -> S {
        self.limit.as_ref().map_or(command, |limits| limits[place].apply(command))
    }
}

impl<S: Scalar> Differences<S> {
    /// Reference of computed torque with its rates, `time_step` (s) after the last call.
    #[inline]
    pub fn next(&mut self, reference: S, time_step: f64) -> [S; 3] {
        let [last, before] = self.last;
        let rate = |now: S, last: S| (now - last) / time_step;
        let (first, second) = match self.seen {
            0 => (S::zero(), S::zero()),
            1 => (rate(reference, last), S::zero()),
            _ => (rate(reference, last), rate(rate(reference, last), rate(last, before))),
        };
        *self = Self { seen: (self.seen + 1).min(2), last: [reference, last] };
        [reference, first, second]
    }
}
