//! A force that was read off data and that no law of physics stands behind.

use std::f64::consts::TAU;

use serde::Deserialize;

use super::{Domain, Law, tanh_ratio, within_largest};
use crate::scalar::Scalar;

/// Empirical force of a joint: a short sum of terms that a fit chose. It describes a record; it explains nothing.
///
/// Law: with `x = (q - middle)/reach` and `y = v/speed`, both held at -1 and 1 outside of the range that was seen, `s = tanh(v /
/// transition_velocity)`, `phi = 2 pi q / period` and u the effort of the actuators on the joint,
/// `tau = -(at_rest + viscous_part + dry_part + load_part)` with
/// `at_rest = constant + position x + position_2 x^2 + position_3 x^3 + cosine cos(phi) + sine sin(phi)`,
/// `viscous_part = viscous y + speed_2 y^2 + drag y|y| + speed_3 y^3 + viscous_position y x + viscous_position_2 y x^2`,
/// `dry_part = s (dry + dry_position x + dry_position_2 x^2 + dry_cosine cos(phi) + dry_sine sin(phi))` and
/// `load_part = |u| (load_dry s + load_cosine cos(phi) + load_sine sin(phi))`;
/// coefficients in N or N m at the edge of the range, those of the load without unit; `middle`, `reach`, `period` in m or rad,
/// velocities in m/s or rad/s. Terms without a coefficient are not there.
/// Source: none but data. Checked: reach, speed and transition velocity must be positive; the share of the load is held within 0.95.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EmpiricalForce<P> {
    /// Middle of the range of positions, m or rad.
    pub middle: P,
    /// Half of that range, m or rad.
    pub reach: P,
    /// Largest speed, m/s or rad/s.
    pub speed: P,
    /// Velocity over which dry terms change their direction, m/s or rad/s.
    pub transition_velocity: P,
    /// Way after which harmonic terms repeat, m or rad; twice the reach if none is given.
    pub period: Option<P>,
    /// Coefficient of 1.
    pub constant: Option<P>,
    /// Coefficient of x.
    pub position: Option<P>,
    /// Coefficient of x^2.
    pub position_2: Option<P>,
    /// Coefficient of x^3.
    pub position_3: Option<P>,
    /// Coefficient of cos(phi).
    pub cosine: Option<P>,
    /// Coefficient of sin(phi).
    pub sine: Option<P>,
    /// Coefficient of y.
    pub viscous: Option<P>,
    /// Coefficient of y^2.
    pub speed_2: Option<P>,
    /// Coefficient of y|y|.
    pub drag: Option<P>,
    /// Coefficient of y^3.
    pub speed_3: Option<P>,
    /// Coefficient of y x.
    pub viscous_position: Option<P>,
    /// Coefficient of y x^2.
    pub viscous_position_2: Option<P>,
    /// Coefficient of s.
    pub dry: Option<P>,
    /// Coefficient of s x.
    pub dry_position: Option<P>,
    /// Coefficient of s x^2.
    pub dry_position_2: Option<P>,
    /// Coefficient of s cos(phi).
    pub dry_cosine: Option<P>,
    /// Coefficient of s sin(phi).
    pub dry_sine: Option<P>,
    /// Coefficient of |u| s.
    pub load_dry: Option<P>,
    /// Coefficient of |u| cos(phi).
    pub load_cosine: Option<P>,
    /// Coefficient of |u| sin(phi).
    pub load_sine: Option<P>,
}

