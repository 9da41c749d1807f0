//! The servovalve: a spool that follows a current and opens four edges.

use std::f64::consts::FRAC_PI_2;

use serde::Deserialize;

use super::{NamedDomain, Orifice};
use crate::actuator::{DeadZone, Saturation};
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Flows through a 4-way valve, m^3/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flows<S> {
    /// Into port a.
    pub into_a: S,
    /// Out of port b.
    pub out_of_b: S,
    /// Out of the supply.
    pub supply: S,
    /// Into the tank.
    pub tank: S,
}

/// 4-way servovalve with a spool of second order, or one that follows at once.
///
/// Law: `z'' = w^2 (sat(gain i) - z) - 2 D w z'` with `1/w = 1/frequency + delay`, i the current in A, z the spool's place in a unit of the user's choice (`gain` units
/// of z per A), sat the limit `±stroke`. What opens is `u = dead_zone(sat(z))`: an overshoot beyond the stroke, at most
/// `e^(-pi D / sqrt(1 - D^2))` of a step, opens no more. u > 0: supply to a, b to tank; u < 0: a to tank, supply to b (4.1, 4.2, both
/// directions of each edge): `qa = flow(u, ps - pa)` and `qb = flow(u, pb - pt)`, or `qa = -flow(-u, pa - pt)` and
/// `qb = -flow(-u, ps - pb)`, qa into a and qb out of b.
/// Source: D'Imperio 2016, section 4.1 and appendix A; Merritt 1967, "Hydraulic Control Systems", section 5-3 (overlap). The stroke
/// as a limit of what drives and of what opens, not as an impact that would need steps of its own, is an assumption.
/// A valve without a frequency is its static gain, `z = sat(gain i)`: the limit of a fast spool (Merritt 1967, section 6-3).
/// No edge shuts quite: with a `clearance` c those that u opens are open by `(root + u) / 2`, the others by `(root - u) / 2`, with
/// `root = sqrt(u^2 + c^2)`, c in spool units; in the middle all four let the valve's leakage pass (Merritt 1967, section 5-3, leakage of practical
/// critical-centre valves; the hyperbola is an assumption). Without one an edge is open by u or shut.
/// Checked: frequency, stroke and clearance are positive, damping and overlap not negative.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Valve<P> {
    /// Place of the spool per current, spool unit/A.
    pub gain: P,
    /// Natural frequency of the spool, rad/s; none of a spool that follows at once.
    #[serde(default = "crate::actuator::none")]
    pub frequency: Option<P>,
    /// Damping ratio of the spool; none of one that follows at once.
    #[serde(default = "crate::actuator::none")]
    pub damping: Option<P>,
    /// How much slower than that a worn or cold valve is, s: it adds to the inverse of the frequency.
    #[serde(default = "crate::actuator::none")]
    pub delay: Option<P>,
    /// Largest place of the spool, spool unit.
    pub stroke: P,
    /// How far the spool moves before it opens, spool unit.
    pub overlap: DeadZone<P>,
    /// What an edge lets pass where it should be shut, as an opening, spool unit: see the law.
    #[serde(default = "crate::actuator::none")]
    pub clearance: Option<P>,
    /// Each of the four edges; its opening is in spool units.
    pub orifice: Orifice<P>,
}

impl<P> Valve<P> {
    /// The same valve over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Valve<T> {
        Valve {
            gain: f(&self.gain),
            frequency: self.frequency.as_ref().map(&mut *f),
            damping: self.damping.as_ref().map(&mut *f),
            delay: self.delay.as_ref().map(&mut *f),
            stroke: f(&self.stroke),
            overlap: self.overlap.map(f),
            clearance: self.clearance.as_ref().map(&mut *f),
            orifice: self.orifice.map(f),
        }
    }

    /// Parameters of the valve and where each is defined.
    pub fn domains(&self) -> Vec<NamedDomain<'_, P>> {
        let mut domains = vec![
            ("valve.gain", &self.gain, Domain::Any),
            ("valve.stroke", &self.stroke, Domain::Positive),
            ("valve.overlap", &self.overlap.width, Domain::NonNegative),
        ];
        domains.extend(self.frequency.as_ref().map(|frequency| ("valve.frequency", frequency, Domain::Positive)));
        domains.extend(self.damping.as_ref().map(|damping| ("valve.damping", damping, Domain::NonNegative)));
        domains.extend(self.clearance.as_ref().map(|clearance| ("valve.clearance", clearance, Domain::Positive)));
        domains.extend(self.orifice.domains());
        domains.extend(self.delay.as_ref().map(|delay| ("valve.delay", delay, Domain::NonNegative)));
        domains
    }
}

