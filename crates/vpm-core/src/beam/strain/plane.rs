//! The axis of a beam that bends in one plane and cannot stretch or shear: the exact map in closed form but for one quadrature.

use super::angles::Angles;
use super::sums::{Passing, Slices, Sums};
use crate::beam::entry::Component;
use crate::beam::fields::Fields;
use crate::beam::motion::{SectionMotion, Sections};
use crate::beam::quadrature::composite;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, SpatialInertia, Twist, Vector3};

/// Gauss points between neighbouring sections: exact to the sixth order of the angle that the beam bends between them.
const POINTS: usize = 3;

/// Share of a coordinate's largest turn below which its turn at a point is rounding.
const ROUNDING: f64 = 4e-15;

/// An axis whose slope angle is linear in the coordinates, `alpha(mu) = int_0^mu Phi q`.
///
/// Law: `r(mu) = int_0^mu t dmu` with the tangent t turned by alpha, and its derivatives under the same quadrature, so that Jacobian and
/// acceleration are those of the map itself to rounding. Checked: against the exponentials in space and against dual numbers.
#[derive(Clone, Debug)]
pub(in crate::beam) struct PlaneAxis {
    /// Whether it bends about y, deflecting along x; otherwise about x, along y.
    about_y: bool,
    n: usize,
    /// Weight of each point in m; a section instead of a point has none.
    weights: Vec<Option<f64>>,
    /// Derivative of the angle at each point by the coordinates.
    rows: Vec<f64>,
    angles: Angles,
}

impl PlaneAxis {
    /// An axis with sections at `places`, if the fields are one curvature and nothing else.
    pub fn new(fields: &Fields, places: &[f64]) -> Option<Self> {
        let [field] = &fields.list[..] else { return None };
        if !field.component.bends() {
            return None;
        }
        let mut axis = Self {
            about_y: field.component == Component::BendingY,
            n: fields.len(),
            weights: Vec::new(),
            rows: Vec::new(),
            angles: Angles::default(),
        };
        let mut points = Vec::new();
        let (mut begin, mut angle) = (0.0, vec![0.0; axis.n]);
        for &place in places {
            let inside = fields.breaks().into_iter().filter(|&at| at > begin && at < place);
            for end in inside.chain(std::iter::once(place)).collect::<Vec<_>>() {
                let reach = |to: f64| turned(fields, &angle, begin, to);
                for point in composite(POINTS, &[begin, end]) {
                    points.push((axis.weights.len(), point.place));
                    axis.weights.push(Some(point.weight));
                    axis.rows.extend(reach(point.place));
                }
                angle = reach(end);
                begin = end;
            }
            axis.weights.push(None);
            axis.rows.extend(&angle);
        }
        axis.drop_rounding();
        axis.angles = Angles::new(&points, field.basis.length(), &axis.rows, axis.n);
        Some(axis)
    }

    /// Makes zero what is rounding, as at the tip the integral of any Legendre polynomial but the first one.
    fn drop_rounding(&mut self) {
        for coordinate in 0..self.n {
            let own = self.rows.iter().skip(coordinate).step_by(self.n);
            let size = own.fold(0.0_f64, |most, entry| most.max(entry.abs()));
            let small =
                self.rows.iter_mut().skip(coordinate).step_by(self.n).filter(|entry| entry.abs() < ROUNDING * size);
            small.for_each(|entry| *entry = 0.0);
        }
    }

    /// Numbers of partial sums that a motion needs.
    pub fn scratch(&self) -> usize {
        2 * self.n + 2 * self.weights.len()
    }

