//! Ball joints of a machine in motion: what stands in the place of their angles between steps, and what watches these angles.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::ball::{Ball, LARGEST_TURN, accelerations, angles, angular_velocity, rates};
use crate::scalar::Scalar;
use crate::spatial::{Quaternion, Vector3};

/// What became of the coordinates of a ball joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Trouble {
    /// The second angle (rad) of this joint came too near to 90 degrees for its coordinates.
    Singular(usize, f64),
    /// A step turned this joint by this angle (rad), too far for the coordinates of a step.
    Leap(usize, f64),
    /// Loops could not be closed again: the gap that is left (m).
    Open(f64),
    /// Equations of the loops that became dependent: how many were independent at first, and how many are.
    Dependent(usize, usize),
}

/// The ball joints of a machine.
///
/// Law: between steps a joint that nothing acts on by its angles has a unit quaternion p; within a step its orientation is
/// `R(p) Rx(a) Ry(b) Rz(c)` with a, b, c zero at the beginning, so that their rates there are the angular velocity of the child in its own
/// axes. After the step p takes the angles over: a Lie group method in local coordinates, see [`crate::ode::Ode::arrive`].
/// Checked: rigid bodies tumbling through all orientations against Euler's equations; orders of all integrators.
#[derive(Clone, Debug)]
pub(super) struct Turning<S> {
    free: Vec<Free<S>>,
    watched: Vec<Watched>,
    trouble: Option<Trouble>,
    rests: bool,
}

/// A joint that turns from an orientation of its own.
#[derive(Clone, Debug)]
struct Free<S> {
    /// Its number among the ball joints of the machine.
    number: usize,
    /// Coordinates of its angles.
    places: [usize; 3],
    orientation: Quaternion<S>,
    /// The same as angles, which go on from those of the step before.
    angles: [S; 3],
}

/// A joint whose angles are coordinates.
#[derive(Clone, Debug)]
struct Watched {
    number: usize,
    ball: Ball,
    /// Half turns of the second angle from 90 degrees on.
    halves: f64,
}