impl<P> EmpiricalForce<P> {
    /// Empirical force over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> EmpiricalForce<T> {
        let (middle, reach, speed) = (f(&self.middle), f(&self.reach), f(&self.speed));
        let transition_velocity = f(&self.transition_velocity);
        let mut each = |term: &Option<P>| term.as_ref().map(&mut *f);
        EmpiricalForce {
            middle,
            reach,
            speed,
            transition_velocity,
            period: each(&self.period),
            constant: each(&self.constant),
            position: each(&self.position),
            position_2: each(&self.position_2),
            position_3: each(&self.position_3),
            cosine: each(&self.cosine),
            sine: each(&self.sine),
            viscous: each(&self.viscous),
            speed_2: each(&self.speed_2),
            drag: each(&self.drag),
            speed_3: each(&self.speed_3),
            viscous_position: each(&self.viscous_position),
            viscous_position_2: each(&self.viscous_position_2),
            dry: each(&self.dry),
            dry_position: each(&self.dry_position),
            dry_position_2: each(&self.dry_position_2),
            dry_cosine: each(&self.dry_cosine),
            dry_sine: each(&self.dry_sine),
            load_dry: each(&self.load_dry),
            load_cosine: each(&self.load_cosine),
            load_sine: each(&self.load_sine),
        }
    }

    /// Parameters of the empirical force and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let shapes = [
            (&self.middle, Domain::Any),
            (&self.reach, Domain::Positive),
            (&self.speed, Domain::Positive),
            (&self.transition_velocity, Domain::Positive),
        ];
        let period = self.period.as_ref().map(|period| (period, Domain::NonZero));
        let terms = self.terms().into_iter().flatten().map(|term| (term, Domain::Any));
        shapes.into_iter().chain(period).chain(terms).collect()
    }

    /// Coefficients of the empirical force.
    fn terms(&self) -> [Option<&P>; 20] {
        [
            &self.constant,
            &self.position,
            &self.position_2,
            &self.position_3,
            &self.cosine,
            &self.sine,
            &self.viscous,
            &self.speed_2,
            &self.drag,
            &self.speed_3,
            &self.viscous_position,
            &self.viscous_position_2,
            &self.dry,
            &self.dry_position,
            &self.dry_position_2,
            &self.dry_cosine,
            &self.dry_sine,
            &self.load_dry,
            &self.load_cosine,
            &self.load_sine,
        ]
        .map(Option::as_ref)
    }
}

/// Term of an empirical force, `coefficient value`, or nothing.
#[inline]
fn times<S: Scalar>(coefficient: Option<S>, value: S) -> S {
    coefficient.map_or(S::zero(), |coefficient| coefficient * value)
}

/// Position in an empirical force, held at -1 and 1.
#[inline]
fn held<S: Scalar>(value: S) -> S {
    value.max(-S::one()).min(S::one())
}

impl<S: Scalar> Law<S> for EmpiricalForce<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        let x = self.place(q);
        let even = times(self.constant, S::one()) + times(self.position_2, x * x);
        let odd = times(self.position, x) + times(self.position_3, x * x * x);
        -(even + odd + self.harmonics(q, self.cosine, self.sine))
    }

    #[inline]
    fn resistance(&self, q: S, v: S) -> S {
        let (x, y) = (self.place(q), held(v / self.speed));
        // y/v: beyond the largest speed the effort stays what it is there.
        let per_velocity = self.speed.if_less(v.abs(), || v.abs().recip(), || self.speed.recip());
        let viscous = times(self.viscous, S::one())
            + times(self.speed_2, y)
            + times(self.drag, y.abs())
            + times(self.speed_3, y * y)
            + times(self.viscous_position, x)
            + times(self.viscous_position_2, x * x);
        let dry = times(self.dry, S::one())
            + times(self.dry_position, x)
            + times(self.dry_position_2, x * x)
            + self.harmonics(q, self.dry_cosine, self.dry_sine);
        viscous * per_velocity + dry * tanh_ratio(v / self.transition_velocity) / self.transition_velocity
    }

    #[inline]
    fn follows_load(&self) -> bool {
        self.load_dry.is_some() || self.load_cosine.is_some() || self.load_sine.is_some()
    }

    #[inline]
    fn share_of_load(&self, q: S, v: S, _: S) -> S {
        let dry = times(self.load_dry, (v / self.transition_velocity).tanh());
        within_largest(dry + self.harmonics(q, self.load_cosine, self.load_sine))
    }

    #[inline]
    fn resistance_per_load(&self, v: S, _: S) -> S {
        times(self.load_dry, tanh_ratio(v / self.transition_velocity) / self.transition_velocity)
    }
}

impl<S: Scalar> EmpiricalForce<S> {
    #[inline]
    fn place(&self, q: S) -> S {
        held((q - self.middle) / self.reach)
    }

    #[inline]
    fn harmonics(&self, q: S, cosine: Option<S>, sine: Option<S>) -> S {
        if cosine.is_none() && sine.is_none() {
            return S::zero();
        }
        let period = self.period.unwrap_or(self.reach * 2.0);
        let (s, c) = (q * TAU / period).sin_cos();
        times(cosine, c) + times(sine, s)
    }
}
