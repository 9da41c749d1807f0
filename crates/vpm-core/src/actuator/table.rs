//! An effort looked up by command and velocity.

use serde::Deserialize;

use crate::scalar::Scalar;

/// Table of efforts over the command and the velocity of what the drive acts on, smooth in between.
///
/// Law: bicubic in Hermite's form, with the values and slopes of the four corners; slopes along a grid line are harmonic means of those of
/// both neighbouring intervals, weighted by their lengths, and zero at an extremum (at an end: three points, cut to three times that of the
/// interval), so that between two values nothing overshoots along a grid line; the slope of the slopes likewise without cut. Value and
/// slopes are continuous. The command is held at the ends of the table beyond them; beyond the velocities the effort goes on straight, so
/// that what damps goes on damping.
/// Source: Fritsch & Butland 1984, "A method for constructing local monotone piecewise cubic interpolants", SIAM J. Sci. Stat. Comput. 5(2);
/// Press et al. 2007, "Numerical Recipes", section 3.6 (bicubic interpolation). Checked: nodes, cubics of one direction, slopes against
/// differences.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(from = "Written")]
pub struct TableDrive {
    commands: Vec<f64>,
    velocities: Vec<f64>,
    /// Effort, its slope by command, by velocity and by both, at each pair of a command and a velocity.
    nodes: Vec<[f64; 4]>,
    written: usize,
}

/// As a description says it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    /// Commands, rising, SI.
    commands: Vec<f64>,
    /// Velocities, rising, m/s or rad/s.
    velocities: Vec<f64>,
    /// Effort at each command and velocity, row by row for a command, N or N m.
    efforts: Vec<f64>,
}

impl From<Written> for TableDrive {
    fn from(Written { commands, velocities, efforts }: Written) -> Self {
        let (rows, columns) = (commands.len(), velocities.len());
        let mut nodes: Vec<[f64; 4]> = efforts.iter().map(|&effort| [effort, 0.0, 0.0, 0.0]).collect();
        if rows > 1 && columns > 1 && rows.checked_mul(columns) == Some(efforts.len()) {
            let mut along = |axis: &[f64], first: usize, stride: usize, [from, to]: [usize; 2]| {
                for k in 0..axis.len() {
                    let slope = node_slope(axis, k, |place| nodes[first + stride * place][from], to < 3);
                    nodes[first + stride * k][to] = slope;
                }
            };
            (0..columns).for_each(|column| along(&commands, column, columns, [0, 1]));
            (0..rows).for_each(|row| along(&velocities, columns * row, 1, [0, 2]));
            (0..columns).for_each(|column| along(&commands, column, columns, [2, 3]));
        }
        Self { commands, velocities, nodes, written: efforts.len() }
    }
}

/// Slope of a table at place `k` of an axis; `cut` where nothing may overshoot.
fn node_slope(axis: &[f64], k: usize, value: impl Fn(usize) -> f64, cut: bool) -> f64 {
    let secant = |first: usize| (value(first + 1) - value(first)) / (axis[first + 1] - axis[first]);
    let last = axis.len() - 1;
    if last == 1 {
        return secant(0);
    }
    if k == 0 || k == last {
        let (near, next) = if k == 0 { (0, 1) } else { (last - 1, last - 2) };
        let [own, other] = [near, next].map(|first| axis[first + 1] - axis[first]);
        let slope = secant(near) + (secant(near) - secant(next)) * own / (own + other);
        return match (cut, slope * secant(near) > 0.0) {
            (false, _) => slope,
            (true, false) => 0.0,
            (true, true) if slope.abs() > 3.0 * secant(near).abs() => 3.0 * secant(near),
            (true, true) => slope,
        };
    }
    let [before, after] = [k - 1, k].map(|first| axis[first + 1] - axis[first]);
    let (left, right) = (secant(k - 1), secant(k));
    if !cut {
        return (after * left + before * right) / (before + after);
    }
    if left * right <= 0.0 {
        return 0.0;
    }
    let share = (before + 2.0 * after) / (3.0 * (before + after));
    left * right / (share * right + (1.0 - share) * left)
}

impl TableDrive {
    /// Effort (N or N m) of a table under a `command` at a `velocity` (m/s or rad/s).
    #[inline]
    pub fn effort<S: Scalar>(&self, command: S, velocity: S) -> S {
        let patch = |row, column| self.patch((row, command), (column, velocity));
        within(&self.commands, command, &|row| within(&self.velocities, velocity, &|column| patch(row, column)))
    }

