//! Shape functions along a beam, with their derivatives.

use nalgebra::DMatrix;

use super::positive;
use crate::error::{Error, Result};

/// Highest polynomial degree; beyond it the mass matrix of most bases is singular to rounding.
const HIGHEST: usize = 24;

/// A row of shape functions `Phi(mu)` on a beam of a given length; a field is `Phi(mu) q`.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    length: f64,
    kind: Kind,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Bernstein { degree: usize, clamped: usize },
    Hermite { elements: usize },
    Linear { elements: usize, clamped: usize },
    Legendre { count: usize },
    Monomial { count: usize },
    Combination { base: Box<Basis>, columns: DMatrix<f64> },
}

impl Basis {
    /// Basis of Bernstein polynomials of a Bezier curve whose first `clamped` control points are fixed at zero.
    ///
    /// Two fixed points hold place and direction at the root (shear-rigid beams), one holds the place (fields of shear-flexible
    /// beams), none leaves all free. Law: `B_k = C(n, k) x^k (1 - x)^(n - k)`, `x = mu / L`, and
    /// `dB_k^n/dx = n (B_(k-1)^(n-1) - B_k^(n-1))` (Farin 2002, "Curves and Surfaces for CAGD", chapters 4 and 5).
    pub fn bernstein(length: f64, degree: usize, clamped: usize) -> Result<Self> {
        within("the degree of a Bernstein basis", degree, clamped.max(1), HIGHEST)?;
        Self::new(length, Kind::Bernstein { degree, clamped })
    }

    /// Basis of cubic Hermite elements of equal length, clamped at the root. The coordinates are deflection and slope
    /// of each further node.
    pub fn hermite(length: f64, elements: usize) -> Result<Self> {
        within("the number of Hermite elements", elements, 1, 1000)?;
        Self::new(length, Kind::Hermite { elements })
    }

    /// Basis of piecewise linear functions on equal elements, one for each node but the first `clamped` (0 or 1).
    pub fn linear(length: f64, elements: usize, clamped: usize) -> Result<Self> {
        within("the number of linear elements", elements, 1, 1000)?;
        within("the clamped nodes of linear elements", clamped, 0, 1)?;
        Self::new(length, Kind::Linear { elements, clamped })
    }

    /// Legendre polynomials `P_0 .. P_(count-1)` in `2 mu / L - 1`: orthogonal, the natural choice for strains.
    pub fn legendre(length: f64, count: usize) -> Result<Self> {
        within("the number of Legendre polynomials", count, 1, HIGHEST + 1)?;
        Self::new(length, Kind::Legendre { count })
    }

    /// Basis of powers `(mu / L)^k`, `k = 0 .. count-1`.
    pub fn monomial(length: f64, count: usize) -> Result<Self> {
        within("the number of monomials", count, 1, 13)?;
        Self::new(length, Kind::Monomial { count })
    }

    /// Combinations of the functions of another basis, one per column: mode shapes, for example.
    pub fn combination(base: Self, columns: DMatrix<f64>) -> Result<Self> {
        super::dimension("the rows of a combination", base.len(), columns.nrows(), "function of the basis")?;
        Self::new(base.length, Kind::Combination { base: Box::new(base), columns })
    }

    fn new(length: f64, kind: Kind) -> Result<Self> {
        positive("beam.length", length)?;
        Ok(Self { length, kind })
    }

    /// Length in m of the beam that the basis spans.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Number of functions of the basis.
    pub fn len(&self) -> usize {
        match &self.kind {
            Kind::Bernstein { degree, clamped } => degree + 1 - clamped,
            Kind::Hermite { elements } => 2 * elements,
            Kind::Linear { elements, clamped } => elements + 1 - clamped,
            Kind::Legendre { count } | Kind::Monomial { count } => *count,
            Kind::Combination { columns, .. } => columns.ncols(),
        }
    }

    /// Whether the basis has no function at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Breaks of the basis in m, root and tip included: between them every function is one polynomial.
    pub fn breaks(&self) -> Vec<f64> {
        match &self.kind {
            Kind::Hermite { elements } | Kind::Linear { elements, .. } => {
                (0..=*elements).map(|k| self.length * k as f64 / *elements as f64).collect()
            }
            Kind::Combination { base, .. } => base.breaks(),
            _ => vec![0.0, self.length],
        }
    }

    /// Points that a Gauss rule needs on each piece to integrate a product of two basis functions exactly.
    pub fn points(&self) -> usize {
        match &self.kind {
            Kind::Bernstein { degree, .. } => degree + 1,
            Kind::Hermite { .. } => 4,
            Kind::Linear { .. } => 2,
            Kind::Legendre { count } | Kind::Monomial { count } => *count,
            Kind::Combination { base, .. } => base.points(),
        }
    }

