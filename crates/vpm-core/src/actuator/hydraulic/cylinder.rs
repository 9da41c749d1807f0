//! The cylinder: two chambers of oil with a piston between them.

use serde::Deserialize;

use super::{EndStop, Fluid, NamedDomain, PistonSize, SealFriction};
use crate::effect::Domain;
use crate::scalar::Scalar;

/// One quantity of both chambers of a cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chambers<S> {
    /// On the side of the full area.
    pub a: S,
    /// On the side of the rod.
    pub b: S,
}

/// Cylinder with a rod on one side; x is the piston's place from mid-stroke, positive where chamber a is large.
///
/// Law: areas A and `alpha A`, see [`PistonSize`]; volumes `va = line_a + A (L/2 + x)` and
/// `vb = line_b + alpha A (L/2 - x)`, never below those of the lines; `pa' = beta_e/va (qa - A v - leak - leak_a)` and
/// `pb' = beta_e/vb (-qb + alpha A v + leak - leak_b)` (4.11, 4.12 with the sign of A v corrected), `leak = (C_i + C_w) (pa - pb)`,
/// `leak_k = C_e (pk - pt)`. Force on the piston `A pa - alpha A pb` (N), friction of the seals and stops apart.
/// Beyond an end the closed chamber's volume stays that of its line, and does not change with v.
/// Source: D'Imperio 2016, section 4.1 and appendix A. Checked: stroke, lines and stiffness of the stop are positive,
/// leakages and damping not negative; see the size.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cylinder<P> {
    /// How thick piston and rod are.
    pub size: PistonSize<P>,
    /// Way of the piston, m.
    pub stroke: P,
    /// Volume of the line to chamber a and of what the piston leaves there at its end, m^3.
    pub line_a: P,
    /// The same of chamber b, m^3.
    pub line_b: P,
    /// Laminar leakage past the piston, m^3/(s Pa).
    pub internal_leakage: P,
    /// What worn seals add to it, m^3/(s Pa).
    #[serde(default = "crate::actuator::none")]
    pub worn_leakage: Option<P>,
    /// Laminar leakage of each chamber to the tank, m^3/(s Pa).
    pub external_leakage: P,
    /// The ends of the stroke.
    pub stop: EndStop<P>,
    /// Friction of the seals.
    pub seal: SealFriction<P>,
}

impl<P> Cylinder<P> {
    /// The same cylinder over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Cylinder<T> {
        Cylinder {
            size: self.size.map(f),
            stroke: f(&self.stroke),
            line_a: f(&self.line_a),
            line_b: f(&self.line_b),
            internal_leakage: f(&self.internal_leakage),
            worn_leakage: self.worn_leakage.as_ref().map(&mut *f),
            external_leakage: f(&self.external_leakage),
            stop: EndStop { stiffness: f(&self.stop.stiffness), damping: f(&self.stop.damping) },
            seal: self.seal.map(f),
        }
    }

    /// Parameters of the cylinder and where each is defined.
    pub fn domains(&self) -> Vec<NamedDomain<'_, P>> {
        let mut domains = self.size.domains();
        domains.extend([
            ("cylinder.stroke", &self.stroke, Domain::Positive),
            ("cylinder.line_a", &self.line_a, Domain::Positive),
            ("cylinder.line_b", &self.line_b, Domain::Positive),
            ("cylinder.internal_leakage", &self.internal_leakage, Domain::NonNegative),
            ("cylinder.external_leakage", &self.external_leakage, Domain::NonNegative),
            ("cylinder.stop.stiffness", &self.stop.stiffness, Domain::Positive),
            ("cylinder.stop.damping", &self.stop.damping, Domain::NonNegative),
        ]);
        domains.extend(self.worn_leakage.as_ref().map(|size| ("cylinder.worn_leakage", size, Domain::Any)));
        domains.extend(self.seal.domains());
        domains
    }
}

impl<S: Scalar> Cylinder<S> {
    /// Piston areas of the cylinder in m^2 on which the pressures act.
    #[inline]
    pub fn areas(&self) -> Chambers<S> {
        self.size.areas()
    }

    /// Cylinder pressures in Pa at rest without net force: `A pa = alpha A pb`, `pa + pb = ps + pt`. Supply and tank
    /// have ps and pt (Pa).
    pub fn rest(&self, supply: S, tank: S) -> Chambers<S> {
        let areas = self.areas();
        let b = (supply + tank) / (areas.b / areas.a + 1.0);
        Chambers { a: areas.b / areas.a * b, b }
    }

    /// Chamber volumes of the cylinder in m^3 with the piston at `x`.
    #[inline]
    pub fn volumes(&self, x: S) -> Chambers<S> {
        let (areas, half) = (self.areas(), self.stroke * 0.5);
        Chambers {
            a: self.line_a + areas.a * (half + x).max(S::zero()),
            b: self.line_b + areas.b * (half - x).max(S::zero()),
        }
    }

