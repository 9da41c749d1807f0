//! The integrals over one link, in the plane.

use super::chain::LinkParameters;
use crate::beam::quadrature::{Station, gauss};
use crate::beam::{Basis, dimension};
use crate::error::{Error, Result};
use crate::scalar::Scalar;

/// What never changes about a link.
#[derive(Clone, Debug)]
pub(super) struct Link<const EACH: usize> {
    pub parameters: LinkParameters,
    pub basis: Basis,
    stations: Vec<Place<EACH>>,
    /// `cumulative[g][h]`: weight of station h in an integral from the root to station g, row by row, in m.
    cumulative: Vec<f64>,
    /// `w(L)`, the row of the tip's angle.
    pub tip_row: [f64; EACH],
    /// Elastic stiffness over the coordinates of the link.
    pub stiffness: [[f64; EACH]; EACH],
    /// Rotary inertia of hub, sections and tip body over the coordinates.
    pub rotary: [[f64; EACH]; EACH],
}

#[derive(Clone, Copy, Debug)]
struct Place<const EACH: usize> {
    weight: f64,
    row: [f64; EACH],
}

/// Jacobian of a point and its acceleration at zero coordinate accelerations, relative to the link's joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<S, const EACH: usize> {
    pub jacobian: [[S; EACH]; 2],
    pub acceleration: [S; 2],
}

/// The integrals of one link in a state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integrals<S, const EACH: usize> {
    /// `int rhoA J^T J ds`.
    pub mass: [[S; EACH]; EACH],
    /// `int rhoA J^T b ds`, b the acceleration at zero coordinate accelerations.
    pub bias: [S; EACH],
    /// `int rhoA J ds`.
    pub moment: [[S; EACH]; 2],
    /// `int rhoA b ds`.
    pub force: [S; 2],
    /// The tip.
    pub tip: Point<S, EACH>,
}

impl<S: Scalar, const EACH: usize> Point<S, EACH> {
    pub fn zero() -> Self {
        Self { jacobian: [[S::zero(); EACH]; 2], acceleration: [S::zero(); 2] }
    }

    /// The motion of a unit tangent at angle `row . x`, turned by the coordinates.
    fn direction(row: &[f64; EACH], x: &[S; EACH], v: &[S; EACH]) -> Self {
        let (mut angle, mut rate) = (S::zero(), S::zero());
        for k in 0..EACH {
            angle += x[k] * row[k];
            rate += v[k] * row[k];
        }
        let (sin, cos) = angle.sin_cos();
        let square = rate * rate;
        Self { jacobian: [row.map(|w| -sin * w), row.map(|w| cos * w)], acceleration: [-cos * square, -sin * square] }
    }

    #[inline]
    fn add(&mut self, other: &Self, factor: f64) {
        for (own, other) in self.jacobian.as_flattened_mut().iter_mut().zip(other.jacobian.as_flattened()) {
            *own += *other * factor;
        }
        for (own, other) in self.acceleration.iter_mut().zip(other.acceleration) {
            *own += other * factor;
        }
    }
}

impl<const EACH: usize> Link<EACH> {
    /// Precomputes a link whose curvature has `EACH - 1` coefficients, with Gauss rules of `points` stations.
    pub fn new(parameters: LinkParameters, basis: Basis, points: usize) -> Result<Self> {
        parameters.check()?;
        dimension("the curvature basis of a link", EACH - 1, basis.len(), "curvature coordinate of the chain")?;
        if basis.breaks().len() != 2 || !(2..=40).contains(&points) {
            let condition = "lie between 2 and 40, for a curvature that is one polynomial over the link".to_owned();
            let repair = "use a Legendre, Bernstein or monomial basis and 5 to 12 stations";
            return Err(Error::Setting { setting: "the stations of a link", condition, value: points as f64, repair });
        }
        let length = basis.length();
        let rule = gauss(points, 0.0, length);
        let stations: Vec<_> =
            rule.iter().map(|at| Place { weight: at.weight, row: angle_row(&basis, at.place) }).collect();
        let tip_row = angle_row(&basis, length);
        let stiffness = elastic(&basis, parameters.bending);
        let mut rotary = [[0.0; EACH]; EACH];
        rotary[0][0] = parameters.hub.inertia;
        add_square(&mut rotary, parameters.tip.inertia, &tip_row);
        for at in gauss(basis.points() + 1, 0.0, length) {
            add_square(&mut rotary, parameters.rotary * at.weight, &angle_row(&basis, at.place));
        }
        Ok(Self { parameters, basis, stations, cumulative: cumulative(&rule), tip_row, stiffness, rotary })
    }

    /// Length of the beam in m.
    pub fn length(&self) -> f64 {
        self.basis.length()
    }

