//! General and symmetric 3 x 3 matrices.

use std::ops::{Add, AddAssign, Mul, Sub};

use super::Vector3;
use crate::scalar::Scalar;

/// A 3 x 3 matrix by columns: the columns of a rotation `R_AB` are the axes of B seen in A.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matrix3<S> {
    /// The three columns.
    pub columns: [Vector3<S>; 3],
}

impl<S: Scalar> Matrix3<S> {
    /// Matrix from its columns.
    #[inline]
    pub fn from_columns(x: Vector3<S>, y: Vector3<S>, z: Vector3<S>) -> Self {
        Self { columns: [x, y, z] }
    }

    /// Matrix from nine constants, row by row.
    #[inline]
    pub fn from_rows_f64(rows: [f64; 9]) -> Self {
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = rows;
        Self::from_columns(
            Vector3::from_f64([xx, yx, zx]),
            Vector3::from_f64([xy, yy, zy]),
            Vector3::from_f64([xz, yz, zz]),
        )
    }

    /// Identity matrix.
    #[inline]
    pub fn identity() -> Self {
        Self::from_rows_f64([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    }

    /// `[v]x`, the matrix with `[v]x w = v x w`.
    #[inline]
    pub fn skew(v: Vector3<S>) -> Self {
        let zero = S::zero();
        Self::from_columns(Vector3::new(zero, v.z, -v.y), Vector3::new(-v.z, zero, v.x), Vector3::new(v.y, -v.x, zero))
    }

    /// Rotation matrix by `angle` (rad) about the unit vector `axis`, right-handed.
    ///
    /// Law: `R = 1 + sin(angle) [a]x + (1 - cos(angle)) [a]x^2` (Rodrigues; Featherstone 2008, section 2.8).
    pub fn rotation(axis: Vector3<S>, angle: S) -> Self {
        let (sine, cosine) = angle.sin_cos();
        let column =
            |unit: Vector3<S>| unit * cosine + axis.cross(unit) * sine + axis * (axis.dot(unit) * (S::one() - cosine));
        let [x, y, z] = Self::identity().columns;
        Self::from_columns(column(x), column(y), column(z))
    }

    /// Transposed matrix, for a rotation its inverse.
    #[inline]
    pub fn transpose(self) -> Self {
        let [x, y, z] = self.columns;
        Self::from_columns(Vector3::new(x.x, y.x, z.x), Vector3::new(x.y, y.y, z.y), Vector3::new(x.z, y.z, z.z))
    }

    /// Matrix product `A^T v`, without forming the transpose.
    #[inline]
    pub fn transpose_mul(self, v: Vector3<S>) -> Vector3<S> {
        let [x, y, z] = self.columns;
        Vector3::new(x.dot(v), y.dot(v), z.dot(v))
    }

    /// Matrix product `A B^T`.
    #[inline]
    pub fn mul_transpose(self, other: Self) -> Self {
        self * other.transpose()
    }

    /// Determinant of the matrix.
    pub fn determinant(self) -> S {
        let [x, y, z] = self.columns;
        x.dot(y.cross(z))
    }

    /// The symmetric matrix with this one's upper triangle. For products that are symmetric in exact arithmetic.
    #[inline]
    pub fn upper(self) -> Symmetric3<S> {
        let [x, y, z] = self.columns;
        Symmetric3 { xx: x.x, yy: y.y, zz: z.z, xy: y.x, xz: z.x, yz: z.y }
    }
}

impl<S: Scalar> Mul<Vector3<S>> for Matrix3<S> {
    type Output = Vector3<S>;
    #[inline]
    fn mul(self, v: Vector3<S>) -> Vector3<S> {
        let [x, y, z] = self.columns;
        x * v.x + y * v.y + z * v.z
    }
}

impl<S: Scalar> Mul for Matrix3<S> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self { columns: other.columns.map(|column| self * column) }
    }
}

impl<S: Scalar> Add for Matrix3<S> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.columns, other.columns);
        Self::from_columns(a + x, b + y, c + z)
    }
}

