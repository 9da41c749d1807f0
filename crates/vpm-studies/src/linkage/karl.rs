//! KARL: a limb of two joints whose two linear actuators both sit on its first body.
//!
//! Frame 0 has its origin at the first joint A; frame 1 turns with the medial body by q1, its x axis along A to B;
//! frame 2 has its origin at the second joint B and turns with the distal body by q2. Both actuators slide along one
//! direction of frame 1. Source: section 2.4.1 of the thesis. Its printed numbers fix everything but the direction of
//! O; with them the point B = (0.300, 0.050) m is in a drawing frame turned by `-alpha`.
//!
//! ```
//! use vpm_studies::linkage::karl::{Karl, KarlGeometry};
//!
//! let karl = Karl::new(KarlGeometry::default())?;
//! for pose in karl.direct([0.20, 0.18])? {
//!     let (torques, end_point) = (karl.torques(&pose, [300.0, 600.0]), karl.end_point(pose.angles));
//!     println!("{:?} rad: C at {end_point:?} m, {torques:?} N m at full force", pose.angles);
//! }
//! # Ok::<(), vpm_studies::Error>(())
//! ```

use super::{ClosedLinkage, Slider, StrokeGeometry, StrokeLinkage};
use crate::error::{LinkageError, Result};
use vpm_core::Error;
use vpm_core::scalar::Scalar;

/// Dimensions of the limb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KarlGeometry {
    /// Length L1 of the medial body from A to B, in m.
    pub medial: f64,
    /// Length L2 of the distal body from B to the end point C, in m.
    pub distal: f64,
    /// Angle alpha of both strokes in frame 1, in rad.
    pub stroke_direction: f64,
    /// The sliders S1 and S2 at stroke zero, in frame 1, in m.
    pub sliders: [[f64; 2]; 2],
    /// The fixed end O of the first rod, in frame 0, in m.
    pub ground_anchor: [f64; 2],
    /// The end P3 of the second rod, in frame 2, in m.
    pub distal_anchor: [f64; 2],
    /// Lengths l1 and l2 of the rods in m.
    pub rods: [f64; 2],
}

impl Default for KarlGeometry {
    /// Geometry of the KARL prototype. `ground_anchor` is 0.040 m from A by the printed singular strokes; that it lies
    /// below A is an assumption.
    fn default() -> Self {
        let b = [0.300_f64, 0.050_f64];
        Self {
            medial: b[0].hypot(b[1]),
            distal: 0.300,
            stroke_direction: -b[1].atan2(b[0]),
            sliders: [[0.020, 0.040], [-0.020, -0.020]],
            ground_anchor: [0.0, -0.040],
            distal_anchor: [-0.050, 0.0],
            rods: [0.230, 0.150],
        }
    }
}

/// One configuration: joint angles (rad) and strokes (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KarlPose {
    /// q1 and q2 in rad.
    pub angles: [f64; 2],
    /// delta1 and delta2 in m.
    pub strokes: [f64; 2],
}

/// The limb, with its two stroke linkages.
#[derive(Clone, Debug, PartialEq)]
pub struct Karl {
    geometry: KarlGeometry,
    linkages: [StrokeLinkage; 2],
}

