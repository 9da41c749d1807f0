//! A Maxwell element beside a spring as a difference equation, its spring a polynomial map of drive signal and length.

use crate::error::{Error, NarxError, Result};
use crate::scalar::Scalar;

/// A polynomial of total degree <= 3 in the drive signal u and the length s, in the order `1, u, s, u^2, u s, s^2, u^3, u^2 s, u s^2, s^3`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface(pub [f64; 10]);

impl Surface {
    /// Map of the Maxwell element with the same value everywhere.
    pub fn constant(value: f64) -> Self {
        let mut coefficients = [0.0; 10];
        coefficients[0] = value;
        Self(coefficients)
    }

    /// Value of the Maxwell element's map at (u, s).
    #[inline]
    pub fn at<S: Scalar>(&self, u: S, s: S) -> S {
        let [c, u1, s1, u2, us, s2, u3, u2s, us2, s3] = self.0;
        let in_s = s * (s * (s * s3 + s2) + s1);
        let in_u = u * (u * (u * u3 + u2) + u1);
        in_s + c + in_u + u * s * (u * u2s + us + s * us2)
    }
}

/// How the differential equation becomes a difference equation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MaxwellScheme {
    /// Means and differences over one interval: second order, no second memory.
    #[default]
    Trapezoidal,
    /// Equations 5.49 to 5.52 of the thesis as printed: the new force, a central difference of forces, the old length and its
    /// backward difference. First order; odd and even samples do not see each other, so that a start error stays as two interleaved
    /// sequences which fade by `sqrt(x / (1 + x))` per sample, `x = tau / (2 h)`.
    Printed,
    /// The printed form with the mean of the new force and that of two samples ago, and the central difference of the lengths: second
    /// order with twice the interval.
    CentralMean,
}

/// A spring `k_0 (s - s_0)` beside a Maxwell element (`k_1` and `c_1` in a row): `F + tau dF/dt = k_0 (s - s_0) + tau (k_0 + k_1) ds/dt`,
/// with `tau = c_1 / k_1`, sampled at the interval h. `k_0` and `s_0` are maps of the drive signal u and the length s.
///
/// Trapezoidal: `F' = [(E' + E)/2 + tau (k + k_1)(s' - s)/h + (tau/h - 1/2) F] / (tau/h + 1/2)`, `E = k_0 (s - s_0)`, `k` the mean of
/// `k_0` at both ends, the dash marking the new sample.
///
/// Source: thesis, equations 5.45 and 5.49 to 5.52, and the maps of section 5.2.5. Checked: closed form for a sine, orders of the three
/// schemes, the decay of the interleaved sequences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxwellNarx {
    k0: Surface,
    s0: Surface,
    k1: f64,
    tau_over_h: f64,
    scheme: MaxwellScheme,
}

/// What the element remembers: the last two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaxwellState<S = f64> {
    force: [S; 2],
    length: [S; 2],
    elastic: S,
    stiffness: S,
}

impl MaxwellNarx {
    /// Maxwell element with maps `k0` (N/m) and `s0` (m), `k1` in N/m, `c1` in N s/m, sampled every `step` s. `k0` is
    /// the stiffness, `s0` the free length.
    ///
    /// # Errors
    ///
    /// Numbers that are not finite, a step or a `tau = c1 / k1` that is not positive.
    pub fn new(k0: Surface, s0: Surface, k1: f64, c1: f64, step: f64, scheme: MaxwellScheme) -> Result<Self> {
        let tau = c1 / k1;
        let positive = |setting, value: f64, repair| match value.is_finite() && value > 0.0 {
            true => Ok(()),
            false => Err(Error::Setting { setting, condition: "be positive and finite".to_owned(), value, repair }),
        };
        if let Some(&value) = k0.0.iter().chain(&s0.0).find(|value| !value.is_finite()) {
            return Err(Error::NonFinite { path: "a coefficient of k0 or s0".to_owned(), value });
        }
        positive("the relaxation time c1 / k1 in s", tau, "give k1 and c1 the same sign, neither of them zero")?;
        positive("the time step in s", step, "give the time between samples")?;
        Ok(Self { k0, s0, k1, tau_over_h: tau / step, scheme })
    }

