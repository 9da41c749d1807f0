//! The dual number against an independent library: values, first and second derivatives of every function.

use num_dual::{Dual2_64, DualNum};
use proptest::prelude::*;
use vpm_core::{Dual, Scalar, scalar};

type Second = Dual<Dual<f64, 1>, 1>;

/// `x` as the variable of two nested differentiations.
fn nested(x: f64) -> Second {
    Dual::variable(Dual::variable(x, 0), 0)
}

fn close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-12 * (1.0 + expected.abs())
}

/// The same expression in this crate's nested dual and in the witness.
macro_rules! agree {
    ($point:expr, $($name:literal: |$x:ident| $expression:expr),* $(,)?) => {$(
        let ours: Second = { let $x = nested($point); $expression };
        let theirs: Dual2_64 = { let $x = Dual2_64::from_re($point).derivative(); $expression };
        prop_assert!(close(ours.re(), theirs.re), "{} value at {}: {} {}", $name, $point, ours.re(), theirs.re);
        for first in [ours.gradient[0].value, ours.value.gradient[0]] {
            prop_assert!(close(first, theirs.v1), "{} slope at {}: {first} {}", $name, $point, theirs.v1);
        }
        let second = ours.gradient[0].gradient[0];
        prop_assert!(close(second, theirs.v2), "{} curvature at {}: {second} {}", $name, $point, theirs.v2);
    )*};
}

proptest! {
    #[test]
    fn functions_agree_with_the_witness(x in -3.0..3.0_f64) {
        agree!(x,
            "sin": |x| x.sin(), "cos": |x| x.cos(), "sin_cos": |x| x.sin_cos().0 * x.sin_cos().1,
            "exp": |x| x.exp(), "exp_m1": |x| x.exp_m1(), "tanh": |x| x.tanh(), "atan": |x| x.atan(),
            "cube": |x| x.powi(3), "one": |x| x.powi(1), "constant": |x| x.powi(0),
            "sqrt": |x| (x * x + 1.0).sqrt(), "ln": |x| (x * x + 0.5).ln(), "inverse": |x| (x * x + 0.5).powi(-2),
            "recip": |x| (x * x + 0.5).recip(),
        );
    }

    #[test]
    fn operators_agree_with_the_witness(x in -3.0..3.0_f64) {
        agree!(x,
            "add": |x| x + x * 2.0 + 1.0, "sub": |x| x * 3.0 - x - 1.0, "mul": |x| x * x * x,
            "div": |x| (x + 1.0) / (x * x + 0.5), "div number": |x| x * x / 3.0, "neg": |x| -(x * x),
            "add assign": |x| { let mut y = x * x; y += x; y }, "sub assign": |x| { let mut y = x * x; y -= x; y },
            "mul assign": |x| { let mut y = x; y *= x; y }, "div assign": |x| { let mut y = x; y /= x * x + 1.0; y },
        );
    }
}

#[test]
fn tanh_stays_finite_far_out() {
    let steep = Dual::<f64, 1>::variable(1e6, 0).tanh();
    assert!(steep.is_finite() && steep.value == 1.0 && steep.gradient == [0.0]);
}

#[test]
fn seed_puts_each_variable_in_its_lane() {
    let [a, b, c] = [2.0, 3.0, 5.0];
    let numbers = scalar::seed::<f64, 2>(&[a, b, c], &[2, 0]);
    let product = numbers.into_iter().fold(Dual::one(), |product, number| product * number);
    assert_eq!((product.value, product.gradient), (a * b * c, [a * b, b * c]));
}

#[test]
fn comparisons_and_extremes_follow_the_value() {
    let (low, high) = (Dual::<f64, 1>::variable(1.0, 0), Dual::<f64, 1>::constant(2.0));
    assert!(low < high && low.max(high).gradient == [0.0] && low.min(high).gradient == [1.0]);
    assert!(!Dual::<f64, 1> { value: 1.0, gradient: [f64::NAN] }.is_finite());
    let below = Dual::<f64, 1>::variable(-2.0, 0).abs();
    assert_eq!((below.value, below.gradient, low.abs().gradient), (2.0, [-1.0], [1.0]));
    let total: Dual<f64, 1> = [low, high, low].into_iter().sum();
    assert_eq!((total.value, total.gradient), (4.0, [2.0]));
}
