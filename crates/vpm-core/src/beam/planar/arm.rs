//! A flexible arm whose joints follow a reference under proportional-derivative control.

use super::additive::Additive;
use super::chain::PlanarChain;
use super::dynamics::{Load, Motion, Terms, Workspace};
use super::rosenbrock::{Mechanism, Rosenbrock};
use crate::beam::{not_negative, positive};
use crate::error::Result;

/// Proportional-derivative control of one joint: `torque = stiffness (q_d - q) + damping (q_d' - q')`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Servo {
    /// Proportional gain in N m/rad.
    pub stiffness: f64,
    /// Derivative gain in N m s/rad.
    pub damping: f64,
}

/// Where a joint should be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// Joint angle in rad.
    pub angle: f64,
    /// Its rate in rad/s.
    pub rate: f64,
}

/// Time and motion of an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const ALL: usize> {
    /// Time in s.
    pub time: f64,
    /// Coordinates and rates.
    pub motion: Motion<f64, ALL>,
}

impl<const ALL: usize> Default for State<ALL> {
    /// Straight along x, undeformed, at rest.
    fn default() -> Self {
        Self { time: 0.0, motion: Motion { position: [0.0; ALL], velocity: [0.0; ALL] } }
    }
}

/// How an arm steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// [`Rosenbrock`]: two evaluations in each step. Robust at any step, and right where a step is a controller's short period.
    #[default]
    Second,
    /// [`Additive`]: six evaluations in each step, which pay off by far as soon as the reference is smooth over a step.
    Fourth,
}

/// The method of an order.
#[derive(Clone, Debug)]
enum Method<const ALL: usize> {
    Second(Rosenbrock<ALL>),
    Fourth(Additive<ALL>),
}

/// A planar chain with servos, ready to run in fixed steps. Nothing is allocated after [`Arm::new`].
#[derive(Clone, Debug)]
pub struct Arm<const LINKS: usize, const EACH: usize, const ALL: usize> {
    plant: Plant<LINKS, EACH, ALL>,
    method: Method<ALL>,
    step: f64,
}

/// Chain and servos.
#[derive(Clone, Debug)]
struct Plant<const LINKS: usize, const EACH: usize, const ALL: usize> {
    chain: PlanarChain<LINKS, EACH, ALL>,
    workspace: Workspace<f64, LINKS, EACH>,
    servos: [Servo; LINKS],
    joints: [[f64; ALL]; LINKS],
    /// Elasticity and servos together.
    stiffness: [[f64; ALL]; ALL],
    damping: [[f64; ALL]; ALL],
}

/// A plant with the reference that it follows.
struct Driven<'a, F, const LINKS: usize, const EACH: usize, const ALL: usize> {
    plant: &'a mut Plant<LINKS, EACH, ALL>,
    reference: F,
}

impl<const LINKS: usize, const EACH: usize, const ALL: usize> Arm<LINKS, EACH, ALL> {
    /// An arm of the second order that runs in steps of `step` (s). A joint without gains is free.
    pub fn new(chain: PlanarChain<LINKS, EACH, ALL>, servos: [Servo; LINKS], step: f64) -> Result<Self> {
        Self::of_order(Order::Second, chain, servos, step)
    }

    /// The same, of any order.
    pub fn of_order(
        order: Order,
        chain: PlanarChain<LINKS, EACH, ALL>,
        servos: [Servo; LINKS],
        step: f64,
    ) -> Result<Self> {
        positive("arm.step", step)?;
        let joints = std::array::from_fn(|i| chain.joint_row(i));
        let [mut stiffness, mut damping] = chain.elasticity();
        for (servo, row) in servos.iter().zip(&joints) {
            add_square(&mut stiffness, not_negative("servo.stiffness", servo.stiffness)?, row);
            add_square(&mut damping, not_negative("servo.damping", servo.damping)?, row);
        }
        let method = match order {
            Order::Second => Method::Second(Rosenbrock::new([stiffness, damping], step)),
            Order::Fourth => Method::Fourth(Additive::new([stiffness, damping], step)),
        };
        let workspace = chain.workspace();
        Ok(Self { plant: Plant { chain, workspace, servos, joints, stiffness, damping }, method, step })
    }

    /// The order of its method.
    pub fn order(&self) -> Order {
        match self.method {
            Method::Second(_) => Order::Second,
            Method::Fourth(_) => Order::Fourth,
        }
    }

    /// The chain.
    pub fn chain(&self) -> &PlanarChain<LINKS, EACH, ALL> {
        &self.plant.chain
    }

    /// Its step in s.
    pub fn step_size(&self) -> f64 {
        self.step
    }

    /// Stiffness K and damping D of elasticity and servos together.
    pub fn linear(&self) -> [[[f64; ALL]; ALL]; 2] {
        [self.plant.stiffness, self.plant.damping]
    }

    /// Moves `state` on by one step; `reference` tells at any time (s) where the joints should be.
    #[inline]
    pub fn step(&mut self, state: &mut State<ALL>, reference: impl Fn(f64) -> [Reference; LINKS]) {
        let mut driven = Driven { plant: &mut self.plant, reference };
        match &self.method {
            Method::Second(method) => method.step(&mut driven, &mut state.motion, state.time),
            Method::Fourth(method) => method.step(&mut driven, &mut state.motion, state.time),
        }
        state.time += self.step;
    }

    /// Mass matrix and total force: `-bias - K x - D v` and the pull of the reference.
    #[inline]
    pub fn evaluate(
        &mut self,
        motion: &Motion<f64, ALL>,
        reference: &[Reference; LINKS],
    ) -> ([[f64; ALL]; ALL], [f64; ALL]) {
        self.plant.evaluate(motion, motion, reference)
    }
}

impl<const LINKS: usize, const EACH: usize, const ALL: usize> Plant<LINKS, EACH, ALL> {
    #[inline]
    fn evaluate(
        &mut self,
        motion: &Motion<f64, ALL>,
        linear: &Motion<f64, ALL>,
        reference: &[Reference; LINKS],
    ) -> ([[f64; ALL]; ALL], [f64; ALL]) {
        let Terms { mass, bias } = self.chain.terms(motion, &Load::default(), &mut self.workspace);
        let mut force = bias.map(|entry| -entry);
        for (i, force) in force.iter_mut().enumerate() {
            for j in 0..ALL {
                *force -= self.stiffness[i][j] * linear.position[j] + self.damping[i][j] * linear.velocity[j];
            }
        }
        for ((servo, row), aim) in self.servos.iter().zip(&self.joints).zip(reference) {
            let pull = servo.stiffness * aim.angle + servo.damping * aim.rate;
            for (force, entry) in force.iter_mut().zip(row) {
                *force += entry * pull;
            }
        }
        (mass, force)
    }
}

impl<F, const LINKS: usize, const EACH: usize, const ALL: usize> Mechanism<f64, ALL> for Driven<'_, F, LINKS, EACH, ALL>
where
    F: Fn(f64) -> [Reference; LINKS],
{
    #[inline]
    fn evaluate(
        &mut self,
        motion: &Motion<f64, ALL>,
        linear: &Motion<f64, ALL>,
        t: f64,
    ) -> ([[f64; ALL]; ALL], [f64; ALL]) {
        self.plant.evaluate(motion, linear, &(self.reference)(t))
    }
}

fn add_square<const ALL: usize>(matrix: &mut [[f64; ALL]; ALL], factor: f64, row: &[f64; ALL]) {
    for (line, left) in matrix.iter_mut().zip(row) {
        for (entry, right) in line.iter_mut().zip(row) {
            *entry += factor * left * right;
        }
    }
}
