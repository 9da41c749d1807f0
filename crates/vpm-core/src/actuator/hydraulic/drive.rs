//! A servo-cylinder as a drive of a machine: what it pushes is the machine's business.

use serde::Deserialize;

use super::load::chambers_under_load;
use super::{Balance, Chambers, Cylinder, Flows, Pressures, Supply, Valve};
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Cylinder behind a servovalve, on a line or on a sliding joint.
///
/// Law: the piston's place from mid-stroke is `x = s - retracted_length - stroke/2`, with s the length of the line or the coordinate of
/// the joint, m. The effort is `A pa - alpha A pb` and that of seals and stops, N, positive where it pushes apart.
/// State: spool and its rate, unless the spool follows at once; then the state of both chambers, see [`Valve`] and [`Cylinder`], or the
/// load pressure, or nothing, see [`Pressures`].
/// Source: D'Imperio 2016, section 4.1 and appendix A. Checked: see valve and cylinder; the retracted length is any number.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HydraulicDrive<P> {
    /// Number of the supply that feeds it.
    pub supply: usize,
    /// Length (coordinate) with the piston at the end of chamber a, m.
    pub retracted_length: P,
    /// The valve; the command is its current.
    pub valve: Valve<P>,
    /// The cylinder.
    pub cylinder: Cylinder<P>,
    /// How its pressures come about.
    #[serde(default)]
    pub pressures: Pressures,
}

/// What a drive does in a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveAction<S> {
    /// Force of the oil on the piston, and of the stops, N.
    pub force: S,
    /// Place of the spool, spool unit.
    pub spool: S,
    /// Pressures of the chambers, Pa.
    pub pressures: Chambers<S>,
    /// Flows through the valve, m^3/s.
    pub flows: Flows<S>,
}

impl<P> HydraulicDrive<P> {
    /// The same drive over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> HydraulicDrive<T> {
        HydraulicDrive {
            supply: self.supply,
            retracted_length: f(&self.retracted_length),
            valve: self.valve.map(f),
            cylinder: self.cylinder.map(f),
            pressures: self.pressures,
        }
    }

    /// Names of the hydraulic drive's states, in their order.
    pub fn states(&self) -> &'static [&'static str] {
        match (self.valve.frequency.is_some(), self.pressures) {
            (true, Pressures::Chambers) => &["spool", "spool_rate", "chamber_a", "chamber_b"],
            (true, Pressures::Load) => &["spool", "spool_rate", "load"],
            (false, Pressures::Chambers) => &["chamber_a", "chamber_b"],
            (false, Pressures::Load) => &["load"],
            (true, Pressures::QuasiStatic) => &["spool", "spool_rate"],
            (false, Pressures::QuasiStatic) => &[],
        }
    }

    /// Number of states of the hydraulic drive's spool, which are the first.
    #[inline]
    fn of_spool(&self) -> usize {
        if self.valve.frequency.is_some() { 2 } else { 0 }
    }

    /// Parameters of the hydraulic drive and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let parts = [self.valve.domains(), self.cylinder.domains()].concat();
        let mut domains = vec![(&self.retracted_length, Domain::Any)];
        domains.extend(parts.into_iter().map(|(_, parameter, domain)| (parameter, domain)));
        domains
    }
}

impl<S: Scalar> HydraulicDrive<S> {
    /// Piston place of the hydraulic drive from mid-stroke (m) at a length or coordinate `s` (m).
    #[inline]
    pub fn piston(&self, s: S) -> S {
        s - self.retracted_length - self.cylinder.stroke * 0.5
    }

    /// Action of the hydraulic drive in its `states` under a `current` (A); the `rates` are written. The piston is at
    /// `x` (m) and moves with `v` (m/s); `supply` feeds at `pressure` (Pa). The friction of the seals,
    /// [`super::Cylinder::rubbing`], is not in it.
    #[inline]
    pub fn action(
        &self,
        states: &[S],
        rates: &mut [S],
        current: S,
        [x, v]: [S; 2],
        (supply, pressure): (&Supply<S>, S),
    ) -> DriveAction<S> {
        let (oil, tank, cylinder) = (&supply.oil, supply.tank_pressure, &self.cylinder);
        let (of_spool, of_oil) = states.split_at(self.of_spool());
        let (spool_rates, oil_rates) = rates.split_at_mut(self.of_spool());
        let mut spool = self.valve.target(current);
        if let (&[place, rate], [first, second]) = (of_spool, spool_rates) {
            spool = place;
            *first = rate;
            *second = self.valve.spool_acceleration(place, rate, current).unwrap_or_else(S::zero);
        }
        let areas = cylinder.areas();
        let alpha = areas.b / areas.a;
        let held = match *of_oil {
            [a, b] => Chambers { a, b },
            [load] => chambers_under_load(load, self.valve.opening(spool), [pressure, tank], alpha),
            _ => Balance::new(&self.valve, cylinder, oil, spool, [pressure, tank]).chambers(v),
        };
        let pressures = Chambers { a: oil.pressure(held.a), b: oil.pressure(held.b) };
        let flows = self.valve.flows(spool, pressure, tank, [pressures.a, pressures.b]);
        let inflow = Chambers { a: flows.into_a, b: -flows.out_of_b };
        if !oil_rates.is_empty() {
            let change = cylinder.rates(oil, held, [x, v], inflow, tank);
            match oil_rates {
                [a, b] => (*a, *b) = (change.a, change.b),
                [load] => *load = change.a - alpha * change.b,
                _ => {}
            }
        }
        let force = cylinder.force(pressures) + cylinder.stop.force(x, v, cylinder.stroke * 0.5);
        DriveAction { force, spool, pressures, flows }
    }

    /// Chambers (Pa) of the hydraulic drive at rest without net force: `A pa = alpha A pb`, `pa + pb = ps + pt`.
    pub fn rest(&self, supply: &Supply<S>) -> Chambers<S> {
        self.cylinder.rest(supply.pressure, supply.tank_pressure)
    }

    /// Settles the hydraulic drive: writes its states at rest without a command and without net force.
    pub fn settle(&self, supply: &Supply<S>, next: &mut impl FnMut(S)) {
        let Chambers { a, b } = self.rest(supply);
        (0..self.of_spool()).for_each(|_| next(S::zero()));
        match self.pressures {
            Pressures::Chambers => [a, b].into_iter().for_each(next),
            Pressures::Load => next(S::zero()),
            Pressures::QuasiStatic => {}
        }
    }
}
