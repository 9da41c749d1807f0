//! Closed loops of a machine: the forces that keep frames together, and the way back to where steps have led them apart.

use super::connections::End;
use crate::algebra::Cholesky;
use crate::closure::{Closure, LoopEntry};
use crate::data::{Composite, Data, FrameSlot};
use crate::dynamics::{flexible, for_each_column, frames, poses, take_off};
use crate::error::{ConnectionError, Result};
use crate::model::{Model, Place};
use crate::mount::placed;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Vector3, Wrench};

/// The square of the sine of the angle between an equation and all before it below which it says nothing that they do not say:
/// steps lead off the closure by less than that angle, and there an equation that is redundant on the closure is not quite.
const DEPENDENT: f64 = 1e-8;
/// Newton steps of a projection. Each multiplies the gap by about itself, and what a step of time leaves open is small.
const TURNS: usize = 4;
/// Mass of a held coordinate as a multiple of its own: what it gives way by is as much smaller than what the others do, and the forces of the
/// loops keep ten digits.
const HELD: f64 = 1e6;
/// A gap (m, or as a sine) that is as good as closed: some roundings of lengths in metres.
const CLOSED: f64 = 1e-14;

/// The closed loops of a machine, with their buffers.
///
/// Law: `M a + J^T l = f`, `J a = -J' v` with J the derivative of all closures by the coordinates: `(J M^-1 J^T) l = J a_0 + J' v`, `a_0` the
/// accelerations of the tree with open loops (Featherstone 2008, section 8.3). Equations that others imply are left out: those that a
/// pivoted elimination of `J J^T` does not choose, anew in each evaluation. A step ends with a projection along `M^-1 J^T`, of the
/// coordinates onto the closures and of the rates onto `J v = 0` (Lubich 1991; Hairer & Wanner 1996, "Solving Ordinary Differential
/// Equations II", section VII.2), so that nothing drifts.
/// Checked: against closed forms of linkages, stiff bushings in their place, and null spaces in Python.
#[derive(Clone, Debug)]
pub(crate) struct Loops<S> {
    placed: Vec<Placed<S>>,
    /// Derivative of the closures by the coordinates, row by row.
    jacobian: Vec<S>,
    /// `M^-1 J^T`, row by row as J.
    ways: Vec<S>,
    /// What the closures miss, m or the cosine of an angle that has to be a right one.
    gap: Vec<S>,
    /// `J' v`.
    drift: Vec<S>,
    /// Force of each equation in the last evaluation, N or N m: on B along a growing gap.
    forces: Vec<S>,
    /// Sum of the squares of what each end alone has in each row.
    sizes: Vec<S>,
    /// One for each equation that counts, zero for one that others imply.
    chosen: Vec<S>,
    picked: Vec<S>,
    row: Vec<S>,
    gram: Vec<S>,
    factors: Cholesky<S>,
}

/// Where closed loops are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopState<S> {
    /// What the closures miss: loop by loop the way from A to B (m, world axes), then cosines of angles that have to be right ones.
    pub gap: Vec<S>,
    /// The derivative J of the gap by the coordinates, row by row.
    pub jacobian: Vec<S>,
    /// `J' v`.
    pub drift: Vec<S>,
    /// One for each equation that counts, zero for one that others imply.
    pub chosen: Vec<S>,
}

/// A loop in its place.
#[derive(Clone, Debug)]
struct Placed<S> {
    joint: Closure,
    a: End<S>,
    b: End<S>,
    /// Axes of the joint in both ends.
    turn: Matrix3<S>,
    /// Its first equation.
    first: usize,
}

/// An end in world axes: where it is, how it moves, and how it accelerates without accelerations of the coordinates, gravity taken off.
struct Moved<S> {
    pose: Pose<S>,
    acceleration: Vector3<S>,
    spin: Vector3<S>,
    turn: Vector3<S>,
}

impl<S: Scalar> Moved<S> {
    fn new(slots: &[FrameSlot<S>], end: &End<S>) -> Self {
        let slot = &slots[end.frame];
        let FrameSlot { velocity, acceleration, .. } = slot;
        let at = end.pose.translation;
        let speed = velocity.linear + velocity.angular.cross(at);
        // The conventional acceleration of a point from the spatial one (Featherstone 2008, section 2.11).
        let change = acceleration.linear + acceleration.angular.cross(at) + velocity.angular.cross(speed);
        let in_world = |vector: Vector3<S>| slot.pose.rotation * vector;
        Self {
            pose: slot.pose * end.pose,
            acceleration: in_world(change),
            spin: in_world(velocity.angular),
            turn: in_world(acceleration.angular),
        }
    }
}

