//! A machine in a single state, in buffers that stand ready: inverse and forward dynamics, mass matrix, energy, Jacobians.

use super::{Dynamics, add_effects};
use crate::actuator::{Actuator, Drive, Target};
use crate::contact::ContactFriction;
use crate::dynamics::{Energy, crba, energy, flexible, for_each_column, frames, lines, poses, rnea};
use crate::effect::{JointEffect, Seat};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist};

impl<S: Scalar> Dynamics<S> {
    /// Answers with the accelerations of all coordinates at (q, v) under `efforts` on them, with all effects.
    pub fn forward_dynamics(&mut self, q: &[S], v: &[S], efforts: &[S]) -> &[S] {
        let joints = self.joints();
        self.tensions.fill(S::zero());
        self.efforts.copy_from_slice(&efforts[..joints]);
        let elastic = &efforts[joints..];
        self.locate(q, v);
        self.accelerate(q, v, (add_effects, ContactFriction::resistance), elastic);
        &self.data.acceleration
    }

    /// Answers with the efforts on all coordinates that give accelerations `a` at (q, v), less those of effects. On the
    /// elastic coordinates they vanish in free motion.
    pub fn inverse_dynamics(&mut self, q: &[S], v: &[S], a: &[S], efforts: &mut [S]) {
        self.balance(q, v, a, efforts);
        if !self.connections.is_free() {
            let Self { model, data, loads, .. } = self;
            loads.fill(S::zero());
            frames(model, data, q, v);
            poses(model, data);
            self.connections.add_loads(model, data, ContactFriction::resistance, loads);
            for (effort, &load) in efforts.iter_mut().zip(&*loads) {
                *effort -= load;
            }
        }
        self.follow_load(q, v, efforts);
    }

    /// As [`Dynamics::inverse_dynamics`], but without what contacts and bushings do.
    pub(crate) fn inverse_dynamics_of_tree(&mut self, q: &[S], v: &[S], a: &[S], efforts: &mut [S]) {
        self.balance(q, v, a, efforts);
        self.follow_load(q, v, efforts);
    }

    /// Actuator efforts u in a machine's answer, from efforts r that arrive after load-dependent friction. Effects take
    /// a share k of the load: `u - k |u| = r`, so `u = r / (1 - k sign(r))`, k the sum of their shares.
    pub(crate) fn follow_load(&self, q: &[S], v: &[S], efforts: &mut [S]) {
        for (joint, effort) in efforts.iter_mut().enumerate().take(self.joints()) {
            let own = |(seat, effect): &&(Seat<S>, JointEffect<S>)| {
                seat.joint() == Some(joint) && effect.law().follows_load()
            };
            if !self.effects.iter().any(|effect| own(&effect)) {
                continue;
            }
            let share =
                |(_, effect): &(Seat<S>, JointEffect<S>)| effect.law().share_of_load(q[joint], v[joint], *effort);
            let taken: S = self.effects.iter().filter(own).map(share).sum();
            let arriving = *effort;
            *effort = arriving / (S::one() - arriving.if_negative(|| -taken, || taken));
        }
    }

    /// Efforts that arrive in a machine's answer: those of the tree less effects, without load-dependent ones.
    fn balance(&mut self, q: &[S], v: &[S], a: &[S], efforts: &mut [S]) {
        let Self { model, data, loads, .. } = self;
        if model.is_recursive() {
            efforts.copy_from_slice(rnea(model, data, q, v, a));
        } else {
            flexible::terms(model, data, q, v);
            flexible::required(model, data, (q, v), a, efforts);
        }
        loads.fill(S::zero());
        for (seat, effect) in &self.effects {
            seat.push(loads, effect.law().effort(seat.of(q), seat.of(v)));
        }
        self.memories.add_efforts(v, loads);
        for (effort, &effect) in efforts.iter_mut().zip(&*loads) {
            *effort -= effect;
        }
    }

