//! A polynomial as a straight list of products, ready to be summed.

use super::structure::Structure;
use crate::scalar::Scalar;

/// Numbers in the window of a narrow program: an index of eight bits cannot leave it.
pub(super) const NARROW: usize = 256;

/// Products of one, two and three factors are summed in loops of their own: a product costs less than storing and finding a shared
/// one, so that only powers beyond are built up factor by factor.
#[derive(Clone, Debug, Default, PartialEq)]
struct Sums<I> {
    linear: Vec<(f64, I)>,
    square: Vec<(f64, [I; 2])>,
    cubic: Vec<(f64, [I; 3])>,
    higher: Vec<(f64, Vec<I>)>,
}

/// A model's right-hand side over a window of interleaved rows `[y, u_1, ..., u_m]`, oldest first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Program {
    constant: f64,
    sums: Kind,
    /// Numbers in one row.
    pub(super) stride: usize,
    /// Numbers in the window: the lagged rows and that of the present.
    pub(super) window: usize,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Narrow(Sums<u8>),
    Wide(Sums<usize>),
}

impl Program {
    pub(super) fn new(structure: &Structure, theta: &[f64]) -> Self {
        let (stride, longest) = (structure.signals().len(), structure.longest_lag());
        let window = stride * (longest + 1);
        let mut constant = 0.0;
        let mut products: Vec<(f64, Vec<usize>)> = Vec::new();
        for (&value, term) in theta.iter().zip(structure.terms()) {
            let places = term.factors().iter().map(|factor| (longest - factor.delay) * stride + factor.signal);
            match term.factors().len() {
                0 => constant += value,
                _ => products.push((value, places.collect())),
            }
        }
        let narrow: Option<Vec<(f64, Vec<u8>)>> = products
            .iter()
            .map(|(value, places)| {
                let narrow: Option<Vec<u8>> = places.iter().map(|&place| u8::try_from(place).ok()).collect();
                narrow.map(|places| (*value, places))
            })
            .collect();
        let sums = match narrow {
            Some(products) if window <= NARROW => Kind::Narrow(Sums::new(products)),
            _ => Kind::Wide(Sums::new(products)),
        };
        Self { constant, sums, stride, window }
    }

    /// Number of values that a program's buffer must have from the start of any window on.
    pub(super) fn reach(&self) -> usize {
        self.window.max(NARROW)
    }

    /// Evaluates a polynomial program: the sum over the window that begins at `from`.
    #[inline]
    pub(super) fn evaluate<S: Scalar>(&self, buffer: &[S], from: usize) -> S {
        let window = &buffer[from..];
        match &self.sums {
            Kind::Narrow(sums) => match window.first_chunk::<NARROW>() {
                Some(window) => sums.sum(|place| window[usize::from(place)]) + self.constant,
                None => sums.sum(|place| window[usize::from(place)]) + self.constant,
            },
            Kind::Wide(sums) => sums.sum(|place| window[place]) + self.constant,
        }
    }
}

impl<I: Copy> Sums<I> {
    fn new(products: Vec<(f64, Vec<I>)>) -> Self {
        let mut sums = Self { linear: Vec::new(), square: Vec::new(), cubic: Vec::new(), higher: Vec::new() };
        for (value, places) in products {
            match places[..] {
                [a] => sums.linear.push((value, a)),
                [a, b] => sums.square.push((value, [a, b])),
                [a, b, c] => sums.cubic.push((value, [a, b, c])),
                _ => sums.higher.push((value, places)),
            }
        }
        sums
    }

    #[inline]
    fn sum<S: Scalar>(&self, at: impl Fn(I) -> S) -> S {
        let linear = spread(&self.linear, |&(value, a)| at(a) * value);
        let square = spread(&self.square, |&(value, [a, b])| at(a) * at(b) * value);
        let cubic = spread(&self.cubic, |&(value, [a, b, c])| at(a) * value * (at(b) * at(c)));
        let product =
            |(value, places): &(f64, Vec<I>)| places.iter().fold(S::from_f64(*value), |product, &a| product * at(a));
        let higher: S = self.higher.iter().map(product).sum();
        (linear + square) + (cubic + higher)
    }
}

/// Sum of a program in four lanes, because each addition otherwise waits for the last one.
#[inline]
fn spread<T, S: Scalar>(items: &[T], value: impl Fn(&T) -> S) -> S {
    let (fours, rest) = items.as_chunks::<4>();
    let mut lanes = [S::zero(); 4];
    for four in fours {
        for (lane, item) in lanes.iter_mut().zip(four) {
            *lane += value(item);
        }
    }
    let rest: S = rest.iter().map(value).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}
