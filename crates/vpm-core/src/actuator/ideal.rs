//! An effort in proportion to a command.

use serde::Deserialize;

use super::Saturation;
use crate::effect::Domain;
use crate::scalar::Scalar;

/// Ideal drive: an effort proportional to what reaches it (a current-driven motor with its transmission), up to a limit.
///
/// Law: `tau = gain x`, cut at ±limit; tau and limit in N or N m, x in the command's unit.
/// Source: Khalil & Dombre 2002, "Modeling, Identification and Control of Robots", section 12.1 (drive gain). Checked: any finite
/// gain is accepted; the limit must be positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ideal<P> {
    /// Effort per command.
    pub gain: P,
    /// Largest effort.
    #[serde(default = "super::none")]
    pub limit: Option<Saturation<P>>,
}

impl<P> Ideal<P> {
    /// Ideal drive over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Ideal<T> {
        Ideal { gain: f(&self.gain), limit: self.limit.as_ref().map(|limit| limit.map(f)) }
    }

    /// Parameters of the ideal drive and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut domains = vec![(&self.gain, Domain::Any)];
        domains.extend(self.limit.as_ref().map(|limit| (&limit.limit, Domain::Positive)));
        domains
    }
}

impl<S: Scalar> Ideal<S> {
    /// Effort that the ideal drive delivers.
    #[inline]
    pub fn effort(&self, x: S) -> S {
        let effort = self.gain * x;
        self.limit.map_or(effort, |limit| limit.apply(effort))
    }

    /// Slope of the ideal drive's effort by `x`: nothing beyond the limit.
    #[inline]
    pub fn slope(&self, x: S) -> S {
        let Some(limit) = self.limit else { return self.gain };
        limit.limit.if_less((self.gain * x).abs(), S::zero, || self.gain)
    }
}