    /// Answers with the mass matrix at `q` with payloads, n x n.
    pub fn mass_matrix(&mut self, q: &[S]) -> &[S] {
        let Self { model, data, loads, .. } = self;
        if model.is_recursive() {
            return crba(model, data, q);
        }
        loads.fill(S::zero());
        flexible::terms(model, data, q, loads);
        &data.mass_matrix
    }

    /// Answers with the kinetic and potential energy in J. The potential is that of gravity, of the beams, of contacts
    /// and bushings, of the effects that have one, and of springs along lines without command, visco-elastic ones
    /// settled.
    pub fn energy(&mut self, q: &[S], v: &[S]) -> Energy<S> {
        let Self { model, data, effects, connections, .. } = self;
        let mut total = match model.is_recursive() {
            true => energy(model, data, q, v),
            false => flexible::energy(model, data, q, v),
        };
        total.potential += effects.iter().map(|(seat, effect)| effect.law().potential(seat.of(q))).sum();
        if !connections.is_free() {
            frames(model, data, q, v);
            poses(model, data);
            total.potential += connections.potential(data);
        }
        total.potential += self.springs(q, v);
        total
    }

    /// Answers with the load that the coordinates miss at rest: `weight bias(q, 0) + K q - effects(q, 0)`, less a share
    /// of the forces of springs along lines.
    pub(crate) fn unbalance(&mut self, q: &[S], [weight, springs]: [S; 2]) -> Vec<S> {
        let zero = vec![S::zero(); q.len()];
        self.terms(q, &zero);
        let mut loads = zero.clone();
        flexible::required(&self.model, &self.data, (q, &zero), &zero, &mut loads);
        for (load, &bias) in loads.iter_mut().zip(&self.data.composite.bias) {
            *load -= bias * (S::one() - weight);
        }
        for (seat, effect) in &self.effects {
            seat.push(&mut loads, -effect.law().effort_at_rest(seat.of(q)));
        }
        self.subtract_connections(&mut loads);
        self.subtract_springs(q, springs, &mut loads);
        loads
    }

    /// Takes a share of the forces of springs along lines off `loads` in an answer at rest, without command and with
    /// visco-elastic ones settled.
    pub(crate) fn subtract_springs(&mut self, q: &[S], share: S, loads: &mut [S]) {
        if !self.actuators.iter().any(|actuator| is_spring(&actuator.drive)) {
            return;
        }
        let Self { model, data, loads: rates, actuators, .. } = self;
        rates.fill(S::zero());
        frames(model, data, q, rates);
        poses(model, data);
        lines(model, data);
        for actuator in actuators.iter() {
            let Target::Line(line) = actuator.on else { continue };
            let length = data.composite.lines[line].length;
            match &actuator.drive {
                Drive::SpringDamper(law) => data.line_load(line, -law.force(length, S::zero()) * share, loads),
                Drive::Maxwell(law) => data.line_load(line, law.force(length, law.settled(length)) * share, loads),
                _ => {}
            }
        }
    }

    /// Takes the loads of contacts and bushings off `loads` in an answer, after [`Dynamics::terms`] in that state.
    pub(crate) fn subtract_connections(&mut self, loads: &mut [S]) {
        let Self { model, data, loads: own, connections, .. } = self;
        if connections.is_free() {
            return;
        }
        poses(model, data);
        own.fill(S::zero());
        connections.add_loads(model, data, ContactFriction::resistance, own);
        loads.iter_mut().zip(&*own).for_each(|(load, &own)| *load -= own);
    }

    /// Answers with the energy of springs in two-point elements, J.
    fn springs(&mut self, q: &[S], v: &[S]) -> S {
        if !self.actuators.iter().any(|actuator| is_spring(&actuator.drive)) {
            return S::zero();
        }
        self.locate(q, v);
        let lines = &self.data.composite.lines;
        let potential = |actuator: &Actuator<S>| match (&actuator.drive, actuator.on) {
            (Drive::SpringDamper(law), Target::Line(line)) => law.potential(lines[line].length),
            (Drive::Maxwell(law), Target::Line(line)) => {
                law.potential(lines[line].length, law.settled(lines[line].length))
            }
            _ => S::zero(),
        };
        self.actuators.iter().map(potential).sum()
    }

