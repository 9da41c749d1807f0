//! The axis of a beam that bends in one plane and cannot stretch or shear: the exact map in closed form but for one quadrature.

use std::ops::Range;

use super::angles::Angles;
use super::sums::{Passing, Slices, Sums};
use crate::beam::entry::Component;
use crate::beam::fields::Fields;
use crate::beam::motion::{SectionMotion, Sections};
use crate::beam::quadrature::composite;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, SpatialInertia, Twist, Vector3};

/// Gauss points of a rule: exact to the sixth order of the angle that the beam bends over its interval.
const POINTS: usize = 3;

/// Share of a coordinate's largest turn below which its turn at a point is rounding.
const ROUNDING: f64 = 4e-15;

/// Over which intervals places along an axis are integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::beam) enum Rule {
    /// From section to section, whatever lies between them.
    Sections,
    /// Over one element after the other, each of which bends little: up to a section inside by the polynomial through the tangents at the
    /// points of the rule and at both ends, which over the whole element is the rule itself.
    Elements,
}

/// Share of an element below which two places are one.
const SAME: f64 = 1e-12;

/// An axis whose slope angle is linear in the coordinates, `alpha(mu) = int_0^mu Phi q`.
///
/// Law: `r(mu) = int_0^mu t dmu` with the tangent t turned by alpha, and its derivatives under the same quadrature, so that Jacobian and
/// acceleration are those of the map itself to rounding. Checked: against the exponentials in space and against dual numbers.
#[derive(Clone, Debug)]
pub(in crate::beam) struct PlaneAxis {
    /// Whether it bends about y, deflecting along x; otherwise about x, along y.
    about_y: bool,
    n: usize,
    /// Derivative of the angle at each point by the coordinates, then at each section that is none of them.
    rows: Vec<f64>,
    points: usize,
    angles: Angles,
    sections: Vec<Section>,
    /// Points, section by section: what lies between it and the section before.
    terms: Vec<usize>,
    /// Of each of these its weight in m, then that times the derivatives of its angle by the coordinates.
    weights: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Section {
    /// Number of its row.
    row: usize,
    terms: Range<usize>,
}

impl PlaneAxis {
    /// Axis in a plane with sections at `places`, if the fields are one curvature and nothing else.
    pub fn new(fields: &Fields, places: &[f64], rule: Rule) -> Option<Self> {
        let [field] = &fields.list[..] else { return None };
        if !field.component.bends() {
            return None;
        }
        let mut grid = Grid { fields, points: Vec::new(), rows: Vec::new() };
        let (sections, terms) = match rule {
            Rule::Sections => grid.between(places),
            Rule::Elements => grid.over(places),
        };
        let points: Vec<_> = grid.points.iter().copied().enumerate().collect();
        let mut axis = Self {
            about_y: field.component == Component::BendingY,
            n: fields.len(),
            rows: grid.rows,
            points: points.len(),
            angles: Angles::default(),
            sections,
            terms: terms.iter().map(|&(point, _)| point).collect(),
            weights: Vec::new(),
        };
        axis.drop_rounding();
        for (point, weight) in terms {
            axis.weights.push(weight);
            axis.weights.extend(axis.rows[point * axis.n..(point + 1) * axis.n].iter().map(|entry| entry * weight));
        }
        axis.angles = Angles::new(&points, field.basis.length(), &axis.rows, axis.n);
        Some(axis)
    }

    /// Drops rounding errors in the plane axis, as at the tip the integrals of most Legendre polynomials.
    fn drop_rounding(&mut self) {
        for coordinate in 0..self.n {
            let own = self.rows.iter().skip(coordinate).step_by(self.n);
            let size = own.fold(0.0_f64, |most, entry| most.max(entry.abs()));
            let small =
                self.rows.iter_mut().skip(coordinate).step_by(self.n).filter(|entry| entry.abs() < ROUNDING * size);
            small.for_each(|entry| *entry = 0.0);
        }
    }

    /// Numbers of partial sums that a motion of the plane axis needs.
    pub fn scratch(&self) -> usize {
        2 * self.n + 4 * self.points
    }

    /// Motion of the plane axis: poses, twists, columns and accelerations of all sections.
    pub fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>) {
        self.run((q, v), out, None);
    }

    /// Motion of the plane axis outside of its slices, for a root that turns with `turn` about the bending axis. Of
    /// slices of the beam there are only sums. Else as [`PlaneAxis::motion`].
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

