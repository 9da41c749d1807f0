//! The exponential of a twist and its derivative.

use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Twist, Vector3};

/// Terms of the power series, enough for a full turn.
const TERMS: usize = 30;

/// Coefficients of a power series in `-x` for the exponential: `(factor + slope k) / (2 k + first)!`.
const fn series_of(first: usize, factor: f64, slope: f64) -> [f64; TERMS] {
    let mut coefficients = [0.0; TERMS];
    let (mut k, mut inverse, mut done) = (0, 1.0, 0);
    while k < TERMS {
        while done < 2 * k + first {
            done += 1;
            inverse /= done as f64;
        }
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        coefficients[k] = sign * (factor + slope * k as f64) * inverse;
        k += 1;
    }
    coefficients
}

/// `sin(phi) / phi`, `(1 - cos(phi)) / phi^2` and `(phi - sin(phi)) / phi^3` in powers of `x = phi^2`.
const TURN: [[f64; TERMS]; 3] = [series_of(1, 1.0, 0.0), series_of(2, 1.0, 0.0), series_of(3, 1.0, 0.0)];
/// `b = (1 - cos(phi)) / phi^2`, `c = (phi - sin(phi)) / phi^3` and their derivatives by `x = phi^2`, in powers of x.
const TANGENT: [[f64; TERMS]; 4] =
    [series_of(2, 1.0, 0.0), series_of(3, 1.0, 0.0), series_of(4, -1.0, -1.0), series_of(5, -1.0, -1.0)];

/// Power series for the exponential at `x`, from 0 to about 40. Few terms do for the small turns of a piece of a beam,
/// all where x is not known.
fn powers<S: Scalar, const N: usize>(series: &[[f64; TERMS]; N], x: S) -> [S; N] {
    let below = |size: f64| x.known_less(S::from_f64(size)) == Some(true);
    let terms = if below(0.1) {
        7
    } else if below(1.0) {
        12
    } else {
        TERMS
    };
    series.each_ref().map(|row| row[..terms].iter().rev().fold(S::zero(), |sum, &entry| sum * x + entry))
}

/// Exponential `exp(twist)`: the pose that a body reaches with that constant twist in a unit of time. The twist is in
/// its own axes.
///
/// Law: with rotation vector w, `phi = |w|` and W the matrix of `w x`: `R = 1 + a W + b W^2`, `t = (1 + b W + c W^2) v`,
/// `a = sin(phi) / phi`, `b = (1 - cos(phi)) / phi^2`, `c = (phi - sin(phi)) / phi^3`, all three as power series in `phi^2`, so that
/// they and their derivatives hold at zero. Source: Murray, Li & Sastry 1994, "A Mathematical Introduction to Robotic Manipulation",
/// equations 2.14 and 2.36. Checked: to rounding up to a full turn, which is more than a piece of a beam may bend.
pub fn exponential<S: Scalar>(twist: Twist<S>) -> Pose<S> {
    let (w, v) = (twist.angular, twist.linear);
    let [a, b, c] = powers(&TURN, w.dot(w));
    let once = w.cross(v);
    Pose::new(turn(w, a, b), v + once * b + w.cross(once) * c)
}

/// Matrix of the exponential's turn, `1 + a [w]x + b [w]x^2`, entry by entry.
fn turn<S: Scalar>(w: Vector3<S>, a: S, b: S) -> Matrix3<S> {
    let (wb, wa) = (w * b, w * a);
    let (xx, yy, zz) = (w.x * wb.x, w.y * wb.y, w.z * wb.z);
    let (xy, xz, yz) = (w.x * wb.y, w.x * wb.z, w.y * wb.z);
    let one = S::one();
    Matrix3::from_columns(
        Vector3::new(one - yy - zz, xy + wa.z, xz - wa.y),
        Vector3::new(xy - wa.z, one - xx - zz, yz + wa.x),
        Vector3::new(xz + wa.y, yz - wa.x, one - xx - yy),
    )
}

/// Exponential of a rotation `exp([w]x)`, and the columns of its tangent `1 - b [w]x + c [w]x^2`. The tangent makes the
/// angular velocity, in the turned axes, from the rate of `w` (Murray, Li & Sastry 1994, section 2.2; `b` and `c` of
/// [`exponential`]).
pub(in crate::beam) fn rotation<S: Scalar>(w: Vector3<S>) -> (Matrix3<S>, Matrix3<S>) {
    let [a, b, c] = powers(&TURN, w.dot(w));
    (turn(w, a, b), turn(w, -b, c))
}

/// The derivative of [`exponential`] at a twist, prepared for many rates.
///
/// Law: `f(ad) = sum_k (-1)^k / (k + 1)! ad^k`, `ad = twist x` (Iserles et al. 2000, equation 2.46). With W and V the matrices of `w x`
/// and `v x`, `ad = [W, 0; V, W]` multiplies like the dual number `W + eps V`, so that `f(ad) = [J, 0; Q, J]` with
/// `J = f(W) = 1 - b W + c W^2` and Q its derivative along V. Checked: against the derivative of [`exponential`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Tangent<S> {
    /// J.
    pub same: Matrix3<S>,
    /// Q: what an angular rate gives to the linear part.
    pub across: Matrix3<S>,
}

impl<S: Scalar> Tangent<S> {
    /// Prepares the derivative of the exponential at `twist`.
    pub fn new(twist: Twist<S>) -> Self {
        let (w, v) = (twist.angular, twist.linear);
        let x = w.dot(w);
        let [b, c, b_slope, c_slope] = powers(&TANGENT, x);
        let s = w.dot(v) * 2.0;
        // Q = -b V - b' s W + c (W V + V W) + c' s W^2, with W V + V W = w v^T + v w^T - s 1 and W^2 = w w^T - x 1.
        let skew = v * b + w * (b_slope * s);
        let (right, left) = (v * c + w * (c_slope * s), w * c);
        let diagonal = c * s + c_slope * s * x;
        let column = |right_k: S, left_k: S| w * right_k + v * left_k;
        let mut columns = [column(right.x, left.x), column(right.y, left.y), column(right.z, left.z)];
        columns[0] += Vector3::new(-diagonal, -skew.z, skew.y);
        columns[1] += Vector3::new(skew.z, -diagonal, -skew.x);
        columns[2] += Vector3::new(-skew.y, skew.x, -diagonal);
        Self { same: turn(w, -b, c), across: Matrix3 { columns } }
    }

    /// The twist, in the moved body's axes, for a `rate` of the exponent.
    #[inline]
    pub fn apply(&self, rate: Twist<S>) -> Twist<S> {
        Twist::new(self.same * rate.angular, self.same * rate.linear + self.across * rate.angular)
    }
}

/// Tangent of the exponential: the body's twist of `exp(twist)` when `twist` changes at `rate`. It is in the moved
/// body's axes.
pub fn tangent<S: Scalar>(twist: Twist<S>, rate: Twist<S>) -> Twist<S> {
    Tangent::new(twist).apply(rate)
}