impl<S: Scalar> Loops<S> {
    /// Closed loops on their ends in `model`, two for each of the `entries`.
    ///
    /// # Errors
    /// [`ConnectionError`] for a loop both of whose ends move as one piece, or whose axes are none.
    pub(crate) fn new(model: &Model<S>, entries: &[LoopEntry], ends: &[Place]) -> Result<Self> {
        let (n, mut rows) = (model.n_coordinates(), 0);
        let place = |(entry, ends): (&LoopEntry, &[Place])| {
            let [a, b] = [0, 1].map(|k| End { frame: ends[k].frame, pose: Pose::from_f64(ends[k].pose) });
            if a.frame == b.frame {
                return Err(ConnectionError::LoopOnOnePiece { closure: entry.name.clone() }.into());
            }
            let turn = Pose::from_f64(placed(&format!("{}.axes", entry.name), [0.0; 3], entry.axes)?).rotation;
            let (joint, first) = (entry.joint, rows);
            rows += joint.equations();
            Ok(Placed { joint, a, b, turn, first })
        };
        let placed = entries.iter().zip(ends.chunks_exact(2)).map(place).collect::<Result<Vec<_>>>()?;
        let zeros = |count: usize| vec![S::zero(); count];
        Ok(Self {
            placed,
            jacobian: zeros(rows * n),
            ways: zeros(rows * n),
            gap: zeros(rows),
            drift: zeros(rows),
            forces: zeros(rows),
            sizes: zeros(rows),
            chosen: zeros(rows),
            picked: zeros(rows),
            row: zeros(rows),
            gram: zeros(rows * rows),
            factors: Cholesky::new(rows),
        })
    }

    /// Number of closed loops.
    pub(crate) fn len(&self) -> usize {
        self.placed.len()
    }

    /// State of the closed loops that the last [`Loops::place`] and [`Loops::choose`] found.
    pub(super) fn state(&self) -> LoopState<S> {
        let Self { gap, jacobian, drift, chosen, .. } = self;
        LoopState { gap: gap.clone(), jacobian: jacobian.clone(), drift: drift.clone(), chosen: chosen.clone() }
    }

    /// Places the closed loops: gap, its derivative and second rate, after the motion of the frames.
    pub(crate) fn place(&mut self, model: &Model<S>, data: &Data<S>) {
        let Self { placed, jacobian, gap, drift, sizes, .. } = self;
        let (n, Composite { frames, sections, .. }) = (model.n_coordinates(), &data.composite);
        jacobian.fill(S::zero());
        sizes.fill(S::zero());
        for &mut Placed { joint, ref a, ref b, turn, first } in placed {
            let [from, to] = [a, b].map(|end| Moved::new(frames, end));
            let across = to.pose.translation - from.pose.translation;
            gap[first..first + 3].copy_from_slice(&across.to_array());
            drift[first..first + 3].copy_from_slice(&(to.acceleration - from.acceleration).to_array());
            let pairs = joint.perpendicular();
            let [axes, others] = [&from, &to].map(|end| (end.pose.rotation * turn).columns);
            let mut normals = [Vector3::zero(); 3];
            for (place, &(own, other)) in pairs.iter().enumerate() {
                let (x, y) = (axes[own], others[other]);
                let (swing, sway) = (from.spin.cross(x), to.spin.cross(y));
                let rate = sway.cross(x) + y.cross(swing);
                normals[place] = y.cross(x);
                gap[first + 3 + place] = x.dot(y);
                drift[first + 3 + place] = (to.turn - from.turn).dot(normals[place]) + (to.spin - from.spin).dot(rate);
            }
            for (end, moved, sign) in [(a, &from, -1.0), (b, &to, 1.0)] {
                let at = moved.pose.translation;
                for_each_column(model, frames, sections, end.frame, |coordinate, column| {
                    let speed = column.linear + column.angular.cross(at);
                    for (k, entry) in speed.to_array().into_iter().enumerate() {
                        jacobian[(first + k) * n + coordinate] += entry * sign;
                        sizes[first + k] += speed.dot(speed);
                    }
                    for (k, normal) in normals[..pairs.len()].iter().enumerate() {
                        jacobian[(first + 3 + k) * n + coordinate] += normal.dot(column.angular) * sign;
                        sizes[first + 3 + k] += column.angular.dot(column.angular);
                    }
                });
            }
        }
    }