    /// Memory of the Maxwell element from forces (N) and lengths (m) of the last two samples, oldest first. The drive
    /// signal of the last is `u`.
    pub fn start<S: Scalar>(&self, force: [S; 2], u: S, length: [S; 2]) -> MaxwellState<S> {
        let (elastic, stiffness) = self.elastic(u, length[1]);
        MaxwellState { force, length, elastic, stiffness }
    }

    /// Settled force in N of the Maxwell element at drive signal `u` and length `s` (m): that of its spring.
    #[inline]
    pub fn settled<S: Scalar>(&self, u: S, s: S) -> S {
        self.elastic(u, s).0
    }

    /// Elastic force of the Maxwell element, `k_0 (s - s_0)`, and `k_0` at (u, s).
    #[inline]
    fn elastic<S: Scalar>(&self, u: S, s: S) -> (S, S) {
        let stiffness = self.k0.at(u, s);
        (stiffness * (s - self.s0.at(u, s)), stiffness)
    }

    /// Force in N of the Maxwell element at the next sample, where drive signal is `u` and length `s` (m).
    #[inline]
    pub fn step<S: Scalar>(&self, state: &mut MaxwellState<S>, u: S, s: S) -> S {
        let (r, [older, old], [s_older, s_old]) = (self.tau_over_h, state.force, state.length);
        let (elastic, stiffness) = self.elastic(u, s);
        let force = match self.scheme {
            MaxwellScheme::Trapezoidal => {
                let rate = ((stiffness + state.stiffness) * 0.5 + self.k1) * (s - s_old);
                ((elastic + state.elastic) * 0.5 + rate * r + old * (r - 0.5)) / (r + 0.5)
            }
            MaxwellScheme::Printed => {
                let rate = (state.stiffness + self.k1) * (s_old - s_older);
                (state.elastic + rate * r + older * (0.5 * r)) / (1.0 + 0.5 * r)
            }
            MaxwellScheme::CentralMean => {
                let rate = (state.stiffness + self.k1) * 0.5 * (s - s_older);
                (state.elastic + rate * r + older * (0.5 * (r - 1.0))) / (0.5 * (r + 1.0))
            }
        };
        *state = MaxwellState { force: [old, force], length: [s_old, s], elastic, stiffness };
        force
    }

    /// Free run of the Maxwell element: forces in N, the first two given, the rest from its **own** past.
    ///
    /// # Errors
    ///
    /// Drive signal and lengths of different counts or fewer than two, a number that is not finite, a run that leaves `limit`.
    pub fn simulate_free_run(&self, start: [f64; 2], u: &[f64], length: &[f64], limit: f64) -> Result<Vec<f64>> {
        let record = "arrays".to_owned();
        if u.len() != length.len() {
            let (what, found) = ("the drive signal".to_owned(), format!("has {} samples", u.len()));
            let needed = format!("is given {} lengths", length.len());
            return Err(NarxError::Count { what, found, needed, repair: "give one for each sample" }.into());
        }
        let (Some(&first), Some(&second)) = (length.first(), length.get(1)) else {
            return Err(NarxError::Short { record, samples: length.len(), lag: 2, least: 2 }.into());
        };
        for (channel, values) in [("u", u), ("s", length)] {
            if let Some(sample) = values.iter().position(|value| !value.is_finite()) {
                let (channel, value) = (channel.to_owned(), values[sample]);
                return Err(NarxError::NotFinite { record, channel, sample, value }.into());
            }
        }
        let mut state = self.start(start, u[1], [first, second]);
        let mut forces = Vec::with_capacity(u.len());
        forces.extend(start);
        for (sample, (&u, &s)) in u.iter().zip(length).enumerate().skip(2) {
            let value = self.step(&mut state, u, s);
            if !(value.is_finite() && value.abs() <= limit) {
                let output = "F".to_owned();
                return Err(NarxError::Diverged { record, output, sample, value, limit, samples: forces }.into());
            }
            forces.push(value);
        }
        Ok(forces)
    }
}