    /// Whether actuators act on lines or shafts, so that an answer needs their lever arms.
    pub(crate) fn pulls(&self) -> bool {
        self.pulls
    }

    /// Answers with lever arms at `q`: length of each line, then angle of each shaft, per unit of each coordinate. They
    /// are lines and shafts x n.
    pub(crate) fn levers(&mut self, q: &[S], levers: &mut [S]) {
        let Self { model, data, loads, .. } = self;
        loads.fill(S::zero());
        frames(model, data, q, loads);
        poses(model, data);
        lines(model, data);
        let (n, data) = (self.coordinates(), &self.data);
        levers.fill(S::zero());
        for (line, row) in levers.chunks_exact_mut(n.max(1)).enumerate() {
            data.line_load(line, S::one(), row);
        }
    }

    /// Answers with the Jacobian of a marker at `q`, 6 x n row by row. It gives angular velocity, then velocity of its
    /// origin, in world axes per unit rate.
    ///
    /// Checked: against the derivative of the marker's pose.
    pub fn jacobian(&mut self, q: &[S], marker: usize, jacobian: &mut [S]) {
        jacobian.fill(S::zero());
        let Some(Pose { translation: at, .. }) = self.located(q, marker) else { return };
        let Self { model, data, .. } = self;
        let Some(place) = model.markers().get(marker) else { return };
        let (n, frames) = (model.n_coordinates(), &data.composite.frames);
        for_each_column(model, frames, &data.composite.sections, place.frame, |coordinate, column: Twist<S>| {
            let velocity = column.linear + column.angular.cross(at);
            let entries = column.angular.to_array().into_iter().chain(velocity.to_array());
            for (row, entry) in jacobian.chunks_exact_mut(n).zip(entries) {
                row[coordinate] = entry;
            }
        });
    }

    /// Answers with the poses of all markers at `q`, twelve numbers each: origin, then rotation `R_WM` row by row.
    ///
    /// Checked: against the markers' outputs, and in Python against the chain of textbooks.
    pub fn marker_poses(&mut self, q: &[S], values: &mut [S]) {
        self.place(q);
        let Self { model, data, .. } = self;
        for (numbers, place) in values.chunks_exact_mut(12).zip(model.markers()) {
            let pose = data.composite.frames[place.frame].pose * Pose::from_f64(place.pose);
            numbers[..3].copy_from_slice(&pose.translation.to_array());
            for (row, numbers) in numbers[3..].chunks_exact_mut(3).enumerate() {
                numbers.copy_from_slice(&pose.rotation.columns.map(|column| column.to_array()[row]));
            }
        }
    }

    /// Pose of a marker in the world at `q` for an answer; none if there is no such marker.
    pub(crate) fn located(&mut self, q: &[S], marker: usize) -> Option<Pose<S>> {
        self.place(q);
        let place = self.model.markers().get(marker)?;
        Some(self.data.composite.frames[place.frame].pose * Pose::from_f64(place.pose))
    }

    /// Answers with the least time, s, until an open contact closes at the speeds of a state.
    pub(crate) fn time_to_contact(&mut self, state: &[S]) -> f64 {
        let (n, Self { model, data, connections, .. }) = (self.coordinates(), self);
        frames(model, data, &state[..n], &state[n..2 * n]);
        poses(model, data);
        let closing = connections.contacts.iter().map(|contact| contact.time_to_close(&data.composite.frames));
        closing.fold(f64::INFINITY, f64::min)
    }

    /// Places all frames at `q` for an answer.
    fn place(&mut self, q: &[S]) {
        let Self { model, data, loads, .. } = self;
        loads.fill(S::zero());
        frames(model, data, q, loads);
        poses(model, data);
    }
}

/// Whether a drive stores energy, so that an answer has it at rest.
fn is_spring<S>(drive: &Drive<S>) -> bool {
    matches!(drive, Drive::SpringDamper(_) | Drive::Maxwell(_))
}
