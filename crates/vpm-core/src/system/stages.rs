//! How long each part of one evaluation of the rates takes, part by part at the same state.

use std::hint::black_box;
use std::time::Instant;

use super::{Dynamics, Matrix, System, add_effects};
use crate::contact::ContactFriction;
use crate::data::Composite;
use crate::dynamics::articulated::articulated;
use crate::dynamics::{Stations, aba, flexible, frames, lines, motion, outward, poses};
use crate::integrator::Method;
use crate::ode::Ode;

/// How long calls in a row take together between two looks at the clock, which itself takes tens of ns, s.
const ROW: f64 = 1e-5;
/// The most calls in a row.
const REPEATS: u32 = 16;
/// Rows of calls; the shortest counts, because nothing makes a computation faster than it is.
const ROWS: usize = 5;
/// How far a stage of an additive step reaches, s; what it costs does not depend on it.
const REACH: f64 = 1e-4;

/// Seconds of one call of each part.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Parts {
    /// Frames and lines: where everything is and how it moves, without the beams.
    pub(crate) kinematics: f64,
    /// Sections of the beams along their centrelines.
    pub(crate) beams: f64,
    /// Mass matrix and bias; none where articulated bodies take their place, which are part of the solution.
    pub(crate) mass_matrix: f64,
    /// Drives and supplies.
    pub(crate) actuators: f64,
    /// Effects on the joints.
    pub(crate) effects: f64,
    /// Contacts and bushings.
    pub(crate) contact: f64,
    /// Accelerations from all loads.
    pub(crate) solve: f64,
}

impl Parts {
    /// Stages of the rates, part by part with names.
    pub(crate) fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("kinematics", self.kinematics),
            ("beams", self.beams),
            ("mass matrix", self.mass_matrix),
            ("actuators", self.actuators),
            ("effects", self.effects),
            ("contact", self.contact),
            ("solve", self.solve),
        ]
    }
}

/// Seconds of one stage: the least over some rows of calls.
pub(crate) fn seconds(mut call: impl FnMut()) -> f64 {
    let mut row = |calls: u32| {
        let begin = Instant::now();
        for _ in 0..calls {
            call();
        }
        begin.elapsed().as_secs_f64() / f64::from(calls)
    };
    // The first finds the memory cold: it only says how many calls fill a row.
    let calls = ((ROW / row(1)) as u32).clamp(1, REPEATS);
    (0..ROWS).map(|_| row(calls)).fold(f64::INFINITY, f64::min)
}

