//! The axis of a beam in space, as a map from strain coordinates to sections, by exponentials on SE(3).

use crate::beam::fields::Fields;
use crate::beam::motion::Sections;
use crate::beam::quadrature::gauss;
use crate::beam::rest::Rest;
use crate::scalar::{Dual, Scalar};
use crate::spatial::{Matrix3, Pose, Twist, Vector3};

use super::exponential::{Tangent, exponential};

/// An axis, cut into pieces that one exponential each crosses.
#[derive(Clone, Debug)]
pub(in crate::beam) struct SpaceAxis {
    /// The component of each coordinate, 0 to 5.
    components: Vec<usize>,
    pieces: Vec<Piece>,
    /// Integral of each shape function over a piece, then its first moment about the middle per size of the piece; piece by piece.
    rows: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Piece {
    size: f64,
    /// Integral of the strain at rest over the piece, then its first moment about the middle per size.
    rest: [Twist<f64>; 2],
    /// Whether a section stands at its end.
    section: bool,
}

/// How a frame moves on across a piece: pose, twist of its end relative to its begin, and the rate of that at constant coordinate
/// rates.
#[derive(Clone, Copy, Debug)]
pub(in crate::beam) struct Crossing<S> {
    pub pose: Pose<S>,
    pub twist: Twist<S>,
    pub acceleration: Twist<S>,
    moments: [Twist<S>; 2],
    tangent: Tangent<S>,
}

impl SpaceAxis {
    /// Axis in space with sections at `places`, ascending, cut there and at all breaks. Breaks are those of the shape
    /// functions and of the shape at rest.
    pub fn new(fields: &Fields, places: &[f64], rest: &Rest) -> Self {
        let (mut pieces, mut rows, mut begin) = (Vec::new(), Vec::new(), 0.0);
        for &place in places {
            let inside = fields.breaks().into_iter().chain(rest.breaks()).filter(|&at| at > begin && at < place);
            let mut ends: Vec<f64> = inside.chain(std::iter::once(place)).collect();
            ends.sort_by(f64::total_cmp);
            ends.dedup();
            for end in ends {
                rows.extend(moments(fields, begin, end).concat());
                pieces.push(Piece { size: end - begin, rest: rest.moments(begin, end), section: end == place });
                begin = end;
            }
        }
        Self { components: fields.components.clone(), pieces, rows }
    }

    /// Number of pieces of the axis in space.
    pub fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Rows of the axis in space: integrals and first moments of the shape functions over a piece.
    fn rows(&self, piece: usize) -> [&[f64]; 2] {
        let n = self.components.len();
        [2 * piece, 2 * piece + 1].map(|row| &self.rows[row * n..(row + 1) * n])
    }

    /// Crosses a piece of the axis in space with coordinates `c` and rates `rates`.
    ///
    /// Law: fourth-order Magnus step with exact moments (Iserles et al. 2000, section 5.3): `Omega = A + A x B`, `A = int e dmu`,
    /// `B = 1/h int (mu - m) e dmu` with m the middle; the sign of the bracket is that of a strain that multiplies from the right.
    pub(in crate::beam) fn cross<S: Scalar>(&self, piece: usize, c: &[S], rates: &[S]) -> Crossing<S> {
        self.cross_as_asked(piece, (c, rates), true)
    }

    /// Crosses a piece of the axis in space as [`SpaceAxis::cross`], the acceleration only if it is asked for.
    fn cross_as_asked<S: Scalar>(&self, piece: usize, (c, rates): (&[S], &[S]), accelerates: bool) -> Crossing<S> {
        let (Piece { size, rest, .. }, rows) = (self.pieces[piece], self.rows(piece));
        let [mut whole, mut moment] = rows.map(|row| self.sum(row, c));
        let turn = |rest: Twist<f64>| Vector3::from_f64(rest.angular.to_array());
        (whole.angular, moment.angular) = (whole.angular + turn(rest[0]), moment.angular + turn(rest[1]));
        whole.linear.z = whole.linear.z + size;
        let [whole_rate, moment_rate] = rows.map(|row| self.sum(row, rates));
        let screw = whole + whole.cross(moment);
        let rate = whole_rate + whole_rate.cross(moment) + whole.cross(moment_rate);
        if !accelerates {
            let tangent = Tangent::new(screw);
            let (pose, twist, acceleration) = (exponential(screw), tangent.apply(rate), Twist::zero());
            return Crossing { pose, twist, acceleration, moments: [whole, moment], tangent };
        }
        let second = whole_rate.cross(moment_rate) * S::from_f64(2.0);
        // The exponent as a function of time: its rate and the rate of that make twist and acceleration.
        let tangent = Tangent::new(along(screw, rate));
        let moving = tangent.apply(along(rate, second));
        Crossing {
            pose: exponential(screw),
            twist: part(moving, |number| number.value),
            acceleration: part(moving, |number| number.gradient[0]),
            moments: [whole, moment],
            tangent: Tangent { same: value(tangent.same), across: value(tangent.across) },
        }
    }

