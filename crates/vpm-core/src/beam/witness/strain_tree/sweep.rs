//! The sweep over a flexible tree: poses, twists, Jacobians, mass matrix and bias.

use super::beam::StrainBeam;
use super::statics::TipLoad;
use super::tree::FlexibleTree;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, SpatialInertia, Symmetric3, Twist, Vector3, Wrench};

/// A frame that moves with the tree, everything in its own axes.
#[derive(Clone, Debug)]
pub struct Frame<S> {
    /// Its pose in the world.
    pub pose: Pose<S>,
    /// Its twist.
    pub twist: Twist<S>,
    /// Its spatial acceleration at zero coordinate accelerations, gravity taken off.
    pub acceleration: Twist<S>,
    /// Its twist per unit rate of each coordinate.
    pub jacobian: Vec<Twist<S>>,
}

/// The buffers of one evaluation, and its results.
#[derive(Clone, Debug)]
pub struct TreeWorkspace<S> {
    /// Mass matrix, row by row.
    pub mass: Vec<S>,
    /// Velocity terms and gravity less the loads on the tips, counted as loads.
    pub bias: Vec<S>,
    /// The frame at the tip of each link.
    pub tips: Vec<Frame<S>>,
    moving: Frame<S>,
}

impl<S: Scalar> Frame<S> {
    fn at_base(n: usize, gravity: [f64; 3]) -> Self {
        let acceleration = Twist::new(Vector3::zero(), -Vector3::from_f64(gravity));
        Self { pose: Pose::identity(), twist: Twist::zero(), acceleration, jacobian: vec![Twist::zero(); n] }
    }

    fn copy(&mut self, other: &Self) {
        (self.pose, self.twist, self.acceleration) = (other.pose, other.twist, other.acceleration);
        self.jacobian.copy_from_slice(&other.jacobian);
    }

    /// Sweeps on to a frame at `across`. It moves relative to this one with `twist` and, at constant rates,
    /// `acceleration`.
    ///
    /// Law: `V = Ad V + v`, `A = Ad A + V x v + dv/dt`, Ad the transport into the new frame.
    fn advance(&mut self, across: &Pose<S>, twist: Twist<S>, acceleration: Twist<S>, support: &[usize]) {
        self.pose = self.pose * *across;
        self.twist = across.inverse_twist(self.twist) + twist;
        self.acceleration = across.inverse_twist(self.acceleration) + self.twist.cross(twist) + acceleration;
        for &k in support {
            self.jacobian[k] = across.inverse_twist(self.jacobian[k]);
        }
    }
}

impl FlexibleTree {
    /// Buffers for the sweep over this tree.
    pub fn workspace<S: Scalar>(&self) -> TreeWorkspace<S> {
        let (n, zero) = (self.len(), S::zero());
        let moving = Frame::at_base(n, self.gravity);
        let tips = vec![moving.clone(); self.links.len()];
        TreeWorkspace { mass: vec![zero; n * n], bias: vec![zero; n], tips, moving }
    }

    /// Sweep at coordinates `q` and rates `v`: mass matrix and bias of `M a + bias + K q + D v = efforts`.
    ///
    /// Law: `M = sum J^T m J`, `bias = sum J^T (m A + V x* m V) - J^T load`, over hubs, Gauss stations and tip bodies.
    pub fn terms<S: Scalar>(&self, q: &[S], v: &[S], loads: &[TipLoad], workspace: &mut TreeWorkspace<S>) {
        debug_assert!(q.len() == self.len() && v.len() == self.len());
        workspace.mass.fill(S::zero());
        workspace.bias.fill(S::zero());
        for (k, link) in self.links.iter().enumerate() {
            workspace.begin(link.parent, self.gravity);
            let (support, mut first) = (&self.support[k], self.offsets[k]);
            if let Some(joint) = &link.joint {
                let motion = joint.motion::<S>();
                let moving = &mut workspace.moving;
                moving.advance(&joint.pose(q[first]), motion * v[first], Twist::zero(), support);
                moving.jacobian[first] = motion;
                first += 1;
            }
            workspace.add(link.hub, support);
            if let Some((root, beam)) = &link.beam {
                workspace.moving.advance(&lift(root), Twist::zero(), Twist::zero(), support);
                workspace.along(beam, first, (q, v), support);
            }
            workspace.add(link.tip, support);
            for load in loads.iter().filter(|load| load.link == k) {
                workspace.load(load, support);
            }
            workspace.tips[k].copy(&workspace.moving);
        }
        workspace.mirror(self.len());
    }
}

