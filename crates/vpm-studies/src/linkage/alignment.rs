//! Where a stroke loses control of its angle, and an angle of its stroke.

use std::f64::consts::PI;

use super::stroke::wrapped;
use super::{Slider, StrokeLinkage};
use vpm_core::spatial::Vector2;

/// A stroke at which axis, slider and anchor are in line: there the stroke cannot control the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// The stroke in m.
    pub stroke: f64,
    /// The angle in rad, in (-pi, pi].
    pub angle: f64,
    /// Whether axis, anchor and slider lie with rod and arm end to end (true), or the rod folded back over the arm.
    pub extended: bool,
}

/// A configuration in which the rod is perpendicular to the stroke: there the angle cannot move the stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perpendicular {
    /// The stroke in m.
    pub stroke: f64,
    /// The angle in rad, in (-pi, pi].
    pub angle: f64,
}

impl StrokeLinkage {
    /// Configurations near an alignment with the rod perpendicular to the stroke. They are zeros of
    /// [`StrokeLinkage::stroke_slope`] on the closed linkage, where the two strokes of an angle meet. None, two or
    /// four; the larger stroke first.
    ///
    /// Law: in the axes of the body that carries the slider, the turning anchor is one rod length away from the slider's line,
    /// on either side: `n . R b = n . start +- l` with n normal to the stroke. Checked: slope and constraint vanish there.
    pub fn perpendiculars(&self) -> Vec<Perpendicular> {
        let (start, anchor) = (self.slider(0.0), self.anchor());
        let normal = self.direction().perpendicular();
        let turn = if self.slider_on() == Slider::OnRocker { -1.0 } else { 1.0 };
        let mut found = Vec::with_capacity(4);
        for side in [1.0, -1.0] {
            let cosine = (normal.dot(start) + side * self.rod()) / self.arm();
            if cosine.is_nan() || cosine.abs() > 1.0 {
                continue;
            }
            for half in [cosine.acos(), -cosine.acos()] {
                let angle = turn * (normal.argument() + half - anchor.argument());
                let (sine, cosine) = (turn * angle).sin_cos();
                let target: Vector2<f64> = anchor.rotated((sine, cosine));
                let stroke = (target - start).dot(self.direction());
                found.push(Perpendicular { stroke, angle: wrapped(angle) });
            }
        }
        found.sort_by(|a, b| b.stroke.total_cmp(&a.stroke));
        found
    }

    /// Alignments: the strokes at which axis, slider and anchor are in line. They are zeros of
    /// [`StrokeLinkage::determinant`] on the closed linkage. First the two with rod and arm end to end, then the two
    /// folded, the larger stroke first.
    pub fn alignments(&self) -> Vec<Alignment> {
        let (rod, arm) = (self.rod(), self.arm());
        let mut found = Vec::with_capacity(4);
        for (extended, distance) in [(true, rod + arm), (false, rod - arm)] {
            let strokes = self.strokes_at_distance(self.slider(0.0), distance.abs());
            for stroke in strokes.into_iter().flatten() {
                found.push(Alignment { stroke, angle: self.aligned(stroke, extended), extended });
            }
        }
        found
    }

    /// The angle at an alignment.
    fn aligned(&self, stroke: f64, extended: bool) -> f64 {
        let (a, b) = self.ends(stroke);
        wrapped(b.argument() - a.argument() + if extended { 0.0 } else { self.folded() })
    }

    /// Angle of the folded alignment at the axis between slider and anchor. The axis lies between them if the rod is
    /// the longer link.
    fn folded(&self) -> f64 {
        if self.rod() > self.arm() { PI } else { 0.0 }
    }

    /// Span of the rocker (rad) in one assembly mode between the extended and the folded alignment.
    ///
    /// Law: `arg b - arg a`, which follows the moving slider, changes by less than half a turn; the angle between
    /// slider and anchor goes from zero to its folded value, with the sign of `mode`, that in
    /// [`StrokeLinkage::angles`].
    pub fn span(&self, extended: &Alignment, folded: &Alignment, mode: f64) -> f64 {
        let middle = |stroke: f64| {
            let (a, b) = self.ends(stroke);
            b.argument() - a.argument()
        };
        wrapped(middle(folded.stroke) - middle(extended.stroke)) + self.folded().copysign(mode)
    }
}
