//! Third derivation: the balances of every body, with every reaction.

use super::{Leg, Place, Points};
use crate::algebra::solve;
use crate::error::Result;
use vpm_core::scalar::{Dual, Scalar};
use vpm_core::spatial::Vector2;

/// Three balances for each of seven bodies, and as many unknown reactions.
const SIZE: usize = 21;
/// A number with its time derivatives.
type InTime = Dual<Dual<f64, 1>, 1>;

/// Forces and moments that hold the leg together in a given motion. Forces in N, moments in N m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reactions {
    /// Joint torques to which the cylinder forces are equivalent.
    pub torques: [f64; 2],
    /// Hip and knee cylinder, positive when extending.
    pub cylinder_forces: [f64; 2],
    /// Of the ground on the foot, upward.
    pub ground: f64,
    /// Of the guide on the slider: force along x, moment.
    pub guide: [f64; 2],
    /// In the pins: slider on upper leg (A), upper on lower leg (B), then on the four ends H1, H2, K1, K2 of the
    /// cylinders.
    pub pins: [[f64; 2]; 6],
    /// Of each barrel on its rod: force across the line at the tip, moment.
    pub bearings: [[f64; 2]; 2],
}

/// The balances in the making: `matrix reactions = inertia + weight`.
struct Balances {
    matrix: [[f64; SIZE]; SIZE],
    right: [f64; SIZE],
    centers: [Vector2<f64>; 7],
    column: usize,
}

impl Leg {
    /// Newton-Euler reactions of the leg at `q` (rad), rates `v` (rad/s) and accelerations `a` (rad/s^2).
    ///
    /// Law: for each body `sum f = m (c_ddot - g)` and `sum (r x f + n) = I w_dot` about its centre of mass, 21
    /// equations for 21 reactions; accelerations by differentiating the places twice in time. No friction. Source: eqs
    /// 2.39 to 2.44, with the moment arms of 2.41 corrected. Fails where the reactions are not determined. Allocates
    /// nothing.
    pub fn newton_euler(&self, q: [f64; 2], v: [f64; 2], a: [f64; 2]) -> Result<Reactions> {
        let time: [InTime; 2] = std::array::from_fn(|k| Dual {
            value: Dual { value: q[k], gradient: [v[k]] },
            gradient: [Dual { value: v[k], gradient: [a[k]] }],
        });
        let mut balances = self.inertia_and_weight(&self.places(time));
        self.add_reactions(&mut balances, &self.points(q));
        let Balances { matrix, right, .. } = balances;
        let x = solve(matrix, right).map_err(|pivot| self.singular(q, pivot))?;
        Ok(self.named(q, &x))
    }

    fn inertia_and_weight(&self, places: &[Place<InTime>; 7]) -> Balances {
        let mut right = [0.0; SIZE];
        for ((row, place), (mass, inertia)) in right.chunks_exact_mut(3).zip(places).zip(self.masses()) {
            let acceleration = second(place.center);
            // The axis is a unit vector, so the angular acceleration is axis x axis_ddot.
            let turning = now(place.axis).cross(second(place.axis));
            row.copy_from_slice(&[
                mass * acceleration.x,
                mass * (acceleration.y + self.parameters.gravity),
                inertia * turning,
            ]);
        }
        Balances {
            matrix: [[0.0; SIZE]; SIZE],
            right,
            centers: places.each_ref().map(|place| now(place.center)),
            column: 0,
        }
    }

    /// Adds reactions to the Newton-Euler balances; the order of the columns is that of [`Leg::named`].
    fn add_reactions(&self, balances: &mut Balances, points: &Points<f64>) {
        const SLIDER: usize = 0;
        const UPPER: usize = 1;
        const LOWER: usize = 2;
        let [x, y] = [Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0)];
        balances.force(LOWER, None, points.foot, y);
        balances.force(SLIDER, None, points.hip, x);
        balances.moment(SLIDER, None);
        // Receiving body, giving body, place.
        let pins = [
            (UPPER, SLIDER, points.hip),
            (LOWER, UPPER, points.knee),
            (3, SLIDER, points.bases[0]),
            (4, UPPER, points.tips[0]),
            (5, UPPER, points.bases[1]),
            (6, LOWER, points.tips[1]),
        ];
        for (on, from, place) in pins {
            balances.force(on, Some(from), place, x);
            balances.force(on, Some(from), place, y);
        }
        for k in 0..2 {
            let (barrel, rod, tip) = (3 + 2 * k, 4 + 2 * k, points.tips[k]);
            let across = tip - points.bases[k];
            let line = across * across.length().recip();
            balances.force(rod, Some(barrel), tip, line.perpendicular());
            balances.moment(rod, Some(barrel));
            balances.force(rod, Some(barrel), tip, line);
        }
    }

    fn named(&self, q: [f64; 2], x: &[f64; SIZE]) -> Reactions {
        let cylinder_forces = [x[17], x[20]];
        let lifted: [Dual<f64, 2>; 2] = std::array::from_fn(|k| Dual::variable(q[k], k));
        let strokes = self.strokes(lifted);
        Reactions {
            torques: std::array::from_fn(|k| strokes[k].gradient[k] * cylinder_forces[k]),
            cylinder_forces,
            ground: x[0],
            guide: [x[1], x[2]],
            pins: std::array::from_fn(|k| [x[3 + 2 * k], x[4 + 2 * k]]),
            bearings: [[x[15], x[16]], [x[18], x[19]]],
        }
    }
}

impl Balances {
    /// Unknown force in the Newton-Euler balances along `direction`, at `place`, on one body and against another. The
    /// other may be the world.
    fn force(&mut self, on: usize, from: Option<usize>, place: Vector2<f64>, direction: Vector2<f64>) {
        for (body, sign) in [(Some(on), 1.0), (from, -1.0)] {
            if let Some(body) = body {
                let arm = place - self.centers[body];
                let entries = [direction.x, direction.y, arm.cross(direction)];
                for (row, entry) in entries.into_iter().enumerate() {
                    self.matrix[3 * body + row][self.column] += sign * entry;
                }
            }
        }
        self.column += 1;
    }

    /// Unknown moment in the Newton-Euler balances on one body and against another (or the world).
    fn moment(&mut self, on: usize, from: Option<usize>) {
        self.matrix[3 * on + 2][self.column] = 1.0;
        if let Some(body) = from {
            self.matrix[3 * body + 2][self.column] = -1.0;
        }
        self.column += 1;
    }
}

fn now(vector: Vector2<InTime>) -> Vector2<f64> {
    Vector2::new(vector.x.re(), vector.y.re())
}

fn second(vector: Vector2<InTime>) -> Vector2<f64> {
    Vector2::new(vector.x.gradient[0].gradient[0], vector.y.gradient[0].gradient[0])
}
