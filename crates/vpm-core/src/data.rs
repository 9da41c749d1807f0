//! Every buffer the recursions need, allocated once per model.

mod segment;

use crate::algebra::BlockCholesky;
use crate::beam::{Sections, Slices, Sums};
use crate::model::{Model, Shaft};
use crate::scalar::Scalar;
use crate::spatial::{ArticulatedInertia, Pose, SpatialInertia, Twist, Vector3, Wrench};
use crate::transmission::Ratio;
pub(crate) use segment::SegmentSlot;
use segment::segments;

/// Working memory of the algorithms in [`crate::dynamics`], which leave their results here.
///
/// Buffers per body have one slot more than there are bodies: slot 0 is the world, slot k + 1 is body k. Those of articulated bodies have
/// one for each frame of the model, stations of beams included.
#[derive(Clone, Debug)]
pub struct Data<S> {
    pub(crate) kinematics: Vec<KinematicsSlot<S>>,
    pub(crate) rnea: Vec<RneaSlot<S>>,
    pub(crate) crba: Vec<CrbaSlot<S>>,
    pub(crate) aba: Vec<AbaSlot<S>>,
    pub(crate) effort: Vec<S>,
    pub(crate) acceleration: Vec<S>,
    pub(crate) mass_matrix: Vec<S>,
    /// Acceleration of frames by products of rates alone, where some parts of the model do without them.
    pub(crate) drifts: Vec<Twist<S>>,
    pub(crate) composite: Composite<S>,
    /// Segments of each beam, where the recursion over them applies.
    pub(crate) segments: Vec<Vec<SegmentSlot<S>>>,
}

/// Composite bodies over rigid bodies and beams: everything in the axes of its own frame.
#[derive(Clone, Debug)]
pub(crate) struct Composite<S> {
    /// The frames of the model: world, bodies in aligned frames, stations of elastic beams.
    pub(crate) frames: Vec<FrameSlot<S>>,
    /// Sections of each beam relative to its root.
    pub(crate) sections: Vec<Sections<S>>,
    /// Sums over the slices of each beam, where there are any.
    pub(crate) sums: Vec<Sums<S>>,
    /// Wrench per unit acceleration of each coordinate, on its way to the root.
    pub(crate) columns: Vec<Wrench<S>>,
    /// Velocity terms and gravity, counted as loads.
    pub(crate) bias: Vec<S>,
    pub(crate) factors: BlockCholesky<S>,
    /// Lines, then the shafts of transmissions: a shaft is a line whose levers are its ratios, wherever the machine is.
    pub(crate) lines: Vec<LineSlot<S>>,
}

/// A frame of the model.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameSlot<S> {
    /// X_PF, in the frame that it hangs on.
    pub(crate) across: Pose<S>,
    /// X_WF.
    pub(crate) pose: Pose<S>,
    pub(crate) velocity: Twist<S>,
    /// Spatial acceleration at zero coordinate accelerations, gravity taken off.
    pub(crate) acceleration: Twist<S>,
    /// Inertia of what sits on the frame; on the way inward, of all that it carries.
    pub(crate) inertia: SpatialInertia<S>,
    /// What carries that inertia at zero coordinate accelerations.
    pub(crate) wrench: Wrench<S>,
}

/// A line in the axes of the world.
#[derive(Clone, Debug)]
pub(crate) struct LineSlot<S> {
    pub(crate) length: S,
    /// Unit vector from its beginning to its end.
    pub(crate) direction: Vector3<S>,
    pub(crate) from: PointSlot<S>,
    pub(crate) to: PointSlot<S>,
    /// Rate of the direction per unit rate of each coordinate, of lines that weigh something.
    pub(crate) turns: Vec<Vector3<S>>,
}

/// A point that moves with the machine, in the axes of the world.
#[derive(Clone, Debug)]
pub(crate) struct PointSlot<S> {
    pub(crate) place: Vector3<S>,
    pub(crate) velocity: Vector3<S>,
    /// Acceleration at zero coordinate accelerations, gravity taken off.
    pub(crate) acceleration: Vector3<S>,
    /// Velocity per unit rate of each coordinate.
    pub(crate) columns: Vec<Vector3<S>>,
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

/// A frame on an articulated body: the quantities of Featherstone 2008, table 7.1, by their names there.
///
/// The pose of a station of a beam is that in its segment's begin, its inertia and wrench those of what it carries beside its own.
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
    /// Allocates all data buffers for `model`.
    pub fn new(model: &Model<S>) -> Self {
        let (n, count) = (model.n_joints(), model.n_coordinates());
        let world = KinematicsSlot { pose: Pose::identity(), twist: Twist::zero() };
        Self {
            kinematics: vec![world; n + 1],
            rnea: vec![RneaSlot::default(); n + 1],
            crba: vec![CrbaSlot::default(); n + 1],
            aba: vec![AbaSlot::default(); model.n_frames()],
            effort: vec![S::zero(); n],
            acceleration: vec![S::zero(); count],
            mass_matrix: vec![S::zero(); count * count],
            drifts: vec![Twist::zero(); model.n_frames()],
            composite: Composite::new(model),
            segments: segments(model),
        }
    }

