//! A visco-elastic element along a line: stiffer in fast motion than in slow motion.

use serde::Deserialize;

use crate::effect::Domain;
use crate::scalar::Scalar;

/// A spring beside a Maxwell element (a spring and a damper in a row), between the ends of a line.
///
/// Law: `F + tau dF/dt = k_0 (s - s_0) + tau (k_0 + k_1) ds/dt`, with `tau = c_1 / k_1`; F in N, positive when it **pulls the ends together**
/// (the force on a line, which pushes them apart, is -F), s in m. As one state x, the stretch of the damper in m:
/// `F = k_0 (s - s_0) + k_1 (s - s_0 - x)` with `tau dx/dt = s - s_0 - x`, which needs no rate of s. For s linear over an interval h,
/// with `a = h / tau` and `f = F - k_0 (s - s_0)`, the solution is `f(h) = f(0) e^(-a) + k_1 (s(h) - s(0)) (1 - e^(-a)) / a`.
/// Source: eq 5.45 of the thesis; the interval is its exact solution, in the place of the first-order differences 5.49 to 5.52.
/// Checked: the equation itself, relaxation from `k_0 + k_1` to `k_0`, one interval against many, power balance.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Maxwell<P> {
    /// `k_0`, stiffness at rest, N/m.
    pub stiffness: P,
    /// `s_0`, length without force at rest, m.
    pub free_length: P,
    /// `k_1`, what fast motion adds to the stiffness, N/m.
    pub fast_stiffness: P,
    /// tau, time in which that fades, s.
    pub relaxation_time: P,
}

impl<P> Maxwell<P> {
    /// Maxwell element over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Maxwell<T> {
        let Self { stiffness, free_length, fast_stiffness, relaxation_time } = self;
        Maxwell {
            stiffness: f(stiffness),
            free_length: f(free_length),
            fast_stiffness: f(fast_stiffness),
            relaxation_time: f(relaxation_time),
        }
    }

    /// Parameters of the Maxwell element and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let Self { stiffness, free_length, fast_stiffness, relaxation_time } = self;
        vec![
            (stiffness, Domain::Any),
            (free_length, Domain::Any),
            (fast_stiffness, Domain::Any),
            (relaxation_time, Domain::Positive),
        ]
    }
}

impl<S: Scalar> Maxwell<S> {
    /// Force in N of the Maxwell element, at length `s` (m) with the damper stretched by `x` (m). It pulls the ends
    /// together.
    #[inline]
    pub fn force(&self, s: S, x: S) -> S {
        let stretch = s - self.free_length;
        self.stiffness * stretch + self.fast_stiffness * (stretch - x)
    }

    /// Rate dx/dt of the Maxwell element's damper in m/s.
    #[inline]
    pub fn rate(&self, s: S, x: S) -> S {
        (s - self.free_length - x) / self.relaxation_time
    }

    /// Settled stretch (m) of the Maxwell element's damper at length `s` (m): the state after standing.
    #[inline]
    pub fn settled(&self, s: S) -> S {
        s - self.free_length
    }

    /// Force (N) of the Maxwell element after an interval `time_step` (s), from `force` (N). The length goes evenly
    /// from `start` to `end` (m).
    #[inline]
    pub fn interval(&self, force: S, start: S, end: S, time_step: f64) -> S {
        let inverse = self.relaxation_time.recip() * time_step;
        let decay_less_one = (-inverse).exp_m1();
        let fast = force - self.stiffness * (start - self.free_length);
        let built = -(self.fast_stiffness * (end - start) * decay_less_one * self.relaxation_time / time_step);
        self.stiffness * (end - self.free_length) + fast * (decay_less_one + 1.0) + built
    }

    /// Energy in both springs of the Maxwell element in J.
    #[inline]
    pub fn potential(&self, s: S, x: S) -> S {
        let stretch = s - self.free_length;
        (self.stiffness * stretch * stretch + self.fast_stiffness * (stretch - x) * (stretch - x)) * 0.5
    }

    /// Power in W that the Maxwell element's damper takes: `k_1 (s - s_0 - x)^2 / tau`.
    #[inline]
    pub fn dissipation(&self, s: S, x: S) -> S {
        let fast = s - self.free_length - x;
        self.fast_stiffness * fast * fast / self.relaxation_time
    }
}