impl Karl {
    /// KARL limb with these dimensions, or what is wrong with them.
    pub fn new(geometry: KarlGeometry) -> vpm_core::Result<Self> {
        let KarlGeometry { medial, distal, sliders: [first, [x, y]], rods, .. } = geometry;
        for (path, value) in [("karl.medial", medial), ("karl.distal", distal)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Domain { path: path.to_owned(), condition: "be positive and finite", value });
            }
        }
        let direction = geometry.stroke_direction;
        let hip = StrokeGeometry {
            slider: Slider::OnRocker,
            start: first,
            direction,
            anchor: geometry.ground_anchor,
            rod: rods[0],
        };
        // The second linkage turns about B.
        let knee = StrokeGeometry {
            slider: Slider::OnFrame,
            start: [x - medial, y],
            direction,
            anchor: geometry.distal_anchor,
            rod: rods[1],
        };
        let linkages = [StrokeLinkage::new("karl.first", hip)?, StrokeLinkage::new("karl.second", knee)?];
        Ok(Self { geometry, linkages })
    }

    /// Two linkages of KARL, hip first, each between a stroke and an angle.
    pub fn linkages(&self) -> &[StrokeLinkage; 2] {
        &self.linkages
    }

    /// End point C of KARL in frame 0, in m. Source: eq 2.72.
    pub fn end_point(&self, [q1, q2]: [f64; 2]) -> [f64; 2] {
        let ((s1, c1), (s12, c12)) = (q1.sin_cos(), (q1 + q2).sin_cos());
        let KarlGeometry { medial, distal, .. } = self.geometry;
        [medial * c1 + distal * c12, medial * s1 + distal * s12]
    }

    /// End-point determinant of KARL `det dC/dq = L1 L2 sin q2` in m^2: zero stretched or folded. Source: eq 2.73.
    pub fn end_point_determinant(&self, [_, q2]: [f64; 2]) -> f64 {
        self.geometry.medial * self.geometry.distal * q2.sin()
    }

    /// Direct kinematics of KARL: all four configurations at the given strokes (m). Source: eqs 2.61 to 2.71.
    pub fn direct(&self, strokes: [f64; 2]) -> Result<[KarlPose; 4]> {
        let [first, second] = [self.linkages[0].angles(strokes[0])?, self.linkages[1].angles(strokes[1])?];
        Ok(std::array::from_fn(|k| KarlPose { angles: [first[k / 2], second[k % 2]], strokes }))
    }

    /// Inverse kinematics of KARL: all eight configurations that put the end point C at `target` (m). Two elbows, two
    /// strokes for each angle.
    ///
    /// Source: section 2.4.1. Fails if C is out of reach, or if one of the elbows cannot be driven by any stroke.
    pub fn inverse(&self, target: [f64; 2]) -> Result<[KarlPose; 8]> {
        let [left, right] = self.elbows(target)?;
        let ([l1, l2], [r1, r2]) = (self.strokes(left)?, self.strokes(right)?);
        Ok(std::array::from_fn(|k| {
            let (angles, first, second) = if k < 4 { (left, l1, l2) } else { (right, r1, r2) };
            KarlPose { angles, strokes: [first[k / 2 % 2], second[k % 2]] }
        }))
    }

    /// Elbows of KARL: the joint angles of both at `target`, q2 >= 0 first, by the cosine law.
    pub fn elbows(&self, [x, y]: [f64; 2]) -> Result<[[f64; 2]; 2]> {
        let KarlGeometry { medial, distal, .. } = self.geometry;
        let distance = x.hypot(y);
        let cosine = (distance * distance - medial * medial - distal * distal) / (2.0 * medial * distal);
        if cosine.is_nan() || cosine.abs() > 1.0 {
            let (nearest, farthest) = ((medial - distal).abs(), medial + distal);
            let (linkage, input) = ("karl".to_owned(), "distance of the end point (m)");
            return Err(LinkageError::Apart { linkage, input, value: distance, distance, nearest, farthest }.into());
        }
        Ok([cosine.acos(), -cosine.acos()].map(|q2| {
            let q1 = y.atan2(x) - (distal * q2.sin()).atan2(medial + distal * q2.cos());
            [q1, q2]
        }))
    }

    fn strokes(&self, [q1, q2]: [f64; 2]) -> Result<[[f64; 2]; 2]> {
        Ok([self.linkages[0].strokes(q1)?, self.linkages[1].strokes(q2)?])
    }

    /// Diagonal of KARL's `Lambda` in rad/m: `q_dot = Lambda delta_dot`. Source: eqs 2.82 to 2.84.
    pub fn lambda(&self, pose: &KarlPose) -> [f64; 2] {
        std::array::from_fn(|k| self.linkages[k].ratio(pose.strokes[k], pose.angles[k]))
    }

    /// Joint torques (N m) of KARL's actuator forces (N, positive along the stroke): `tau = Lambda^-T F`. Source: after
    /// eq 2.84.
    pub fn torques(&self, pose: &KarlPose, forces: [f64; 2]) -> [f64; 2] {
        let lambda = self.lambda(pose);
        std::array::from_fn(|k| forces[k] / lambda[k])
    }

    /// Determinants of KARL `det Psi` and `det Omega` in m^2, zero where a stroke loses control of its angle. Source:
    /// eqs 2.77 and 2.79.
    pub fn determinants(&self, pose: &KarlPose) -> [f64; 2] {
        std::array::from_fn(|k| self.linkages[k].determinant(pose.strokes[k], pose.angles[k]))
    }
}

impl ClosedLinkage<2, 2> for Karl {
    fn name(&self) -> &str {
        "karl"
    }

    fn constraints<S: Scalar>(&self, q: &[S; 2], input: &[S; 2]) -> [S; 2] {
        std::array::from_fn(|k| self.linkages[k].constraint(input[k], q[k]))
    }
}
