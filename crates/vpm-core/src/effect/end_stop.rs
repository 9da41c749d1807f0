//! Ends of a joint's way.

use super::{Law, law};
use crate::scalar::Scalar;

/// Over which share of its own force the push of a stop that rebounds fades to none.
const FADE: f64 = 0.1;

law! {
    /// End stops: springs that push back beyond both ends of the way, with damping in proportion to the depth, and that never pull.
    ///
    /// Law: `tau = -stiffness (p(q - high) r(damping v) - p(low - q) r(-damping v))`, tau in N or N m, q in m or rad, v in m/s or rad/s, with
    /// the depth `p(x) = 1/2 (x + sqrt(x^2 + width^2))`, zero far before the stop and `x` far beyond, and
    /// `r(y) = 1/2 (y + b + sqrt((y + b)^2 + e^2))`, e = 0.1 and b = 1 - e^2/4, which is `1 + y` but for a rounded end at zero, and 1 at rest.
    /// Source: Hunt & Crossley 1975, "Coefficient of restitution interpreted as damping in vibroimpact", J. Appl. Mech. 42, with exponent 1;
    /// rounding by hyperbolas of which the sharp corners are the asymptotes.
    /// Checked: pushes back only; takes energy out of every closed way, for r grows with y; potential and chord against the effort.
    EndStop {
        /// Effort per depth, N/m or N m/rad.
        stiffness: Any,
        /// Share by which the effort grows per approaching speed, s/m or s/rad.
        damping: Any,
        /// Lower end of the way, m or rad.
        low: Any,
        /// Upper end of the way, m or rad.
        high: Any,
        /// Way over which a contact closes, m or rad.
        width: Positive,
    }
}

impl<S: Scalar> Law<S> for EndStop<S> {
    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        self.stiffness * (self.depth(self.low - q) - self.depth(q - self.high))
    }

    #[inline]
    fn resistance(&self, q: S, v: S) -> S {
        let push = self.damping * v;
        let chords = self.depth(q - self.high) * chord(push) + self.depth(self.low - q) * chord(-push);
        self.stiffness * self.damping * chords
    }

    #[inline]
    fn potential(&self, q: S) -> S {
        self.stiffness * (self.area(q - self.high) + self.area(self.low - q))
    }
}

impl<S: Scalar> EndStop<S> {
    /// Depth beyond a stop.
    #[inline]
    fn depth(&self, way: S) -> S {
        let (square, distance) = (self.width * self.width, self.distance(way));
        way.if_negative(|| square / (distance - way), || way + distance) * 0.5
    }

    /// Integral of the depth in an end stop.
    #[inline]
    fn area(&self, way: S) -> S {
        let size = ((way.abs() + self.distance(way)) / self.width).ln();
        let signed = way.if_negative(|| -size, || size);
        (way * self.depth(way) * 2.0 + self.width * self.width * signed) * 0.25
    }

    #[inline]
    fn distance(&self, way: S) -> S {
        (way * way + self.width * self.width).sqrt()
    }
}

/// Chord of an end stop, `(r(y) - 1)/y`, without a division by what may vanish.
#[inline]
fn chord<S: Scalar>(y: S) -> S {
    let (b, at_rest) = (1.0 - 0.25 * FADE * FADE, 1.0 + 0.25 * FADE * FADE);
    let root = ((y + b) * (y + b) + FADE * FADE).sqrt();
    ((y + 2.0 * b) / (root + at_rest) + 1.0) * 0.5
}
