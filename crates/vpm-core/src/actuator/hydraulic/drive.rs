//! A servo-cylinder as a drive of a machine: what it pushes is the machine's business.

use serde::Deserialize;

use super::{Chambers, Cylinder, Flows, Supply, Valve};
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Cylinder behind a servovalve, on a line or on a sliding joint.
///
/// Law: the piston's place from mid-stroke is `x = s - retracted_length - stroke/2`, with s the length of the line or the coordinate of
/// the joint, m. The effort is `A pa - alpha A pb` and that of seals and stops, N, positive where it pushes apart.
/// State: spool, its rate, the state of both chambers; see [`Valve`] and [`Cylinder`].
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
}

/// States of the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveState<S> {
    /// Place of the spool, spool unit.
    pub spool: S,
    /// Its rate, spool unit/s.
    pub spool_rate: S,
    /// States of the chambers, Pa.
    pub chambers: Chambers<S>,
}

/// What a drive does in a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveAction<S> {
    /// Force of the oil on the piston, and of the stops, N.
    pub force: S,
    /// Rates of spool, spool rate and both chambers.
    pub rates: [S; 4],
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
        }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let parts = [self.valve.domains(), self.cylinder.domains()].concat();
        let mut domains = vec![(&self.retracted_length, Domain::Any)];
        domains.extend(parts.into_iter().map(|(_, parameter, domain)| (parameter, domain)));
        domains
    }
}

impl<S: Scalar> HydraulicDrive<S> {
    /// Place of the piston from mid-stroke (m) at a length or coordinate `s` (m).
    #[inline]
    pub fn piston(&self, s: S) -> S {
        s - self.retracted_length - self.cylinder.stroke * 0.5
    }

    /// What it does under a `current` (A), with the piston at `x` (m) and moving with `v` (m/s), fed from `supply` at `pressure` (Pa).
    /// The friction of the seals, [`super::SealFriction::force`], is not in it.
    #[inline]
    pub fn action(
        &self,
        state: DriveState<S>,
        current: S,
        [x, v]: [S; 2],
        (supply, pressure): (&Supply<S>, S),
    ) -> DriveAction<S> {
        let (oil, tank, cylinder) = (&supply.oil, supply.tank_pressure, &self.cylinder);
        let pressures = Chambers { a: oil.pressure(state.chambers.a), b: oil.pressure(state.chambers.b) };
        let flows = self.valve.flows(state.spool, pressure, tank, [pressures.a, pressures.b]);
        let inflow = Chambers { a: flows.into_a, b: -flows.out_of_b };
        let chambers = cylinder.rates(oil, state.chambers, [x, v], inflow, tank);
        let spool = self.valve.spool_acceleration(state.spool, state.spool_rate, current);
        DriveAction {
            force: cylinder.force(pressures) + cylinder.stop.force(x, v, cylinder.stroke * 0.5),
            rates: [state.spool_rate, spool, chambers.a, chambers.b],
            pressures,
            flows,
        }
    }

    /// Chambers (Pa) at rest without net force: `A pa = alpha A pb`, `pa + pb = ps + pt`.
    pub fn rest(&self, supply: &Supply<S>) -> Chambers<S> {
        self.cylinder.rest(supply.pressure, supply.tank_pressure)
    }
}
