//! What can be seen of a machine in a state: all its outputs, in one place.

use super::Dynamics;
use super::connections::into_body;
use crate::ball::angular_velocity;
use crate::contact::ContactFriction;
use crate::dynamics::{Motion, accelerated, frames, lines, poses, reactions, shafts, specific_force};
use crate::scalar::Scalar;
use crate::sensor::Layout;
use crate::spatial::{Pose, Quaternion};

impl<S: Scalar> Dynamics<S> {
    /// Layout of the observed outputs.
    pub fn layout(&self) -> Layout {
        Layout {
            joints: self.model.n_joints(),
            actuators: self.actuators.len(),
            lines: self.model.n_wires(),
            gauges: self.model.gauges().len(),
            markers: self.model.markers().len(),
            hydraulics: self.shown.hydraulics.len(),
            dc_motors: self.shown.currents.len(),
            supplies: self.supplies.len(),
            contacts: self.connections.contacts.len(),
            bushings: self.connections.bushings.len(),
            load_cells: self.connections.cells.len(),
            balls: self.balls.len(),
            loops: self.loops.as_ref().map_or(0, |loops| loops.len()),
            imus: self.model.imus().len(),
        }
    }

    /// Observes all true outputs in the order of [`Layout`], in state `x` with rate `dxdt`. The command of an actuator
    /// is what enters its lag.
    pub fn observe(&mut self, x: &[S], dxdt: &[S], outputs: &mut [S]) {
        self.observe_motion(x, outputs);
        self.observe_efforts(x, dxdt, outputs);
        let layout = self.layout();
        let commands = outputs[layout.actuators()..layout.lines()].chunks_exact_mut(2);
        for (channels, &input) in commands.zip(&self.inputs) {
            channels[0] = input;
        }
    }

    /// Observes outputs that the state alone decides: positions and velocities, lines, strains, markers.
    pub fn observe_motion(&mut self, x: &[S], outputs: &mut [S]) {
        let (n, layout) = (self.coordinates(), self.layout());
        self.observe_balls(&x[..n], &x[n..2 * n], &mut outputs[layout.balls()..layout.loops()]);
        if layout.lines + layout.gauges + layout.markers > 0 || !self.connections.is_free() {
            let (q, v) = x[..2 * n].split_at(n);
            let Self { model, data, .. } = self;
            frames(model, data, q, v);
            poses(model, data);
            lines(model, data);
            shafts(model, data, q, v);
        }
        let (q, v) = x[..2 * n].split_at(n);
        for ((channels, &q), &v) in outputs[..layout.actuators()].chunks_exact_mut(4).zip(q).zip(v) {
            channels[0] = q;
            channels[1] = v;
        }
        if layout.lines + layout.gauges + layout.markers == 0 && self.connections.is_free() {
            return;
        }
        let Self { model, data, connections, .. } = &*self;
        for (channels, line) in outputs[layout.lines()..].chunks_exact_mut(3).zip(&data.composite.lines) {
            channels[0] = line.length;
            channels[1] = line.rate();
        }
        for (output, gauge) in outputs[layout.gauges()..].iter_mut().zip(model.gauges()) {
            let [kappa_x, kappa_y, .., extension] = gauge.section.strain(&q[gauge.first..gauge.first + gauge.len]);
            let [x, y] = gauge.point;
            *output = extension + kappa_x * y - kappa_y * x;
        }
        for (channels, place) in outputs[layout.markers()..].chunks_exact_mut(6).zip(model.markers()) {
            let pose = data.composite.frames[place.frame].pose * Pose::from_f64(place.pose);
            channels[..3].copy_from_slice(&pose.translation.to_array());
            channels[3..].copy_from_slice(&pose.rotation.rotation_vector().to_array());
        }
        connections.observe_contacts(data, &mut outputs[layout.contacts()..layout.bushings()]);
        connections.observe_bushings(data, &mut outputs[layout.bushings()..layout.load_cells()]);
    }

    /// Observes the forces of the actuators at the state last evaluated.
    pub(crate) fn observe_forces(&self, outputs: &mut [S]) {
        for (channels, &force) in outputs[self.layout().actuators()..].chunks_exact_mut(2).zip(&self.forces) {
            channels[1] = force;
        }
    }

