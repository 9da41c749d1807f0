//! A motion between its samples.

use crate::scalar::Scalar;

/// Position, velocity and acceleration of a joint.
pub(crate) type State<S> = [S; 3];

/// Quintic polynomial between two samples with position, velocity and acceleration, and its derivatives. The interval
/// is in s, and `time` (s) counts from its begin.
///
/// Law: the quintic Hermite interpolant (Biagiotti & Melchiorri 2008, "Trajectory Planning for Automatic Machines and Robots", section
/// 2.1.7). Checked: a polynomial of degree 5 is itself.
pub(super) fn between<S: Scalar>(ends: &[State<S>; 2], time: S, interval: S) -> State<S> {
    let [[q0, v0, a0], [q1, v1, a1]] = *ends;
    let (h, s) = (interval, time / interval);
    // In units of the interval: q0 + s v + s^2 a / 2 + s^3 (c3 + c4 s + c5 s^2).
    let (v0, v1, a0, a1) = (v0 * h, v1 * h, a0 * (h * h), a1 * (h * h));
    let (gap, turn, bend) = (q1 - q0 - v0 - a0 * 0.5, v1 - v0 - a0, a1 - a0);
    let c3 = gap * 10.0 - turn * 4.0 + bend * 0.5;
    let c4 = gap * -15.0 + turn * 7.0 - bend;
    let c5 = gap * 6.0 - turn * 3.0 + bend * 0.5;
    let square = s * s;
    let q = q0 + v0 * s + a0 * square * 0.5 + square * s * (c3 + c4 * s + c5 * square);
    let v = v0 + a0 * s + square * (c3 * 3.0 + c4 * s * 4.0 + c5 * square * 5.0);
    let a = a0 + s * (c3 * 6.0 + c4 * s * 12.0 + c5 * square * 20.0);
    [q, v / h, a / (h * h)]
}
