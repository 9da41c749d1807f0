//! A planar rocker driven by a stroke: the linkage of a linear actuator with a rod.

use std::f64::consts::PI;

use super::constraint::singular;
use crate::algebra::{Conic, degree, quadratic_roots, resultant};
use crate::error::{Error, LinkageError, Result};
use vpm_core::scalar::Scalar;
use vpm_core::spatial::Vector2;

/// How far the cosine of an angle may be beyond 1 before the parts count as apart: rounding at an alignment.
const ROUNDING: f64 = 1e-12;

/// Which body carries the slider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slider {
    /// The slider sits on the rocker, the rod's other end on the frame.
    OnRocker,
    /// The slider sits on the frame, the rod's other end on the rocker.
    OnFrame,
}

/// Dimensions of a stroke linkage. All points are relative to the rocker's axis, in the axes of the body that they sit
/// on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeGeometry {
    /// Which body carries the slider.
    pub slider: Slider,
    /// The slider at stroke zero, in m.
    pub start: [f64; 2],
    /// Angle of the stroke's direction, in rad.
    pub direction: f64,
    /// The rod's other end, in m.
    pub anchor: [f64; 2],
    /// Length of the rod in m.
    pub rod: f64,
}

/// A rocker with angle `q` about an axis, a slider with stroke `delta`, and a rod between the slider and an anchor.
///
/// Law: `Pi = |R(q) a - b|^2 - l^2 = 0`, with a the rod's end on the rocker and b its end on the frame; one of them
/// moves as `start + delta u`. Source: eqs 2.61 and 2.67, which are the two cases of [`Slider`].
#[derive(Clone, Debug, PartialEq)]
pub struct StrokeLinkage {
    name: String,
    geometry: StrokeGeometry,
    direction: Vector2<f64>,
}

impl StrokeLinkage {
    /// Stroke linkage, or what is wrong with its dimensions.
    pub fn new(name: &str, geometry: StrokeGeometry) -> vpm_core::Result<Self> {
        let StrokeGeometry { start, direction, anchor, rod, .. } = geometry;
        let parts = [("start", &start[..]), ("direction", &[direction]), ("anchor", &anchor), ("rod", &[rod])];
        for (part, numbers) in parts {
            if let Some(&value) = numbers.iter().find(|number| !number.is_finite()) {
                return Err(vpm_core::Error::NonFinite { path: format!("{name}.{part}"), value });
            }
        }
        for (path, value) in [("rod", rod), ("anchor's distance from the axis", anchor[0].hypot(anchor[1]))] {
            if value <= 0.0 {
                return Err(vpm_core::Error::Domain {
                    path: format!("{name}.{path}"),
                    condition: "be positive",
                    value,
                });
            }
        }
        let (sine, cosine) = direction.sin_cos();
        Ok(Self { name: name.to_owned(), geometry, direction: Vector2::new(cosine, sine) })
    }

    /// Name of the stroke linkage.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The slider at a stroke (m), relative to the axis, on the body that carries it. Source: eqs 2.63 and 2.68.
    pub fn slider<S: Scalar>(&self, stroke: S) -> Vector2<S> {
        Vector2::from_f64(self.geometry.start) + Vector2::from_f64(self.direction.to_array()) * stroke
    }

    /// Ends of the stroke linkage's rod on the rocker (in the rocker's axes) and on the frame.
    pub(super) fn ends<S: Scalar>(&self, stroke: S) -> (Vector2<S>, Vector2<S>) {
        let (slider, anchor) = (self.slider(stroke), Vector2::from_f64(self.geometry.anchor));
        match self.geometry.slider {
            Slider::OnRocker => (slider, anchor),
            Slider::OnFrame => (anchor, slider),
        }
    }

    /// Constraint `Pi(delta, q)` of the stroke linkage in m^2, zero where it is closed.
    pub fn constraint<S: Scalar>(&self, stroke: S, angle: S) -> S {
        let (a, b) = self.ends(stroke);
        let rod = a.rotated(angle.sin_cos()) - b;
        rod.dot(rod) - self.geometry.rod * self.geometry.rod
    }