impl<S: Scalar> Sub for Matrix3<S> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.columns, other.columns);
        Self::from_columns(a - x, b - y, c - z)
    }
}

/// A symmetric 3 x 3 matrix by its six entries.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Symmetric3<S> {
    /// Entry (1, 1).
    pub xx: S,
    /// Entry (2, 2).
    pub yy: S,
    /// Entry (3, 3).
    pub zz: S,
    /// Entry (1, 2).
    pub xy: S,
    /// Entry (1, 3).
    pub xz: S,
    /// Entry (2, 3).
    pub yz: S,
}

impl<S: Scalar> Symmetric3<S> {
    /// Symmetric matrix from xx yy zz xy xz yz.
    #[inline]
    pub fn from_array([xx, yy, zz, xy, xz, yz]: [S; 6]) -> Self {
        Self { xx, yy, zz, xy, xz, yz }
    }

    /// Symmetric matrix as xx yy zz xy xz yz.
    #[inline]
    pub fn to_array(self) -> [S; 6] {
        [self.xx, self.yy, self.zz, self.xy, self.xz, self.yz]
    }

    /// The zero matrix.
    #[inline]
    pub fn zero() -> Self {
        Self::from_array([S::zero(); 6])
    }

    /// Symmetric matrix: `factor` times the identity.
    #[inline]
    pub fn diagonal(factor: S) -> Self {
        let zero = S::zero();
        Self { xx: factor, yy: factor, zz: factor, xy: zero, xz: zero, yz: zero }
    }

    /// All nine entries of the symmetric matrix.
    #[inline]
    pub fn full(self) -> Matrix3<S> {
        Matrix3::from_columns(
            Vector3::new(self.xx, self.xy, self.xz),
            Vector3::new(self.xy, self.yy, self.yz),
            Vector3::new(self.xz, self.yz, self.zz),
        )
    }

    /// Rotated symmetric matrix `R A R^T`: the same tensor in the axes that `R` turns into.
    #[inline]
    pub fn rotated(self, rotation: Matrix3<S>) -> Self {
        let turned = rotation * self.full();
        let [x, y, z] = turned.transpose().columns;
        let [a, b, c] = rotation.transpose().columns;
        Self { xx: x.dot(a), yy: y.dot(b), zz: z.dot(c), xy: x.dot(b), xz: x.dot(c), yz: y.dot(c) }
    }

    /// `2 (a . b) 1 - a b^T - b a^T = -[a]x [b]x - [b]x [a]x`, the symmetric product of two cross product matrices.
    #[inline]
    pub fn cross_product(a: Vector3<S>, b: Vector3<S>) -> Self {
        let (x, y, z) = (a.x * b.x, a.y * b.y, a.z * b.z);
        Self {
            xx: (y + z) * 2.0,
            yy: (x + z) * 2.0,
            zz: (x + y) * 2.0,
            xy: -(a.x * b.y + a.y * b.x),
            xz: -(a.x * b.z + a.z * b.x),
            yz: -(a.y * b.z + a.z * b.y),
        }
    }
}

impl<S: Scalar> Mul<Vector3<S>> for Symmetric3<S> {
    type Output = Vector3<S>;
    #[inline]
    fn mul(self, v: Vector3<S>) -> Vector3<S> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

impl<S: Scalar> Mul<S> for Symmetric3<S> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: S) -> Self {
        Self::from_array(self.to_array().map(|entry| entry * factor))
    }
}

impl<S: Scalar> Add for Symmetric3<S> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            yy: self.yy + other.yy,
            zz: self.zz + other.zz,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yz: self.yz + other.yz,
        }
    }
}

impl<S: Scalar> Sub for Symmetric3<S> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self {
            xx: self.xx - other.xx,
            yy: self.yy - other.yy,
            zz: self.zz - other.zz,
            xy: self.xy - other.xy,
            xz: self.xz - other.xz,
            yz: self.yz - other.yz,
        }
    }
}

impl<S: Scalar> AddAssign for Symmetric3<S> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
