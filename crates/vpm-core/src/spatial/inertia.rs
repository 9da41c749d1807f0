//! Inertia of a rigid body in ten parameters.

use std::ops::{Add, AddAssign};

use super::{Symmetric3, Twist, Vector3, Wrench};
use crate::scalar::Scalar;

/// Inertia of a rigid body about the origin of its frame: mass, first moment and rotational inertia (ten numbers).
///
/// Law: the momentum of a twist `[w; v]` is `[I w + h x v; m v - h x w]` with h = m c.
/// Source: Featherstone 2008, section 2.13. Checked: against the point masses that it stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpatialInertia<S> {
    /// Mass m in kg.
    pub mass: S,
    /// First moment h = m c in kg m, with c the centre of mass.
    pub first_moment: Vector3<S>,
    /// Rotational inertia about the frame origin in kg m^2.
    pub rotational: Symmetric3<S>,
}

impl<S: Scalar> SpatialInertia<S> {
    /// Inertia of no mass.
    #[inline]
    pub fn zero() -> Self {
        Self { mass: S::zero(), first_moment: Vector3::zero(), rotational: Symmetric3::zero() }
    }

    /// From mass (kg), centre of mass (m) and rotational inertia about the centre of mass (kg m^2): `I = I_c - m [c]x^2`.
    pub fn new(mass: S, center_of_mass: Vector3<S>, central: Symmetric3<S>) -> Self {
        let first_moment = center_of_mass * mass;
        let steiner = Symmetric3::cross_product(center_of_mass, first_moment) * S::from_f64(0.5);
        Self { mass, first_moment, rotational: central + steiner }
    }

    /// Inertia of a mass (kg) in one point (m).
    pub fn point_mass(mass: S, position: Vector3<S>) -> Self {
        Self::new(mass, position, Symmetric3::zero())
    }

    /// Centre of mass of an inertia in m. Only for positive mass.
    pub fn center_of_mass(self) -> Vector3<S> {
        self.first_moment * self.mass.recip()
    }

    /// Rotational inertia about the centre of mass in kg m^2. Only for positive mass.
    pub fn central(self) -> Symmetric3<S> {
        let steiner = Symmetric3::cross_product(self.center_of_mass(), self.first_moment) * S::from_f64(0.5);
        self.rotational - steiner
    }

    /// The same inertia in plain numbers, for checks.
    pub fn value(self) -> SpatialInertia<f64> {
        let first_moment = Vector3::from(self.first_moment.to_array().map(|entry| entry.inspect()));
        let rotational = Symmetric3::from_array(self.rotational.to_array().map(|entry| entry.inspect()));
        SpatialInertia { mass: self.mass.inspect(), first_moment, rotational }
    }

    /// Momentum of an inertia moving with `v`, as a wrench about the frame origin.
    #[inline]
    pub fn apply(&self, v: Twist<S>) -> Wrench<S> {
        Wrench::new(
            self.rotational * v.angular + self.first_moment.cross(v.linear),
            v.linear * self.mass - self.first_moment.cross(v.angular),
        )
    }

    /// Kinetic energy in J of the body moving with `v`: 1/2 V . M V.
    #[inline]
    pub fn kinetic_energy(&self, v: Twist<S>) -> S {
        v.power(self.apply(v)) * 0.5
    }
}

impl<S: Scalar> Add for SpatialInertia<S> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            rotational: self.rotational + other.rotational,
        }
    }
}

impl<S: Scalar> AddAssign for SpatialInertia<S> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Principal moments of inertia: eigenvalues of a symmetric matrix, ascending. By Jacobi rotations (Golub & Van Loan
/// 2013, section 8.5).
///
/// Used once per body at build, for the message as much as for the check.
pub fn principal_moments(inertia: Symmetric3<f64>) -> [f64; 3] {
    const SWEEPS: usize = 12; // convergence is quadratic: six sweeps reach rounding for any 3 x 3 matrix
    let Symmetric3 { xx, yy, zz, xy, xz, yz } = inertia;
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            jacobi_rotation(&mut a, p, q);
        }
    }
    let mut moments = [a[0][0], a[1][1], a[2][2]];
    moments.sort_by(f64::total_cmp);
    moments
}

/// Jacobi rotation for principal moments of inertia: zeroes entry (p, q), p < q, on both sides.
fn jacobi_rotation(a: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let ratio = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let sine = tangent * cosine;
    let rotate = |x: &mut f64, y: &mut f64| (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    for row in a.iter_mut() {
        let (left, right) = row.split_at_mut(q);
        rotate(&mut left[p], &mut right[0]);
    }
    let (top, bottom) = a.split_at_mut(q);
    for (x, y) in top[p].iter_mut().zip(&mut bottom[0]) {
        rotate(x, y);
    }
}
