//! Where drives and supplies begin, whether their pistons are where they can be, and how large their states are.

use super::Dynamics;
use super::drives::motion;
use crate::actuator::{Actuator, Drive};
use crate::scalar::Scalar;

impl<S: Scalar> Dynamics<S> {
    /// Settles drives and supplies of a machine at rest at `q` without commands: writes their states. Lags, currents
    /// and spools are 0, visco-elastic elements settled and memories relaxed. Chambers have no net force, and supplies,
    /// of which nothing is lost, their pressure.
    pub fn settle_drives(&mut self, q: &[S], states: &mut [S]) {
        let zero = vec![S::zero(); q.len()];
        self.locate(q, &zero);
        let mut at = states.iter_mut();
        let mut next = |value: S| at.next().into_iter().for_each(|state| *state = value);
        for actuator in &self.actuators {
            if actuator.lag.is_some() {
                next(S::zero());
            }
            let [length, _] = motion(actuator.on, q, &zero, &self.data.composite.lines);
            match &actuator.drive {
                Drive::Ideal(_) | Drive::SpringDamper(_) | Drive::Table(_) | Drive::Narx(_) | Drive::MaxwellNarx(_) => {
                }
                Drive::DcMotor(_) => next(S::zero()),
                Drive::Maxwell(law) => next(law.settled(length)),
                Drive::Hydraulic(law) => law.settle(&self.supplies[law.supply], &mut next),
            }
        }
        for supply in &self.supplies {
            if supply.is_sagging() {
                next(supply.pressure);
            }
            if supply.drop.is_some() {
                next(S::zero());
            }
        }
        at.for_each(|memory| *memory = S::zero());
    }

    /// Actuator whose piston stands beyond its stroke at `q`, so that it cannot settle. Stops give way by 1 mm or 2 %
    /// of the stroke, and by what they yield under twice the force of the supply. Returns its number, with the piston's
    /// place from mid-stroke and half of the stroke, m.
    pub(crate) fn piston_outside(&mut self, q: &[S]) -> Option<(usize, f64, f64)> {
        if self.shown.hydraulics.is_empty() {
            return None;
        }
        self.loads.fill(S::zero());
        let rest = std::mem::take(&mut self.loads);
        self.locate(q, &rest);
        let lines = &self.data.composite.lines;
        let found = self.actuators.iter().enumerate().find_map(|(number, actuator)| {
            let Drive::Hydraulic(law) = &actuator.drive else { return None };
            let [length, _] = motion(actuator.on, q, &rest, lines);
            let (place, reach) = (law.piston(length).inspect(), 0.5 * law.cylinder.stroke.inspect());
            let push = self.supplies[law.supply].pressure.inspect() * law.cylinder.areas().a.inspect();
            let give = (0.04 * reach).max(1e-3) + 2.0 * push / law.cylinder.stop.stiffness.inspect();
            (place.abs() > reach + give).then_some((number, place, reach))
        });
        self.loads = rest;
        found
    }

    /// Chords for friction of seals and drives in an iteration matrix at (q, v), after [`Dynamics::rhs`].
    pub(super) fn drive_chords(&self, q: &[S], v: &[S], chords: &mut [Option<S>]) {
        let rubs = |actuator: &Actuator<S>| match &actuator.drive {
            Drive::Hydraulic(law) => actuator.friction.is_some() || law.cylinder.seal.is_there(),
            Drive::DcMotor(_) => true,
            _ => actuator.friction.is_some(),
        };
        if self.ideal || !self.actuators.iter().any(rubs) {
            return;
        }
        let (mut currents, mut cylinders) = (self.shown.currents.iter(), self.shown.chambers());
        for ((actuator, &force), chord) in self.actuators.iter().zip(&self.driven).zip(chords) {
            let [_, rate] = motion(actuator.on, q, v, &self.data.composite.lines);
            let own = match &actuator.drive {
                Drive::Hydraulic(law) => {
                    cylinders.next().map_or(S::zero(), |held| law.cylinder.rubbing_chord(rate, held))
                }
                Drive::DcMotor(law) => {
                    let current = currents.next().copied().unwrap_or_default();
                    law.gear_resistance(law.driving(current), rate)
                }
                _ => S::zero(),
            };
            *chord = Some(own + actuator.friction_chord(force, rate));
        }
    }

    /// Natural sizes of all states: a hundredth for coordinates, 1 for rates, of the drives what is natural for each.
    pub(crate) fn scales(&self, scales: &mut [f64]) {
        let n = self.coordinates();
        let (motion, internal) = scales.split_at_mut(2 * n);
        motion[..n].fill(1e-2);
        motion[n..].fill(1.0);
        self.drive_scales(internal);
    }

    /// Natural sizes of the last states of drives, supplies and memories, in SI units.
    pub(crate) fn drive_scales(&self, scales: &mut [f64]) {
        let mut others = self.dim() - 2 * self.coordinates() - scales.len();
        let mut scales = scales.iter_mut();
        self.drive_sizes(|[size, _]| match others.checked_sub(1) {
            Some(left) => others = left,
            None => scales.next().into_iter().for_each(|scale| *scale = size),
        });
    }

    /// State of a drive, supply or memory that is out of reach in `states`, and the limit of its law. It may be no more
    /// than its natural size beyond: steps may be off by that.
    pub(crate) fn out_of_reach(&self, states: &[f64]) -> Option<(usize, f64)> {
        let (mut states, mut found) = (states.iter().enumerate(), None);
        self.drive_sizes(|[size, reach]| {
            let outside = states.next().filter(|(_, state)| state.abs() > reach + size);
            found = found.or(outside.map(|(place, _)| (place, reach)));
        });
        found
    }

    /// Tells `next` the natural size and limit of each state of drives, supplies and memories, in SI units. The limit
    /// is how far from zero its law leads at most: infinite where commands or motions decide.
    fn drive_sizes(&self, mut next: impl FnMut([f64; 2])) {
        const STRETCH: f64 = 1e-3;
        const PRESSURE: f64 = 1e5;
        let free = |size: f64| [size, f64::INFINITY];
        for actuator in &self.actuators {
            if actuator.lag.is_some() {
                next(actuator.saturation.map_or(free(1.0), |saturation| [saturation.limit.inspect(); 2]));
            }
            match &actuator.drive {
                Drive::Ideal(_) | Drive::SpringDamper(_) | Drive::Table(_) | Drive::Narx(_) | Drive::MaxwellNarx(_) => {
                }
                Drive::DcMotor(_) => next(free(1.0)),
                Drive::Maxwell(_) => next(free(STRETCH)),
                Drive::Hydraulic(law) => {
                    let stroke = law.valve.stroke.inspect();
                    let rate = law.valve.own_frequency().map_or(1.0, |frequency| stroke * frequency.inspect());
                    let [place, speed] = law.valve.reach();
                    let size = |state: &&str| match *state {
                        "spool" => [stroke, place.inspect()],
                        "spool_rate" => [rate, speed.inspect()],
                        _ => free(PRESSURE),
                    };
                    law.states().iter().map(size).for_each(&mut next);
                }
            }
        }
        self.supplies.iter().flat_map(|supply| supply.states()).for_each(|_| next(free(PRESSURE)));
        self.memories.reaches().for_each(|reach| next([1.0, reach.inspect()]));
    }
}
