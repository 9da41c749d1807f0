//! The planar two-link flexible arm with its converged motions.
//!
//! The motions were computed with eight curvature coordinates per link and Richardson extrapolation of 0.1 and 0.05 ms, and checked
//! against six coordinates (5e-13 m) and an implicit Runge-Kutta method (1e-12 m).

use serde_json::Value;
use vpm_core::Result;
use vpm_core::beam::linear::{Plane, TipBody};
use vpm_core::beam::planar::{Arm, Hub, LinkParameters, Order, PlanarChain, Reference, Servo, State};
use vpm_core::beam::{Basis, Material, Section, Shape};

const STEEL: Material = Material { young: 210e9, poisson: 0.3, density: 7850.0 };
const LENGTHS: [f64; 2] = [0.44, 0.41];
const GAUGE: f64 = 0.02;
const HALF_DEPTH: f64 = 0.002;

/// A motion and its samples (t, tip x, tip y, strain of link 1, of link 2) at 10 Hz.
pub struct Case {
    amplitude: f64,
    period: f64,
    samples: Vec<[f64; 5]>,
}

/// RMS distance of the tip in m, RMS errors of both strains relative to their RMS.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Tip, in m.
    pub tip: f64,
    /// Strains.
    pub strain: [f64; 2],
}

impl Case {
    /// The motion of that name: `slow` or `fast`.
    pub fn load(name: &str) -> Option<Self> {
        let data: Value = serde_json::from_str(include_str!("../../data/flexible_arm.json")).ok()?;
        let case = &data["cases"][name];
        let rows = case["samples_10Hz"].as_array()?.iter();
        let numbers = |row: &Value| Some(std::array::from_fn(|k| row[k].as_f64().unwrap_or(f64::NAN)));
        let samples = rows.map(numbers).collect::<Option<_>>()?;
        Some(Self { amplitude: case["amp"].as_f64()?, period: case["T"].as_f64()?, samples })
    }

    /// Both joints swing together: `amplitude / 2 (1 - cos(2 pi t / period))`.
    pub fn reference(&self) -> impl Fn(f64) -> [Reference; 2] + Copy + use<> {
        let (half, speed) = (0.5 * self.amplitude, std::f64::consts::TAU / self.period);
        move |t| {
            let (sin, cos) = (speed * t).sin_cos();
            [Reference { angle: half * (1.0 - cos), rate: half * speed * sin }; 2]
        }
    }

    /// The first seconds of the motion.
    #[allow(dead_code, reason = "the benchmark runs whole motions")]
    pub fn first(mut self, seconds: usize) -> Self {
        self.samples.truncate(10 * seconds);
        self
    }

    /// Runs the arm over the whole record in steps of `step` and compares.
    pub fn run<const EACH: usize, const ALL: usize>(&self, order: Order, points: usize, step: f64) -> Result<Errors> {
        let mut arm = arm::<EACH, ALL>(order, points, step)?;
        let (reference, steps) = (self.reference(), (0.1 / step).round() as usize);
        let gauges = [0, 1].map(|link| arm.chain().curvature_row(link, GAUGE));
        let (mut state, mut tip_sum, mut error, mut size) = (State::default(), 0.0, [0.0; 2], [0.0; 2]);
        for &[_, x, y, first, second] in &self.samples {
            for _ in 0..steps {
                arm.step(&mut state, reference);
            }
            let tip = arm.chain().tips(&state.motion.position)[1];
            tip_sum += (tip[0] - x).powi(2) + (tip[1] - y).powi(2);
            for (k, expected) in [first, second].into_iter().enumerate() {
                let curvature: f64 = gauges[k].iter().zip(&state.motion.position).map(|(row, x)| row * x).sum();
                error[k] += (HALF_DEPTH * curvature - expected).powi(2);
                size[k] += expected.powi(2);
            }
        }
        let strain = std::array::from_fn(|k| (error[k] / size[k]).sqrt());
        Ok(Errors { tip: (tip_sum / self.samples.len() as f64).sqrt(), strain })
    }
}

/// The arm with `EACH - 1` curvature coordinates per link.
pub fn arm<const EACH: usize, const ALL: usize>(order: Order, points: usize, step: f64) -> Result<Arm<2, EACH, ALL>> {
    let strip = Section::new(Shape::Rectangle { width: 0.015, height: 0.004 }, STEEL)?;
    let link = LinkParameters { damping: 5e-4, ..LinkParameters::new(&strip, Plane::Y) };
    let hubs = [0.02, 0.002].map(|inertia| Hub { inertia, ..Hub::default() });
    let tips = [TipBody { mass: 2.0, inertia: 0.002 }, TipBody { mass: 0.05, inertia: 0.0 }];
    let basis = |length| Basis::legendre(length, EACH - 1);
    let links = [
        (LinkParameters { hub: hubs[0], tip: tips[0], ..link }, basis(LENGTHS[0])?),
        (LinkParameters { hub: hubs[1], tip: tips[1], ..link }, basis(LENGTHS[1])?),
    ];
    let servos = [Servo { stiffness: 400.0, damping: 10.0 }, Servo { stiffness: 50.0, damping: 0.5 }];
    Arm::of_order(order, PlanarChain::new(links, [0.0, -9.81], points)?, servos, step)
}