    /// Column of the axis in space: twist of a piece's end per unit rate of coordinate `k`. It is relative to the
    /// begin; none where the coordinate does nothing.
    pub(in crate::beam) fn column<S: Scalar>(
        &self,
        piece: usize,
        crossing: &Crossing<S>,
        k: usize,
    ) -> Option<Twist<S>> {
        let [whole, moment] = self.rows(piece).map(|row| row[k]);
        if whole == 0.0 && moment == 0.0 {
            return None;
        }
        let unit = unit(self.components[k]);
        let turned = crossing.moments[1] * S::from_f64(whole) - crossing.moments[0] * S::from_f64(moment);
        let change = unit * S::from_f64(whole) + unit.cross(turned);
        Some(crossing.tangent.apply(change))
    }

    /// Motion of the axis in space: poses, twists and columns of all sections, and accelerations if asked for.
    pub fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>, accelerates: bool) {
        let (n, mut station) = (self.components.len(), 0);
        let mut moving = out.begin(station, n);
        for (number, piece) in self.pieces.iter().enumerate() {
            let crossing = self.cross_as_asked(number, (q, v), accelerates);
            moving.advance(&crossing.pose, crossing.twist, crossing.acceleration);
            for (k, column) in out.columns[station * n..(station + 1) * n].iter_mut().enumerate() {
                *column = crossing.pose.inverse_twist(*column);
                if let Some(own) = self.column(number, &crossing, k) {
                    *column += own;
                }
            }
            if piece.section {
                out.at[station] = moving;
                station += 1;
                if station < out.at.len() {
                    moving = out.begin(station, n);
                }
            }
        }
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

/// Moments of shape functions on the axis in space: integral and first moment about the middle, per size. They lie
/// between two places.
fn moments(fields: &Fields, begin: f64, end: f64) -> [Vec<f64>; 2] {
    let mut sums = [vec![0.0; fields.len()], vec![0.0; fields.len()]];
    let (middle, size) = (0.5 * (begin + end), end - begin);
    for at in gauss(fields.points() + 1, -0.5, 0.5) {
        for (k, entry) in fields.strain_row(middle + size * at.place).into_iter().enumerate() {
            sums[0][k] += at.weight * size * entry;
            sums[1][k] += at.weight * size * at.place * entry;
        }
    }
    sums
}

fn unit<S: Scalar>(component: usize) -> Twist<S> {
    let mut parts = [0.0; 6];
    parts[component] = 1.0;
    let [a, b, c, d, e, f] = parts;
    Twist::new(Vector3::from_f64([a, b, c]), Vector3::from_f64([d, e, f]))
}

/// Twist of the axis in space as a function of time: value and rate.
fn along<S: Scalar>(value: Twist<S>, rate: Twist<S>) -> Twist<Dual<S, 1>> {
    let join = |v: Vector3<S>, r: Vector3<S>| {
        let dual = |value, rate| Dual { value, gradient: [rate] };
        Vector3::new(dual(v.x, r.x), dual(v.y, r.y), dual(v.z, r.z))
    };
    Twist::new(join(value.angular, rate.angular), join(value.linear, rate.linear))
}

/// Matrix of the axis in space without its rate.
fn value<S: Scalar>(matrix: Matrix3<Dual<S, 1>>) -> Matrix3<S> {
    Matrix3 { columns: matrix.columns.map(|column| Vector3::from(column.to_array().map(|number| number.value))) }
}

/// One part of a twist in space over dual numbers.
fn part<S: Scalar>(twist: Twist<Dual<S, 1>>, pick: impl Fn(Dual<S, 1>) -> S) -> Twist<S> {
    let vector = |v: Vector3<Dual<S, 1>>| Vector3::from(v.to_array().map(&pick));
    Twist::new(vector(twist.angular), vector(twist.linear))
}
