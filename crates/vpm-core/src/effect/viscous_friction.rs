//! Friction proportional to speed.

use super::{Law, law};
use crate::scalar::Scalar;

law! {
    /// Viscous friction of a joint: a lubricant's resistance, proportional to the velocity.
    ///
    /// Law: `tau = -viscous v`, with tau in N or N m, v in m/s or rad/s and `viscous` in N s/m or N m s/rad.
    /// Source: Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, "A survey of models, analysis tools and compensation methods for the
    /// control of machines with friction", Automatica 30(7), section 2. Checked: any finite value is accepted.
    ViscousFriction {
        /// Resistance per velocity, N s/m or N m s/rad.
        viscous: Any,
    }
}

impl<S: Scalar> Law<S> for ViscousFriction<S> {
    #[inline]
    fn damping(&self) -> Option<S> {
        Some(self.viscous)
    }
}
