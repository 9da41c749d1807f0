//! Quasi-static pressures: both chambers without a state, from what flows in and out of them.

use super::{Chambers, Cylinder, Fluid, Valve};
use crate::scalar::Scalar;

/// Most steps of one search for a pressure, and how near its end has to be in shares of the supply's pressure.
const STEPS: usize = 40;
const NEAR: f64 = 1e-5;

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

/// A chamber with its two edges in plain numbers.
struct Side {
    /// Flow per root of pressure through the edges to the supply and to the tank, m^3/(s sqrt(Pa)).
    open: [f64; 2],
    /// Laminar leakage to the tank, m^3/(s Pa).
    external: f64,
    /// Flow that the piston takes, m^3/s.
    swept: f64,
    supply: f64,
    tank: f64,
    vapour: f64,
    transition: f64,
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

    /// Pressures (Pa) with the piston moving at `v` (m/s).
    #[inline]
    pub fn chambers(&self, v: S) -> Chambers<S> {
        let Chambers { a, b } = self.search(v.re());
        let mut found = [S::from_f64(a), S::from_f64(b)];
        for _ in 0..2 {
            found = self.refined(found, v);
        }
        Chambers { a: found[0], b: found[1] }
    }

    /// Laminar leakage past the piston, m^3/(s Pa).
    #[inline]
    fn internal(&self) -> S {
        self.cylinder.worn_leakage.map_or(self.cylinder.internal_leakage, |worn| self.cylinder.internal_leakage + worn)
    }

    /// Both pressures to within [`NEAR`].
    fn search(&self, v: f64) -> Chambers<f64> {
        let areas = self.cylinder.areas();
        let (a, b) =
            (self.side(self.edges, areas.a.re() * v), self.side([self.edges[1], self.edges[0]], -areas.b.re() * v));
        let leakage = self.internal().re();
        let alone = [a.pressure(0.0).0, b.pressure(0.0).0];
        let most = alone[0] - alone[1];
        if leakage == 0.0 || most == 0.0 {
            return Chambers { a: alone[0], b: alone[1] };
        }
        let gap = |difference: f64| {
            let ((a, by_a), (b, by_b)) = (a.pressure(leakage * difference), b.pressure(-leakage * difference));
            (a - b - difference, leakage * (by_a + by_b) - 1.0)
        };
        let near = NEAR * self.supply.re();
        let difference = falling_zero(most, [most.min(0.0), most.max(0.0)], near, gap);
        Chambers { a: a.pressure(leakage * difference).0, b: b.pressure(-leakage * difference).0 }
    }

    fn side(&self, edges: [S; 2], swept: f64) -> Side {
        let orifice = &self.valve.orifice;
        Side {
            open: edges.map(|opening| orifice.gain.re() * opening.re()),
            external: self.cylinder.external_leakage.re(),
            swept,
            supply: self.supply.re(),
            tank: self.tank.re(),
            vapour: self.vapour.re(),
            transition: orifice.transition_pressure.re(),
        }
    }

    /// One step of Newton's method on both balances; a chamber at the vapour pressure stays there.
    fn refined(&self, [a, b]: [S; 2], v: S) -> [S; 2] {
        let (areas, internal, external) = (self.cylinder.areas(), self.internal(), self.cylinder.external_leakage);
        let [forward, backward] = self.edges;
        let orifice = &self.valve.orifice;
        let side = |p: S, [filling, emptying]: [S; 2], swept: S| {
            let (in_drop, out_drop) = (self.supply - p, p - self.tank);
            let flow = orifice.flow(filling, in_drop) - orifice.flow(emptying, out_drop) - external * out_drop - swept;
            (flow, orifice.conductance(filling, in_drop) + orifice.conductance(emptying, out_drop) + external)
        };
        let ((net_a, slope_a), (net_b, slope_b)) =
            (side(a, [forward, backward], areas.a * v), side(b, [backward, forward], -(areas.b * v)));
        let leak = internal * (a - b);
        let (net_a, net_b) = (net_a - leak, net_b + leak);
        match [a, b].map(|p| p.re() <= self.vapour.re()) {
            [true, true] => [self.vapour, self.vapour],
            [true, false] => {
                let shift = (net_b + internal * (self.vapour - a)) / (slope_b + internal);
                [self.vapour, (b + shift).max(self.vapour)]
            }
            [false, true] => {
                let shift = (net_a + internal * (self.vapour - b)) / (slope_a + internal);
                [(a + shift).max(self.vapour), self.vapour]
            }
            [false, false] => {
                let (own_a, own_b) = (slope_a + internal, slope_b + internal);
                let determinant = own_a * own_b - internal * internal;
                let shift_a = (own_b * net_a + internal * net_b) / determinant;
                let shift_b = (internal * net_a + own_a * net_b) / determinant;
                [(a + shift_a).max(self.vapour), (b + shift_b).max(self.vapour)]
            }
        }
    }
}

