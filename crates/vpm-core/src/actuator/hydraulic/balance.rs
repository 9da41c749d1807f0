//! Quasi-static pressures: both chambers without a state, from what flows in and out of them.

mod search;

use super::{Chambers, Cylinder, Fluid, Valve};
use crate::scalar::Scalar;
use search::{DIFFERENCE, PRESSURE};

/// Flows of a cylinder's chambers behind a valve that stands still, with oil that does not give way.
///
/// Law: `q_a(pa) - A v - leak_a = 0` and `-q_b(pb) + alpha A v - leak_b = 0`, the flows of [`Valve::flows`] and the leakage of
/// [`Cylinder::leakage`]: the balance that pressures settle to when oil is stiff or motion slow. A chamber that the valve cannot fill even
/// at the vapour pressure stays there; how large its void becomes is forgotten. The piston displaces oil beyond the ends of its stroke too.
/// A valve without clearance would lock the piston in its middle: no pressure balances a velocity there.
/// Source: Merritt 1967, "Hydraulic Control Systems", section 6-1 (valve-controlled piston, without compression flow). Checked: rates of the
/// chambers vanish, the closed form of a symmetric cylinder, and stiff oil comes near to it.
///
/// What flows into a chamber falls with its pressure, so that there is one solution, between the vapour pressure and what drives
/// everything out through one edge. Where chambers leak into each other, so does the difference of their pressures with the difference
/// that the leakage is taken at. Both are Newton's steps inside of brackets, from the closed form without leakage and with turbulent
/// edges; two steps on both equations at once give the last figures, and the derivatives of numbers that carry some (those of an implicit
/// function: each step doubles the order that is right).
#[derive(Clone, Copy, Debug)]
pub struct Balance<'a, S> {
    valve: &'a Valve<S>,
    cylinder: &'a Cylinder<S>,
    vapour: S,
    edges: [S; 2],
    supply: S,
    tank: S,
}

impl<'a, S: Scalar> Balance<'a, S> {
    /// The balance with the spool at `place` (spool unit) between the pressures of `[supply, tank]` (Pa).
    #[inline]
    pub fn new(
        valve: &'a Valve<S>,
        cylinder: &'a Cylinder<S>,
        oil: &Fluid<S>,
        place: S,
        [supply, tank]: [S; 2],
    ) -> Self {
        Self { valve, cylinder, vapour: oil.vapour_pressure, edges: valve.edges(place), supply, tank }
    }

    /// Chamber pressures (Pa) by balance of flows, with the piston moving at `v` (m/s).
    #[inline]
    pub fn chambers(&self, v: S) -> Chambers<S> {
        let areas = self.cylinder.areas();
        let swept = [areas.a * v, -(areas.b * v)];
        let mut found = self.search(swept);
        for _ in 0..2 {
            found = self.refined(found, swept);
        }
        Chambers { a: found[0], b: found[1] }
    }

    /// Laminar leakage past the piston in the balance of flows, m^3/(s Pa).
    #[inline]
    fn internal(&self) -> S {
        self.cylinder.worn_leakage.map_or(self.cylinder.internal_leakage, |worn| self.cylinder.internal_leakage + worn)
    }

    /// Search for both balanced pressures, without derivatives. The piston takes the flows `swept` (m^3/s) from the
    /// chambers.
    fn search(&self, [swept_a, swept_b]: [S; 2]) -> [S; 2] {
        let [forward, backward] = self.edges.map(|opening| self.valve.orifice.gain * opening);
        let (internal, external) = (self.internal(), self.cylinder.external_leakage);
        let shared = [self.supply, self.tank, self.vapour, self.valve.orifice.transition_pressure];
        let own = [forward, backward, swept_a, swept_b, internal, external];
        let leak = internal * S::search(&DIFFERENCE, own.into_iter().chain(shared));
        [[forward, backward, swept_a + leak, external], [backward, forward, swept_b - leak, external]]
            .map(|own| S::search(&PRESSURE, own.into_iter().chain(shared)))
    }

    /// One step of Newton's method on both balances; a chamber at the vapour pressure stays there.
    fn refined(&self, [a, b]: [S; 2], [swept_a, swept_b]: [S; 2]) -> [S; 2] {
        let internal = self.internal();
        let [forward, backward] = self.edges;
        let leak = internal * (a - b);
        // Net flow, its slope by the chamber's own pressure and by the other: instead, at the vapour pressure, the way to that.
        let row = |p: S, edges: [S; 2], taken: S| {
            let held = || [self.vapour - p, S::one(), S::zero()];
            let free = || {
                let [net, slope] = self.net(p, edges, taken);
                [net, slope + internal, internal]
            };
            self.vapour.if_less(p, free, held)
        };
        let [net_a, own_a, cross_a] = row(a, [forward, backward], swept_a + leak);
        let [net_b, own_b, cross_b] = row(b, [backward, forward], swept_b - leak);
        let determinant = own_a * own_b - cross_a * cross_b;
        let shifts = [(own_b * net_a + cross_a * net_b) / determinant, (cross_b * net_a + own_a * net_b) / determinant];
        [(a + shifts[0]).max(self.vapour), (b + shifts[1]).max(self.vapour)]
    }

    /// Balance of a chamber's flows at pressure `p`, and how much it falls with the pressure. It is what flows in less
    /// what is `taken` (m^3/s).
    fn net(&self, p: S, [filling, emptying]: [S; 2], taken: S) -> [S; 2] {
        let (orifice, external) = (&self.valve.orifice, self.cylinder.external_leakage);
        let (in_drop, out_drop) = (self.supply - p, p - self.tank);
        let flow = orifice.flow(filling, in_drop) - orifice.flow(emptying, out_drop) - external * out_drop - taken;
        [flow, orifice.conductance(filling, in_drop) + orifice.conductance(emptying, out_drop) + external]
    }
}