    /// Chooses independent loop equations, by the largest remaining share, after [`Loops::place`]. The share is what
    /// those chosen before leave; it ends when nothing is left.
    pub(crate) fn choose(&mut self, n: usize) {
        let Self { jacobian, sizes, chosen, picked, row, gram, .. } = self;
        let rows = chosen.len();
        for (i, one) in jacobian.chunks_exact(n.max(1)).enumerate() {
            for (j, other) in jacobian.chunks_exact(n.max(1)).enumerate().take(i + 1) {
                let scale = (sizes[i] * sizes[j]).sqrt().max(S::from_f64(f64::MIN_POSITIVE));
                let entry = dot(one, other) / scale;
                gram[i * rows + j] = entry;
                gram[j * rows + i] = entry;
            }
        }
        chosen.fill(S::zero());
        for _ in 0..rows {
            let mut best = S::from_f64(DEPENDENT);
            picked.fill(S::zero());
            for i in 0..rows {
                let left = gram[i * rows + i];
                if best.known_less(left) == Some(false) {
                    continue;
                }
                for entry in &mut picked[..i] {
                    *entry = best.if_less(left, S::zero, || *entry);
                }
                picked[i] = best.if_less(left, S::one, S::zero);
                best = best.max(left);
            }
            if S::from_f64(DEPENDENT).known_less(best) == Some(false) {
                break;
            }
            for (k, entry) in row.iter_mut().enumerate() {
                *entry = (0..rows).map(|i| picked[i] * gram[i * rows + k]).sum();
            }
            let share = best.recip();
            for (i, line) in gram.chunks_exact_mut(rows).enumerate() {
                line.iter_mut().zip(&*row).for_each(|(entry, &other)| *entry -= row[i] * other * share);
            }
            chosen.iter_mut().zip(&*picked).for_each(|(sum, &one)| *sum += one);
        }
    }

    /// Factorises `J M^-1 J^T` of the chosen loop equations, with the factors of M in `data`.
    fn factorise(&mut self, data: &Data<S>) {
        let Self { jacobian, ways, chosen, gram, factors, .. } = self;
        let (rows, n) = (chosen.len(), data.acceleration.len());
        ways.copy_from_slice(jacobian);
        ways.chunks_exact_mut(n.max(1)).for_each(|way| data.solve(way));
        for (i, row) in jacobian.chunks_exact(n.max(1)).enumerate() {
            for (j, way) in ways.chunks_exact(n.max(1)).enumerate().take(i + 1) {
                let entry = dot(row, way) * chosen[i] * chosen[j];
                // One that does not count stands alone, as the equation that its force is zero.
                gram[i * rows + j] = if i == j { entry + (S::one() - chosen[i]) } else { entry };
            }
        }
        factors.factorise(gram);
    }

    /// Solves the chosen loop equations: replaces `misses` by their multipliers.
    fn solve(&self, misses: &mut [S]) {
        misses.iter_mut().zip(&self.chosen).for_each(|(miss, &counts)| *miss *= counts);
        self.factors.solve(misses);
    }

    /// Moves `numbers` of the coordinates along `M^-1 J^T` by `shares` of the loop equations.
    fn push(&self, shares: &[S], numbers: &mut [S]) {
        for (way, &share) in self.ways.chunks_exact(numbers.len().max(1)).zip(shares) {
            numbers.iter_mut().zip(way).for_each(|(number, &entry)| *number += entry * share);
        }
    }

