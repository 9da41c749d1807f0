//! Friction with memory: a force that depends on the path of the joint.

use super::{MemoryChords, MemoryLaw, law};
use crate::scalar::Scalar;

law! {
    /// Hysteresis of a joint: a normalised Bouc-Wen element, between a spring for small ways and dry friction for large ones.
    ///
    /// Law: `tau = -force z` with tau and `force` in N or N m and the memory z a state without unit,
    /// `dz/dt = (v / displacement) (1 - |z|)` while it is being loaded, `v z >= 0`, and `(v / displacement) (1 + shape |z|)` while it is being
    /// unloaded; v in m/s or rad/s, `displacement` in m or rad. About z = 0 it is a spring of stiffness `force / displacement`, on reversal
    /// one that is `1 + shape` times as stiff; along a long way z tends to the sign of the motion. With `shape = 1` it is Dahl's law of
    /// pre-sliding, `dz/dt = (v - |v| z) / displacement`; with `shape = 0` it gives way elastically and loads along an exponential.
    ///
    /// It depends on the path alone, not on the speed; |z| never leaves 1, or falls towards it. For `force >= 0` and `shape >= 0` it
    /// only takes energy: what is stored is `force displacement` times the integral of `s / (1 + shape s)` from 0 to |z|.
    /// Source: Ikhouane & Rodellar 2007, "Systems with Hysteresis: Analysis, Identification and Control using the Bouc-Wen Model", section
    /// 2.5 (normalised form, with exponent 1, rho = 1/displacement and sigma = (1 + shape)/2); Dahl 1968, "A solid friction model", Aerospace
    /// Corporation TOR-158(3107-18). Checked: Dahl's closed form, energy over closed loops, independence of the speed.
    Hysteresis {
        /// Resistance after a long way in one direction, N or N m.
        force: Any,
        /// Way over which it builds up: after that way from z = 0, 63 % are there, m or rad.
        displacement: Positive,
        /// Stiffness on reversal from the full resistance over that about z = 0, less 1.
        shape: NonNegative,
    }
}

impl<S: Scalar> MemoryLaw<S> for Hysteresis<S> {
    /// Chords of a hysteresis: the fading is not negative.
    #[inline]
    fn chords(&self, v: S, z: S) -> MemoryChords<S> {
        let loading = v.abs() / self.displacement;
        let fading = (v * z).if_negative(|| loading * self.shape, || loading);
        let (push, gain, zero) = (self.force, self.displacement.recip(), S::zero());
        MemoryChords { push, resistance: zero, gain, source: zero, fading }
    }

    /// Memory of a hysteresis after a way.
    ///
    /// Law: with `u = |way| / displacement` and y = z along the motion,
    /// `y+ = (y + (1 - e^(-b u))/b) - y (1 - e^(-b u))` for y < 0, b the shape, until y = 0 at `u = ln(1 - b y)/b`;
    /// from there `1 - y` falls by `e^(-u)`.
    #[inline]
    fn advance(&self, z: S, way: S, _: S) -> S {
        let along = way.if_negative(|| -z, || z);
        let left = way.abs() / self.displacement;
        let load = |along: S, left: S| along - (along - 1.0) * -(-left).exp_m1();
        let unload = || {
            let to_zero = logarithm(self.shape, -along);
            let rise = || {
                let rise = saturation(self.shape, left);
                along + rise - along * self.shape * rise
            };
            to_zero.if_less(left, || load(S::zero(), left - to_zero), rise)
        };
        let moved = along.if_negative(unload, || load(along, left));
        way.if_negative(|| -moved, || moved)
    }
}

impl<S: Scalar> Hysteresis<S> {
    /// Energy in J stored in a hysteresis, which unloading gives back.
    #[inline]
    pub fn stored(&self, z: S) -> S {
        let (size, b) = (z.abs(), self.shape);
        // s/(1 + b s) integrates to (s - ln(1 + b s)/b)/b.
        let series = || size * size * 0.5 - b * size * size * size * (1.0 / 3.0);
        let share = (b * size).if_less(S::from_f64(SMALL), series, || (size - logarithm(b, size)) / b);
        self.force * self.displacement * share
    }
}

/// Below this the laws of a shape are their series, whose next terms are below a millionth of a millionth.
const SMALL: f64 = 1e-5;

/// Saturation of a hysteresis, (1 - exp(-b u))/b; u where b vanishes.
#[inline]
fn saturation<S: Scalar>(b: S, u: S) -> S {
    let x = b * u;
    x.if_less(S::from_f64(SMALL), || u * (x * (x * (1.0 / 6.0) - 0.5) + 1.0), || -(-x).exp_m1() / b)
}

/// Logarithm ln(1 + b y)/b in a hysteresis; y where b vanishes.
#[inline]
fn logarithm<S: Scalar>(b: S, y: S) -> S {
    let x = b * y;
    x.if_less(S::from_f64(SMALL), || y * (x * (x * (1.0 / 3.0) - 0.5) + 1.0), || (x + 1.0).ln() / b)
}
