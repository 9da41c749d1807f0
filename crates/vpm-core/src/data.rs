//! Every buffer the recursions need, allocated once per model.

use crate::model::Model;
use crate::scalar::Scalar;
use crate::spatial::{ArticulatedInertia, Pose, SpatialInertia, Twist, Wrench};

/// Working memory of the algorithms in [`crate::dynamics`], which leave their results here.
///
/// Buffers per body have one slot more than there are bodies: slot 0 is the world, slot k + 1 is body k.
#[derive(Clone, Debug)]
pub struct Data<S> {
    pub(crate) kinematics: Vec<KinematicsSlot<S>>,
    pub(crate) rnea: Vec<RneaSlot<S>>,
    pub(crate) crba: Vec<CrbaSlot<S>>,
    pub(crate) aba: Vec<AbaSlot<S>>,
    pub(crate) effort: Vec<S>,
    pub(crate) acceleration: Vec<S>,
    pub(crate) mass_matrix: Vec<S>,
}

/// Motion of a body in the frames of its description.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KinematicsSlot<S> {
    /// X_WB.
    pub(crate) pose: Pose<S>,
    /// V_WB, in the axes and at the origin of B.
    pub(crate) twist: Twist<S>,
}

/// Recursive Newton-Euler: X_PB, V, A and F of a body in its aligned frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RneaSlot<S> {
    pub(crate) pose: Pose<S>,
    pub(crate) velocity: Twist<S>,
    pub(crate) acceleration: Twist<S>,
    pub(crate) wrench: Wrench<S>,
}

/// Composite rigid body: X_PB and the inertia of the body with everything it carries.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CrbaSlot<S> {
    pub(crate) pose: Pose<S>,
    pub(crate) composite: SpatialInertia<S>,
}

/// Articulated body: the quantities of Featherstone 2008, table 7.1, by their names there.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AbaSlot<S> {
    pub(crate) pose: Pose<S>,
    pub(crate) velocity: Twist<S>,
    /// c: velocity-dependent acceleration across the joint.
    pub(crate) bias_acceleration: Twist<S>,
    /// p^A: force that keeps the acceleration zero.
    pub(crate) bias_wrench: Wrench<S>,
    /// I^A.
    pub(crate) inertia: ArticulatedInertia<S>,
    /// U = I^A S.
    pub(crate) unit_wrench: Wrench<S>,
    /// 1/D, with D = S . U.
    pub(crate) inverse: S,
    /// u: effort left over for the joint.
    pub(crate) effort: S,
    pub(crate) acceleration: Twist<S>,
}

impl<S: Scalar> Data<S> {
    /// Allocates all buffers for `model`.
    pub fn new(model: &Model<S>) -> Self {
        let n = model.n_joints();
        let world = KinematicsSlot { pose: Pose::identity(), twist: Twist::zero() };
        Self {
            kinematics: vec![world; n + 1],
            rnea: vec![RneaSlot::default(); n + 1],
            crba: vec![CrbaSlot::default(); n + 1],
            aba: vec![AbaSlot::default(); n + 1],
            effort: vec![S::zero(); n],
            acceleration: vec![S::zero(); n],
            mass_matrix: vec![S::zero(); n * n],
        }
    }

    /// The pose `X_WB` of body `k` after [`crate::dynamics::kinematics()`].
    pub fn pose(&self, k: usize) -> Option<Pose<S>> {
        self.kinematics.get(k + 1).map(|slot| slot.pose)
    }

    /// The twist `V_WB` of body `k` at its own origin, in its own axes, after [`crate::dynamics::kinematics()`].
    pub fn twist(&self, k: usize) -> Option<Twist<S>> {
        self.kinematics.get(k + 1).map(|slot| slot.twist)
    }

    /// Joint efforts (N or N m) of the last [`crate::dynamics::rnea()`].
    pub fn effort(&self) -> &[S] {
        &self.effort
    }

    /// Joint accelerations (m/s^2 or rad/s^2) of the last [`crate::dynamics::aba()`].
    pub fn acceleration(&self) -> &[S] {
        &self.acceleration
    }

    /// Mass matrix of the last [`crate::dynamics::crba()`], n x n, column by column.
    pub fn mass_matrix(&self) -> &[S] {
        &self.mass_matrix
    }
}