    /// `Pi` as a polynomial in c = cos q and s = sin q, for one stroke. Source: eq 2.65.
    pub fn polynomial(&self, stroke: f64) -> Conic {
        let (a, b) = self.ends(stroke);
        let (square, along, across) = (a.dot(a), a.dot(b), a.perpendicular().dot(b));
        let constant = b.dot(b) - self.geometry.rod * self.geometry.rod;
        Conic { constant, c: -2.0 * along, s: -2.0 * across, cc: square, cs: 0.0, ss: square }
    }

    /// Both angles (rad) at a stroke (m): all assembly modes, in closed form.
    ///
    /// Law: `q = arg b - arg a +- acos((|a|^2 + |b|^2 - l^2) / (2 |a| |b|))`, the mode with + first; in (-pi, pi].
    /// Fails where the rod is too long or too short, and
    /// where every angle will do. Checked: against [`StrokeLinkage::angles_by_resultant`].
    pub fn angles(&self, stroke: f64) -> Result<[f64; 2]> {
        let (a, b) = self.ends(stroke);
        let (far, near, rod) = (a.length(), b.length(), self.geometry.rod);
        let cosine = (far * far + near * near - rod * rod) / (2.0 * far * near);
        if cosine.is_nan() && stroke.is_finite() {
            // The slider sits on the axis and the rod lies on the arm: every angle closes the linkage.
            return Err(singular(&self.name, &[stroke], 0.0).into());
        }
        if cosine.is_nan() || cosine.abs() > 1.0 + ROUNDING {
            return Err(self.apart("stroke (m)", stroke));
        }
        let (middle, half) = (b.argument() - a.argument(), cosine.clamp(-1.0, 1.0).acos());
        Ok([wrapped(middle + half), wrapped(middle - half)])
    }

    /// Both angles (rad) at a stroke (m), by eliminating one of c and s.
    ///
    /// Law: the resultant of `Pi` and `c^2 + s^2 - 1` is a polynomial of degree 2, whose zeros are the assembly modes;
    /// the other unknown follows from the kernel of the Sylvester matrix. Source: eqs 2.64 to 2.66.
    pub fn angles_by_resultant(&self, stroke: f64) -> Result<[f64; 2]> {
        let pi = self.polynomial(stroke);
        // Eliminate the unknown with the larger linear factor, so that the kernel determines it.
        let turned = pi.s.abs() > pi.c.abs();
        let pi = if turned { pi.exchanged() } else { pi };
        let polynomial = resultant(&pi, &Conic::CIRCLE);
        let [c0, c1, c2, ..] = polynomial;
        let roots = match degree(&polynomial) {
            2 => quadratic_roots([c0, c1, c2]),
            _ => None,
        };
        let roots = roots.ok_or_else(|| self.apart("stroke (m)", stroke))?;
        Ok(roots.map(|s| {
            // Row f minus |a|^2 times row g of the Sylvester matrix is linear: its kernel gives c.
            let c = -(pi.constant + pi.cc + pi.s * s) / pi.c;
            if turned { c.atan2(s) } else { s.atan2(c) }
        }))
    }

    /// Both strokes (m) at an angle (rad), the larger one first: `Pi` is quadratic in the stroke.
    pub fn strokes(&self, angle: f64) -> Result<[f64; 2]> {
        let anchor = Vector2::from_f64(self.geometry.anchor);
        let (sine, cosine) = angle.sin_cos();
        // The anchor in the axes of the body that carries the slider.
        let target = match self.geometry.slider {
            Slider::OnRocker => anchor.rotated((-sine, cosine)),
            Slider::OnFrame => anchor.rotated((sine, cosine)),
        };
        let gap = Vector2::from_f64(self.geometry.start) - target;
        self.strokes_at_distance(gap, self.geometry.rod).ok_or_else(|| self.apart("angle (rad)", angle))
    }

