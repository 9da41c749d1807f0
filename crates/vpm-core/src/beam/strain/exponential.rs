//! The exponential of a twist and its derivative.

use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Twist, Vector3};

/// The pose `exp(twist)` that a body reaches after moving with that constant twist, in its own axes, for a unit of time.
///
/// Law: with rotation vector w, `phi = |w|` and W the matrix of `w x`: `R = 1 + a W + b W^2`, `t = (1 + b W + c W^2) v`,
/// `a = sin(phi) / phi`, `b = (1 - cos(phi)) / phi^2`, `c = (phi - sin(phi)) / phi^3`, all three as power series in `phi^2`, so that
/// they and their derivatives hold at zero. Source: Murray, Li & Sastry 1994, "A Mathematical Introduction to Robotic Manipulation",
/// equations 2.14 and 2.36. Checked: to rounding up to a full turn, which is more than a piece of a beam may bend.
pub fn exponential<S: Scalar>(twist: Twist<S>) -> Pose<S> {
    let (w, v) = (twist.angular, twist.linear);
    let square = w.dot(w);
    let [a, b, c] = [1, 2, 3].map(|first| series(square, first));
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|unit| {
        let unit = Vector3::from_f64(unit);
        let once = w.cross(unit);
        unit + once * a + w.cross(once) * b
    });
    let once = w.cross(v);
    Pose::new(Matrix3 { columns }, v + once * b + w.cross(once) * c)
}

/// `sum_k (-x)^k / (2 k + first)!`, for x up to about 40.
fn series<S: Scalar>(x: S, first: u32) -> S {
    let mut term = S::from_f64(1.0 / f64::from((1..=first).product::<u32>()));
    let mut sum = term;
    for k in (first..first + 60).step_by(2).map(f64::from) {
        term = -(term * x) / ((k + 1.0) * (k + 2.0));
        sum += term;
        // Derivatives may lag behind the value by a few terms.
        if k > 12.0 && term.re().abs() < 1e-20 {
            break;
        }
    }
    sum
}

/// The twist, in the moved body's axes, of `exp(twist)` when `twist` changes at `rate`.
///
/// Law: `sum_k (-1)^k / (k + 1)! ad^k rate`, `ad = twist x` (Iserles et al. 2000, equation 2.46). Checked: against the derivative of
/// [`exponential`].
pub fn tangent<S: Scalar>(twist: Twist<S>, rate: Twist<S>) -> Twist<S> {
    let size = twist.angular.dot(twist.angular).re().sqrt();
    let (mut term, mut sum) = (rate, rate);
    let (mut bound, mut spare) = (1.0, 4);
    for k in (1..60).map(f64::from) {
        term = twist.cross(term) * S::from_f64(-1.0 / (k + 1.0));
        sum += term;
        bound *= size / (k + 1.0);
        // A few terms more than the rotation alone needs: the translation, and derivatives, lag behind.
        if bound < 1e-17 {
            spare -= 1;
        }
        if spare == 0 {
            break;
        }
    }
    sum
}
