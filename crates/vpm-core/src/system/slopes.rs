//! What contacts, bushings and friction are to steps: stiffness, damping, and the slope where friction turns around.

use super::Dynamics;
use super::connections::{PlacedBushing, PlacedContact};
use crate::actuator::hydraulic::Chambers;
use crate::actuator::{Drive, Target};
use crate::bushing::Bushing;
use crate::contact::ContactFriction;
use crate::dynamics::{for_each_column, poses};
use crate::effect::Seat;
use crate::integrator::resolution::Taken;
use crate::spatial::{Pose, Twist};

/// A velocity at which dry friction has turned around, m/s or rad/s.
const FAST: f64 = 1e3;

/// Dry friction of one place at rest, in N s/m, N/m and N s/m or their like.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rubbing {
    /// By how much its own coordinate moves with each of the machine.
    pub(crate) along: Vec<f64>,
    /// Resistance at rest less that of fast motion: the slope of friction that turns around with the velocity.
    pub(crate) slope: f64,
    /// Stiffness of what bends before it slides.
    pub(crate) stiffness: f64,
    /// Its resistance to bending.
    pub(crate) damping: f64,
    /// How steps take it.
    pub(crate) taken: Taken,
}

impl Dynamics<f64> {
    /// Adds slopes of contacts and bushings to `stiffness` and `damping` (n x n), after [`Dynamics::terms`].
    ///
    /// Law: `J^T K J` and `J^T C J` with K and C of each law where it is now, the friction by its chord: what is left out, the change of
    /// J with the state, is small beside it. Checked: against the change of the loads with the state.
    pub(crate) fn add_slopes(&mut self, stiffness: &mut [f64], damping: &mut [f64]) {
        poses(&self.model, &mut self.data);
        for contact in &self.connections.contacts {
            self.add_contact(contact, stiffness, damping);
        }
        for bushing in &self.connections.bushings {
            self.add_bushing(bushing, stiffness, damping);
        }
    }

    /// Slopes of friction at rest at `q`: of effects, memories and actuators, in their order.
    pub(crate) fn rubbing(&self, q: &[f64]) -> Vec<Rubbing> {
        let zeros = || vec![0.0; self.coordinates()];
        let at = |seat: &Seat<f64>| {
            let mut along = zeros();
            seat.push(&mut along[..self.joints()], 1.0);
            along
        };
        let effects = self.effects.iter().map(|(seat, effect)| {
            let (law, q, u) = (effect.law(), seat.of(q), seat.load(&self.efforts));
            let [rest, fast] = [0.0, FAST].map(|v| law.resistance(q, v) + law.resistance_per_load(v, u) * u.abs());
            Rubbing { along: at(seat), slope: rest - fast, ..Rubbing::default() }
        });
        let memories = self.memories.iter().map(|(seat, effect, memory)| {
            let [rest, fast] = [0.0, FAST].map(|v| effect.law().chords(v, memory));
            let (slope, stiffness) = (rest.resistance - fast.resistance, rest.push * rest.gain);
            Rubbing { along: at(seat), slope, stiffness, damping: fast.resistance, ..Rubbing::default() }
        });
        let mut cylinders = self.shown.chambers();
        let actuators = self.actuators.iter().zip(&self.driven).map(|(actuator, &force)| {
            let none = Chambers { a: 0.0, b: 0.0 };
            let cylinder = matches!(actuator.drive, Drive::Hydraulic(_));
            let held = if cylinder { cylinders.next().unwrap_or(none) } else { none };
            let mut along = zeros();
            match actuator.on {
                Target::Joint(joint) => along[joint] = 1.0,
                Target::Line(line) => self.data.line_load(line, 1.0, &mut along),
            }
            let [rest, fast] = [0.0, FAST].map(|v| actuator.resistance(force, v, held));
            Rubbing { along, slope: rest - fast, taken: Taken::ByChord, ..Rubbing::default() }
        });
        effects.chain(memories).chain(actuators).collect()
    }

    fn add_contact(&self, contact: &PlacedContact<f64>, stiffness: &mut [f64], damping: &mut [f64]) {
        let slot = &self.data.composite.frames[contact.frame];
        let Some(touch) = contact.touch(slot, ContactFriction::resistance) else { return };
        let (normal, n) = (contact.plane.normal(), self.coordinates());
        let [slope, resistance] = contact.law.normal.slopes(contact.plane.depth(touch.place));
        let leaving = normal.dot(touch.velocity);
        let sliding = touch.velocity - normal * leaving;
        let chord = contact.law.friction.map_or(0.0, |law| law.chord(sliding.dot(sliding)));
        let chord = chord * normal.dot(touch.force);
        let mut columns = vec![None; n];
        self.columns(contact.frame, |place, column| {
            columns[place] = Some(column.linear + column.angular.cross(touch.place));
        });
        for (i, left) in columns.iter().enumerate() {
            for (j, right) in columns.iter().enumerate() {
                let (Some(left), Some(right)) = (left, right) else { continue };
                let along = normal.dot(*left) * normal.dot(*right);
                stiffness[i * n + j] += slope * along;
                damping[i * n + j] += resistance * along + chord * (left.dot(*right) - along);
            }
        }
    }

    fn add_bushing(&self, bushing: &PlacedBushing<f64>, stiffness: &mut [f64], damping: &mut [f64]) {
        let (frames, n) = (&self.data.composite.frames, self.coordinates());
        let [pose_a, pose_b]: [Pose<f64>; 2] = [bushing.a, bushing.b].map(|end| frames[end.frame].pose * end.pose);
        let pose = pose_b.inverse() * pose_a;
        let mut motions = vec![Twist::zero(); n];
        for (end, sign) in [(bushing.a, 1.0), (bushing.b, -1.0)] {
            self.columns(end.frame, |place, column| motions[place] += pose_a.inverse_twist(column) * sign);
        }
        let rates: Vec<[f64; 6]> = motions.iter().map(|motion| Bushing::displacement_rate(&pose, *motion)).collect();
        for (matrix, whole) in [(&bushing.law.stiffness, stiffness), (&bushing.law.damping, damping)] {
            for (i, left) in rates.iter().enumerate() {
                for (j, right) in rates.iter().enumerate() {
                    whole[i * n + j] += quadratic(left, matrix, right);
                }
            }
        }
    }

    fn columns(&self, frame: usize, visit: impl FnMut(usize, Twist<f64>)) {
        let composite = &self.data.composite;
        for_each_column(&self.model, &composite.frames, &composite.sections, frame, visit);
    }
}

fn quadratic(left: &[f64; 6], matrix: &[[f64; 6]; 6], right: &[f64; 6]) -> f64 {
    let row = |entries: &[f64; 6]| entries.iter().zip(right).map(|(entry, right)| entry * right).sum::<f64>();
    left.iter().zip(matrix).map(|(left, entries)| left * row(entries)).sum()
}
