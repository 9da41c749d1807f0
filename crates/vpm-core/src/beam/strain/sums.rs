//! Integrals over a beam that bends in one plane, in the axes of its root instead of those of its stations.
//!
//! Let r be the place of a slice of mass m, and `J_i = dr/dq_i`. Then all that the dynamics need of many slices are sums like
//! `sum m J_i . J_j` and `sum m r x J_i`: no slice is turned into axes of its own. The stations are those of the beam, so that both ways
//! agree to rounding. Axes: across, the axis of bending, along. Source: Shabana 2013, "Dynamics of Multibody Systems", sections 5.2 to
//! 5.5, the inertia shape integrals of a floating frame, here at the current state.

use crate::scalar::Scalar;
use crate::spatial::{Pose, SpatialInertia, Symmetric3, Vector3};

/// What the slices of a beam weigh, of parameters alone, and how the beam sits on its root.
#[derive(Clone, Debug)]
pub(crate) struct Slices<S> {
    /// By station; none where something else can sit.
    pub(super) each: Vec<Option<Slice<S>>>,
    /// Across, axis of bending and along, in what carries the beam.
    pub(crate) frame: Pose<f64>,
    /// Whether the root may turn about other axes than that of bending.
    pub(crate) spatial: bool,
    mass: S,
    /// About the axis of bending, all slices.
    rotary: S,
    /// Moment of momentum of the slices' own turning per unit rate of each coordinate.
    pub(crate) turning: Vec<S>,
    /// What that turning adds to the mass matrix, row by row.
    pub(crate) block: Vec<S>,
}

/// Mass and rotary inertia (across, axis of bending, along) of a station that is nothing but a slice of the beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice<S> {
    mass: S,
    rotary: [S; 3],
}

/// The sums at a state. "Across" comes before "along" in all pairs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sums<S> {
    /// `sum m r`.
    pub(crate) first: [S; 2],
    /// `sum m x x`, `sum m z z`, `sum m x z`, x across and z along.
    second: [S; 3],
    /// Rotary inertia beyond that of slices which are not turned: across and across, across and along.
    turned: [S; 2],
    /// `sum m r'`, r' the acceleration in the plane by the rate of the root about the axis of bending and the rates of the coordinates.
    pub(crate) force: [S; 2],
    /// `sum m r x r'` about the axis of bending.
    pub(crate) moment: S,
    pub(crate) columns: Vec<Column<S>>,
    /// `sum m J_i . J_j`, row by row, the lower triangle.
    pub(crate) block: Vec<S>,
    /// `m J` of one slice.
    heavy: Vec<[S; 2]>,
}

/// The sums of one coordinate.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Column<S> {
    /// `sum m J`.
    pub(crate) momentum: [S; 2],
    /// `sum m r x J` about the axis of bending, without the slices' own turning.
    pub(crate) angular: S,
    /// `sum m J . r'`.
    pub(crate) effort: S,
    /// Half the derivatives of the moments of second order by the coordinate: `xx`, `zz`, and twice that of `xz`.
    ///
    /// Those of the slices' rotary inertia are in them, as if it came of masses in the plane. Only for roots that move in space.
    pub(crate) spread: [S; 3],
}

/// A station as the running sums along the axis have it.
pub(super) struct Passing<'a, S> {
    /// Derivatives of its angle by the coordinates.
    pub(super) row: &'a [f64],
    pub(super) place: [S; 2],
    pub(super) change: [S; 2],
    /// J, one after the other.
    pub(super) columns: &'a [S],
}

impl<S: Scalar> Slices<S> {
    /// Slices for sums over a beam: the stations that `is_slice` names. They have the beam's inertias and the
    /// derivatives of its angle (`rows`) there.
    pub(super) fn new(
        (inertias, about_y): (&[SpatialInertia<S>], bool),
        is_slice: impl Fn(usize) -> bool,
        rows: &[&[f64]],
        (frame, spatial): (Pose<f64>, bool),
    ) -> Self {
        let n = rows.first().map_or(0, |row| row.len());
        let zero = S::zero();
        let (mut turning, mut block) = (vec![zero; n], vec![zero; n * n]);
        let (mut mass, mut rotary) = (zero, zero);
        let mut each = Vec::with_capacity(inertias.len());
        for (station, (inertia, row)) in inertias.iter().zip(rows).enumerate() {
            if !is_slice(station) {
                each.push(None);
                continue;
            }
            let Symmetric3 { xx, yy, zz, .. } = inertia.rotational;
            let [across, about] = if about_y { [xx, yy] } else { [yy, xx] };
            mass += inertia.mass;
            rotary += about;
            for (i, &entry) in row.iter().enumerate() {
                turning[i] += about * entry;
                for (sum, &other) in block[i * n..].iter_mut().zip(row.iter()) {
                    *sum += about * (entry * other);
                }
            }
            each.push(Some(Slice { mass: inertia.mass, rotary: [across, about, zz] }));
        }
        Self { each, frame, spatial, mass, rotary, turning, block }
    }

