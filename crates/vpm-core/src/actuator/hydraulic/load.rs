//! How the pressures of a cylinder come about; both chambers from the load pressure alone.

use serde::Deserialize;

use super::Chambers;
use crate::scalar::Scalar;

/// How the pressures of a cylinder come about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pressures {
    /// Each chamber has a state of its own.
    #[default]
    Chambers,
    /// The load pressure is the state, and both chambers follow from it and the balance of flows: [`chambers_under_load`].
    Load,
    /// None is a state: both chambers follow from what flows in and out, see [`super::Balance`].
    QuasiStatic,
}

/// Pressures (Pa) of both chambers at a load pressure `load = pa - alpha pb` (Pa) and an `opening` of the valve, between `supply`
/// and `tank` (Pa), of a cylinder with the area ratio `alpha`.
///
/// Law: a piston that takes `q` into a gives `alpha q` out of b, through equal edges, so that their drops are as 1 to `alpha^2`:
/// `u > 0: (pb - pt) = alpha^2 (ps - pa)`, hence `ps - pa = (ps - alpha pt - load) / (1 + alpha^3)`, and
/// `u < 0: (ps - pb) = alpha^2 (pa - pt)`, hence `pa - pt = (load - pt + alpha ps) / (1 + alpha^3)`. With the valve shut nothing
/// flows and any share is possible: `pa + pb = ps + pt` is taken, as at rest.
/// Source: Merritt 1967, "Hydraulic Control Systems", section 5-3 (load pressure and load flow); Jelali & Kroll 2003, "Hydraulic
/// Servo-systems", section 4.3 (single rod). Exact in steady motion without leakage, and for `alpha = 1` with equal chambers.
#[inline]
pub fn chambers_under_load<S: Scalar>(load: S, opening: S, [supply, tank]: [S; 2], alpha: S) -> Chambers<S> {
    let (square, share) = (alpha * alpha, (alpha * alpha * alpha + 1.0).recip());
    let forward = || {
        let drop = (supply - alpha * tank - load) * share;
        [supply - drop, tank + square * drop]
    };
    let backward = || {
        let drop = (load - tank + alpha * supply) * share;
        [tank + drop, supply - square * drop]
    };
    let shut = || {
        let b = (supply + tank - load) / (alpha + 1.0);
        [supply + tank - b, b]
    };
    let [a, b] = opening.if_positive(forward, || opening.if_negative(backward, shut));
    Chambers { a, b }
}
