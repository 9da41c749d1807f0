//! Polynomials of planar linkages: quadratics, conics and their resultant.

/// A coefficient below this fraction of the largest one is rounding left over from terms that cancel.
const CANCELLED: f64 = 1e-12;

/// Real roots of the polynomial `c0 + c1 x + c2 x^2`, the larger one first. There are none if they are complex or `c2`
/// is zero.
///
/// Law: the larger root in size without cancellation, the other one from their product (Press et al. 2007, "Numerical
/// Recipes", section 5.6).
pub fn quadratic_roots([c0, c1, c2]: [f64; 3]) -> Option<[f64; 2]> {
    let discriminant = c1 * c1 - 4.0 * c2 * c0;
    if c2 == 0.0 || discriminant.is_nan() || discriminant < 0.0 {
        return None;
    }
    let large = -0.5 * (c1 + discriminant.sqrt().copysign(c1));
    let roots = [large / c2, if large == 0.0 { 0.0 } else { c0 / large }];
    Some([roots[0].max(roots[1]), roots[0].min(roots[1])])
}

/// A polynomial of second degree in two unknowns c and s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conic {
    /// The constant term.
    pub constant: f64,
    /// Factor of c.
    pub c: f64,
    /// Factor of s.
    pub s: f64,
    /// Factor of c^2.
    pub cc: f64,
    /// Factor of c s.
    pub cs: f64,
    /// Factor of s^2.
    pub ss: f64,
}

impl Conic {
    /// c^2 + s^2 - 1, which cosine and sine of one angle satisfy.
    pub const CIRCLE: Self = Self { constant: -1.0, c: 0.0, s: 0.0, cc: 1.0, cs: 0.0, ss: 1.0 };

    /// The same polynomial with the unknowns exchanged.
    pub fn exchanged(self) -> Self {
        Self { c: self.s, s: self.c, cc: self.ss, ss: self.cc, ..self }
    }

    /// The value of the polynomial at (c, s).
    pub fn at(&self, c: f64, s: f64) -> f64 {
        self.constant + c * (self.c + self.cc * c + self.cs * s) + s * (self.s + self.ss * s)
    }

    /// As a polynomial in c: its coefficients of c^0, c^1 and c^2, each a polynomial in s, lowest power first.
    pub fn in_c(&self) -> [[f64; 3]; 3] {
        [[self.constant, self.s, self.ss], [self.c, self.cs, 0.0], [self.cc, 0.0, 0.0]]
    }
}

/// The polynomial in s, lowest power first, whose zeros are the s of the common points of two conics.
///
/// Law: determinant of the 4 x 4 Sylvester matrix of `f` and `g` as polynomials in c,
/// `(f2 g0 - f0 g2)^2 - (f2 g1 - f1 g2)(f1 g0 - f0 g1)`. Source: D'Imperio 2016, "Modelling and simulation
/// techniques for advanced robotic systems", eq 2.66, whose last two rows belong to the second polynomial. Degree 4 in
/// general, 2 if both conics are circles, as for a rod between two points.
pub fn resultant(f: &Conic, g: &Conic) -> [f64; 5] {
    let ([f0, f1, f2], [g0, g1, g2]) = (f.in_c(), g.in_c());
    let minor = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| difference(product(a, b), product(c, d));
    let outer = minor(f2, g0, f0, g2);
    let (upper, lower) = (minor(f2, g1, f1, g2), minor(f1, g0, f0, g1));
    let mut result = [0.0; 5];
    for i in 0..5 {
        for j in 0..5 - i {
            result[i + j] += outer[i] * outer[j] - upper[i] * lower[j];
        }
    }
    result
}

fn product(a: [f64; 3], b: [f64; 3]) -> [f64; 5] {
    let mut result = [0.0; 5];
    for (i, &left) in a.iter().enumerate() {
        for (j, &right) in b.iter().enumerate() {
            result[i + j] += left * right;
        }
    }
    result
}

fn difference(a: [f64; 5], b: [f64; 5]) -> [f64; 5] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// Degree of a polynomial, lowest power first; coefficients that are rounding of the largest count as zero.
pub fn degree(polynomial: &[f64]) -> usize {
    let largest = polynomial.iter().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
    polynomial.iter().rposition(|entry| entry.abs() > CANCELLED * largest).unwrap_or(0)
}
