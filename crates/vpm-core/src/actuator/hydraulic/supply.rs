//! Where the oil comes from.

use serde::Deserialize;

use super::Fluid;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Oil under pressure for any number of cylinders, and the tank that it returns to.
///
/// Checked: all pressures are positive; that of the supply lies above that of the tank.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Supply<P> {
    /// Name, unique in the model.
    pub name: String,
    /// Pressure without flow, Pa.
    pub pressure: P,
    /// Pressure of the tank, Pa.
    pub tank_pressure: P,
    /// The oil.
    pub oil: Fluid<P>,
    /// How the pressure answers to what is drawn.
    pub source: Source<P>,
    /// What hoses and filters take off on the way to the valves.
    #[serde(default = "crate::actuator::none")]
    pub drop: Option<SupplyDrop<P>>,
}

/// How the pressure of a supply comes about.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source<P> {
    /// It never changes.
    Constant,
    /// It is an input, Pa, held between samples.
    Logged,
    /// It answers to the flow that is drawn.
    Sagging(Sagging<P>),
}

/// A pump or accumulator that gives way.
///
/// Law: `capacitance dp/dt = (pressure - p) / resistance - flow`, p in Pa, the flow drawn in m^3/s; so that a steady flow lowers the
/// pressure by `resistance flow`. Source: Merritt 1967, "Hydraulic Control Systems", section 3-2 (capacitance of a volume), with the
/// source as a pressure behind a laminar resistance. Checked: both are positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sagging<P> {
    /// Loss of pressure per flow, Pa s/m^3.
    pub resistance: P,
    /// Volume per pressure, m^3/Pa.
    pub capacitance: P,
}

/// Pressure that is lost between a supply and its valves.
///
/// Law: `time_constant dd/dt = resistance flow - d`, d in Pa taken off the supply's pressure, the flow in m^3/s that of all its valves: a laminar
/// resistance behind which hoses give way. With `time_constant = resistance capacitance` and a constant supply the pressure at the valves is
/// that of [`Sagging`]; unlike there, no resistance is no drop. Source: Merritt 1967, "Hydraulic Control Systems", sections 3-2 and 3-3.
/// Checked: the time constant is positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupplyDrop<P> {
    /// Loss of pressure per flow, Pa s/m^3.
    pub resistance: P,
    /// Time after which 63 % of a loss are there, s.
    pub time_constant: P,
}

impl<P> Supply<P> {
    /// The same supply over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Supply<T> {
        Supply {
            name: self.name.clone(),
            pressure: f(&self.pressure),
            tank_pressure: f(&self.tank_pressure),
            oil: self.oil.map(f),
            source: match &self.source {
                Source::Constant => Source::Constant,
                Source::Logged => Source::Logged,
                Source::Sagging(law) => {
                    Source::Sagging(Sagging { resistance: f(&law.resistance), capacitance: f(&law.capacitance) })
                }
            },
            drop: self
                .drop
                .as_ref()
                .map(|law| SupplyDrop { resistance: f(&law.resistance), time_constant: f(&law.time_constant) }),
        }
    }

    /// Parameters of the supply and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut domains = vec![(&self.pressure, Domain::Positive), (&self.tank_pressure, Domain::Positive)];
        domains.extend(self.oil.domains().into_iter().map(|(_, parameter, domain)| (parameter, domain)));
        if let Source::Sagging(Sagging { resistance, capacitance }) = &self.source {
            domains.extend([(resistance, Domain::Positive), (capacitance, Domain::Positive)]);
        }
        if let Some(SupplyDrop { resistance, time_constant }) = &self.drop {
            domains.extend([(resistance, Domain::Any), (time_constant, Domain::Positive)]);
        }
        domains
    }

    /// Names of the supply's states, in their order.
    pub fn states(&self) -> impl Iterator<Item = &'static str> {
        let (sagging, drop) = (self.is_sagging().then_some("pressure"), self.drop.as_ref().map(|_| "drop"));
        sagging.into_iter().chain(drop)
    }

    /// Whether the supply's pressure is a logged input.
    pub fn is_logged(&self) -> bool {
        matches!(self.source, Source::Logged)
    }

    /// Whether the supply's pressure is a state.
    pub fn is_sagging(&self) -> bool {
        matches!(self.source, Source::Sagging(_))
    }
}

impl<S: Scalar> SupplyDrop<S> {
    /// Change in Pa/s of a supply's `drop` (Pa) with `flow` (m^3/s) drawn.
    #[inline]
    pub fn rate(&self, drop: S, flow: S) -> S {
        (self.resistance * flow - drop) / self.time_constant
    }
}

impl<S: Scalar> Sagging<S> {
    /// Rate dp/dt in Pa/s of a supply at pressure `p` with `flow` (m^3/s) drawn, from a source of `pressure` (Pa).
    #[inline]
    pub fn rate(&self, p: S, pressure: S, flow: S) -> S {
        ((pressure - p) / self.resistance - flow) / self.capacitance
    }
}