    /// Effort by the corners of one pair of intervals, which command and velocity lie in or, at the ends of the table, beyond.
    #[inline]
    fn patch<S: Scalar>(&self, (row, command): (usize, S), (column, velocity): (usize, S)) -> S {
        let columns = self.velocities.len();
        let (du, dv) =
            (self.commands[row + 1] - self.commands[row], self.velocities[column + 1] - self.velocities[column]);
        let over_u = hermite(share(&self.commands, row, command));
        let mut over_v = hermite(share(&self.velocities, column, velocity));
        let [least, most] = [self.velocities[0], self.velocities[columns - 1]];
        // The ends themselves count as beyond, for the slope's sake, but what is no number does not.
        if column + 2 == columns {
            let beyond = || (velocity - most) * (1.0 / dv);
            over_v[1][1] = S::from_f64(most.next_down()).if_less(velocity, beyond, || over_v[1][1]);
        }
        if column == 0 {
            let beyond = || (velocity - least) * (1.0 / dv);
            over_v[0][1] = velocity.if_less(S::from_f64(least.next_up()), beyond, || over_v[0][1]);
        }
        let mut effort = S::zero();
        for (i, [by_value, by_slope]) in over_u.into_iter().enumerate() {
            for (j, [value, slope]) in over_v.into_iter().enumerate() {
                let [f, f_u, f_v, f_uv] = self.nodes[(row + i) * columns + column + j];
                effort += by_value * (value * f + slope * (f_v * dv))
                    + by_slope * (value * (f_u * du) + slope * (f_uv * du * dv));
            }
        }
        effort
    }

    /// The first fault of the table and its repair; none for a table that can be used.
    pub(crate) fn complaint(&self) -> Option<(String, &'static str)> {
        for (name, axis) in [("commands", &self.commands), ("velocities", &self.velocities)] {
            if axis.len() < 2 {
                return Some((format!("has {} of {name}, but takes two or more", axis.len()), "give more of them"));
            }
            let falls = |pair: &[f64]| !(pair[0] < pair[1] && pair.iter().all(|number| number.is_finite()));
            if let Some(at) = axis.windows(2).position(falls) {
                let (low, high) = (axis[at], axis[at + 1]);
                return Some((format!("has {name} that do not rise: {low}, then {high}"), "sort them, each once"));
            }
        }
        let (rows, columns) = (self.commands.len(), self.velocities.len());
        if rows * columns != self.written {
            let what = format!("has {} efforts, but {rows} commands and {columns} velocities", self.written);
            return Some((what, "give one effort for each pair"));
        }
        let wrong = self.nodes.iter().position(|node| !node.iter().all(|number| number.is_finite()))?;
        let what =
            format!("has an effort of {} in row {}, column {}", self.nodes[wrong][0], wrong / columns, wrong % columns);
        Some((what, "give finite numbers"))
    }
}

/// Interval of a table's axis in which a number lies, for `of`; the nearest one beyond its ends.
#[inline]
fn within<S: Scalar>(axis: &[f64], number: S, of: &impl Fn(usize) -> S) -> S {
    let last = axis.len() - 2;
    if number.known_less(S::zero()).is_none() {
        return (1..=last).fold(of(0), |found, at| number.if_less(S::from_f64(axis[at]), || found, || of(at)));
    }
    let number = number.re();
    of(axis.partition_point(|&node| node <= number).saturating_sub(1).min(last))
}

/// Share of interval `at` of a table's axis below a number, held at both ends of the axis.
#[inline]
fn share<S: Scalar>(axis: &[f64], at: usize, number: S) -> S {
    let [low, high] = [axis[at], axis[at + 1]];
    let inside = || (number - low) * (1.0 / (high - low));
    let below = || if at + 2 == axis.len() { number.if_less(S::from_f64(high), inside, S::one) } else { inside() };
    if at == 0 { S::from_f64(low).if_less(number, below, S::zero) } else { below() }
}

/// Hermite weights of a table interval's end values and slopes at a share of it.
#[inline]
fn hermite<S: Scalar>(t: S) -> [[S; 2]; 2] {
    let (square, rest) = (t * t, -t + 1.0);
    let far = square * (-t * 2.0 + 3.0);
    [[-far + 1.0, t * rest * rest], [far, -(square * rest)]]
}