impl<S: Scalar> Valve<S> {
    /// Natural frequency of the valve's spool as it is, rad/s; none of one that follows at once.
    #[inline]
    pub fn own_frequency(&self) -> Option<S> {
        let frequency = self.frequency?;
        Some(self.delay.map_or(frequency, |delay| frequency / (frequency * delay + 1.0)))
    }

    /// Place to which a held `current` (A) leads the valve's spool, spool units.
    #[inline]
    pub fn target(&self, current: S) -> S {
        Saturation { limit: self.stroke }.apply(self.gain * current)
    }

    /// Acceleration of a valve's spool at `place` with `rate` under a `current` (A), spool unit/s^2. There is none of
    /// one that follows at once.
    #[inline]
    pub fn spool_acceleration(&self, place: S, rate: S, current: S) -> Option<S> {
        let frequency = self.own_frequency()?;
        let resistance = self.damping.unwrap_or_else(S::zero) * frequency * rate * 2.0;
        Some(frequency * frequency * (self.target(current) - place) - resistance)
    }

    /// Reach of the valve's spool from the middle, and its speed, in spool units and 1/s. It is for any command;
    /// infinite without damping.
    ///
    /// Law: of `z'' = w^2 (u - z) - 2 D w z'` with `|u| <= stroke`, from rest, the worst command changes its sign with every half swing:
    /// `|z| <= stroke coth(pi D / (2 sqrt(1 - D^2)))` for D < 1, else `|z| <= stroke`. Where the rate is largest, its change vanishes:
    /// `|z'| <= w (stroke + |z|) / (2 D)`.
    /// Source: the integral of the magnitude of the impulse response, Desoer & Vidyasagar 1975, "Feedback Systems", section II.6; its halves
    /// fall by `e^(-pi D / sqrt(1 - D^2))`.
    /// Checked: that command, step by step.
    pub fn reach(&self) -> [S; 2] {
        let (Some(frequency), Some(damping)) = (self.own_frequency(), self.damping) else {
            return [S::from_f64(f64::INFINITY); 2];
        };
        let d = damping.inspect();
        let swing = if d < 1.0 { (FRAC_PI_2 * d / (1.0 - d * d).sqrt()).tanh().recip() } else { 1.0 };
        let place = self.stroke * swing;
        [place, frequency * (self.stroke + place) / (damping * 2.0)]
    }

    /// Opening of a valve with its spool at `place`, in spool units: positive from supply to a.
    #[inline]
    pub fn opening(&self, place: S) -> S {
        self.overlap.apply(Saturation { limit: self.stroke }.apply(place))
    }

    /// Openings of the valve's edges with the spool at `place`, spool units. First from the supply to a and from b to
    /// the tank, then the two others.
    #[inline]
    pub fn edges(&self, place: S) -> [S; 2] {
        match self.clearance {
            Some(clearance) => {
                // In the very middle a dead zone, be it of no width, has no slope.
                let within = Saturation { limit: self.stroke }.apply(place);
                let opening = self.overlap.width.if_positive(|| self.overlap.apply(within), || within);
                let (root, square) = ((opening * opening + clearance * clearance).sqrt(), clearance * clearance);
                // The smaller one as a quotient, so that nothing is lost where the valve is wide open.
                let wide = (root + opening.abs()) * 0.5;
                let narrow = square * 0.25 / wide;
                opening.if_negative(|| [narrow, wide], || [wide, narrow])
            }
            None => {
                let opening = self.opening(place);
                [opening.max(S::zero()), (-opening).max(S::zero())]
            }
        }
    }

    /// Flows of a valve with the spool at `place` between `supply`, `tank` and ports `[a, b]`, all in Pa.
    #[inline]
    pub fn flows(&self, place: S, supply: S, tank: S, [a, b]: [S; 2]) -> Flows<S> {
        if self.clearance.is_some() {
            let [forward, backward] = self.edges(place);
            let [to_a, from_a] = [self.orifice.flow(forward, supply - a), self.orifice.flow(backward, a - tank)];
            let [to_b, from_b] = [self.orifice.flow(backward, supply - b), self.orifice.flow(forward, b - tank)];
            return Flows {
                into_a: to_a - from_a,
                out_of_b: from_b - to_b,
                supply: to_a + to_b,
                tank: from_a + from_b,
            };
        }
        let opening = self.opening(place);
        let forward = || {
            let [at_a, at_b] = [supply - a, b - tank].map(|drop| self.orifice.flow(opening, drop));
            [at_a, at_b, at_a, at_b]
        };
        let backward = || {
            let [at_a, at_b] = [a - tank, supply - b].map(|drop| self.orifice.flow(-opening, drop));
            [-at_a, -at_b, at_b, at_a]
        };
        let [into_a, out_of_b, supply, tank] = opening.if_positive(forward, backward);
        Flows { into_a, out_of_b, supply, tank }
    }
}