    /// Pose `X_WB` of body `k` in the data after [`crate::dynamics::kinematics()`].
    pub fn pose(&self, k: usize) -> Option<Pose<S>> {
        self.kinematics.get(k + 1).map(|slot| slot.pose)
    }

    /// Twist `V_WB` of body `k` in the data, after [`crate::dynamics::kinematics()`]. At its own origin, in its own
    /// axes.
    pub fn twist(&self, k: usize) -> Option<Twist<S>> {
        self.kinematics.get(k + 1).map(|slot| slot.twist)
    }

    /// Makes coordinates `times` as heavy in the mass matrix of the data. It is that of the last
    /// [`crate::dynamics::flexible::terms()`].
    pub(crate) fn weigh(&mut self, coordinates: &[u32], times: f64) {
        let n = self.acceleration.len();
        for &place in coordinates {
            self.mass_matrix[place as usize * (n + 1)] *= S::from_f64(times);
        }
    }

    /// Factorises the mass matrix in the data of the last [`crate::dynamics::flexible::terms()`].
    pub(crate) fn factorise(&mut self) {
        self.composite.factors.factorise(&self.mass_matrix);
    }

    /// Replaces a load on the coordinates by `M^-1` times it, after [`Data::factorise`].
    pub(crate) fn solve(&self, load: &mut [S]) {
        self.composite.factors.solve(load);
    }

    /// Adds to `loads` the `force` (N) on a line of the data: `J^T F`.
    pub(crate) fn line_load(&self, line: usize, force: S, loads: &mut [S]) {
        let LineSlot { direction, from, to, .. } = &self.composite.lines[line];
        for (load, (&to, &from)) in loads.iter_mut().zip(to.columns.iter().zip(&from.columns)) {
            *load += direction.dot(to - from) * force;
        }
    }

    /// Joint efforts (N or N m) in the data of the last [`crate::dynamics::rnea()`].
    pub fn effort(&self) -> &[S] {
        &self.effort
    }

    /// Accelerations (m/s^2 or rad/s^2) in the data. They are those of the last [`crate::dynamics::aba()`] or
    /// [`crate::dynamics::flexible::solve()`].
    pub fn acceleration(&self) -> &[S] {
        &self.acceleration
    }

    /// Mass matrix in the data, n x n, column by column. It is that of the last [`crate::dynamics::crba()`] or
    /// [`crate::dynamics::flexible::terms()`].
    pub fn mass_matrix(&self) -> &[S] {
        &self.mass_matrix
    }
}

impl<S: Scalar> LineSlot<S> {
    /// Growth of a line in the data, m/s.
    #[inline]
    pub(crate) fn rate(&self) -> S {
        self.direction.dot(self.to.velocity - self.from.velocity)
    }
}

impl<S: Scalar> Composite<S> {
    fn new(model: &Model<S>) -> Self {
        let n = model.n_coordinates();
        let world = FrameSlot { pose: Pose::identity(), across: Pose::identity(), ..FrameSlot::default() };
        let point = || PointSlot {
            place: Vector3::zero(),
            velocity: Vector3::zero(),
            acceleration: Vector3::zero(),
            columns: vec![Vector3::zero(); n],
        };
        let line = || LineSlot {
            length: S::zero(),
            direction: Vector3::zero(),
            from: point(),
            to: point(),
            turns: vec![Vector3::zero(); n],
        };
        let shaft = |shaft: &Shaft<S>| {
            let mut slot = LineSlot { direction: Vector3::new(S::one(), S::zero(), S::zero()), ..line() };
            for &Ratio { joint, ratio } in &shaft.ratios {
                slot.to.columns[joint] = Vector3::new(ratio, S::zero(), S::zero());
            }
            slot
        };
        Self {
            frames: vec![world; model.n_frames()],
            sections: model.beams().iter().map(|elastic| elastic.beam.sections()).collect(),
            sums: model
                .beams()
                .iter()
                .map(|elastic| elastic.slices.as_ref().map_or_else(Sums::default, Slices::sums))
                .collect(),
            columns: vec![Wrench::zero(); n],
            bias: vec![S::zero(); n],
            factors: BlockCholesky::new(model.blocks()),
            lines: model.lines().iter().map(|_| line()).chain(model.shafts().iter().map(shaft)).collect(),
        }
    }
}
