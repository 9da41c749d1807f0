//! Angles along an axis that bends in one plane, at many points at once.

use super::plane::dot;
use crate::scalar::Scalar;

/// Share of the largest entry below which a sum of two entries is rounding.
const ROUNDING: f64 = 4e-15;

/// The points of an axis in pairs that are mirror images of each other in its middle, as far as that saves anything.
///
/// With rows r and s of the two points the angles are `(e + o) x` and `(e - o) x`, `e = (r + s) / 2`, `o = (r - s) / 2`. Legendre
/// polynomials are even or odd, so that half of e and o vanishes.
#[derive(Clone, Debug, Default)]
pub(super) struct Angles {
    alone: Vec<usize>,
    pairs: Vec<Pair>,
}

#[derive(Clone, Debug)]
struct Pair {
    points: [usize; 2],
    even: Vec<Term>,
    odd: Vec<Term>,
}

/// A coordinate and its factor.
type Term = (usize, f64);

impl Angles {
    /// Angles at pairs of `points`, each a number and a place on an axis of that `length`.
    ///
    /// Entry `number n + i` of `rows` is the derivative of a point's angle by coordinate i.
    pub fn new(points: &[(usize, f64)], length: f64, rows: &[f64], n: usize) -> Self {
        let (mut left, mut alone, mut pairs) = (points.to_vec(), Vec::new(), Vec::<Pair>::new());
        while let Some((number, place)) = left.pop() {
            match left.iter().position(|&(_, other)| (place + other - length).abs() < ROUNDING * length) {
                Some(image) => pairs.push(Pair::new([left.swap_remove(image).0, number], rows, n)),
                None => alone.push(number),
            }
        }
        // What is the same in all pairs but for rounding is worked out once.
        for k in 1..pairs.len() {
            let (before, rest) = pairs.split_at_mut(k);
            for (term, first) in rest[0].even.iter_mut().zip(&before[0].even) {
                if term.0 == first.0 && (term.1 - first.1).abs() < ROUNDING * first.1.abs() {
                    *term = *first;
                }
            }
        }
        let sparse = |pair: &Pair| pair.even.len() + pair.odd.len() <= n + 1;
        if n < 2 || !pairs.iter().all(sparse) {
            return Self { alone: points.iter().map(|&(number, _)| number).collect(), pairs: Vec::new() };
        }
        Self { alone, pairs }
    }

    /// The angles of all points, by their numbers, for coordinates `x`, beyond one that all have.
    pub fn evaluate<S: Scalar>(&self, rows: &[f64], x: &[S], begin: S, out: &mut [S]) {
        let n = x.len();
        for &number in &self.alone {
            out[number] = dot(&rows[number * n..(number + 1) * n], x, begin);
        }
        for Pair { points: [first, second], even, odd } in &self.pairs {
            let sum = |terms: &[Term], begin| terms.iter().fold(begin, |sum, &(i, factor)| sum + x[i] * factor);
            let (even, odd) = (sum(even, begin), sum(odd, S::zero()));
            (out[*first], out[*second]) = (even + odd, even - odd);
        }
    }
}

impl Pair {
    fn new(points: [usize; 2], rows: &[f64], n: usize) -> Self {
        let [first, second] = points.map(|number| &rows[number * n..(number + 1) * n]);
        let size = first.iter().chain(second).fold(0.0_f64, |most, entry| most.max(entry.abs()));
        let terms = |sign: f64| {
            let all = first.iter().zip(second).map(|(a, b)| 0.5 * (a + sign * b)).enumerate();
            all.filter(|(_, factor)| factor.abs() > ROUNDING * size).collect()
        };
        Self { points, even: terms(1.0), odd: terms(-1.0) }
    }
}
