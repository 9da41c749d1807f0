//! The map from the modes of a reduced solid to its point masses and interfaces.

use super::Field;
use crate::beam::deflection::Screw;
use crate::beam::motion::{SectionMotion, Sections};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Twist, Vector3};

/// The stations of a reduced solid: point masses, then what is mounted.
#[derive(Clone, Debug)]
pub(in crate::beam) struct ReducedAxis {
    /// How many modes move it.
    n: usize,
    points: Vec<Fields<3>>,
    frames: Vec<Fields<6>>,
}

/// Fields of some of the modes, prepared for sums.
#[derive(Clone, Debug)]
pub(in crate::beam) struct Fields<const D: usize> {
    rest: [f64; D],
    /// Per mode, the field and the second derivatives by it and another mode: those that are not zero.
    modes: Vec<Mode<D>>,
}

#[derive(Clone, Debug)]
struct Mode<const D: usize> {
    shape: [f64; D],
    curved: Vec<(usize, [f64; D])>,
}

/// Fields at some coordinates: value, rate, and second rate at constant coordinate rates.
struct Course<S, const D: usize> {
    value: [S; D],
    rate: [S; D],
    second: [S; D],
}

impl<const D: usize> Fields<D> {
    /// Fields of a reduced solid's axis at a place that does not move.
    pub fn still(rest: [f64; D], n: usize) -> Self {
        Self { rest, modes: vec![Mode { shape: [0.0; D], curved: Vec::new() }; n] }
    }

    /// Fields of a reduced solid's axis: the first `n` modes, with or without what is quadratic in them.
    pub fn new(field: &Field<D>, n: usize, quadratic: bool) -> Self {
        let pair = |i: usize, j: usize| {
            let (low, high) = (i.min(j), i.max(j));
            let entry = field.curved.get(high * (high + 1) / 2 + low).filter(|_| quadratic)?;
            entry.iter().any(|&number| number != 0.0).then_some((j, *entry))
        };
        let mode = |i: usize| Mode { shape: field.shapes[i], curved: (0..n).filter_map(|j| pair(i, j)).collect() };
        Self { rest: field.rest, modes: (0..n).map(mode).collect() }
    }

    /// Fields of a reduced solid's axis at coordinates `q` and rates `v`. `column` is given the derivative of the value
    /// by each coordinate.
    #[inline]
    fn course<S: Scalar>(
        &self,
        (q, v): (&[S], &[S]),
        accelerates: bool,
        mut column: impl FnMut(usize, &[S; D]),
    ) -> Course<S, D> {
        let zero = [S::zero(); D];
        let mut course = Course { value: self.rest.map(S::from_f64), rate: zero, second: zero };
        for (i, Mode { shape, curved }) in self.modes.iter().enumerate() {
            let shape = shape.map(S::from_f64);
            let (mut slope, mut change) = (shape, zero);
            for (j, entry) in curved {
                for k in 0..D {
                    slope[k] += q[*j] * entry[k];
                }
                if accelerates {
                    for k in 0..D {
                        change[k] += v[*j] * entry[k];
                    }
                }
            }
            for k in 0..D {
                course.value[k] += q[i] * (shape[k] + slope[k]) * 0.5;
                course.rate[k] += v[i] * slope[k];
                course.second[k] += v[i] * change[k];
            }
            column(i, &slope);
        }
        course
    }
}

impl ReducedAxis {
    /// Axis of a reduced solid: stations that `n` modes move.
    pub fn new(n: usize, points: Vec<Fields<3>>, frames: Vec<Fields<6>>) -> Self {
        Self { n, points, frames }
    }

    /// Place on a reduced solid's axis at rest of what is mounted as number `i`.
    pub fn place(&self, i: usize) -> Vector3<f64> {
        let [_, _, _, x, y, z] = self.frames[i].rest;
        Vector3::new(x, y, z)
    }

    /// Largest turn on a reduced solid's axis of what is mounted, in rad and to first order.
    pub fn slope<S: Scalar>(&self, q: &[S]) -> S {
        let mut most = S::zero();
        for frame in &self.frames {
            let mut turn = [S::zero(); 3];
            for (mode, &q) in frame.modes.iter().zip(q) {
                for (turn, &entry) in turn.iter_mut().zip(&mode.shape) {
                    *turn += q * entry;
                }
            }
            most = most.max(turn.iter().map(|&turn| turn * turn).sum());
        }
        // The root of zero has no derivative; there the turn is at its least.
        most.if_positive(|| most.sqrt(), S::zero)
    }

    /// Motion along a reduced solid's axis: places, twists and columns of all stations. Accelerations come if these are
    /// asked for.
    ///
    /// Point masses keep the axes of the root; the axes of a frame are `exp([w]x)`.
    pub fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>, accelerates: bool) {
        let (n, masses) = (self.n, self.points.len());
        let Sections { at, columns, .. } = out;
        for (station, point) in self.points.iter().enumerate() {
            let columns = &mut columns[station * n..(station + 1) * n];
            let course = point.course((q, v), accelerates, |i, slope| {
                columns[i] = Twist::new(Vector3::zero(), Vector3::from(*slope));
            });
            let [place, speed, change] = [course.value, course.rate, course.second].map(Vector3::from);
            let still = Vector3::zero();
            at[station] = SectionMotion {
                pose: Pose { translation: place, ..Pose::identity() },
                twist: Twist::new(still, speed),
                acceleration: Twist::new(still, change),
            };
        }
        for (station, frame) in (masses..).zip(&self.frames) {
            let columns = &mut columns[station * n..(station + 1) * n];
            let course = frame.course((q, v), accelerates, |i, slope| {
                let [a, b, c, x, y, z] = *slope;
                columns[i] = Twist::new(Vector3::new(a, b, c), Vector3::new(x, y, z));
            });
            let screw = Screw { value: course.value, rate: course.rate, second: course.second };
            let (motion, rows) = screw.section(accelerates);
            at[station] = motion;
            columns.iter_mut().for_each(|column| *column = rows.turned(*column));
        }
    }
}