    /// Slices of a beam with this plane axis and these inertias at its stations.
    pub fn slices<S: Scalar>(
        &self,
        inertias: &[SpatialInertia<S>],
        is_slice: impl Fn(usize) -> bool,
        (root, spatial): (&Pose<f64>, bool),
    ) -> Slices<S> {
        let rows: Vec<_> = self.sections.iter().map(|section| self.row(section.row)).collect();
        let across = self.vector([1.0, 0.0]);
        let axes = Matrix3::from_columns(across, self.axis(), Vector3::new(0.0, 0.0, 1.0));
        let frame = *root * Pose::new(axes, Vector3::zero());
        Slices::new((inertias, self.about_y), is_slice, &rows, (frame, spatial))
    }

    /// Bending axis normal to the plane.
    pub fn axis(&self) -> Vector3<f64> {
        self.twist(1.0, [0.0; 2]).angular
    }

    /// Runs along the plane axis, station by station.
    ///
    /// With `turn` the rate of the root about the axis of bending, `change` is the acceleration in axes that do not turn. There the tangent
    /// turns with `turn + alpha'`, so that it is `-int_0^mu t (turn + alpha')^2 dmu`.
    fn run<S: Scalar>(&self, motion: (&[S], &[S]), out: &mut Sections<S>, sums: Option<(S, &Slices<S>, &mut Sums<S>)>) {
        // The two coordinates of an element: loops are written out.
        if self.n == 2 { self.pass::<S, 2>(motion, out, sums) } else { self.pass::<S, 0>(motion, out, sums) }
    }

    /// Runs along the plane axis for N coordinates, or with 0 for any number.
    fn pass<S: Scalar, const N: usize>(
        &self,
        (q, v): (&[S], &[S]),
        out: &mut Sections<S>,
        mut sums: Option<(S, &Slices<S>, &mut Sums<S>)>,
    ) {
        let (n, zero) = (if N == 0 { self.n } else { N }, S::zero());
        let (q, v) = (&q[..n], &v[..n]);
        let turn = sums.as_ref().map_or(zero, |(turn, ..)| *turn);
        // Across and along the root's axis: place, and acceleration at zero coordinate accelerations.
        let (mut place, mut change) = ([zero; 2], [zero; 2]);
        let mut scratch = std::mem::take(&mut out.scratch);
        let (running, rest) = scratch.split_at_mut(2 * n);
        let (tangents, rest) = rest.split_at_mut(2 * self.points);
        let (angles, rates) = rest.split_at_mut(self.points);
        running.fill(zero);
        self.angles.evaluate(&self.rows, q, zero, angles);
        self.angles.evaluate(&self.rows, v, turn, rates);
        for ((tangent, angle), rate) in tangents.chunks_exact_mut(2).zip(&*angles).zip(&mut *rates) {
            (tangent[0], tangent[1]) = angle.sin_cos();
            *rate = *rate * *rate;
        }
        let mut weights = self.weights.chunks_exact(1 + n);
        for (station, section) in self.sections.iter().enumerate() {
            for (&point, weights) in self.terms[section.terms.clone()].iter().zip(&mut weights) {
                let (sin, cos, square) = (tangents[2 * point], tangents[2 * point + 1], rates[point]);
                let (across, along) = (sin * weights[0], cos * weights[0]);
                (place[0], place[1]) = (place[0] + across, place[1] + along);
                (change[0], change[1]) = (change[0] - across * square, change[1] - along * square);
                for (sums, &weight) in running[..2 * n].chunks_exact_mut(2).zip(&weights[1..1 + n]) {
                    sums[0] += cos * weight;
                    sums[1] -= sin * weight;
                }
            }
            let row = &self.row(section.row)[..n];
            let tangent = || match tangents.get(2 * section.row..2 * section.row + 2) {
                Some(known) => (known[0], known[1]),
                None => dot(row, q, zero).sin_cos(),
            };
            if let Some((_, slices, sums)) = &mut sums
                && let Some(slice) = &slices.each[station]
            {
                let passing = Passing { row, place, change, columns: &running[..2 * n] };
                sums.add::<N>(slice, &passing);
                if slices.spatial {
                    sums.add_in_space(slice, &passing, tangent());
                }
            } else {
                let ((sin, cos), rates) = (tangent(), (dot(row, v, zero), turn));
                self.section(row, (sin, cos, rates), (place, change, &*running), v, (station, &mut *out));
            }
        }
        out.scratch = scratch;
    }