impl Side {
    /// Pressure (Pa) with a `leak` (m^3/s) that leaves the chamber beside that to the tank, and how it changes with that.
    fn pressure(&self, leak: f64) -> (f64, f64) {
        let taken = self.swept + leak;
        let net = |p: f64| {
            let (to_supply, to_tank) = (self.root(self.supply - p), self.root(p - self.tank));
            let [filling, emptying] = self.open;
            let flow = filling * to_supply.0 - emptying * to_tank.0 - self.external * (p - self.tank) - taken;
            (flow, -(filling * to_supply.1 + emptying * to_tank.1 + self.external))
        };
        if net(self.vapour).0 <= 0.0 {
            return (self.vapour, 0.0);
        }
        let wide = self.open[0].max(self.open[1]);
        let most = self.supply + self.transition + (taken / wide).powi(2);
        let found = falling_zero(self.turbulent(taken), [self.vapour, most], NEAR * self.supply, net);
        (found, 1.0 / net(found).1)
    }

    /// Signed root of a drop and its slope, see [`super::Orifice`].
    fn root(&self, drop: f64) -> (f64, f64) {
        let size = drop.abs();
        if size < self.transition {
            let (share, root) = (drop / self.transition, self.transition.sqrt());
            return (root * share * (3.0 - share.abs()) * 0.5, (1.5 - share.abs()) / root);
        }
        let root = size.sqrt();
        (root.copysign(drop), 0.5 / root)
    }

    /// Pressure that lets `taken` (m^3/s) pass in closed form, without leakage and with turbulent edges.
    ///
    /// Law: `f sqrt(ps - p) - e sqrt(p - pt) = taken` with f and e of both edges. Between the two pressures `p = pt + (ps - pt) s^2` gives
    /// `f sqrt(1 - s^2) = c + e s`, `c = taken / sqrt(ps - pt)`; beyond, both edges flow the same way.
    fn turbulent(&self, taken: f64) -> f64 {
        let ([filling, emptying], range) = (self.open, self.supply - self.tank);
        let share = taken / range.sqrt();
        let beyond = |near: f64, far: f64| {
            let root = (share * share - far * far)
                / (share.abs() * near + far * (share * share + (near * near - far * far)).max(0.0).sqrt());
            range * root * root
        };
        if share > filling {
            return self.tank - beyond(emptying, filling);
        }
        if share < -emptying {
            return self.supply + beyond(filling, emptying);
        }
        let square = filling * filling + emptying * emptying;
        let s = (filling * (square - share * share).max(0.0).sqrt() - emptying * share) / square;
        self.tank + range * s * s
    }
}

/// Zero of a falling function between `low` and `high`, from `start`: Newton's steps, and halves of the bracket where those leave it or do
/// not shrink, as around the root of a root, which they would jump across for ever (Press et al. 2007, "Numerical Recipes", section 9.4).
fn falling_zero(start: f64, [mut low, mut high]: [f64; 2], near: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let mut at = if start >= low && start <= high { start } else { 0.5 * (low + high) };
    let mut before = high - low;
    for _ in 0..STEPS {
        let (value, slope) = f(at);
        if value > 0.0 {
            low = at;
        } else {
            high = at;
        }
        let mut next = at - value / slope;
        if (next - at).abs() <= near {
            return next;
        }
        if !(next > low && next < high && (next - at).abs() <= 0.5 * before) {
            next = 0.5 * (low + high);
        }
        before = (next - at).abs();
        at = next;
    }
    at
}