    /// Observes ball joints: their orientations, and angular velocities of what they carry.
    fn observe_balls(&self, q: &[S], v: &[S], outputs: &mut [S]) {
        for (channels, ball) in outputs.chunks_exact_mut(7).zip(&self.balls) {
            let (angles, rates) = (ball.of(q), ball.of(v));
            let orientation = self.model.orientation(ball.angles[0][0]).then(Quaternion::from_angles(angles));
            channels[..4].copy_from_slice(&orientation.to_array());
            channels[4..].copy_from_slice(&angular_velocity(angles, rates).to_array());
        }
    }

    /// Observes load cells and inertial measurement units in the motion `[q, v, a]`.
    pub(crate) fn observe_accelerated(&mut self, motion: Motion<'_, S>, outputs: &mut [S]) {
        if self.model.imus().is_empty() {
            return self.observe_reactions(motion, outputs);
        }
        let Self { model, data, connections, .. } = self;
        accelerated(model, data, motion, &mut connections.extra);
        for (channels, place) in outputs[self.layout().imus()..].chunks_exact_mut(6).zip(self.model.imus()) {
            let [force, turning] = specific_force(&self.model, &self.data, place);
            channels[..3].copy_from_slice(&force.to_array());
            channels[3..].copy_from_slice(&turning.to_array());
        }
        self.observe_reactions(motion, outputs);
    }

    /// Observes the reactions at load cells' joints in the motion `[q, v, a]`, with the forces on lines.
    fn observe_reactions(&mut self, motion: Motion<'_, S>, outputs: &mut [S]) {
        if self.connections.cells.is_empty() {
            return;
        }
        let first = self.layout().load_cells();
        let Self { model, data, connections, tensions, loops, .. } = self;
        let mut extra = std::mem::take(&mut connections.extra);
        reactions(model, data, motion, &mut extra, tensions, |data| {
            connections.take_off(data, ContactFriction::resistance);
            if let Some(loops) = loops {
                loops.take_off(data);
            }
        });
        connections.extra = extra;
        for (channels, &joint) in outputs[first..].chunks_exact_mut(6).zip(&connections.cells) {
            let wrench = into_body(model, joint, data.composite.frames[joint + 1].wrench);
            channels[..3].copy_from_slice(&wrench.angular.to_array());
            channels[3..].copy_from_slice(&wrench.linear.to_array());
        }
    }

    /// Observes outputs that follow from efforts: accelerations, efforts, forces, drives, supplies, reactions. In state
    /// `x` after [`Dynamics::rhs`].
    pub(crate) fn observe_efforts(&mut self, x: &[S], dxdt: &[S], outputs: &mut [S]) {
        let (n, layout) = (self.coordinates(), self.layout());
        let accelerations = &dxdt[n..2 * n];
        let of_joints = outputs[..layout.actuators()].chunks_exact_mut(4);
        for ((channels, &a), &effort) in of_joints.zip(accelerations).zip(&self.efforts) {
            channels[2] = a;
            channels[3] = effort;
        }
        self.observe_forces(outputs);
        for (channels, &tension) in outputs[layout.lines()..].chunks_exact_mut(3).zip(&self.tensions) {
            channels[2] = tension;
        }
        if let Some(loops) = &self.loops {
            loops.observe(&self.data, &mut outputs[layout.loops()..]);
        }
        let shown = &self.shown;
        for (channels, values) in
            outputs[layout.hydraulics()..layout.dc_motors()].chunks_exact_mut(5).zip(&shown.hydraulics)
        {
            channels.copy_from_slice(values);
        }
        outputs[layout.dc_motors()..layout.supplies()].copy_from_slice(&shown.currents);
        for (channels, values) in outputs[layout.supplies()..layout.contacts()].chunks_exact_mut(2).zip(&shown.supplies)
        {
            channels.copy_from_slice(values);
        }
        self.observe_accelerated([&x[..n], &x[n..2 * n], accelerations], outputs);
    }
}
