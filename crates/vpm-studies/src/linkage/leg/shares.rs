//! How much of the effort is inertia, velocity and weight: the indices mu_M, mu_V and mu_G over the workspace.

use super::Leg;
use vpm_core::dynamics::Terms;
use vpm_core::{Error, Result};

/// What the norm of one term is divided by.
///
/// Printed is a ratio to the torque (eq 2.109), which is unbounded since the torque passes through zero; the published
/// averages are those of [`ShareDefinition::SumOfNorms`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShareDefinition {
    /// `|M a| + |V| + |G|`: the three shares add up to one at every instant.
    #[default]
    SumOfNorms,
    /// The norm of the componentwise `|M a| + |V| + |G|`.
    NormOfAbsoluteSum,
    /// `sqrt(|M a|^2 + |V|^2 + |G|^2)`.
    RootOfSquares,
    /// `|M a + V + G|`, the printed one: large wherever the torque is small.
    Torque,
}

/// Limits of joint rates (rad/s) and accelerations (rad/s^2), the same for both joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DutyCycle {
    /// Largest rate in rad/s.
    pub rate: f64,
    /// Largest acceleration in rad/s^2.
    pub acceleration: f64,
}

impl DutyCycle {
    /// Low dynamics.
    pub const LOW: Self = Self { rate: 2.5, acceleration: 1.25 };
    /// Medium dynamics.
    pub const MEDIUM: Self = Self { rate: 5.0, acceleration: 2.5 };
    /// High dynamics.
    pub const HIGH: Self = Self { rate: 10.0, acceleration: 5.0 };
}

/// The motions and angles over which the shares are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShareStudy {
    /// What a share is.
    pub definition: ShareDefinition,
    /// How fast the joints move.
    pub duty: DutyCycle,
    /// Equispaced values of each rate and each acceleration, limits included. An odd number includes standstill, which
    /// makes the largest share of the weight 1 whatever the machine.
    pub samples: usize,
    /// Range of each joint angle in rad.
    pub ranges: [[f64; 2]; 2],
    /// Equispaced values of each joint angle, limits included.
    pub counts: [usize; 2],
}

impl ShareStudy {
    /// Study of the thesis for the leg's shares: six values of each rate and acceleration. Angles are every 10 deg in
    /// -40..60 and -140..-20 deg.
    pub fn of(duty: DutyCycle) -> Self {
        let ranges = [[-40.0_f64, 60.0], [-140.0, -20.0]].map(|range| range.map(f64::to_radians));
        Self { definition: ShareDefinition::default(), duty, samples: 6, ranges, counts: [11, 13] }
    }
}

/// Shares of the three terms, each its largest value over all sampled motions, averaged over the workspace (fractions).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// mu_M, of `M a`.
    pub inertia: f64,
    /// mu_V, of V.
    pub velocity: f64,
    /// mu_G, of G.
    pub gravity: f64,
}

impl Leg {
    /// The shares of inertia, velocity and weight in the effort, averaged over the workspace.
    ///
    /// Source: eq 2.109 and section 2.4.2, with the denominator as chosen. Checked: the published averages.
    pub fn shares(&self, study: &ShareStudy) -> Result<Shares> {
        check(study)?;
        let ([first, second], [rows, columns]) = (study.ranges, study.counts);
        let mut total = [0.0; 3];
        for i in 0..rows {
            for j in 0..columns {
                let largest = self.largest([spread(first, rows, i), spread(second, columns, j)], study);
                total.iter_mut().zip(largest).for_each(|(sum, share)| *sum += share);
            }
        }
        let [inertia, velocity, gravity] = total.map(|sum| sum / (rows * columns) as f64);
        Ok(Shares { inertia, velocity, gravity })
    }

    /// The largest of each share over all sampled motions in one configuration `q` (rad): a point of the map whose mean is
    /// [`Leg::shares`]. Ranges and counts of the study are not used.
    pub fn shares_at(&self, q: [f64; 2], study: &ShareStudy) -> Result<Shares> {
        check(study)?;
        let [inertia, velocity, gravity] = self.largest(q, study);
        Ok(Shares { inertia, velocity, gravity })
    }

    fn largest(&self, q: [f64; 2], study: &ShareStudy) -> [f64; 3] {
        let DutyCycle { rate, acceleration } = study.duty;
        let grid = |limit: f64| {
            let value = move |k| spread([-limit, limit], study.samples, k);
            (0..study.samples * study.samples).map(move |k| [value(k / study.samples), value(k % study.samples)])
        };
        let mut largest = [0.0_f64; 3];
        for v in grid(rate) {
            let terms = self.terms(q, v);
            for a in grid(acceleration) {
                for (most, share) in largest.iter_mut().zip(study.definition.shares(&terms, &a)) {
                    *most = most.max(share);
                }
            }
        }
        largest
    }
}

impl ShareDefinition {
    /// The shares of `M a`, V and G.
    pub fn shares(self, terms: &Terms<f64, 2>, a: &[f64; 2]) -> [f64; 3] {
        let parts = [terms.inertia(a), terms.velocity, terms.gravity];
        let norms = parts.map(norm);
        let sum = |weight: fn(f64) -> f64| norm([0, 1].map(|k| parts.iter().map(|part| weight(part[k])).sum()));
        let whole = match self {
            Self::SumOfNorms => norms.iter().sum(),
            Self::NormOfAbsoluteSum => sum(f64::abs),
            Self::RootOfSquares => norms.iter().map(|norm| norm * norm).sum::<f64>().sqrt(),
            Self::Torque => sum(|part| part),
        };
        norms.map(|norm| norm / whole)
    }
}

fn norm([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Value number `k` of `count` equispaced ones over a range for shares, ends included.
fn spread([low, high]: [f64; 2], count: usize, k: usize) -> f64 {
    low + (high - low) * k as f64 / (count - 1) as f64
}

fn check(study: &ShareStudy) -> Result<()> {
    let counts = [("samples", study.samples), ("counts[0]", study.counts[0]), ("counts[1]", study.counts[1])];
    if let Some((_, count)) = counts.into_iter().find(|(_, count)| *count < 2) {
        let (setting, repair) = ("every number of values of a share study", "give both limits at least");
        return Err(Error::Setting { setting, condition: "be 2 or more".to_owned(), value: count as f64, repair });
    }
    let limits = [("duty.rate", study.duty.rate), ("duty.acceleration", study.duty.acceleration)];
    let angles = study.ranges.as_flattened().iter().map(|&angle| ("ranges", angle));
    match limits.into_iter().chain(angles).find(|(_, value)| !value.is_finite()) {
        Some((name, value)) => Err(Error::NonFinite { path: format!("share study {name}"), value }),
        None => Ok(()),
    }
}
