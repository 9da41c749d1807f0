//! The force between two bodies that press on each other.

use serde::Deserialize;

use super::step;
use crate::effect::Domain;
use crate::scalar::{Choice, Scalar};

/// Normal force of a contact: a hardening spring with a damper that fades in with the depth.
///
/// Law: `F = max(0, k d^n + c step(d / d_c) d')` for a depth d > 0 and 0 otherwise; F in N, d in m, positive when the bodies overlap,
/// its rate d' in m/s, positive when they approach. `step` is the cubic step `3 t^2 - 2 t^3` from 0 to 1, so `d_c` is the depth at which
/// the damper is fully there, not a depth of rest. The contact pushes and never pulls: where the damper would hold a leaving body back, F
/// is zero. F is continuous, also at touch-down at speed; for n > 1 its slope is continuous there too. It has a corner where the pull is
/// cut off, and with n < 1 an infinite slope at the surface.
/// Source: eq 3.41 of the thesis with its units put right (k in N/mm^n, c in N s/mm, 0.1 mm is `d_c`), the impact function of
/// multibody programs. Checked: deepest point of an undamped impact, depth of rest, and that no motion gains energy from it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalContact<P> {
    /// k, force at a depth of 1 m, N/m^n.
    pub stiffness: P,
    /// n, how the spring hardens; 1 is linear, 3/2 that of Hertz.
    pub exponent: P,
    /// c, force per speed at full depth, N s/m.
    pub damping: P,
    /// `d_c`, depth from which the damping is c, m.
    pub damping_depth: P,
}

impl<P> NormalContact<P> {
    /// Normal contact over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> NormalContact<T> {
        let Self { stiffness, exponent, damping, damping_depth } = self;
        NormalContact {
            stiffness: f(stiffness),
            exponent: f(exponent),
            damping: f(damping),
            damping_depth: f(damping_depth),
        }
    }

    /// Parameters of normal contact and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let Self { stiffness, exponent, damping, damping_depth } = self;
        vec![
            (stiffness, Domain::NonNegative),
            (exponent, Domain::Positive),
            (damping, Domain::NonNegative),
            (damping_depth, Domain::Positive),
        ]
    }
}

impl<S: Scalar> NormalContact<S> {
    /// Normal force of a contact in N that pushes the bodies apart, at depth `d` (m) and its rate (m/s).
    #[inline]
    pub fn force(&self, d: S, rate: S) -> S {
        let push = || (self.spring(d) + self.damping * step(d / self.damping_depth) * rate).max(S::zero());
        touching(d, S::zero(), push)
    }

    /// Normal force of a contact's spring in N.
    #[inline]
    pub fn spring(&self, d: S) -> S {
        touching(d, S::zero(), || self.stiffness * (self.exponent * d.ln()).exp())
    }

    /// Slopes of normal contact at depth `d` (m): spring in N/m, resistance of the damper in N s/m.
    pub fn slopes(&self, d: S) -> [S; 2] {
        let slopes = || [self.exponent * self.spring(d) / d, self.damping * step(d / self.damping_depth)];
        touching(d, [S::zero(); 2], slopes)
    }

    /// Energy of the spring in normal contact in J: `k d^(n+1) / (n + 1)`.
    #[inline]
    pub fn potential(&self, d: S) -> S {
        touching(d, S::zero(), || self.spring(d) * d / (self.exponent + 1.0))
    }

    /// Power lost in normal contact in W, `(F - k d^n) d'`. It is never negative, whether the damper acts or the pull
    /// is cut off.
    #[inline]
    pub fn dissipation(&self, d: S, rate: S) -> S {
        (self.force(d, rate) - self.spring(d)) * rate
    }
}

/// Value in normal contact, else `apart`. A depth that has no finite inverse counts as none, so that derivatives stay
/// finite.
#[inline]
fn touching<S: Scalar, T: Choice<S>>(d: S, apart: T, contact: impl FnOnce() -> T) -> T {
    d.if_less(S::from_f64(f64::MIN_POSITIVE), || apart, contact)
}
