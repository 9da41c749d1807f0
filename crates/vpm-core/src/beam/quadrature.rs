//! Gauss-Legendre quadrature.

use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::OnceLock;

/// Roots with slopes of Legendre polynomials of low degree, each made at its first use: a beam asks for them at all of its stations.
static ROOTS: [OnceLock<Vec<(f64, f64)>>; 32] = [const { OnceLock::new() }; 32];

/// One station of a quadrature rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Where, in the units of the interval.
    pub place: f64,
    /// Its weight, in the same units.
    pub weight: f64,
}

/// Quadrature rule of `count` points on `[begin, end]`, exact for polynomials of degree `2 count - 1`.
///
/// Law: the places are the roots of the Legendre polynomial P, the weights `2 / ((1 - x^2) P'(x)^2)`, found by Newton's method
/// (Press et al. 2007, "Numerical Recipes", section 4.6). Checked: exact for those polynomials to rounding.
pub fn gauss(count: usize, begin: f64, end: f64) -> Vec<Station> {
    let (middle, half) = (0.5 * (begin + end), 0.5 * (end - begin));
    let station = |&(root, slope): &(f64, f64)| Station {
        place: middle + half * root,
        weight: 2.0 * half / ((1.0 - root * root) * slope * slope),
    };
    roots(count).iter().map(station).collect()
}

/// Quadrature rule of `count` points on each piece between neighbouring `breaks`.
pub fn composite(count: usize, breaks: &[f64]) -> Vec<Station> {
    breaks.windows(2).flat_map(|piece| gauss(count, piece[0], piece[1])).collect()
}

/// Quadrature points: roots of the Legendre polynomial of degree `n`, ascending, with the slopes there.
fn roots(n: usize) -> Cow<'static, [(f64, f64)]> {
    let made = || (0..n).rev().map(|k| root(n, k)).collect::<Vec<_>>();
    ROOTS.get(n).map_or_else(|| Cow::Owned(made()), |kept| Cow::Borrowed(&kept.get_or_init(made)[..]))
}

/// Quadrature point: root `k` (descending) of the Legendre polynomial of degree `n`, with the slope there.
fn root(n: usize, k: usize) -> (f64, f64) {
    let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
    for _ in 0..8 {
        let (value, slope) = legendre(n, x);
        x -= value / slope;
    }
    (x, legendre(n, x).1)
}

/// Legendre polynomial of degree `n` for quadrature: value and slope inside (-1, 1). By the three-term recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut value, mut before) = (1.0, 0.0);
    for k in 1..=n {
        let degree = k as f64;
        (value, before) = (((2.0 * degree - 1.0) * x * value - (degree - 1.0) * before) / degree, value);
    }
    (value, n as f64 * (x * value - before) / (x * x - 1.0))
}