impl<S: Scalar> Turning<S> {
    /// Turning ball joints, each with whether it turns freely.
    pub(super) fn new<'a>(balls: impl Iterator<Item = (&'a Ball, bool)>) -> Self {
        let (mut own, mut watched) = (Vec::new(), Vec::new());
        for (number, (ball, free)) in balls.enumerate() {
            match ball.places().filter(|_| free) {
                Some(places) => {
                    own.push(Free { number, places, orientation: Quaternion::identity(), angles: [S::zero(); 3] });
                }
                None => watched.push(Watched { number, ball: ball.clone(), halves: 0.0 }),
            }
        }
        Self { free: own, watched, trouble: None, rests: false }
    }

    /// Whether there are no turning ball joints.
    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.free.is_empty() && self.watched.is_empty()
    }

    /// Rests turning ball joints at their orientations, however steps move the coordinates.
    pub(super) fn rest(&mut self) {
        self.rests = true;
    }

    /// Whether turning ball joints keep their reference orientations.
    pub(super) fn is_resting(&self) -> bool {
        self.rests
    }

    pub(super) fn trouble(&self) -> Option<Trouble> {
        self.trouble
    }

    /// Enters a state `x` with users' angles of turning ball joints, and holds the orientations by `hold`.
    pub(super) fn enter(&mut self, x: &mut [S], n: usize, mut hold: impl FnMut(usize, S)) {
        self.trouble = None;
        let (q, v) = x.split_at_mut(n);
        for (place, joint) in self.free.iter_mut().enumerate() {
            joint.angles = joint.places.map(|place| q[place]);
            joint.orientation = Quaternion::from_angles(joint.angles);
            let omega = angular_velocity(joint.angles, joint.places.map(|place| v[place]));
            joint.begin(q, v, omega);
            joint.hold(place, &mut hold);
        }
        for joint in &mut self.watched {
            joint.halves = halves(joint.ball.of(q)[1].re());
        }
        self.watch(x, n, None);
    }

    /// Arrives after a step: turning ball joints take new orientations, see [`crate::ode::Ode::arrive`].
    pub(super) fn arrive(&mut self, x: &mut [S], n: usize, step: Option<f64>, mut hold: impl FnMut(usize, S)) {
        if self.rests {
            return;
        }
        self.watch(x, n, step);
        let (q, v) = x.split_at_mut(n);
        for (place, joint) in self.free.iter_mut().enumerate() {
            let [local, rates] = [&*q, &*v].map(|numbers| joint.places.map(|place| numbers[place]));
            if local[1].re().abs() > LARGEST_TURN {
                self.trouble.get_or_insert(Trouble::Leap(joint.number, local[1].re()));
            }
            joint.orientation = joint.orientation.then(Quaternion::from_angles(local)).normalised();
            joint.angles = angles(joint.orientation.rotation(), joint.angles.map(|angle| angle.re()));
            joint.begin(q, v, angular_velocity(local, rates));
            joint.hold(place, &mut hold);
        }
    }

    /// Watches for an angle of a turning ball joint that is too near to its singularity.
    fn watch(&mut self, x: &[S], n: usize, step: Option<f64>) {
        for joint in &mut self.watched {
            let (angle, near) = joint.ball.nearness(&x[..n], &x[n..], step);
            if near || halves(angle) != joint.halves {
                self.trouble.get_or_insert(Trouble::Singular(joint.number, angle));
            }
        }
    }

    /// Shows angles and rates of turning ball joints at state `x` in `shown`.
    pub(super) fn show(&self, x: &[S], n: usize, shown: &mut [S]) {
        for joint in &self.free {
            let rates = rates(joint.angles, joint.omega(&x[n..]));
            for (k, place) in joint.places.into_iter().enumerate() {
                shown[place] = joint.angles[k];
                shown[n + place] = rates[k];
            }
        }
    }

    /// Shows angles and rates of turning ball joints in the outputs. Accelerations too where the rates `dxdt` of the
    /// state are given.
    pub(super) fn show_outputs(&self, x: &[S], n: usize, dxdt: Option<&[S]>, outputs: &mut [S]) {
        for joint in &self.free {
            let omega = joint.omega(&x[n..]);
            let rates = rates(joint.angles, omega);
            let second = dxdt.map(|dxdt| {
                // The coordinates are zero, so that their rates and the angular velocity are the same, and their accelerations almost.
                let Vector3 { x, y, z } = omega;
                let drift = Vector3::new(y * z, -(x * z), x * y);
                accelerations(joint.angles, rates, joint.omega(&dxdt[n..]) + drift)
            });
            for (k, place) in joint.places.into_iter().enumerate() {
                let channels = &mut outputs[4 * place..4 * place + 4];
                channels[..2].copy_from_slice(&[joint.angles[k], rates[k]]);
                if let Some(second) = second {
                    channels[2] = second[k];
                }
            }
        }
    }
}

impl<S: Scalar> Free<S> {
    /// Begins a turning ball joint: zero coordinates, and an angular velocity as their rates.
    fn begin(&self, q: &mut [S], v: &mut [S], omega: Vector3<S>) {
        for (place, rate) in self.places.into_iter().zip(omega.to_array()) {
            (q[place], v[place]) = (S::zero(), rate);
        }
    }

    fn hold(&self, place: usize, hold: &mut impl FnMut(usize, S)) {
        self.orientation.to_array().into_iter().enumerate().for_each(|(k, number)| hold(4 * place + k, number));
    }

    /// Indices of a turning ball joint's three rates among those of all coordinates.
    fn omega(&self, numbers: &[S]) -> Vector3<S> {
        let [x, y, z] = self.places.map(|place| numbers[place]);
        Vector3::new(x, y, z)
    }
}

/// Number of half turns of a ball joint's angle from 90 degrees on.
fn halves(angle: f64) -> f64 {
    ((angle + FRAC_PI_2) / PI).floor()
}