    /// Whether a station is part of the sums.
    #[inline]
    pub(crate) fn has(&self, station: usize) -> bool {
        self.each[station].is_some()
    }

    /// Buffers for the sums.
    pub(crate) fn sums(&self) -> Sums<S> {
        let n = self.turning.len();
        Sums {
            columns: vec![Column::default(); n],
            block: vec![S::zero(); n * n],
            heavy: vec![[S::zero(); 2]; n],
            ..Sums::default()
        }
    }

    /// Sum of the inertia of all slices where they are, about the root. It is in axes across, of bending and along.
    ///
    /// Law: `I = sum m (|r|^2 1 - r r^T) + R diag(I_b) R^T`. A root that turns about the axis of bending alone asks only for the moment about
    /// that.
    pub(crate) fn inertia(&self, sums: &Sums<S>) -> SpatialInertia<S> {
        let ([x, z], [xx, zz, xz], zero) = (sums.first, sums.second, S::zero());
        let mut rotational = Symmetric3::zero();
        rotational.yy = xx + zz + self.rotary;
        if self.spatial {
            let whole = self
                .each
                .iter()
                .flatten()
                .fold([zero; 2], |[across, along], Slice { rotary, .. }| [across + rotary[0], along + rotary[2]]);
            rotational.xx = zz + whole[0] + sums.turned[0];
            rotational.zz = xx + whole[1] - sums.turned[0];
            rotational.xz = sums.turned[1] - xz;
        }
        SpatialInertia { mass: self.mass, first_moment: Vector3::new(x, zero, z), rotational }
    }
}

impl<S: Scalar> Sums<S> {
    pub(super) fn clear(&mut self) {
        let zero = S::zero();
        (self.first, self.second, self.turned) = ([zero; 2], [zero; 3], [zero; 2]);
        (self.force, self.moment) = ([zero; 2], zero);
        self.columns.fill(Column::default());
        self.block.fill(zero);
    }

    /// Adds a slice to the sums that do not depend on the root's motion, for N coordinates or with 0 for any number.
    #[inline]
    pub(super) fn add<const N: usize>(&mut self, slice: &Slice<S>, at: &Passing<'_, S>) {
        let n = if N == 0 { self.columns.len() } else { N };
        let (m, [x, z], [across, along]) = (slice.mass, at.place, at.change);
        let (mx, mz) = (x * m, z * m);
        (self.first[0], self.first[1]) = (self.first[0] + mx, self.first[1] + mz);
        (self.second[0], self.second[1]) = (self.second[0] + mx * x, self.second[1] + mz * z);
        (self.force[0], self.force[1]) = (self.force[0] + across * m, self.force[1] + along * m);
        self.moment += mz * across - mx * along;
        let (columns, heavy, own) = (&mut self.columns[..n], &mut self.heavy[..n], &at.columns[..2 * n]);
        for ((column, heavy), own) in columns.iter_mut().zip(&mut *heavy).zip(own.chunks_exact(2)) {
            *heavy = [own[0] * m, own[1] * m];
            let Column { momentum, angular, effort, .. } = column;
            (momentum[0], momentum[1]) = (momentum[0] + heavy[0], momentum[1] + heavy[1]);
            *angular += mz * own[0] - mx * own[1];
            *effort += heavy[0] * across + heavy[1] * along;
        }
        for (i, (own, row)) in own.chunks_exact(2).zip(self.block[..n * n].chunks_exact_mut(n)).enumerate() {
            for (sum, heavy) in row[..=i].iter_mut().zip(&*heavy) {
                *sum += heavy[0] * own[0] + heavy[1] * own[1];
            }
        }
    }

    /// Adds a slice to the sums for a root that moves in space. It is turned by an angle of this sine and cosine.
    ///
    /// Law: `R diag(a, b, c) R^T` has `a + d s s`, `c - d s s` and `d s c` in the plane, `d = c - a`; its derivative by the angle is
    /// `2 d s c`, its opposite and `d (c c - s s)`.
    pub(super) fn add_in_space(&mut self, slice: &Slice<S>, at: &Passing<'_, S>, (sin, cos): (S, S)) {
        let Slice { mass, rotary: [across, _, along] } = *slice;
        let [x, z] = at.place;
        let (mx, mz, difference) = (x * mass, z * mass, along - across);
        let (square, product) = (sin * sin * difference, sin * cos * difference);
        self.second[2] += mx * z;
        (self.turned[0], self.turned[1]) = (self.turned[0] + square, self.turned[1] + product);
        let skew = difference - square * 2.0;
        for ((column, own), &entry) in self.columns.iter_mut().zip(at.columns.chunks_exact(2)).zip(at.row) {
            let [xx, zz, xz] = &mut column.spread;
            *xx += mx * own[0] - product * entry;
            *zz += mz * own[1] + product * entry;
            *xz += mz * own[0] + mx * own[1] - skew * entry;
        }
    }
}