    /// Turns accelerations of the open tree into those with closed loops. Both stand in `data`, with the factors of M.
    pub(crate) fn constrain(&mut self, model: &Model<S>, data: &mut Data<S>) {
        self.place(model, data);
        self.choose(model.n_coordinates());
        self.factorise(data);
        let mut forces = std::mem::take(&mut self.forces);
        let rows = self.jacobian.chunks_exact(model.n_coordinates().max(1)).zip(&self.drift);
        for (force, (row, &drift)) in forces.iter_mut().zip(rows) {
            *force = -(dot(row, &data.acceleration) + drift);
        }
        self.solve(&mut forces);
        self.push(&forces, &mut data.acceleration);
        self.forces = forces;
    }

    /// Closes loops: moves coordinates `q` and rates `v` onto the closures, least in the metric of M. The coordinates
    /// `held` count as [`HELD`] times as heavy: they stay where they are as far as the loops let them. Returns the
    /// largest gap that is left, and how many equations count.
    pub(crate) fn close(
        &mut self,
        model: &Model<S>,
        data: &mut Data<S>,
        (q, v): (&mut [S], &mut [S]),
        held: &[u32],
    ) -> [S; 2] {
        flexible::terms(model, data, q, v);
        data.weigh(held, HELD);
        data.factorise();
        poses(model, data);
        self.place(model, data);
        self.choose(q.len());
        self.factorise(data);
        let mut shares = std::mem::take(&mut self.forces);
        let mut open = self.open();
        for _ in 0..TURNS {
            if open.known_less(S::from_f64(CLOSED)) == Some(true) {
                break;
            }
            shares.iter_mut().zip(&self.gap).for_each(|(share, &gap)| *share = -gap);
            self.solve(&mut shares);
            self.push(&shares, q);
            frames(model, data, q, v);
            poses(model, data);
            self.place(model, data);
            open = self.open();
        }
        for _ in 0..TURNS / 2 {
            for (share, row) in shares.iter_mut().zip(self.jacobian.chunks_exact(q.len().max(1))) {
                *share = -dot(row, v);
            }
            self.solve(&mut shares);
            self.push(&shares, v);
        }
        self.forces = shares;
        [open, self.chosen.iter().copied().sum()]
    }

    fn open(&self) -> S {
        self.gap.iter().fold(S::zero(), |most, gap| most.max(gap.abs()))
    }

    /// Wrenches of a closed loop on the bodies of A and B, with frames, in the last evaluation. Each is about the
    /// frame's origin and in its axes.
    fn wrenches(
        &self,
        slots: &[FrameSlot<S>],
        Placed { joint, a, b, turn, first }: &Placed<S>,
    ) -> [(usize, Wrench<S>); 2] {
        let forces = &self.forces[*first..first + joint.equations()];
        let [axes, others] = [a, b].map(|end| ((slots[end.frame].pose * end.pose).rotation * *turn).columns);
        let force = Vector3::new(forces[0], forces[1], forces[2]);
        let moments = joint.perpendicular().iter().zip(&forces[3..]);
        let moment =
            moments.fold(Vector3::zero(), |sum, (&(own, other), &force)| sum + others[other].cross(axes[own]) * force);
        [(a, -1.0), (b, 1.0)].map(|(end, sign)| {
            let axes = slots[end.frame].pose.rotation;
            let [moment, force] = [moment, force].map(|vector| axes.transpose_mul(vector * S::from_f64(sign)));
            (end.frame, Wrench::new(moment + end.pose.translation.cross(force), force))
        })
    }

    /// Takes the wrenches of closed loops off those of the frames, for reactions.
    pub(super) fn take_off(&self, data: &mut Data<S>) {
        for placed in &self.placed {
            for (frame, wrench) in self.wrenches(&data.composite.frames, placed) {
                take_off(data, frame, wrench);
            }
        }
    }

    /// Observes closed loops: wrench of each on the body of A, about A's origin and in A's axes.
    pub(crate) fn observe(&self, data: &Data<S>, outputs: &mut [S]) {
        for (channels, placed) in outputs.chunks_exact_mut(6).zip(&self.placed) {
            let [(_, on_a), _] = self.wrenches(&data.composite.frames, placed);
            let on_a = placed.a.pose.inverse_wrench(on_a);
            channels[..3].copy_from_slice(&on_a.angular.to_array());
            channels[3..].copy_from_slice(&on_a.linear.to_array());
        }
    }
}

fn dot<S: Scalar>(left: &[S], right: &[S]) -> S {
    left.iter().zip(right).map(|(&l, &r)| l * r).sum()
}
