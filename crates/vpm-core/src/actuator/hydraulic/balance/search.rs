//! The search for quasi-static pressures, in plain numbers.

use crate::scalar::{ARGUMENTS, Search};

/// Most steps of one search for a pressure, and how near its end has to be in shares of the supply's pressure.
const STEPS: usize = 40;
const NEAR: f64 = 1e-5;

/// Pressure of a chamber (Pa) to within [`NEAR`]: from the flow per root of pressure of its edges to the supply and to the tank
/// (m^3/(s sqrt(Pa))), what is taken from it (m^3/s) and its leakage to the tank (m^3/(s Pa)), then the pressures of [`Shared`].
pub(super) static PRESSURE: Search = Search {
    name: "vpm_chamber_pressure",
    arguments: 8,
    run: |&[filling, emptying, taken, external, supply, tank, vapour, transition, ..]| {
        let shared = Shared { external, supply, tank, vapour, transition };
        Side { open: [filling, emptying], shared }.pressure(taken).0
    },
    source: &[include_str!("pressure.c")],
};

/// Difference of the pressures of two chambers that leak into each other (Pa) to within [`NEAR`]: from the flow per root of pressure of
/// the edges from the supply to the first and to the second, what the piston takes from each, the leakage between them and to the
/// tank, then the pressures of [`Shared`]. Zero without leakage, where nothing follows from it.
pub(super) static DIFFERENCE: Search = Search {
    name: "vpm_chamber_difference",
    arguments: 10,
    run: difference,
    source: &[include_str!("pressure.c"), include_str!("difference.c")],
};

fn difference(arguments: &[f64; ARGUMENTS]) -> f64 {
    let [forward, backward, swept_a, swept_b, leakage, external, supply, tank, vapour, transition, ..] = *arguments;
    if leakage == 0.0 {
        return 0.0;
    }
    let shared = Shared { external, supply, tank, vapour, transition };
    let (a, b) = (Side { open: [forward, backward], shared }, Side { open: [backward, forward], shared });
    let most = a.pressure(swept_a).0 - b.pressure(swept_b).0;
    if most == 0.0 {
        return 0.0;
    }
    let gap = |difference: f64| {
        let leak = leakage * difference;
        let ((a, by_a), (b, by_b)) = (a.pressure(swept_a + leak), b.pressure(swept_b - leak));
        (a - b - difference, leakage * (by_a + by_b) - 1.0)
    };
    falling_zero(most, [most.min(0.0), most.max(0.0)], NEAR * supply, gap)
}

/// What both chambers have in common.
#[derive(Clone, Copy)]
struct Shared {
    /// Laminar leakage to the tank, m^3/(s Pa).
    external: f64,
    supply: f64,
    tank: f64,
    vapour: f64,
    transition: f64,
}

/// A chamber with its two edges.
struct Side {
    /// Flow per root of pressure through the edges to the supply and to the tank, m^3/(s sqrt(Pa)).
    open: [f64; 2],
    shared: Shared,
}

impl Side {
    /// Pressure (Pa) in the search where `taken` (m^3/s) leaves the chamber, and its change with that. Leakage to the
    /// tank leaves the chamber too.
    fn pressure(&self, taken: f64) -> (f64, f64) {
        let Shared { external, supply, tank, vapour, transition } = self.shared;
        let net = |p: f64| {
            let (to_supply, to_tank) = (self.root(supply - p), self.root(p - tank));
            let [filling, emptying] = self.open;
            let flow = filling * to_supply.0 - emptying * to_tank.0 - external * (p - tank) - taken;
            (flow, -(filling * to_supply.1 + emptying * to_tank.1 + external))
        };
        if net(vapour).0 <= 0.0 {
            return (vapour, 0.0);
        }
        let wide = self.open[0].max(self.open[1]);
        let most = supply + transition + (taken / wide).powi(2);
        let mut found = falling_zero(self.turbulent(taken), [vapour, most], NEAR * supply, net);
        if found < vapour {
            found = vapour;
        }
        (found, 1.0 / net(found).1)
    }

    /// Signed root of a pressure drop in the search and its slope, see [`super::Orifice`].
    fn root(&self, drop: f64) -> (f64, f64) {
        let (size, transition) = (drop.abs(), self.shared.transition);
        if size < transition {
            let (share, root) = (drop / transition, transition.sqrt());
            return (root * share * (3.0 - share.abs()) * 0.5, (1.5 - share.abs()) / root);
        }
        let root = size.sqrt();
        (root.copysign(drop), 0.5 / root)
    }

    /// Pressure in the search that lets `taken` (m^3/s) pass, in closed form without leakage, with turbulent edges.
    ///
    /// Law: `f sqrt(ps - p) - e sqrt(p - pt) = taken` with f and e of both edges. Between the two pressures `p = pt + (ps - pt) s^2` gives
    /// `f sqrt(1 - s^2) = c + e s`, `c = taken / sqrt(ps - pt)`; beyond, both edges flow the same way.
    fn turbulent(&self, taken: f64) -> f64 {
        let ([filling, emptying], Shared { supply, tank, .. }) = (self.open, self.shared);
        let range = supply - tank;
        let share = taken / range.sqrt();
        let beyond = |near: f64, far: f64| {
            let root = (share * share - far * far)
                / (share.abs() * near + far * (share * share + (near * near - far * far)).max(0.0).sqrt());
            range * root * root
        };
        if share > filling {
            return tank - beyond(emptying, filling);
        }
        if share < -emptying {
            return supply + beyond(filling, emptying);
        }
        let square = filling * filling + emptying * emptying;
        let s = (filling * (square - share * share).max(0.0).sqrt() - emptying * share) / square;
        tank + range * s * s
    }
}

/// Search for the zero of a falling function between `low` and `high`, from `start`. Newton's steps, and halves of the
/// bracket where those leave it or do not shrink, as around the root of a root, which they would jump across for ever
/// (Press et al. 2007, "Numerical Recipes", section 9.4).
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
