//! First derivation: virtual work over the Jacobians of the seven bodies.

use super::{Leg, Points};
use crate::linkage::line_actuator::planar;
use crate::linkage::{Line, PointMotion};
use vpm_core::dynamics::{Carried, Rate, Terms, virtual_work};
use vpm_core::scalar::Scalar;
use vpm_core::spatial::{Symmetric3, Twist, Vector2};

/// Dependent coordinates: q1, q2 and the lengths s1, s2 of the cylinders.
const DEPENDENT: usize = 4;

/// Jacobians of the seven bodies for the rates of (q1, q2, s1, s2), and how those depend on the rates of q1 and q2.
struct Kinematics<S> {
    bodies: [[Twist<S>; DEPENDENT]; 7],
    psi: [[S; 2]; DEPENDENT],
}

impl Leg {
    /// Terms M (kg m^2), V and G (N m) of the leg at `q` (rad) and `v` (rad/s), by body Jacobians.
    ///
    /// Law: [`virtual_work`] with the coordinates (q1, q2, s1, s2) of eq 2.92 and `Psi = d(q1, q2, s1, s2)/d(q1, q2)`;
    /// the Jacobians are written out below, their time derivatives come exact from dual numbers. Allocates nothing.
    /// Source: eqs 2.92 to 2.107. Checked: against [`Leg::lagrange`] and [`Leg::newton_euler`].
    pub fn terms<S: Scalar>(&self, q: [S; 2], v: [S; 2]) -> Terms<S, 2> {
        let moving: [Rate<S>; 2] = std::array::from_fn(|k| Rate { value: q[k], gradient: [v[k]] });
        let Kinematics { bodies, psi } = self.kinematics(moving);
        let masses = self.masses();
        let carried: [Carried<S, DEPENDENT>; 7] = std::array::from_fn(|k| Carried {
            mass: S::from_f64(masses[k].0),
            inertia: Symmetric3 { zz: S::from_f64(masses[k].1), ..Symmetric3::zero() },
            jacobian: bodies[k],
        });
        virtual_work(&carried, &psi, &v, [0.0, -self.parameters.gravity, 0.0])
    }

    /// Jacobian of the leg's cylinders: lever arms ds1/dq1 and ds2/dq2 (m/rad) at angles `q` (rad). The other two
    /// derivatives are zero.
    pub fn levers<S: Scalar>(&self, q: [S; 2]) -> [S; 2] {
        let psi = self.kinematics(q).psi;
        [psi[2][0], psi[3][1]]
    }

    fn kinematics<S: Scalar>(&self, q: [S; 2]) -> Kinematics<S> {
        let (p, points) = (&self.parameters, self.points(q));
        let [thigh, shank] = points.axes;
        let center = |from: Vector2<S>, axis: Vector2<S>, [along, ahead]: [f64; 2]| {
            from + axis * S::from_f64(along) + axis.perpendicular() * S::from_f64(ahead)
        };
        let (one, zero) = (S::one(), S::zero());
        let slider = points.on_slider(points.hip);
        let upper = points.on_upper(center(points.hip, thigh, p.upper.center));
        let lower = points.on_lower(center(points.knee, shank, p.lower.center));
        let spun = |spins: [S; DEPENDENT], point: &PointMotion<S, DEPENDENT>| {
            std::array::from_fn(|b| planar(spins[b], point.columns[b]))
        };
        let bases = [points.on_slider(points.bases[0]), points.on_upper(points.bases[1])];
        let tips = [points.on_upper(points.tips[0]), points.on_lower(points.tips[1])];
        let [hip, knee] = [0, 1].map(|k| Line::new(&bases[k], &tips[k]));
        let [hip_barrel, hip_rod] = p.actuators[0].jacobians(&bases[0], &hip, 2);
        let [knee_barrel, knee_rod] = p.actuators[1].jacobians(&bases[1], &knee, 3);
        let legs = [
            spun([zero; DEPENDENT], &slider),
            spun([one, zero, zero, zero], &upper),
            spun([one, one, zero, zero], &lower),
        ];
        let [slider, upper, lower] = legs;
        let levers = |line: &Line<S, DEPENDENT>| [line.levers[0], line.levers[1]];
        Kinematics {
            bodies: [slider, upper, lower, hip_barrel, hip_rod, knee_barrel, knee_rod],
            psi: [[one, zero], [zero, one], levers(&hip), levers(&knee)],
        }
    }
}

impl<S: Scalar> Points<S> {
    /// Jacobian of a point on the leg's slider: up and down with the hip, since the foot stays on the ground.
    fn on_slider(&self, place: Vector2<S>) -> PointMotion<S, DEPENDENT> {
        let zero = S::zero();
        // y_A = L_UL cos q1 + L_LL cos(q1 + q2).
        let first = Vector2::new(zero, -self.foot.x);
        let second = Vector2::new(zero, self.knee.x - self.foot.x);
        PointMotion { place, columns: [first, second, Vector2::zero(), Vector2::zero()] }
    }

    /// Jacobian of a point of the leg that also turns about the hip.
    fn on_upper(&self, place: Vector2<S>) -> PointMotion<S, DEPENDENT> {
        let mut point = self.on_slider(place);
        point.columns[0] = point.columns[0] + (place - self.hip).perpendicular();
        point
    }

    /// Jacobian of a point of the leg that also turns about the knee.
    fn on_lower(&self, place: Vector2<S>) -> PointMotion<S, DEPENDENT> {
        let mut point = self.on_upper(place);
        point.columns[1] = point.columns[1] + (place - self.knee).perpendicular();
        point
    }
}