impl Dynamics<f64> {
    /// Seconds of each stage of the rates at `x`.
    pub(crate) fn parts(&mut self, x: &[f64]) -> Parts {
        let n = self.coordinates();
        let (q, v) = x[..2 * n].split_at(n);
        let mut rates = vec![0.0; self.dim()];
        self.rhs(x, &mut rates);
        let mut parts = Parts { actuators: seconds(|| self.actuate(black_box(x), &mut rates)), ..Parts::default() };
        self.rhs(x, &mut rates);
        let (moves, touches) = (self.pulls, !self.connections.is_free());
        let Self { model, data, effects, efforts, loads, connections, .. } = self;
        if model.is_recursive() {
            if moves || touches {
                parts.kinematics = seconds(|| {
                    motion(model, data, black_box(q), v);
                    lines(model, data);
                });
            }
        } else if model.is_articulated() {
            if moves || touches {
                parts.kinematics = seconds(|| {
                    frames(model, data, black_box(q), v);
                    poses(model, data);
                    lines(model, data);
                });
            }
            let segments = model.beams().iter().map(|elastic| elastic.beam.segments()).zip(&mut data.segments);
            for (segment, slot) in segments.flat_map(|(segments, slots)| segments.iter().zip(slots)) {
                let (q, v, keeps) = (&slot.coordinates, &slot.rates, model.keeps_velocity_terms());
                parts.beams += seconds(|| segment.motion(black_box(q), v, &mut slot.sections, keeps));
            }
        } else {
            let outward = seconds(|| outward(model, data, (black_box(q), v), Stations::Summed));
            let Composite { sections, sums, .. } = &mut data.composite;
            let buffers = sections.iter_mut().zip(sums);
            for (number, (elastic, (sections, sums))) in model.beams().iter().zip(buffers).enumerate() {
                let own = elastic.coordinate..elastic.coordinate + elastic.beam.len();
                let (beam, asked) = (&elastic.beam, model.accelerates(number));
                let (q, v) = (&q[own.clone()], &v[own]);
                parts.beams += seconds(|| match &elastic.slices {
                    Some(slices) => beam.gather((black_box(q), v), 0.0, (slices, sums), sections),
                    None => beam.sweep(black_box(q), v, sections, asked),
                });
            }
            let terms = seconds(|| flexible::terms(model, data, black_box(q), v));
            parts.mass_matrix = (terms - outward).max(0.0);
            parts.kinematics = (outward - parts.beams).max(0.0);
            if touches {
                parts.kinematics += seconds(|| poses(model, data));
            }
        }
        if !effects.is_empty() {
            parts.effects = seconds(|| add_effects(effects, [black_box(q), v, efforts], loads));
        }
        if touches {
            parts.contact =
                seconds(|| connections.add_loads(model, data, ContactFriction::resistance, black_box(loads)));
        }
        loads.fill(0.0);
        parts.solve = if model.is_recursive() {
            seconds(|| {
                aba(model, data, black_box(q), v, loads);
            })
        } else if model.is_articulated() {
            let whole = seconds(|| {
                articulated(model, data, black_box(q), v, loads);
            });
            (whole - parts.beams).max(0.0)
        } else {
            seconds(|| {
                flexible::solve(model, data, black_box(q), v, loads);
            })
        };
        parts
    }

    /// Seconds of the stage that reads all outputs at `x`.
    pub(crate) fn observing(&mut self, x: &[f64], outputs: &mut [f64]) -> f64 {
        let mut rates = vec![0.0; self.dim()];
        self.rhs(x, &mut rates);
        seconds(|| self.observe(black_box(x), &rates, outputs))
    }
}

impl System<f64> {
    /// Seconds of the rates at `x` that steps by `method` need.
    pub(crate) fn rates_seconds(&mut self, method: Method, x: &[f64]) -> f64 {
        let mut rates = vec![0.0; self.dim()];
        match method {
            _ if method.is_additive() => seconds(|| {
                self.additive_rates(black_box(x), x, REACH, &mut rates);
            }),
            _ => seconds(|| self.rhs(black_box(x), &mut rates)),
        }
    }

    /// Seconds of the stage of rates with all outputs at `x`.
    pub(crate) fn sample_seconds(&mut self, x: &[f64], outputs: &mut [f64]) -> f64 {
        let mut rates = vec![0.0; self.dim()];
        seconds(|| self.sample(black_box(x), &mut rates, outputs))
    }

    /// Seconds of the stage of one matrix of this kind at `x`, with rates where they come with it.
    pub(crate) fn matrix_seconds(&mut self, kind: Matrix, x: &[f64]) -> f64 {
        let (dim, n) = (self.dim(), self.coordinates());
        let mut rates = vec![0.0; dim];
        let mut matrix = vec![0.0; dim * dim];
        let whole = match kind {
            Matrix::Jacobian => seconds(|| self.linearise(black_box(x), &mut matrix, &mut rates)),
            Matrix::Iteration => seconds(|| self.prepare(black_box(x), &mut matrix, &mut rates)),
            Matrix::Elasticity => {
                let block = &mut matrix[..2 * n * n];
                return seconds(|| {
                    self.elasticity(black_box(x), block);
                });
            }
        };
        if self.has_rates_in(kind) {
            return whole;
        }
        (whole - seconds(|| self.rhs(black_box(x), &mut rates))).max(0.0)
    }
}
