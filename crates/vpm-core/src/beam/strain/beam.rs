//! One beam in strain coordinates.

use crate::beam::quadrature::gauss;
use crate::beam::{Basis, Section, not_negative};
use crate::error::{Error, Result};
use crate::scalar::{Dual, Scalar};
use crate::spatial::{Pose, SpatialInertia, Symmetric3, Twist, Vector3};

use super::exponential::{exponential, tangent};

/// A component of the strain screw `(theta_x', theta_y', theta_z', v_x' - theta_y, v_y' + theta_x, v_z')`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strain {
    /// Curvature about x.
    BendingX,
    /// Curvature about y.
    BendingY,
    /// Twist.
    Torsion,
    /// Shear along x.
    ShearX,
    /// Shear along y.
    ShearY,
    /// Extension.
    Extension,
}

/// A strain that the beam may have, with its shape functions. Strains that are not listed are rigid.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Which component.
    pub strain: Strain,
    /// Its shape functions.
    pub basis: Basis,
}

/// A straight beam along z of its root frame.
#[derive(Clone, Debug)]
pub struct StrainBeam {
    fields: Vec<Field>,
    section: Section,
    damping: f64,
    length: f64,
    /// The component of each coordinate, 0 to 5.
    components: Vec<usize>,
    pieces: Vec<Piece>,
}

/// A piece of the beam, crossed by one exponential.
#[derive(Clone, Debug)]
struct Piece {
    size: f64,
    /// Values of all shape functions at both Gauss points of the piece.
    rows: [Vec<f64>; 2],
    /// Inertia of the beam that is lumped at the end of the piece by the Gauss rule over the beam.
    inertia: SpatialInertia<f64>,
}

/// How a frame moves on across a piece: pose, twist of its end relative to its begin, and the rate of that at constant coordinate
/// rates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing<S> {
    pub pose: Pose<S>,
    pub twist: Twist<S>,
    pub acceleration: Twist<S>,
    strains: [Twist<S>; 2],
    screw: Twist<S>,
}

impl StrainBeam {
    /// A beam of that section with those strains, Kelvin-Voigt `damping` (s), integrated over `stations` Gauss stations.
    ///
    /// Checked: at least one field, one length, smooth bases, 2 to 60 stations.
    pub fn new(section: Section, fields: Vec<Field>, damping: f64, stations: usize) -> Result<Self> {
        not_negative("beam.damping", damping)?;
        let length = fields.first().map_or(0.0, |field| field.basis.length());
        let alike = fields.iter().all(|field| field.basis.length() == length && field.basis.breaks().len() == 2);
        if length == 0.0 || !alike || !(2..=60).contains(&stations) {
            let condition = "lie between 2 and 60, for one or more smooth strain fields of the same length".to_owned();
            let repair = "give every field a Legendre, Bernstein or monomial basis of the beam's length";
            let value = stations as f64;
            return Err(Error::Setting { setting: "the stations of a strain beam", condition, value, repair });
        }
        let components =
            fields.iter().flat_map(|field| std::iter::repeat_n(field.strain as usize, field.basis.len())).collect();
        let mut beam = Self { fields, section, damping, length, components, pieces: Vec::new() };
        beam.pieces = beam.cut(stations);
        Ok(beam)
    }

    /// The pieces between neighbouring stations of the Gauss rule, and the last one to the tip.
    fn cut(&self, stations: usize) -> Vec<Piece> {
        let mut begin = 0.0;
        let ends = gauss(stations, 0.0, self.length).into_iter().map(|at| (at.place, at.weight));
        ends.chain(std::iter::once((self.length, 0.0)))
            .map(|(end, weight)| {
                let points = gauss(2, begin, end);
                let rows = [0, 1].map(|k| self.row(points[k].place));
                let size = end - begin;
                begin = end;
                Piece { size, rows, inertia: self.slice(weight) }
            })
            .collect()
    }

    /// All shape functions at `mu`.
    fn row(&self, mu: f64) -> Vec<f64> {
        self.fields.iter().flat_map(|field| field.basis.evaluate(mu, 0)).collect()
    }

    fn slice(&self, length: f64) -> SpatialInertia<f64> {
        let [x, y, z, mass, ..] = self.section.inertia.map(|density| density * length);
        SpatialInertia::new(mass, Vector3::zero(), Symmetric3::from_array([x, y, z, 0.0, 0.0, 0.0]))
    }

    /// How many coordinates the beam has.
    pub fn len(&self) -> usize {
        self.components.len()
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.components.is_empty()
    }

    /// How many pieces it has.
    pub(super) fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// The inertia at the end of a piece.
    pub(super) fn inertia(&self, piece: usize) -> SpatialInertia<f64> {
        self.pieces[piece].inertia
    }