    /// Row of the plane axis: derivatives of the angle at a point or section by the coordinates.
    #[inline]
    fn row(&self, number: usize) -> &[f64] {
        &self.rows[number * self.n..(number + 1) * self.n]
    }

    /// Writes one section of the plane axis from the sums up to it.
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

/// The points of an axis while they are laid out.
struct Grid<'a> {
    fields: &'a Fields,
    points: Vec<f64>,
    rows: Vec<f64>,
}

impl Grid<'_> {
    /// Rule on the plane axis between neighbouring sections and all breaks between them.
    fn between(&mut self, places: &[f64]) -> (Vec<Section>, Vec<(usize, f64)>) {
        let (mut begin, mut angle) = (0.0, vec![0.0; self.fields.len()]);
        let (mut ends, mut terms, mut own) = (Vec::new(), Vec::new(), Vec::<f64>::new());
        for &place in places {
            let inside = self.fields.breaks().into_iter().filter(|&at| at > begin && at < place);
            for end in inside.chain(std::iter::once(place)).collect::<Vec<_>>() {
                for point in composite(POINTS, &[begin, end]) {
                    terms.push((self.points.len(), point.weight));
                    self.points.push(point.place);
                    self.rows.extend(turned(self.fields, &angle, begin, point.place));
                }
                angle = turned(self.fields, &angle, begin, end);
                begin = end;
            }
            own.extend(&angle);
            ends.push(terms.len());
        }
        self.rows.extend(own);
        let starts = std::iter::once(0).chain(ends.iter().copied());
        let rows = self.points.len()..;
        let sections =
            rows.zip(starts.zip(&ends)).map(|(row, (start, &end))| Section { row, terms: start..end }).collect();
        (sections, terms)
    }

    /// Rule on the plane axis over each element, with points at its ends besides.
    fn over(&mut self, places: &[f64]) -> (Vec<Section>, Vec<(usize, f64)>) {
        let (breaks, last) = (self.fields.breaks(), places.last().copied().unwrap_or(0.0));
        let (mut angle, mut sections, mut terms) = (vec![0.0; self.fields.len()], Vec::new(), Vec::new());
        let (mut apart, mut first) = (Vec::new(), 0);
        self.points.push(0.0);
        self.rows.extend(&angle);
        let mut left = places.iter().copied().peekable();
        for piece in breaks.windows(2).take_while(|piece| piece[0] < last) {
            let (begin, end, root) = (piece[0], piece[1], self.points.len() - 1);
            for place in composite(POINTS, piece).into_iter().map(|point| point.place).chain([end]) {
                self.points.push(place);
                self.rows.extend(turned(self.fields, &angle, begin, place));
            }
            let (nodes, mut from) = (self.points[root..].to_vec(), begin);
            let mut go = |to: f64, terms: &mut Vec<(usize, f64)>| {
                let weights = (0..nodes.len()).map(|node| (root + node, integral(&nodes, node, from, to)));
                terms.extend(weights.filter(|(_, weight)| weight.abs() > ROUNDING * (end - begin)));
                from = to;
            };
            let near = |place: f64, other: f64| (place - other).abs() <= SAME * (end - begin);
            while let Some(place) = left.next_if(|&place| place < end || near(place, end)) {
                go(place, &mut terms);
                let node = nodes.iter().position(|&node| near(node, place));
                let row = node.map(|node| root + node).ok_or_else(|| turned(self.fields, &angle, begin, place));
                apart.push(row);
                sections.push(first..terms.len());
                first = terms.len();
            }
            go(end, &mut terms);
            angle = turned(self.fields, &angle, begin, end);
        }
        let mut number = self.points.len();
        let rows = apart.into_iter().map(|row| {
            row.unwrap_or_else(|own| {
                self.rows.extend(own);
                number += 1;
                number - 1
            })
        });
        let sections = rows.zip(sections).map(|(row, terms)| Section { row, terms }).collect();
        (sections, terms)
    }
}

/// Integral on the plane axis of a node's polynomial, from `from` to `to`. It is 1 at this of the `nodes` and 0 at the
/// others.
fn integral(nodes: &[f64], node: usize, from: f64, to: f64) -> f64 {
    let others = || nodes.iter().enumerate().filter(|&(other, _)| other != node).map(|(_, at)| at);
    let value = |x: f64| others().map(|at| (x - at) / (nodes[node] - at)).product::<f64>();
    composite(POINTS, &[from, to]).into_iter().map(|point| point.weight * value(point.place)).sum()
}

/// Derivative of the plane axis' angle at `to` by the coordinates, from that at `begin`.
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