    /// Volume rates of the cylinder's chambers in m^3/s, the piston at `x` moving with `v`.
    #[inline]
    pub fn volume_rates(&self, x: S, v: S) -> Chambers<S> {
        let (areas, half) = (self.areas(), self.stroke * 0.5);
        Chambers { a: x.if_less(-half, S::zero, || areas.a * v), b: half.if_less(x, S::zero, || -(areas.b * v)) }
    }

    /// Force of the cylinder's oil on the piston in N under `pressures` (Pa).
    #[inline]
    pub fn force(&self, pressures: Chambers<S>) -> S {
        let areas = self.areas();
        areas.a * pressures.a - areas.b * pressures.b
    }

    /// Force of the cylinder's seals on the piston in N, which moves with `v` (m/s) between `pressures` (Pa).
    #[inline]
    pub fn rubbing(&self, v: S, pressures: Chambers<S>) -> S {
        self.seal.force(v, self.areas().a, pressures)
    }

    /// Chord from rest of the force of the cylinder's seals, N s/m.
    #[inline]
    pub fn rubbing_chord(&self, v: S, pressures: Chambers<S>) -> S {
        self.seal.resistance(v, self.areas().a, pressures)
    }

    /// Force of the cylinder's seals and stops on the piston in N, at `x` (m) between `pressures` (Pa).
    #[inline]
    pub fn resistance(&self, x: S, v: S, pressures: Chambers<S>) -> S {
        self.rubbing(v, pressures) + self.stop.force(x, v, self.stroke * 0.5)
    }

    /// Leakage of each cylinder chamber past piston and rod in m^3/s.
    #[inline]
    pub fn leakage(&self, pressures: Chambers<S>, tank: S) -> Chambers<S> {
        let laminar = self.worn_leakage.map_or(self.internal_leakage, |worn| self.internal_leakage + worn);
        let inside = laminar * (pressures.a - pressures.b);
        Chambers {
            a: inside + self.external_leakage * (pressures.a - tank),
            b: -inside + self.external_leakage * (pressures.b - tank),
        }
    }

    /// Rates in Pa/s of the cylinder's chamber `states` (see [`Fluid`]), the piston at `x` moving with `v`. The valve
    /// gives the flows `inflow` (m^3/s) into each.
    #[inline]
    pub fn rates(
        &self,
        fluid: &Fluid<S>,
        states: Chambers<S>,
        [x, v]: [S; 2],
        inflow: Chambers<S>,
        tank: S,
    ) -> Chambers<S> {
        let pressures = Chambers { a: fluid.pressure(states.a), b: fluid.pressure(states.b) };
        let (leakage, volumes, change) = (self.leakage(pressures, tank), self.volumes(x), self.volume_rates(x, v));
        Chambers {
            a: fluid.effective_bulk_modulus(states.a) / volumes.a * (inflow.a - change.a - leakage.a),
            b: fluid.effective_bulk_modulus(states.b) / volumes.b * (inflow.b - change.b - leakage.b),
        }
    }

    /// Stiffness of the cylinder's oil in N/m with the piston at `x` and both chambers full.
    ///
    /// Law: `beta_a A^2 / va + beta_b (alpha A)^2 / vb`, the factor of the velocity in 4.20 and 4.21.
    #[inline]
    pub fn oil_stiffness(&self, fluid: &Fluid<S>, states: Chambers<S>, x: S) -> S {
        let (areas, volumes) = (self.areas(), self.volumes(x));
        fluid.effective_bulk_modulus(states.a) * areas.a * areas.a / volumes.a
            + fluid.effective_bulk_modulus(states.b) * areas.b * areas.b / volumes.b
    }

    /// Rate of the cylinder's force in N/s, inside the stroke with both chambers full. In the form without pressure
    /// rates.
    ///
    /// Law: `F' = -K v + A (beta_a (qa - leak_a) / va + alpha beta_b (qb + leak_b) / vb)` with the oil's stiffness K, qa into a and qb
    /// out of b (4.19 with its missing alpha; 4.20 and 4.21 with leakage), a witness of [`Cylinder::rates`].
    pub fn force_rate(&self, fluid: &Fluid<S>, states: Chambers<S>, [x, v]: [S; 2], inflow: Chambers<S>, tank: S) -> S {
        let (areas, volumes, leakage) = (self.areas(), self.volumes(x), self.leakage(states, tank));
        let net_into_a = (inflow.a - leakage.a) * fluid.effective_bulk_modulus(states.a) / volumes.a;
        let net_out_of_b = (leakage.b - inflow.b) * fluid.effective_bulk_modulus(states.b) / volumes.b;
        areas.a * (net_into_a + areas.b / areas.a * net_out_of_b) - self.oil_stiffness(fluid, states, x) * v
    }
}