    /// Poses, twists, columns and accelerations of all sections.
    pub fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>) {
        self.run((q, v), out, None);
    }

    /// As [`PlaneAxis::motion`], but of slices of the beam alone only sums, for a root that turns with `turn` about the axis of bending.
    pub fn gather<S: Scalar>(
        &self,
        (q, v): (&[S], &[S]),
        turn: S,
        (slices, sums): (&Slices<S>, &mut Sums<S>),
        out: &mut Sections<S>,
    ) {
        sums.clear();
        self.run((q, v), out, Some((turn, slices, sums)));
    }

    /// The slices of a beam with this axis and these inertias at its stations.
    pub fn slices<S: Scalar>(
        &self,
        inertias: &[SpatialInertia<S>],
        is_slice: impl Fn(usize) -> bool,
        (root, spatial): (&Pose<f64>, bool),
    ) -> Slices<S> {
        let rows = self.rows.chunks_exact(self.n).zip(&self.weights);
        let rows: Vec<_> = rows.filter(|(_, weight)| weight.is_none()).map(|(row, _)| row).collect();
        let across = self.vector([1.0, 0.0]);
        let axes = Matrix3::from_columns(across, self.axis(), Vector3::new(0.0, 0.0, 1.0));
        let frame = *root * Pose::new(axes, Vector3::zero());
        Slices::new((inertias, self.about_y), is_slice, &rows, (frame, spatial))
    }

    /// The axis of bending.
    pub fn axis(&self) -> Vector3<f64> {
        self.twist(1.0, [0.0; 2]).angular
    }

    /// Along the axis, station by station.
    ///
    /// With `turn` the rate of the root about the axis of bending, `change` is the acceleration in axes that do not turn. There the tangent
    /// turns with `turn + alpha'`, so that it is `-int_0^mu t (turn + alpha')^2 dmu`.
    fn run<S: Scalar>(
        &self,
        (q, v): (&[S], &[S]),
        out: &mut Sections<S>,
        mut sums: Option<(S, &Slices<S>, &mut Sums<S>)>,
    ) {
        let (n, mut station) = (self.n, 0);
        let zero = S::zero();
        let turn = sums.as_ref().map_or(zero, |(turn, ..)| *turn);
        // Across and along the root's axis: place, and acceleration at zero coordinate accelerations.
        let (mut place, mut change) = ([zero; 2], [zero; 2]);
        let mut scratch = std::mem::take(&mut out.scratch);
        let (running, rest) = scratch.split_at_mut(2 * n);
        let (angles, rates) = rest.split_at_mut(self.weights.len());
        running.fill(zero);
        self.angles.evaluate(&self.rows, q, zero, angles);
        self.angles.evaluate(&self.rows, v, turn, rates);
        let points = self.weights.iter().zip(self.rows.chunks_exact(n)).zip(angles.iter().zip(&*rates));
        for ((weight, row), (angle, &rate)) in points {
            let Some(weight) = *weight else {
                if let Some((_, slices, sums)) = &mut sums
                    && let Some(slice) = &slices.each[station]
                {
                    let passing = Passing { row, place, change, columns: running };
                    sums.add(slice, &passing);
                    if slices.spatial {
                        sums.add_in_space(slice, &passing, dot(row, q, zero).sin_cos());
                    }
                } else {
                    let (sin, cos) = dot(row, q, zero).sin_cos();
                    let rates = (dot(row, v, zero), turn);
                    self.section(row, (sin, cos, rates), (place, change, &*running), v, (station, &mut *out));
                }
                station += 1;
                continue;
            };
            let (sin, cos) = angle.sin_cos();
            let (sin, cos) = (sin * weight, cos * weight);
            let square = rate * rate;
            (place[0], place[1]) = (place[0] + sin, place[1] + cos);
            (change[0], change[1]) = (change[0] - sin * square, change[1] - cos * square);
            for (sums, &entry) in running.chunks_exact_mut(2).zip(row) {
                sums[0] += cos * entry;
                sums[1] -= sin * entry;
            }
        }
        out.scratch = scratch;
    }

    /// Writes one section from the sums up to it.
    fn section<S: Scalar>(
        &self,
        row: &[f64],
        (sin, cos, (rate, root)): (S, S, (S, S)),
        (place, change, running): ([S; 2], [S; 2], &[S]),
        v: &[S],
        (station, out): (usize, &mut Sections<S>),
    ) {
        // Into the section's axes: across and along.
        let turn = |[across, along]: [S; 2]| [cos * across - sin * along, sin * across + cos * along];
        let columns = &mut out.columns[station * self.n..(station + 1) * self.n];
        let mut speed = [S::zero(); 2];
        for (((column, sums), &entry), &v) in columns.iter_mut().zip(running.chunks_exact(2)).zip(row).zip(v) {
            let own = turn([sums[0], sums[1]]);
            *column = self.twist(S::from_f64(entry), own);
            (speed[0], speed[1]) = (speed[0] + own[0] * v, speed[1] + own[1] * v);
        }
        // Without the root's turning: less `2 w x dr/dt + w x (w x r)`.
        let square = root * root;
        let change = turn([change[0] + place[0] * square, change[1] + place[1] * square]);
        // d/dt of R^T dr/dt: the axes turn with the rate.
        let both = rate + root * 2.0;
        let change = [change[0] - both * speed[1], change[1] + both * speed[0]];
        let pose = Pose::new(self.rotation(sin, cos), self.vector(place));
        out.at[station] =
            SectionMotion { pose, twist: self.twist(rate, speed), acceleration: self.twist(S::zero(), change) };
    }

    fn vector<S: Scalar>(&self, [across, along]: [S; 2]) -> Vector3<S> {
        let zero = S::zero();
        if self.about_y { Vector3::new(across, zero, along) } else { Vector3::new(zero, -across, along) }
    }

    fn twist<S: Scalar>(&self, rate: S, speed: [S; 2]) -> Twist<S> {
        let zero = S::zero();
        let angular = if self.about_y { Vector3::new(zero, rate, zero) } else { Vector3::new(rate, zero, zero) };
        Twist::new(angular, self.vector(speed))
    }

    fn rotation<S: Scalar>(&self, sin: S, cos: S) -> Matrix3<S> {
        let (zero, one) = (S::zero(), S::one());
        let [x, y, z] = [[one, zero, zero], [zero, one, zero], [zero, zero, one]].map(Vector3::from);
        if self.about_y {
            Matrix3::from_columns(Vector3::new(cos, zero, -sin), y, Vector3::new(sin, zero, cos))
        } else {
            let _ = (y, z);
            Matrix3::from_columns(x, Vector3::new(zero, cos, sin), Vector3::new(zero, -sin, cos))
        }
    }
}

/// The derivative of the angle at `to` by the coordinates, from that at `begin`.
fn turned(fields: &Fields, angle: &[f64], begin: f64, to: f64) -> Vec<f64> {
    let mut turned = angle.to_vec();
    for point in composite(fields.points(), &[begin, to]) {
        for (sum, entry) in turned.iter_mut().zip(fields.strain_row(point.place)) {
            *sum += point.weight * entry;
        }
    }
    turned
}

pub(super) fn dot<S: Scalar>(row: &[f64], x: &[S], begin: S) -> S {
    row.iter().zip(x).fold(begin, |sum, (&entry, &x)| sum + x * entry)
}
