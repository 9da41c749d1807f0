//! Linear actuators of barrel and rod between two points of a planar linkage, with masses of their own.

use std::array::from_fn;

use vpm_core::scalar::Scalar;
use vpm_core::spatial::{Twist, Vector2, Vector3};

/// Barrel or rod of an actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorBody {
    /// Mass in kg.
    pub mass: f64,
    /// Rotational inertia about the centre of mass, normal to the plane, in kg m^2.
    pub inertia: f64,
    /// Distance of the centre of mass from its attachment, along the line to the other one, in m.
    pub center: f64,
}

/// An actuator: a barrel on its base point and a rod on its tip point, always in line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineActuator {
    /// The part attached to the base.
    pub barrel: ActuatorBody,
    /// The part attached to the tip.
    pub rod: ActuatorBody,
}

/// A point of a linkage (m), and its velocity per unit rate of each of `B` coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMotion<S, const B: usize> {
    /// Where it is.
    pub place: Vector2<S>,
    /// Its velocity per unit rate.
    pub columns: [Vector2<S>; B],
}

/// The line between two points: its length, its direction, and how both change with the coordinates. Its `levers` are the
/// row of `Psi` that belongs to the length as a dependent coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line<S, const B: usize> {
    /// Distance s of the points in m.
    pub length: S,
    /// Unit vector u from base to tip.
    pub direction: Vector2<S>,
    /// `ds = u . (v_tip - v_base)` per unit rate: the lever arms of the actuator's force.
    pub levers: [S; B],
    /// `w = u x (v_tip - v_base) / s` per unit rate.
    pub spins: [S; B],
}

impl<S: Scalar, const B: usize> Line<S, B> {
    /// Line actuator between a base and a tip; undefined where they coincide.
    pub fn new(base: &PointMotion<S, B>, tip: &PointMotion<S, B>) -> Self {
        let across = tip.place - base.place;
        let length = across.length();
        let direction = across * length.recip();
        let relative: [Vector2<S>; B] = from_fn(|b| tip.columns[b] - base.columns[b]);
        let levers = relative.map(|velocity| direction.dot(velocity));
        let spins = relative.map(|velocity| direction.cross(velocity) / length);
        Self { length, direction, levers, spins }
    }
}

impl LineActuator {
    /// Jacobians of barrel and rod at their centres of mass, where coordinate number `stroke` is the actuator's length.
    ///
    /// Law: both parts turn with the line. The barrel's centre is `base + c u`; the rod's is `base + (s - c) u`, so
    /// that it also moves by u per unit rate of s, the coordinate that its `levers` make dependent. Source: eqs 2.85 to
    /// 2.95.
    /// Checked: the sum over all coordinates is the derivative of the centres' positions.
    pub fn jacobians<S: Scalar, const B: usize>(
        &self,
        base: &PointMotion<S, B>,
        line: &Line<S, B>,
        stroke: usize,
    ) -> [[Twist<S>; B]; 2] {
        let normal = line.direction.perpendicular();
        let column = |b: usize, distance: S| {
            let spin = line.spins[b];
            (spin, base.columns[b] + normal * (spin * distance))
        };
        let barrel = from_fn(|b| {
            let (spin, velocity) = column(b, S::from_f64(self.barrel.center));
            planar(spin, velocity)
        });
        let rod = from_fn(|b| {
            let (spin, velocity) = column(b, line.length - self.rod.center);
            planar(spin, if b == stroke { velocity + line.direction } else { velocity })
        });
        [barrel, rod]
    }
}

/// Motion of a line actuator in the plane as a twist.
pub(super) fn planar<S: Scalar>(spin: S, velocity: Vector2<S>) -> Twist<S> {
    let zero = S::zero();
    Twist::new(Vector3::new(zero, zero, spin), Vector3::new(velocity.x, velocity.y, zero))
}
