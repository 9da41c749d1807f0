//! A leg that is free to leave the ground, with the contact at its foot: coordinates (y, q1, q2), y the height of the hip axis (m).
//!
//! Its equation of motion is written out from the places of the seven bodies; with the foot held it is that of the leg on the ground.

use vpm_core::contact::{Contact, ContactFriction, NormalContact, Plane};
use vpm_core::spatial::{Vector2, Vector3};
use vpm_core::{Dual, Scalar};
use vpm_studies::algebra::solve;
use vpm_studies::linkage::leg::{HyqData, Leg, LegParameters};

/// A number with its rate, and with the derivatives of both by (y, q1, q2).
type Moving = Dual<Dual<f64, 1>, 3>;
const DESIRED: [f64; 2] = [40.0, -80.0];
const DAMPING: f64 = 6.0;
pub const GRAVITY: f64 = 9.81;

pub fn leg(payload: f64) -> Leg {
    let mut parameters = LegParameters::hyq(HyqData::Cad, 0.341);
    parameters.slider_mass += payload;
    Leg::new(parameters).unwrap()
}

pub fn desired() -> [f64; 2] {
    DESIRED.map(f64::to_radians)
}

pub fn foot() -> Contact<f64> {
    let normal =
        NormalContact { stiffness: 2855.0 * 1000_f64.powf(1.1), exponent: 1.1, damping: 1000.0, damping_depth: 1e-4 };
    let friction = ContactFriction {
        static_coefficient: 0.7,
        static_velocity: 0.1,
        dynamic_coefficient: 0.55,
        dynamic_velocity: 1.0,
    };
    Contact { normal, friction: Some(friction) }
}

/// The leg with a free hip, its foot above or on a plane at height zero.
pub struct FreeLeg {
    pub leg: Leg,
    pub contact: Contact<f64>,
    plane: Plane<f64>,
    gain: f64,
}

/// Mass matrix, the rest `V + G`, and what the ground does: its force on the foot and that along the coordinates.
pub struct Balance {
    pub mass: [[f64; 3]; 3],
    pub bias: [f64; 3],
    ground: Vector3<f64>,
    effort: [f64; 3],
}

impl FreeLeg {
    pub fn new(payload: f64, gain: f64) -> Self {
        let plane = Plane::new(Vector3::zero(), Vector3::new(0.0, 1.0, 0.0)).unwrap();
        Self { leg: leg(payload), contact: foot(), plane, gain }
    }

    /// Height of the hip axis above the foot.
    pub fn height(&self, q: [f64; 2]) -> f64 {
        self.leg.points(q).hip.y
    }

    pub fn balance(&self, z: [f64; 3], v: [f64; 3]) -> Balance {
        let lift = |k: usize| Moving::variable(Dual { value: z[k], gradient: [v[k]] }, k);
        let (y, q) = (lift(0), [lift(1), lift(2)]);
        let points = self.leg.points(q);
        let raised = |place: Vector2<Moving>| place - points.hip + Vector2::new(Moving::zero(), y);
        let (mut mass, mut bias) = ([[0.0; 3]; 3], [0.0; 3]);
        for (place, (m, inertia)) in self.leg.places(q).into_iter().zip(self.leg.masses()) {
            let center = raised(place.center);
            let axis = Vector2::new(place.axis.x.value, place.axis.y.value);
            let spin =
                std::array::from_fn(|k| axis.cross(Vector2::new(place.axis.x.gradient[k], place.axis.y.gradient[k])));
            for (row, weight) in [(center.x.gradient, m), (center.y.gradient, m), (spin, inertia)] {
                let drift: f64 = (0..3).map(|k| row[k].gradient[0] * v[k]).sum();
                for i in 0..3 {
                    bias[i] += weight * row[i].value * drift;
                    (0..3).for_each(|j| mass[i][j] += weight * row[i].value * row[j].value);
                }
            }
            (0..3).for_each(|i| bias[i] += m * GRAVITY * center.y.gradient[i].value);
        }
        let foot = raised(points.foot);
        let place = Vector3::new(foot.x.re(), foot.y.re(), 0.0);
        let velocity = Vector3::new(foot.x.value.gradient[0], foot.y.value.gradient[0], 0.0);
        let ground = self.contact.force(&self.plane, place, velocity);
        let effort = std::array::from_fn(|k| foot.x.gradient[k].value * ground.x + foot.y.gradient[k].value * ground.y);
        Balance { mass, bias, ground, effort }
    }

    /// Accelerations under the controller `tau = P (q_d - q) - D dq/dt`, and the force of the ground.
    pub fn acceleration(&self, z: [f64; 3], v: [f64; 3]) -> ([f64; 3], f64) {
        let Balance { mass, bias, ground, effort } = self.balance(z, v);
        let [a, b] = desired();
        let torque = [0.0, self.gain * (a - z[1]) - DAMPING * v[1], self.gain * (b - z[2]) - DAMPING * v[2]];
        let right = std::array::from_fn(|k| torque[k] - bias[k] + effort[k]);
        (solve(mass, right).unwrap(), ground.y)
    }

    /// Rates of the state `(z, v, impulse of the ground)`.
    pub fn rate(&self, [y, a, b, vy, va, vb, _]: [f64; 7]) -> [f64; 7] {
        let ([ay, aa, ab], force) = self.acceleration([y, a, b], [vy, va, vb]);
        [vy, va, vb, ay, aa, ab, force]
    }

    /// One step of the classical Runge-Kutta method.
    pub fn step(&self, x: [f64; 7], h: f64) -> [f64; 7] {
        let ahead = |part: f64, slope: &[f64; 7]| std::array::from_fn(|k| x[k] + part * h * slope[k]);
        let a = self.rate(x);
        let b = self.rate(ahead(0.5, &a));
        let c = self.rate(ahead(0.5, &b));
        let d = self.rate(ahead(1.0, &c));
        std::array::from_fn(|k| x[k] + h * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]) / 6.0)
    }

    pub fn vertical_momentum(&self, x: [f64; 7]) -> f64 {
        let mass = self.balance([x[0], x[1], x[2]], [x[3], x[4], x[5]]).mass;
        (0..3).map(|k| mass[0][k] * x[3 + k]).sum()
    }
}

/// Angles (rad) where the controller carries the weight on a smooth floor: `P (q_d - q) = G(q)`, by Newton's method.
pub fn rest(leg: &Leg, gain: f64) -> [f64; 2] {
    let mut q = desired();
    for _ in 0..50 {
        let lifted: [Dual<f64, 2>; 2] = std::array::from_fn(|k| Dual::variable(q[k], k));
        let gravity = leg.terms(lifted, [Dual::zero(); 2]).gravity;
        let gap: [Dual<f64, 2>; 2] = std::array::from_fn(|k| gravity[k] - (-lifted[k] + desired()[k]) * gain);
        let change = solve(gap.map(|row| row.gradient), gap.map(|row| row.value)).unwrap();
        q = [q[0] - change[0], q[1] - change[1]];
    }
    q
}