    /// From the joint to the tip, in m.
    pub fn reach<S: Scalar>(&self, x: &[S; EACH]) -> [S; 2] {
        let mut sum = [x[0].cos() * self.parameters.hub.radius, x[0].sin() * self.parameters.hub.radius];
        for at in &self.stations {
            let angle: S = x.iter().zip(at.row).map(|(&x, row)| x * row).sum();
            let (sin, cos) = angle.sin_cos();
            sum = [sum[0] + cos * at.weight, sum[1] + sin * at.weight];
        }
        sum
    }

    /// Mass of the beam in kg.
    pub fn mass(&self) -> f64 {
        self.parameters.line * self.length()
    }

    /// The integrals at coordinates `x` and rates `v`; `scratch` holds one point for each station.
    pub fn integrals<S: Scalar>(
        &self,
        x: &[S; EACH],
        v: &[S; EACH],
        scratch: &mut [Point<S, EACH>],
    ) -> Integrals<S, EACH> {
        let mut rim = Point::zero();
        if self.parameters.hub.radius > 0.0 {
            let mut row = [0.0; EACH];
            row[0] = 1.0;
            rim.add(&Point::direction(&row, x, v), self.parameters.hub.radius);
        }
        let mut tip = rim;
        for (point, at) in scratch.iter_mut().zip(&self.stations) {
            *point = Point::direction(&at.row, x, v);
            tip.add(point, at.weight);
        }
        let zero = S::zero();
        let (mass, bias, force) = ([[zero; EACH]; EACH], [zero; EACH], [zero; 2]);
        let mut sums = Integrals { mass, bias, moment: [[zero; EACH]; 2], force, tip };
        for (at, weights) in self.stations.iter().zip(self.cumulative.chunks_exact(self.stations.len())) {
            let mut point = rim;
            for (direction, &weight) in scratch.iter().zip(weights) {
                point.add(direction, weight);
            }
            sums.add(&point, at.weight * self.parameters.line);
        }
        sums.mirror();
        sums
    }
}

impl<S: Scalar, const EACH: usize> Integrals<S, EACH> {
    /// Adds a point mass; of the mass matrix only the lower triangle.
    #[inline]
    fn add(&mut self, point: &Point<S, EACH>, mass: f64) {
        for axis in 0..2 {
            let row = &point.jacobian[axis];
            let weighted = row.map(|entry| entry * mass);
            let acceleration = point.acceleration[axis];
            self.force[axis] += acceleration * mass;
            for (i, &entry) in weighted.iter().enumerate() {
                self.moment[axis][i] += entry;
                self.bias[i] += entry * acceleration;
                for (sum, &other) in self.mass[i][..=i].iter_mut().zip(row) {
                    *sum += entry * other;
                }
            }
        }
    }

    fn mirror(&mut self) {
        for i in 0..EACH {
            for j in 0..i {
                self.mass[j][i] = self.mass[i][j];
            }
        }
    }
}

/// The row w(s) of the section's angle: 1 for the hub, `int_0^s Phi` for the curvature.
fn angle_row<const EACH: usize>(basis: &Basis, s: f64) -> [f64; EACH] {
    let mut row = [0.0; EACH];
    row[0] = 1.0;
    for at in gauss(basis.points() + 1, 0.0, s) {
        for (sum, value) in row[1..].iter_mut().zip(basis.evaluate(at.place, 0)) {
            *sum += at.weight * value;
        }
    }
    row
}

/// `int EJ Phi^T Phi ds`, bordered by zero for the hub.
fn elastic<const EACH: usize>(basis: &Basis, bending: f64) -> [[f64; EACH]; EACH] {
    let mut stiffness = [[0.0; EACH]; EACH];
    for at in gauss(basis.points() + 1, 0.0, basis.length()) {
        let mut row = [0.0; EACH];
        row[1..].copy_from_slice(&basis.evaluate(at.place, 0));
        add_square(&mut stiffness, bending * at.weight, &row);
    }
    stiffness
}

fn add_square<const EACH: usize>(matrix: &mut [[f64; EACH]; EACH], factor: f64, row: &[f64; EACH]) {
    for (line, left) in matrix.iter_mut().zip(row) {
        for (entry, right) in line.iter_mut().zip(row) {
            *entry += factor * left * right;
        }
    }
}

/// Weights of the integral from 0 to each station of the polynomial through all stations.
fn cumulative(rule: &[Station]) -> Vec<f64> {
    let lagrange = |h: usize, s: f64| -> f64 {
        let others = rule.iter().enumerate().filter(|(k, _)| *k != h);
        others.map(|(_, other)| (s - other.place) / (rule[h].place - other.place)).product()
    };
    let row = |end: f64| {
        let inner = gauss(rule.len(), 0.0, end);
        (0..rule.len()).map(move |h| inner.iter().map(|at| at.weight * lagrange(h, at.place)).sum::<f64>())
    };
    rule.iter().flat_map(|at| row(at.place).collect::<Vec<_>>()).collect()
}
