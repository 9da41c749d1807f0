//! A spring and a damper along a line, side by side.

use serde::Deserialize;

use crate::effect::Domain;
use crate::scalar::Scalar;

/// Spring and damper between the ends of a line: a compliant actuator that holds a length.
///
/// Law: `F = k (s_0 - s) - c ds/dt`, F in N, positive when it pushes the ends apart (as on every line), s in m.
/// Source: section 3.4.1 of the thesis. Checked: power is minus the rate of the potential, minus `c (ds/dt)^2`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpringDamper<P> {
    /// k, N/m.
    pub stiffness: P,
    /// `s_0`, length without force, m.
    pub free_length: P,
    /// c, N s/m.
    pub damping: P,
}

impl<P> SpringDamper<P> {
    /// Spring-damper over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> SpringDamper<T> {
        let Self { stiffness, free_length, damping } = self;
        SpringDamper { stiffness: f(stiffness), free_length: f(free_length), damping: f(damping) }
    }

    /// Parameters of the spring-damper and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let Self { stiffness, free_length, damping } = self;
        vec![(stiffness, Domain::Any), (free_length, Domain::Any), (damping, Domain::Any)]
    }
}

impl<S: Scalar> SpringDamper<S> {
    /// Force in N of the spring-damper that pushes the ends apart, at length `s` (m) and its rate (m/s).
    #[inline]
    pub fn force(&self, s: S, rate: S) -> S {
        self.stiffness * (self.free_length - s) - self.damping * rate
    }

    /// Energy in the spring in J: `k (s - s_0)^2 / 2`.
    #[inline]
    pub fn potential(&self, s: S) -> S {
        let stretch = s - self.free_length;
        self.stiffness * stretch * stretch * 0.5
    }
}