    /// Evaluates the basis functions at `mu` (m), differentiated `order` times, in 1/m^order.
    pub fn evaluate(&self, mu: f64, order: usize) -> Vec<f64> {
        let x = mu / self.length;
        let scale = self.length.powi(-(order as i32));
        let values = match &self.kind {
            Kind::Bernstein { degree, clamped } => {
                (*clamped..=*degree).map(|k| bernstein(*degree, k, order, x)).collect()
            }
            Kind::Hermite { elements } => return hermite(self.length, *elements, mu, order),
            Kind::Linear { elements, clamped } => return linear(self.length, *elements, *clamped, (mu, order)),
            Kind::Legendre { count } => legendre(*count, order, x),
            Kind::Monomial { count } => (0..*count).map(|power| monomial(power, order, x)).collect(),
            Kind::Combination { base, columns } => {
                let values = base.evaluate(mu, order);
                return columns.column_iter().map(|c| c.iter().zip(&values).map(|(a, b)| a * b).sum()).collect();
            }
        };
        values.into_iter().map(|value: f64| value * scale).collect()
    }
}

fn within(setting: &'static str, value: usize, least: usize, most: usize) -> Result<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let condition = format!("lie between {least} and {most}");
    Err(Error::Setting { setting, condition, value: value as f64, repair: "choose another basis or another size" })
}

/// Basis function: the Bernstein polynomial `k` of degree `n`, differentiated `order` times by x.
fn bernstein(n: usize, k: usize, order: usize, x: f64) -> f64 {
    if k > n {
        return 0.0;
    }
    if order == 0 {
        let choose = (1..=k).fold(1.0, |product, j| product * (n + 1 - j) as f64 / j as f64);
        return choose * x.powi(k as i32) * (1.0 - x).powi((n - k) as i32);
    }
    if n == 0 {
        return 0.0;
    }
    let left = if k == 0 { 0.0 } else { bernstein(n - 1, k - 1, order - 1, x) };
    n as f64 * (left - bernstein(n - 1, k, order - 1, x))
}

/// Basis functions: shifted Legendre polynomials, differentiated `order` times by x in [0, 1].
///
/// Law: `(n + 1) P_(n+1) = (2n + 1) t P_n - n P_(n-1)` and `P_(n+1)' = P_(n-1)' + (2n + 1) P_n`, `t = 2x - 1`.
fn legendre(count: usize, order: usize, x: f64) -> Vec<f64> {
    let t = 2.0 * x - 1.0;
    let mut row = vec![1.0, t];
    for n in 1..count {
        let degree = n as f64;
        row.push(((2.0 * degree + 1.0) * t * row[n] - degree * row[n - 1]) / (degree + 1.0));
    }
    for _ in 0..order {
        let mut slope = vec![0.0, 2.0 * row[0]];
        for n in 1..count {
            slope.push(slope[n - 1] + 2.0 * (2.0 * n as f64 + 1.0) * row[n]);
        }
        row = slope;
    }
    row.truncate(count);
    row
}

fn monomial(power: usize, order: usize, x: f64) -> f64 {
    if order > power {
        return 0.0;
    }
    let factor: f64 = (power + 1 - order..=power).map(|k| k as f64).product();
    factor * x.powi((power - order) as i32)
}

/// Basis functions: Hermite functions of all nodes but the root, as polynomials of their element.
fn hermite(length: f64, elements: usize, mu: f64, order: usize) -> Vec<f64> {
    let size = length / elements as f64;
    let element = ((mu / size) as usize).min(elements - 1);
    let x = mu / size - element as f64;
    // Coefficients of 1, x, x^2, x^3 for deflection and slope at both ends (Zienkiewicz & Taylor 2000, section 2.10).
    const CUBICS: [[f64; 4]; 4] =
        [[1.0, 0.0, -3.0, 2.0], [0.0, 1.0, -2.0, 1.0], [0.0, 0.0, 3.0, -2.0], [0.0, 0.0, -1.0, 1.0]];
    let mut row = vec![0.0; 2 * (elements + 1)];
    for (k, cubic) in CUBICS.iter().enumerate() {
        let value: f64 = cubic.iter().enumerate().map(|(power, c)| c * monomial(power, order, x)).sum();
        let slope = if k % 2 == 1 { size } else { 1.0 };
        row[2 * element + k] = value * slope * size.powi(-(order as i32));
    }
    row.split_off(2)
}

/// Basis functions: hats of all nodes but the first `clamped`. At a node the slope is that of the element after it.
fn linear(length: f64, elements: usize, clamped: usize, (mu, order): (f64, usize)) -> Vec<f64> {
    let size = length / elements as f64;
    let element = ((mu / size) as usize).min(elements - 1);
    let x = mu / size - element as f64;
    let mut row = vec![0.0; elements + 1];
    (row[element], row[element + 1]) = match order {
        0 => (1.0 - x, x),
        1 => (-1.0 / size, 1.0 / size),
        _ => (0.0, 0.0),
    };
    row.split_off(clamped)
}
