//! Ball joints: the three angles that model files and logs have for an orientation, and what is regular where these are not.
//!
//! An orientation is `R = Rx(a) Ry(b) Rz(c)`: Cardan angles (Wittenburg 2008, "Dynamics of Multibody Systems", section 2.1.2), whose rates
//! are infinite where b is 90 degrees. Unit quaternions and angular velocities have no such place.

use std::f64::consts::TAU;

use serde::Deserialize;

use crate::error::{Error, Result};
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Vector3};

/// Least cosine of the second angle that is shown, about the root of the rounding of a number: angles then tell the orientation, and with
/// their rates the angular velocity, to eight digits everywhere.
pub(crate) const SHOWN: f64 = 1e-8;
/// Least cosine of the second angle where angles are coordinates: a mass matrix loses as many digits as its square has zeros, here half of
/// the sixteen that a number has.
pub(crate) const LEAST: f64 = 1e-4;
/// How many steps of fixed length a joint has to be away from the singularity, as fast as its first two angles turn the child: the rates of
/// the angles go with the inverse of the distance, so that one step changes them by a tenth at most.
pub(crate) const STEPS_AWAY: f64 = 10.0;
/// Largest second angle (rad) of a single step of a joint that turns freely: its cosine, by which the rates of the angles are divided, is
/// then a half at least.
pub(crate) const LARGEST_TURN: f64 = std::f64::consts::FRAC_PI_3;

/// A joint of three angles about x, y and z, each axis turned by the angles before.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Name of the joint.
    pub name: String,
    /// Numbers of the coordinates of each angle: one as a rule, more where effects divide it.
    pub angles: [Vec<usize>; 3],
}

impl Ball {
    /// Angles of a ball joint, or their rates, among those of all coordinates.
    pub(crate) fn of<S: Scalar>(&self, numbers: &[S]) -> [S; 3] {
        self.angles.each_ref().map(|places| places.iter().map(|&place| numbers[place]).sum())
    }

    /// Nearness of a ball joint's second angle (rad) to 90 degrees, where it is no coordinate. At coordinates `q` and
    /// rates `v`, in steps (s) of fixed length or of controlled error.
    pub(crate) fn nearness<S: Scalar>(&self, q: &[S], v: &[S], step: Option<f64>) -> (f64, bool) {
        let [angles, rates] = [self.of(q), self.of(v)].map(|numbers| numbers.map(|number| number.re()));
        let cosine = angles[1].cos();
        let turning = rates[1].hypot(rates[0] * cosine);
        (angles[1], cosine.abs() < LEAST.max(step.map_or(0.0, |step| STEPS_AWAY * step * turning)))
    }

    /// Places of a ball joint's angles among the coordinates, if nothing divides them.
    pub(crate) fn places(&self) -> Option<[usize; 3]> {
        match self.angles.each_ref().map(Vec::as_slice) {
            [&[first], &[second], &[third]] => Some([first, second, third]),
            _ => None,
        }
    }
}

/// Complains about a ball joint whose angles cannot be coordinates at `q`.
pub(crate) fn check_angles(balls: &[Ball], q: &[f64]) -> Result<()> {
    for ball in balls {
        let [_, angle, _] = ball.of(q);
        if angle.cos().abs() < LEAST {
            return Err(Error::Angles { joint: ball.name.clone(), angle: angle.to_degrees() });
        }
    }
    Ok(())
}

/// Angles of a ball joint's orientation next to those `near` (rad). Of the two triples that every orientation has, it
/// takes the one whose first angle is nearer.
pub(crate) fn angles<S: Scalar>(orientation: Matrix3<S>, near: [f64; 3]) -> [S; 3] {
    let [x, y, z] = orientation.columns;
    let (sine, cosine) = near[0].sin_cos();
    // Values alone choose which triple it is: derivatives are those of that one.
    let side = if z.z.re() * cosine < z.y.re() * sine { -1.0 } else { 1.0 };
    let a = match z.y.re().hypot(z.z.re()) < SHOWN {
        true => S::from_f64(near[0]),
        false => angle(-z.y * side, z.z * side, near[0]),
    };
    // What the first angle leaves is regular everywhere.
    let (sine, cosine) = a.sin_cos();
    let b = angle(z.x, regular(z.z * cosine - z.y * sine), near[1]);
    let c = angle(x.y * cosine + x.z * sine, y.y * cosine + y.z * sine, near[2]);
    [a, b, c]
}

/// Angular velocity of a ball joint in axes of the child (rad/s) at these angles and their rates.
pub(crate) fn angular_velocity<S: Scalar>([_, b, c]: [S; 3], [u, v, w]: [S; 3]) -> Vector3<S> {
    let ((sb, cb), (sc, cc)) = (b.sin_cos(), c.sin_cos());
    Vector3::new(u * cb * cc + v * sc, v * cc - u * cb * sc, u * sb + w)
}

/// Rates of a ball joint's angles (rad/s) at an angular velocity, the inverse of [`angular_velocity`]. The velocity is
/// in axes of the child.
pub(crate) fn rates<S: Scalar>([_, b, c]: [S; 3], omega: Vector3<S>) -> [S; 3] {
    let ((sb, cb), (sc, cc)) = (b.sin_cos(), c.sin_cos());
    let u = (cc * omega.x - sc * omega.y) / regular(cb);
    [u, sc * omega.x + cc * omega.y, omega.z - u * sb]
}

/// Second derivatives of a ball joint's angles (rad/s^2). They hold at their rates and the derivative of the angular
/// velocity in axes of the child.
pub(crate) fn accelerations<S: Scalar>(angles: [S; 3], [u, v, w]: [S; 3], alpha: Vector3<S>) -> [S; 3] {
    let ((sb, cb), (sc, cc)) = (angles[1].sin_cos(), angles[2].sin_cos());
    // The derivative of the angular velocity at constant rates.
    let drift = Vector3::new(
        -u * (sb * v * cc + cb * w * sc) + v * cc * w,
        u * (sb * v * sc - cb * w * cc) - v * sc * w,
        u * cb * v,
    );
    rates(angles, alpha - drift)
}

/// Cosine of a ball joint's angle that is not too near to zero to be divided by.
fn regular<S: Scalar>(cosine: S) -> S {
    let least = S::from_f64(SHOWN);
    let away = || cosine.if_negative(|| -least, || least);
    cosine.abs().if_less(least, away, || cosine)
}

/// Angle (rad) of a ball joint next to `near` with this sine and cosine. They count up to a positive factor of both.
fn angle<S: Scalar>(sine: S, cosine: S, near: f64) -> S {
    let turns = (sine.re().atan2(cosine.re()) - near) / TAU;
    let value = near + (turns - turns.round()) * TAU;
    // What is left is rounding, with the derivatives.
    let (s, c) = value.sin_cos();
    S::from_f64(value) + ((sine * c - cosine * s) / (cosine * c + sine * s)).atan()
}