impl<S: Scalar> TreeWorkspace<S> {
    fn begin(&mut self, parent: Option<usize>, gravity: [f64; 3]) {
        match parent.and_then(|parent| self.tips.get(parent)) {
            Some(tip) => self.moving.copy(tip),
            None => {
                self.moving.pose = Pose::identity();
                self.moving.twist = Twist::zero();
                self.moving.acceleration = Twist::new(Vector3::zero(), -Vector3::from_f64(gravity));
                self.moving.jacobian.fill(Twist::zero());
            }
        }
    }

    /// Sweeps along a beam whose first coordinate is number `first`.
    fn along(&mut self, beam: &StrainBeam, first: usize, (q, v): (&[S], &[S]), support: &[usize]) {
        let own = first..first + beam.len();
        for piece in 0..beam.pieces() {
            let crossing = beam.cross(piece, &q[own.clone()], &v[own.clone()]);
            self.moving.advance(&crossing.pose, crossing.twist, crossing.acceleration, support);
            for (k, column) in self.moving.jacobian[own.clone()].iter_mut().enumerate() {
                *column += beam.column(piece, &crossing, k);
            }
            self.add(beam.inertia(piece), support);
        }
    }

    /// Adds an inertia that moves with the frame of the sweep; of the mass matrix only the lower triangle.
    fn add(&mut self, inertia: SpatialInertia<f64>, support: &[usize]) {
        if inertia == SpatialInertia::zero() {
            return;
        }
        let n = self.bias.len();
        let inertia = lift_inertia(inertia);
        let Frame { twist, acceleration, jacobian, .. } = &self.moving;
        let force = inertia.apply(*acceleration) + twist.cross_wrench(inertia.apply(*twist));
        for (place, &i) in support.iter().enumerate() {
            self.bias[i] += jacobian[i].power(force);
            let momentum = inertia.apply(jacobian[i]);
            for &j in &support[..=place] {
                self.mass[i * n + j] += jacobian[j].power(momentum);
            }
        }
    }

    fn load(&mut self, load: &TipLoad, support: &[usize]) {
        let turn = |v: [f64; 3]| self.moving.pose.rotation.transpose_mul(Vector3::from_f64(v));
        let wrench = Wrench::new(turn(load.moment), turn(load.force));
        for &k in support {
            self.bias[k] -= self.moving.jacobian[k].power(wrench);
        }
    }

    fn mirror(&mut self, n: usize) {
        for i in 0..n {
            for j in 0..i {
                self.mass[j * n + i] = self.mass[i * n + j];
            }
        }
    }
}

fn lift<S: Scalar>(pose: &Pose<f64>) -> Pose<S> {
    let columns = pose.rotation.columns.map(|column| Vector3::from_f64(column.to_array()));
    Pose::new(Matrix3 { columns }, Vector3::from_f64(pose.translation.to_array()))
}

fn lift_inertia<S: Scalar>(inertia: SpatialInertia<f64>) -> SpatialInertia<S> {
    SpatialInertia {
        mass: S::from_f64(inertia.mass),
        first_moment: Vector3::from_f64(inertia.first_moment.to_array()),
        rotational: Symmetric3::from_array(inertia.rotational.to_array().map(|entry| S::from_f64(entry))),
    }
}
