//! Where everything is: the geometry that all three derivations share.

use super::{Attachment, Leg};
use vpm_core::scalar::Scalar;
use vpm_core::spatial::Vector2;

/// The points of the leg, in frame 0, in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Points<S> {
    /// A, the hip axis.
    pub hip: Vector2<S>,
    /// B, the knee axis.
    pub knee: Vector2<S>,
    /// C, the foot.
    pub foot: Vector2<S>,
    /// H1 and K1, the bases of hip and knee cylinder.
    pub bases: [Vector2<S>; 2],
    /// H2 and K2, the tips of hip and knee cylinder.
    pub tips: [Vector2<S>; 2],
    /// Directions of upper and lower leg.
    pub axes: [Vector2<S>; 2],
}

/// Where a body is: its centre of mass, and a unit vector fixed in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place<S> {
    /// Centre of mass in frame 0, in m.
    pub center: Vector2<S>,
    /// A direction that turns with the body.
    pub axis: Vector2<S>,
}

impl Leg {
    /// Places of all points of the leg at angles `q` (rad). Source: eqs 2.85 to 2.91.
    pub fn points<S: Scalar>(&self, q: [S; 2]) -> Points<S> {
        let p = &self.parameters;
        let along = |angle: S| {
            let (sine, cosine) = angle.sin_cos();
            Vector2::new(sine, -cosine)
        };
        let axes = [along(q[0]), along(q[0] + q[1])];
        let [thigh, shank] = [axes[0] * S::from_f64(p.upper.length), axes[1] * S::from_f64(p.lower.length)];
        let hip = Vector2::new(S::zero(), -(thigh.y + shank.y));
        let knee = hip + thigh;
        let forward = Vector2::from_f64([1.0, 0.0]);
        let [hip_place, knee_place] = &p.attachments;
        Points {
            hip,
            knee,
            foot: knee + shank,
            bases: [hip + base(hip_place, forward), knee + base(knee_place, -axes[0])],
            tips: [hip + tip(hip_place, axes[0]), knee + tip(knee_place, axes[1])],
            axes,
        }
    }

    /// Lengths of the leg's hip and knee cylinder (m) from their places at angles `q` (rad). Source: eqs 2.88 and 2.90.
    pub fn strokes<S: Scalar>(&self, q: [S; 2]) -> [S; 2] {
        let points = self.points(q);
        std::array::from_fn(|k| (points.tips[k] - points.bases[k]).length())
    }

    /// Places of the seven bodies at angles `q` (rad).
    pub fn places<S: Scalar>(&self, q: [S; 2]) -> [Place<S>; 7] {
        let (p, points) = (&self.parameters, self.points(q));
        let leg = |from: Vector2<S>, axis: Vector2<S>, [along, ahead]: [f64; 2]| Place {
            center: from + axis * S::from_f64(along) + axis.perpendicular() * S::from_f64(ahead),
            axis,
        };
        let cylinder = |k: usize| {
            let across = points.tips[k] - points.bases[k];
            let axis = across * across.length().recip();
            let actuator = &p.actuators[k];
            let barrel = points.bases[k] + axis * S::from_f64(actuator.barrel.center);
            let rod = points.tips[k] - axis * S::from_f64(actuator.rod.center);
            [barrel, rod].map(|center| Place { center, axis })
        };
        let slider = Place { center: points.hip, axis: Vector2::from_f64([1.0, 0.0]) };
        let upper = leg(points.hip, points.axes[0], p.upper.center);
        let lower = leg(points.knee, points.axes[1], p.lower.center);
        let ([hip_barrel, hip_rod], [knee_barrel, knee_rod]) = (cylinder(0), cylinder(1));
        [slider, upper, lower, hip_barrel, hip_rod, knee_barrel, knee_rod]
    }

    /// Mass (kg) and planar inertia (kg m^2) of the leg's seven bodies. The slider does not turn.
    pub fn masses(&self) -> [(f64, f64); 7] {
        let p = &self.parameters;
        let [hip, knee] = &p.actuators;
        let [a, b, c, d] = [hip.barrel, hip.rod, knee.barrel, knee.rod].map(|part| (part.mass, part.inertia));
        [(p.slider_mass, 0.0), (p.upper.mass, p.upper.inertia), (p.lower.mass, p.lower.inertia), a, b, c, d]
    }
}

/// Place of a cylinder's base in the leg from its joint, ahead of the direction `zero`.
fn base<S: Scalar>(place: &Attachment, zero: Vector2<S>) -> Vector2<S> {
    turned(zero, place.base_angle) * S::from_f64(place.base)
}

/// Place of a cylinder's tip in the leg from its joint, behind the direction `zero`.
fn tip<S: Scalar>(place: &Attachment, zero: Vector2<S>) -> Vector2<S> {
    turned(zero, -place.tip_angle) * S::from_f64(place.tip)
}

fn turned<S: Scalar>(direction: Vector2<S>, angle: f64) -> Vector2<S> {
    let (sine, cosine) = angle.sin_cos();
    direction.rotated((S::from_f64(sine), S::from_f64(cosine)))
}
