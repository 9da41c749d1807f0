//! Beams whose deflection is interpolated (levels `deflection`, `hermite`, `modal`): right up to second order in the deflection.
//!
//! The linear fields are `s = Phi q`; the rotation vector of a section is `w = Phi_w q + 1/2 q^T W q`, its place
//! `v = Phi_v q + 1/2 q^T V q` with constant matrices, and its axes are `exp([w]x)`: a proper rotation that takes z to the tangent by the
//! least rotation, and goes with the section along the curve, up to second order. The strain stays linear in `q`, so the stiffness is
//! constant. Source: Kane, Ryan & Banerjee 1987, "Dynamics of a cantilever beam attached to a moving base", J. Guidance 10(2), for the
//! shortening, without which a beam that turns fast loses its centrifugal stiffening.

mod forms;
mod linear;
mod modal;

pub(super) use linear::LinearAxis;
pub(super) use modal::modal;

use super::entry::Component;
use super::fields::Fields;
use super::motion::{SectionMotion, Sections};
use super::strain::rotation;
use crate::scalar::{Dual, Scalar};
use crate::spatial::{Matrix3, Pose, Twist, Vector3};
use forms::{Forms, Second};

/// The map from deflection coordinates to sections.
#[derive(Clone, Debug)]
pub(super) struct DeflectionAxis {
    /// The component of each coordinate.
    components: Vec<Component>,
    /// Arc length of each section in m.
    places: Vec<f64>,
    /// Displacement (of torsion: rotation) and its slope per unit of each coordinate, section by section, and at the tip.
    rows: Vec<[f64; 2]>,
    /// What is quadratic in the coordinates.
    forms: Forms,
}

/// Rotation vector and displacement as functions of time: value, rate, and second rate at constant coordinate rates.
pub(super) struct Screw<S> {
    pub value: [S; 6],
    pub rate: [S; 6],
    pub second: [S; 6],
}

impl<S: Scalar> Screw<S> {
    /// Section of a deflected beam with this rotation vector and place, and what their rates give in its axes.
    pub fn section(&self, accelerates: bool) -> (SectionMotion<S>, Rows<S>) {
        let Self { value, rate, second } = self;
        let halves = |six: &[S; 6]| (Vector3::new(six[0], six[1], six[2]), Vector3::new(six[3], six[4], six[5]));
        let ((w, p), (w_rate, p_rate), (w_second, p_second)) = (halves(value), halves(rate), halves(second));
        let (turn, tangent) = rotation(w);
        let turning = if accelerates { turning(w, w_rate, w_second) } else { [tangent * w_rate, Vector3::zero()] };
        let speed = turn.transpose_mul(p_rate);
        let change = turn.transpose_mul(p_second) - turning[0].cross(speed);
        let motion = SectionMotion {
            pose: Pose::new(turn, p),
            twist: Twist::new(turning[0], speed),
            acceleration: Twist::new(turning[1], change),
        };
        (motion, Rows { angular: tangent.columns, linear: turn.transpose().columns })
    }
}

impl DeflectionAxis {
    /// Deflection axis with sections at `places`, ascending.
    pub fn new(fields: &Fields, places: &[f64]) -> Self {
        let components: Vec<Component> = fields.components.iter().map(|&component| Component::ALL[component]).collect();
        let mut rows = Vec::with_capacity(places.len() * components.len());
        let tip = fields.list.first().map(|field| field.basis.length());
        for &place in places.iter().chain(&tip) {
            let (values, slopes) = (fields.row(place, |_| 0), fields.row(place, |_| 1));
            rows.extend(values.into_iter().zip(slopes).map(|(value, slope)| [value, slope]));
        }
        Self { components, places: places.to_vec(), rows, forms: Forms::new(fields, places) }
    }

    /// Numbers of partial sums that a motion of the deflection axis needs.
    pub fn scratch(&self) -> usize {
        self.forms.slopes()
    }

    /// Motion of the deflection axis: poses, twists and columns of all sections, and accelerations if asked for.
    pub fn motion<S: Scalar>(&self, q: &[S], v: &[S], out: &mut Sections<S>, accelerates: bool) {
        out.scratch.fill(S::zero());
        let mut second = Second::zero();
        for station in 0..self.places.len() {
            self.forms.advance(station, (q, v), &mut second, &mut out.scratch);
            let screw = self.screw(station, (q, v), &second);
            self.section(station, &screw, out, accelerates);
        }
    }

    /// Largest slope of the deflection axis against its direction at the root, in rad.
    pub fn slope<S: Scalar>(&self, q: &[S]) -> S {
        largest_slope(&self.components, &self.rows, q)
    }

