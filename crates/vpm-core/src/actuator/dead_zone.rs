//! Small commands that do nothing.

use serde::Deserialize;

use crate::scalar::Scalar;

/// Dead zone of an actuator: the command must first overcome a threshold.
///
/// Law: `sign(u) max(|u| - width, 0)`, all in the command's unit.
/// Source: Tao & Kokotovic 1996, "Adaptive Control of Systems with Actuator and Sensor Nonlinearities", section 2.1, with equal
/// break points and unit slope. Checked: the width must not be negative.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct DeadZone<P> {
    /// Half of the interval of commands without effect.
    pub width: P,
}

impl<P> DeadZone<P> {
    /// The same dead zone over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> DeadZone<T> {
        DeadZone { width: f(&self.width) }
    }
}

impl<S: Scalar> DeadZone<S> {
    /// The command as it leaves the dead zone: nearer to zero by the width, zero inside.
    #[inline]
    pub fn apply(&self, command: S) -> S {
        let below = || command.if_less(-self.width, || command + self.width, S::zero);
        self.width.if_less(command, || command - self.width, below)
    }
}
