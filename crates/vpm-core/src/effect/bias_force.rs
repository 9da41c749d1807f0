//! A constant load.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Bias force of a joint: a constant load that the drive must overcome (a cable's pull, an unbalanced spring, an amplifier's offset).
    ///
    /// Law: `tau = -force`, both in N or N m. It has the potential `force q`.
    /// Source: the offset term of inverse dynamic identification, Khalil & Dombre 2002, "Modeling, Identification and Control of Robots",
    /// section 12.2. Checked: any finite value is accepted.
    BiasForce {
        /// Load against positive motion, N or N m.
        force: Any,
    }
}

impl<S: Scalar> Law<S> for BiasForce<S> {
    #[inline]
    fn effort_at_rest(&self, _: S) -> S {
        -self.force
    }

    #[inline]
    fn damping(&self) -> Option<S> {
        Some(S::zero())
    }

    /// Potential of a bias force: zero at q = 0.
    #[inline]
    fn potential(&self, q: S) -> S {
        self.force * q
    }
}