    /// The strokes at which a point that starts at `gap` from another one has the given distance from it.
    pub(super) fn strokes_at_distance(&self, gap: Vector2<f64>, distance: f64) -> Option<[f64; 2]> {
        quadratic_roots([gap.dot(gap) - distance * distance, 2.0 * gap.dot(self.direction), 1.0])
    }

    /// `d Pi / d(c, s)` with `d(c^2 + s^2 - 1) / d(c, s)`: the determinant that vanishes where the stroke loses control
    /// of the angle, in m^2. Source: eq 2.77 (with the anchor where it prints A_0) for a slider on the rocker, eq 2.79
    /// on the frame.
    pub fn determinant(&self, stroke: f64, angle: f64) -> f64 {
        let ((a, b), (sine, cosine)) = (self.ends(stroke), angle.sin_cos());
        4.0 * (a.perpendicular().dot(b) * cosine - a.dot(b) * sine)
    }

    /// `d Pi / d delta` in m: zero where the rod is perpendicular to the stroke, so that the angle cannot move the
    /// stroke.
    pub fn stroke_slope(&self, stroke: f64, angle: f64) -> f64 {
        let ((a, b), slope) = (self.ends(stroke), angle.sin_cos());
        let rod = a.rotated(slope) - b;
        match self.geometry.slider {
            Slider::OnRocker => 2.0 * rod.dot(self.direction.rotated(slope)),
            Slider::OnFrame => -2.0 * rod.dot(self.direction),
        }
    }

    /// Ratio `lambda = dq / d delta` of the stroke linkage in rad/m, infinite at an alignment.
    ///
    /// Law: `lambda = (dPi/d delta) / (s dPi/dc - c dPi/ds)`. Source: eqs 2.82 and 2.83.
    pub fn ratio(&self, stroke: f64, angle: f64) -> f64 {
        2.0 * self.stroke_slope(stroke, angle) / self.determinant(stroke, angle)
    }

    /// Length of the stroke linkage's rod in m.
    pub(super) fn rod(&self) -> f64 {
        self.geometry.rod
    }

    /// Arm of the stroke linkage: distance of the anchor from the axis in m.
    pub(super) fn arm(&self) -> f64 {
        let [x, y] = self.geometry.anchor;
        x.hypot(y)
    }

    /// Anchor of the stroke linkage: the rod's end that is not the slider, on its own body, in m.
    pub(super) fn anchor(&self) -> Vector2<f64> {
        Vector2::from_f64(self.geometry.anchor)
    }

    /// Unit vector along the stroke, on the body that carries the slider.
    pub(super) fn direction(&self) -> Vector2<f64> {
        self.direction
    }

    /// Body that carries the slider of the stroke linkage.
    pub(super) fn slider_on(&self) -> Slider {
        self.geometry.slider
    }

    fn apart(&self, input: &'static str, value: f64) -> Error {
        let (rod, arm) = (self.geometry.rod, self.arm());
        let gap = self.distance(input, value);
        let (nearest, farthest) = if input.starts_with("stroke") { ((rod - arm).abs(), rod + arm) } else { (0.0, rod) };
        let linkage = self.name.clone();
        LinkageError::Apart { linkage, input, value, distance: gap, nearest, farthest }.into()
    }

    /// Distance that the stroke linkage has to span. It is from the axis to the slider, or from the anchor to the
    /// slider's line.
    fn distance(&self, input: &str, value: f64) -> f64 {
        if input.starts_with("stroke") {
            return self.slider(value).length();
        }
        let (sine, cosine) = value.sin_cos();
        let turn = if self.geometry.slider == Slider::OnRocker { -sine } else { sine };
        let target = Vector2::from_f64(self.geometry.anchor).rotated((turn, cosine));
        (Vector2::from_f64(self.geometry.start) - target).dot(self.direction.perpendicular()).abs()
    }
}

/// Angle of the stroke linkage wrapped into (-pi, pi].
pub(super) fn wrapped(angle: f64) -> f64 {
    let turn = angle.rem_euclid(2.0 * PI);
    if turn > PI { turn - 2.0 * PI } else { turn }
}