    /// Kelvin-Voigt damping in s.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Elastic stiffness `int Phi^T K Phi`, row by row; different strains do not couple.
    pub fn stiffness(&self) -> Vec<f64> {
        let n = self.len();
        let points = self.fields.iter().map(|field| field.basis.points()).max().unwrap_or(1) + 1;
        let mut stiffness = vec![0.0; n * n];
        for at in gauss(points, 0.0, self.length) {
            let row = self.row(at.place);
            for i in 0..n {
                for j in (0..n).filter(|&j| self.components[i] == self.components[j]) {
                    stiffness[i * n + j] += at.weight * self.section.stiffness[self.components[i]] * row[i] * row[j];
                }
            }
        }
        stiffness
    }

    /// The strain at `mu` (m) for coordinates `c`, in the order of [`Strain`]. The strain of the surface at distance z from the
    /// neutral axis is z times the curvature.
    pub fn strain(&self, mu: f64, c: &[f64]) -> [f64; 6] {
        let mut strain = [0.0; 6];
        for ((value, &component), c) in self.row(mu).iter().zip(&self.components).zip(c) {
            strain[component] += value * c;
        }
        strain
    }

    /// Crosses a piece with coordinates `c` and rates `rates`.
    ///
    /// Law: fourth-order Magnus step (Iserles et al. 2000, section 5.3): `Omega = h/2 (e1 + e2) + sqrt(3)/12 h^2 e1 x e2` at the
    /// two Gauss points; the sign of the bracket is that of a strain that multiplies from the right.
    pub(super) fn cross<S: Scalar>(&self, piece: usize, c: &[S], rates: &[S]) -> Crossing<S> {
        let Piece { size, rows, .. } = &self.pieces[piece];
        let mut strains = rows.each_ref().map(|row| self.sum(row, c));
        for strain in &mut strains {
            strain.linear.z = strain.linear.z + 1.0;
        }
        let speeds = rows.each_ref().map(|row| self.sum(row, rates));
        let [one, two] = [0, 1].map(|k| along(strains[k], speeds[k]));
        let [one_rate, two_rate] = speeds.map(|speed| along(speed, Twist::zero()));
        let screw = magnus(one, two, *size);
        let bracket = (one_rate.cross(two) + one.cross(two_rate)) * Dual::from(bracket(*size));
        let change = (one_rate + two_rate) * Dual::from(0.5 * size) + bracket;
        let moving = tangent(screw, change);
        let screw = part(screw, |number| number.value);
        let twist = part(moving, |number| number.value);
        let acceleration = part(moving, |number| number.gradient[0]);
        Crossing { pose: exponential(screw), twist, acceleration, strains, screw }
    }

    /// The twist of the end of a piece relative to its begin, per unit rate of coordinate `k`.
    pub(super) fn column<S: Scalar>(&self, piece: usize, crossing: &Crossing<S>, k: usize) -> Twist<S> {
        let Piece { size, rows, .. } = &self.pieces[piece];
        let unit = unit(self.components[k]);
        let [one, two] = [rows[0][k], rows[1][k]].map(S::from_f64);
        let bracketed = unit.cross(crossing.strains[1]) * one + crossing.strains[0].cross(unit) * two;
        let change = unit * ((one + two) * (0.5 * size)) + bracketed * S::from_f64(bracket(*size));
        tangent(crossing.screw, change)
    }

    fn sum<S: Scalar>(&self, row: &[f64], c: &[S]) -> Twist<S> {
        let mut sum = [S::zero(); 6];
        for ((&value, &component), &c) in row.iter().zip(&self.components).zip(c) {
            sum[component] += c * value;
        }
        let [a, b, c, d, e, f] = sum;
        Twist::new(Vector3::new(a, b, c), Vector3::new(d, e, f))
    }
}

fn bracket(size: f64) -> f64 {
    3.0_f64.sqrt() / 12.0 * size * size
}

fn magnus<S: Scalar>(one: Twist<S>, two: Twist<S>, size: f64) -> Twist<S> {
    (one + two) * S::from_f64(0.5 * size) + one.cross(two) * S::from_f64(bracket(size))
}

fn unit<S: Scalar>(component: usize) -> Twist<S> {
    let mut parts = [0.0; 6];
    parts[component] = 1.0;
    let [a, b, c, d, e, f] = parts;
    Twist::new(Vector3::from_f64([a, b, c]), Vector3::from_f64([d, e, f]))
}

/// A twist as a function of time: value and rate.
fn along<S: Scalar>(value: Twist<S>, rate: Twist<S>) -> Twist<Dual<S, 1>> {
    let join = |v: Vector3<S>, r: Vector3<S>| {
        let dual = |value, rate| Dual { value, gradient: [rate] };
        Vector3::new(dual(v.x, r.x), dual(v.y, r.y), dual(v.z, r.z))
    };
    Twist::new(join(value.angular, rate.angular), join(value.linear, rate.linear))
}

/// One part of a twist over dual numbers.
fn part<S: Scalar>(twist: Twist<Dual<S, 1>>, pick: impl Fn(Dual<S, 1>) -> S) -> Twist<S> {
    let vector = |v: Vector3<Dual<S, 1>>| Vector3::from(v.to_array().map(&pick));
    Twist::new(vector(twist.angular), vector(twist.linear))
}