    /// Deflection screw of a section: rotation vector and displacement.
    fn screw<S: Scalar>(&self, station: usize, (q, v): (&[S], &[S]), forms: &Second<S>) -> Screw<S> {
        let n = self.components.len();
        let Second { mut value, mut rate, change: second } = *forms;
        for (k, &component) in self.components.iter().enumerate() {
            for (target, entry) in first_order(component, self.rows[station * n + k]) {
                value[target] += q[k] * entry;
                rate[target] += v[k] * entry;
            }
        }
        value[5] += S::from_f64(self.places[station]);
        Screw { value, rate, second }
    }

    fn section<S: Scalar>(&self, station: usize, screw: &Screw<S>, out: &mut Sections<S>, accelerates: bool) {
        let n = self.components.len();
        let (motion, rows) = screw.section(accelerates);
        out.at[station] = motion;
        let columns = &mut out.columns[station * n..(station + 1) * n];
        for ((&component, column), &entries) in self.components.iter().zip(&mut *columns).zip(&self.rows[station * n..])
        {
            *column = Twist::zero();
            for (target, entry) in first_order(component, entries) {
                rows.add(column, target, S::from_f64(entry));
            }
        }
        for (target, first, slopes) in self.forms.rows(&out.scratch) {
            for (column, &slope) in columns[first..].iter_mut().zip(slopes) {
                rows.add(column, target, slope);
            }
        }
    }
}

/// Largest slope of a deflection axis with these rows, section by section, in rad.
fn largest_slope<S: Scalar>(components: &[Component], rows: &[[f64; 2]], q: &[S]) -> S {
    let mut most = S::zero();
    for rows in rows.chunks_exact(components.len()) {
        let mut slope = [S::zero(); 2];
        for ((&component, &[_, entry]), &q) in components.iter().zip(rows).zip(q) {
            match component {
                Component::BendingY | Component::ShearX => slope[0] += q * entry,
                Component::BendingX | Component::ShearY => slope[1] += q * entry,
                Component::Torsion | Component::Extension => {}
            }
        }
        most = most.max(slope[0] * slope[0] + slope[1] * slope[1]);
    }
    // The root of zero has no derivative; there the slope is at its least.
    most.if_positive(|| most.sqrt(), S::zero)
}

/// Rows of first-order deflection fields (rotation vector, displacement) per unit of a coordinate.
#[inline]
fn first_order(component: Component, [value, slope]: [f64; 2]) -> [(usize, f64); 2] {
    match component {
        Component::BendingX => [(0, -slope), (4, value)],
        Component::BendingY => [(1, slope), (3, value)],
        Component::Torsion => [(2, value), (2, 0.0)],
        Component::ShearX => [(3, value), (3, 0.0)],
        Component::ShearY => [(4, value), (4, 0.0)],
        Component::Extension => [(5, value), (5, 0.0)],
    }
}

/// What a rate of each entry of rotation vector and displacement gives in the section's axes.
pub(super) struct Rows<S> {
    angular: [Vector3<S>; 3],
    linear: [Vector3<S>; 3],
}

impl<S: Scalar> Rows<S> {
    #[inline]
    fn add(&self, column: &mut Twist<S>, target: usize, factor: S) {
        match target {
            0..3 => column.angular += self.angular[target] * factor,
            _ => column.linear += self.linear[target - 3] * factor,
        }
    }

    /// Twist whose entries are rates of the deflection's rotation vector and displacement.
    pub fn turned(&self, rates: Twist<S>) -> Twist<S> {
        let sum = |[a, b, c]: [Vector3<S>; 3], rate: Vector3<S>| a * rate.x + b * rate.y + c * rate.z;
        Twist::new(sum(self.angular, rates.angular), sum(self.linear, rates.linear))
    }
}

/// Angular velocity of a deflected section in its axes and its rate, from the rotation vector over time.
fn turning<S: Scalar>(w: Vector3<S>, rate: Vector3<S>, second: Vector3<S>) -> [Vector3<S>; 2] {
    let join = |value: Vector3<S>, rate: Vector3<S>| {
        let dual = |value, rate| Dual::<S, 1> { value, gradient: [rate] };
        Vector3::new(dual(value.x, rate.x), dual(value.y, rate.y), dual(value.z, rate.z))
    };
    let tangent: Matrix3<Dual<S, 1>> = rotation(join(w, rate)).1;
    let turning = (tangent * join(rate, second)).to_array();
    [Vector3::from(turning.map(|entry| entry.value)), Vector3::from(turning.map(|entry| entry.gradient[0]))]
}
