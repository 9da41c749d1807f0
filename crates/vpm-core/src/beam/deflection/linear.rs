//! Beams whose deflection is linear in their coordinates: nothing of second order in it.

use super::{Component, first_order, largest_slope, turning};
use crate::beam::fields::{Fields, Interpolated};
use crate::beam::motion::{SectionMotion, Sections};
use crate::beam::quadrature::composite;
use crate::beam::strain::rotation;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Twist, Vector3};

/// The map from coordinates to sections: rotation vector `w = Phi_w q`, place `v = [0; 0; mu] + Phi_v q`, axes `exp([w]x)`.
///
/// What it leaves out is the shortening of a bent axis, and with it all stiffness that loads along the axis and rotation give a beam, and the
/// second-order turn of a beam that bends in space. Twists are those of this map itself, so that it conserves energy.
/// Source: the conventional linear theory that Kane, Ryan & Banerjee 1987 compare with, "Dynamics of a cantilever beam attached to a moving
/// base", J. Guidance 10(2). Checked: against the map of second order as the deflection vanishes; the frequencies of a spinning beam.
#[derive(Clone, Debug)]
pub(in crate::beam) struct LinearAxis {
    /// The component of each coordinate.
    components: Vec<Component>,
    /// Arc length of each section in m.
    places: Vec<f64>,
    /// Displacement (of torsion: rotation) and its slope per unit of each coordinate, section by section, and at the tip.
    rows: Vec<[f64; 2]>,
    /// The one axis about which all sections turn, if there is one.
    single: Option<usize>,
}

impl LinearAxis {
    /// Axis of linear deflection with sections at `places`, ascending.
    pub fn new(fields: &Fields, places: &[f64]) -> Self {
        let components: Vec<Component> = fields.components.iter().map(|&component| Component::ALL[component]).collect();
        let tip = fields.list.first().map(|field| field.basis.length());
        let rows = places.iter().chain(&tip).flat_map(|&place| rows(fields, place)).collect();
        let mut turned = components.iter().filter_map(|component| match component {
            Component::BendingX => Some(0),
            Component::BendingY => Some(1),
            Component::Torsion => Some(2),
            Component::ShearX | Component::ShearY | Component::Extension => None,
        });
        let first = turned.next().unwrap_or(0);
        let single = turned.all(|axis| axis == first).then_some(first);
        Self { components, places: places.to_vec(), rows, single }
    }

    /// Largest slope of the axis with linear deflection against its root direction, in rad.
    pub fn slope<S: Scalar>(&self, q: &[S]) -> S {
        largest_slope(&self.components, &self.rows, q)
    }

    /// Motion of all sections with linear deflection: poses, twists, columns, and accelerations if asked for.
    pub fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>, accelerates: bool) {
        let n = self.components.len();
        let sections = self.places.iter().zip(self.rows.chunks_exact(n.max(1)));
        let written = out.at.iter_mut().zip(out.columns.chunks_exact_mut(n.max(1)));
        for ((&place, rows), (at, columns)) in sections.zip(written) {
            let (mut value, mut rate) = ([S::zero(); 6], [S::zero(); 6]);
            for (((&component, &entries), &q), &v) in self.components.iter().zip(rows).zip(q).zip(v) {
                for (target, entry) in first_order(component, entries) {
                    value[target] += q * entry;
                    rate[target] += v * entry;
                }
            }
            value[5] += S::from_f64(place);
            let [w, p, w_rate, p_rate] = [&value[..3], &value[3..], &rate[..3], &rate[3..]].map(vector);
            let (turn, tangent, [angular, change]) = self.turned(w, w_rate, accelerates);
            let speed = turn.transpose_mul(p_rate);
            *at = SectionMotion {
                pose: Pose::new(turn, p),
                twist: Twist::new(angular, speed),
                acceleration: Twist::new(change, -angular.cross(speed)),
            };
            let linear = turn.transpose().columns;
            for ((&component, column), &entries) in self.components.iter().zip(columns).zip(rows) {
                *column = Twist::zero();
                for (target, entry) in first_order(component, entries) {
                    match target {
                        0..3 => column.angular += tangent.columns[target] * S::from_f64(entry),
                        _ => column.linear += linear[target - 3] * S::from_f64(entry),
                    }
                }
            }
        }
    }

    /// Axes of a section with linear deflection. Also what makes their angular velocity from a rate of `w`, that
    /// velocity, and its rate at constant coordinate rates.
    #[inline]
    fn turned<S: Scalar>(
        &self,
        w: Vector3<S>,
        rate: Vector3<S>,
        accelerates: bool,
    ) -> (Matrix3<S>, Matrix3<S>, [Vector3<S>; 2]) {
        let Some(axis) = self.single else {
            let (turn, tangent) = rotation(w);
            let zero = Vector3::zero();
            return (turn, tangent, if accelerates { turning(w, rate, zero) } else { [tangent * rate, zero] });
        };
        let (zero, one) = (S::zero(), S::one());
        let (s, c) = w.to_array()[axis].sin_cos();
        let [x, y, z] = match axis {
            0 => [[one, zero, zero], [zero, c, s], [zero, -s, c]],
            1 => [[c, zero, -s], [zero, one, zero], [s, zero, c]],
            _ => [[c, s, zero], [-s, c, zero], [zero, zero, one]],
        };
        let turn = Matrix3::from_columns(Vector3::from(x), Vector3::from(y), Vector3::from(z));
        (turn, Matrix3::identity(), [rate, Vector3::zero()])
    }
}

fn vector<S: Scalar>(three: &[S]) -> Vector3<S> {
    Vector3::new(three[0], three[1], three[2])
}

/// Rows of linear deflection: displacement (of torsion: rotation) and slope per unit of each coordinate. Those of
/// strains come by integrating them.
fn rows(fields: &Fields, place: f64) -> Vec<[f64; 2]> {
    let pair = |(value, slope)| [value, slope];
    if fields.interpolated == Interpolated::Deflection {
        let (values, slopes) = (fields.row(place, |_| 0), fields.row(place, |_| 1));
        return values.into_iter().zip(slopes).map(pair).collect();
    }
    let inside = fields.breaks().into_iter().filter(|&at| at > 0.0 && at < place);
    let breaks: Vec<f64> = std::iter::once(0.0).chain(inside).chain([place]).collect();
    let mut sums = vec![[0.0; 2]; fields.len()];
    for at in composite(fields.points() + 1, &breaks) {
        for ((sum, entry), &component) in sums.iter_mut().zip(fields.row(at.place, |_| 0)).zip(&fields.components) {
            let share = at.weight * entry;
            // theta_x = -v_y': a curvature about x turns the slope of the deflection down.
            let (lever, sign) = match Component::ALL[component] {
                Component::BendingX => (place - at.place, -1.0),
                Component::BendingY => (place - at.place, 1.0),
                _ => (1.0, 1.0),
            };
            sum[0] += sign * lever * share;
            sum[1] += sign * share;
        }
    }
    sums
}
