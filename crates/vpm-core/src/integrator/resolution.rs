//! What a method of fixed steps damps, shifts or lets grow because it does not resolve it.
//!
//! For analysis beside a run: this allocates.

use nalgebra::{Complex, DMatrix};

use super::stability::eigenvalues;
use super::{Integrator, Method, crank_nicolson};
use crate::error::Result;
use crate::ode::Ode;

/// Damping ratio below which a mode counts as lightly damped: it rings for more than a period and a half.
pub const LIGHT: f64 = 0.1;
/// Share of its amplitude that a mode may lose to the method unsaid, or of its frequency and rad of its phase.
pub const LOST: f64 = 0.1;
/// By how much a step may let a mode grow unsaid: rounding.
const GROWN: f64 = 1e-9;
/// Steps in which friction brakes a joint on trial: more than any method takes to forget how it began.
const BRAKING: f64 = 10.0;
/// Steps after which the joint has to rest: those of the braking, and as many again several times for what creeps.
const WAITING: usize = 60;
/// Speeds at which the braking begins, evenly over what friction takes off in a step: one alone could end at rest by luck.
const PHASES: u32 = 8;
/// Loads that friction has to hold on trial, evenly up to the friction itself, under which nothing rests.
const LOADS: u32 = 8;
/// Largest product of angular frequency and step that is looked at, and how finely.
const REACH: f64 = 10.0;
const GRID: f64 = 0.05;

/// A lightly damped mode that the method damps besides or moves to another frequency; or any that it lets grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damped {
    /// Its frequency in Hz; of a decay its rate over 2 pi.
    pub frequency: f64,
    /// Its own damping ratio.
    pub ratio: f64,
    /// The time that counts in s: that of the run, or in which the mode falls to 1/e by itself if that is shorter and it does not grow.
    pub time: f64,
    /// Share of its amplitude that the method leaves of it in that time; of one that grows, what becomes of it, without its own damping.
    pub left: f64,
    /// By which share of its frequency the method makes it faster; 0 for what grows.
    pub shift: f64,
}

/// What a method resolves over a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolution {
    /// Frequency in Hz above which the amplitude or the frequency of an undamped vibration is off by more than [`LOST`]; infinite if there
    /// is none.
    pub limit: f64,
    /// The lightly damped modes that are off by more than that and all that grow, slowest first.
    pub damped: Vec<Damped>,
}

/// How a method steps through a linear system.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// The method.
    pub method: Method,
    /// Its step in s.
    pub step: f64,
    /// Time of the run in s.
    pub duration: f64,
    /// Whether [`Method::SemiImplicit`] takes the stiffness implicitly.
    pub implicit: bool,
}

impl Resolution {
    /// Judges what `steps` resolve of the linear system `x' = A x`, A (`jacobian`) row by row, in states of these natural `sizes`.
    ///
    /// Law: a mode `e^(s t)` is a damped oscillator. The method itself makes one step of it; the eigenvalue g of what that does to its
    /// state leaves `(|g| e^(-h Re s))^(t/h)` of its amplitude over a time t, beside its own damping, and makes its frequency
    /// `arg g / (h Im s)` times as high. It grows where `|g| > 1` and `Re s <= 0`. Forces that a method takes explicitly and others that it
    /// takes implicitly are not told apart.
    /// Steps of controlled error resolve what they meet; guarded ones are those of the Rosenbrock method.
    /// Checked: closed forms of the stability functions, runs of a spring.
    pub fn new(jacobian: &[f64], sizes: &[f64], steps: Steps) -> Result<Self> {
        let none = Self { limit: f64::INFINITY, damped: Vec::new() };
        let steps = match steps.method {
            Method::Adaptive { .. } => return Ok(none),
            Method::Guarded => Steps { method: Method::Rosenbrock, ..steps },
            _ => steps,
        };
        if jacobian.iter().any(|entry| !entry.is_finite()) {
            return Ok(none);
        }
        let n = sizes.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| jacobian[i * n + j] * sizes[j] / sizes[i]);
        let all = eigenvalues(scaled)?.into_iter().filter(|value| value.im >= 0.0 && value.norm() > 0.0);
        let mut damped: Vec<_> = all.filter_map(|value| steps.grown(value).or_else(|| steps.damped(value))).collect();
        damped.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        Ok(Self { limit: steps.limit(), damped })
    }
}

impl Steps {
    /// Lightly damped vibration that a method does not resolve and damps or shifts.
    fn damped(&self, value: Complex<f64>) -> Option<Damped> {
        let (size, ratio) = (value.norm(), -value.re / value.norm());
        if value.im == 0.0 || ratio >= LIGHT {
            return None;
        }
        let own = if ratio > 0.0 { (ratio * size).recip() } else { f64::INFINITY };
        let time = self.duration.min(own);
        let turn = self.turn(size * self.step, ratio);
        let left = (turn.norm() * (-value.re * self.step).exp()).powf(time / self.step);
        let shift = turn.arg().abs() / (value.im * self.step) - 1.0;
        let mode = Damped { frequency: value.im / std::f64::consts::TAU, ratio, time, left, shift };
        // What hardly turns in all that time goes nowhere else: a body that floats has such modes, of rounding alone.
        let moved = shift.abs() > LOST && shift.abs() * value.im * time > LOST;
        (left < 1.0 - LOST || moved).then_some(mode)
    }

    /// Unresolved mode that grows by the method and not by itself.
    fn grown(&self, value: Complex<f64>) -> Option<Damped> {
        let (size, ratio) = (value.norm(), -value.re / value.norm());
        let growth = match value.im == 0.0 {
            true => self.decay(size * self.step),
            false => self.turn(size * self.step, ratio).norm(),
        };
        let left = growth.powf(self.duration / self.step);
        let mode = Damped { frequency: size / std::f64::consts::TAU, ratio, time: self.duration, left, shift: 0.0 };
        (ratio >= 0.0 && growth > 1.0 + GROWN && left > 1.0 + LOST).then_some(mode)
    }

    /// Resolution limit: frequency in Hz above which the method changes an undamped vibration.
    fn limit(&self) -> f64 {
        let lost = |reach: f64| {
            let turn = self.turn(reach, 0.0);
            let left = turn.norm().powf(self.duration / self.step);
            (left - 1.0).abs() > LOST || (turn.arg().abs() / reach - 1.0).abs() > LOST
        };
        let first = (1..=(REACH / GRID) as u32).map(|k| f64::from(k) * GRID).find(|&reach| lost(reach));
        let Some(mut high) = first else { return f64::INFINITY };
        let mut low = high - GRID;
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if lost(middle) { high = middle } else { low = middle }
        }
        high / (std::f64::consts::TAU * self.step)
    }

    /// Factor of one step of `reach` radians on an oscillator of that damping ratio, for its resolution.
    fn turn(&self, reach: f64, ratio: f64) -> Complex<f64> {
        if self.method == Method::CrankNicolson {
            return crank_nicolson::growth(Complex::new(-ratio, (1.0 - ratio * ratio).max(0.0).sqrt()) * reach);
        }
        let [[a, c], [b, d]] = self.columns(1.0, 2.0 * ratio, reach);
        let (half, product) = (0.5 * (a + d), a * d - b * c);
        let square = half * half - product;
        match square < 0.0 {
            true => Complex::new(half, (-square).sqrt()),
            false => Complex::from(half + square.sqrt().copysign(half)),
        }
    }

    /// Growth of a decay in one step of `reach` time constants, which a method does not resolve.
    fn decay(&self, reach: f64) -> f64 {
        if self.method == Method::CrankNicolson {
            return crank_nicolson::growth(Complex::from(-reach)).norm();
        }
        let [[a, c], [b, d]] = self.columns(0.0, 1.0, reach);
        // The other factor is that of the place, which is 1.
        (a * d - b * c).abs()
    }

    /// Derivative of the state after a step by the state before, for the resolution of steps.
    fn columns(&self, stiffness: f64, damping: f64, reach: f64) -> [[f64; 2]; 2] {
        let mut oscillator = Oscillator { stiffness, damping, implicit: self.implicit };
        let mut integrator = Integrator::new(self.method, 2);
        [[1.0, 0.0], [0.0, 1.0]].map(|mut x| {
            integrator.step(&mut oscillator, &mut x, reach);
            x
        })
    }
}

/// How implicit steps take the friction of a law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Taken {
    /// By its chord from rest, in additive steps too: friction of joints and shafts.
    #[default]
    Implicitly,
    /// By its chord, but explicitly in additive steps: friction of seals, of gears, and of drives in proportion to their effort.
    ByChord,
}

/// Whether steps resolve sticking: dry friction brings a joint to rest and keeps it there. `turn` is the slope of the
/// friction at rest, times the step, over the inertia that it moves: the steps in which friction at that slope stops
/// the joint.
///
/// Law: `v' = -turn (tanh(v) - load)` in steps of 1, v over the width in which friction turns around, from speeds that friction takes ten
/// steps to stop, under loads up to 7/8 of the friction. The method itself makes the steps. What does not stay within 1 of `atanh(load)`,
/// where friction holds the load, creeps or chatters, by a share of what friction brakes in a step.
/// Steps of controlled error follow friction: they always do, and so do additive methods where they take it implicitly. Guarded steps
/// are those of the Rosenbrock method, for they let such errors pass.
/// Checked: runs of a slider with each method.
pub fn sticks(method: Method, turn: f64, taken: Taken) -> bool {
    let followed = match method {
        Method::Additive | Method::CrankNicolson => taken == Taken::Implicitly,
        _ => matches!(method, Method::Adaptive { .. }),
    };
    if turn <= 1.0 || followed {
        return true;
    }
    let method = if method == Method::Guarded { Method::Rosenbrock } else { method };
    (0..LOADS).all(|place| {
        let load = f64::from(place) / f64::from(LOADS);
        rests::<2>(method, &mut Braked { turn, load }, turn * (1.0 - load), 1.0 + load.atanh())
    })
}

/// Whether steps resolve sticking by friction that bends before it slides. `stiffness` is that of the bending, times
/// the square of the step, over the inertia that it moves; `damping` its resistance to bending, times the step, over
/// that inertia.
///
/// Law: as [`sticks`], with `v' = -stiffness z - damping z'` and `z' = v - |v| z` (Dahl), v over the way that it bends in a step: friction that
/// has stopped a joint stores no more than what moves it by the root of the stiffness. What stays faster is driven by the steps.
/// Additive methods take such friction where it leads to, and errors that grow so fast are seen by all steps that look at them.
/// Checked: runs of a slider with each method.
pub fn bends(method: Method, [stiffness, damping]: [f64; 2]) -> bool {
    if stiffness <= 0.0 || method.controls_errors() || method.is_additive() {
        return true;
    }
    rests::<3>(method, &mut Bristles { stiffness, damping }, stiffness, stiffness.sqrt())
}

/// Whether steps of 1 resolve rest: they brake a joint to `slowest`, whatever its phase. Friction takes off `braked` of
/// its speed in each step.
fn rests<const STATES: usize>(method: Method, joint: &mut impl Ode<f64>, braked: f64, slowest: f64) -> bool {
    (0..PHASES).all(|phase| {
        let mut integrator = Integrator::new(method, STATES);
        let mut x = [0.0; STATES];
        x[1] = braked * (BRAKING + f64::from(phase) / f64::from(PHASES));
        (0..WAITING).for_each(|_| integrator.step(joint, &mut x, 1.0));
        x[1].abs() <= slowest
    })
}

/// `q'' = -turn (tanh(q') - load)`.
struct Braked {
    turn: f64,
    load: f64,
}

impl Braked {
    fn matrix(slope: f64, matrix: &mut [f64]) {
        matrix.copy_from_slice(&[0.0, 1.0, 0.0, -slope]);
    }
}

impl Ode<f64> for Braked {
    fn dim(&self) -> usize {
        2
    }

    fn coordinates(&self) -> usize {
        1
    }

    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt.copy_from_slice(&[x[1], -self.turn * (x[1].tanh() - self.load)]);
    }

    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        Self::matrix(self.turn * x[1].cosh().powi(-2), jacobian);
    }

    fn iteration_matrix(&mut self, x: &[f64], matrix: &mut [f64]) {
        let chord = if x[1] == 0.0 { 1.0 } else { x[1].tanh() / x[1] };
        Self::matrix(self.turn * chord, matrix);
    }
}

/// `q'' = -stiffness z - damping z'`, `z' = q' - |q'| z`.
struct Bristles {
    stiffness: f64,
    damping: f64,
}

impl Bristles {
    /// Derivatives of bristle bending, for the resolution of friction: by velocity and bending, then of the velocity.
    fn matrix(&self, [by_v, by_z]: [f64; 2], matrix: &mut [f64]) {
        let Self { stiffness, damping } = self;
        matrix.copy_from_slice(&[0.0, 1.0, 0.0, 0.0, -damping * by_v, -stiffness - damping * by_z, 0.0, by_v, by_z]);
    }
}

impl Ode<f64> for Bristles {
    fn dim(&self) -> usize {
        3
    }

    fn coordinates(&self) -> usize {
        1
    }

    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        let bending = x[1] - x[1].abs() * x[2];
        dxdt.copy_from_slice(&[x[1], -self.stiffness * x[2] - self.damping * bending, bending]);
    }

    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        self.matrix([1.0 - x[1].signum() * x[2], -x[1].abs()], jacobian);
    }

    fn iteration_matrix(&mut self, x: &[f64], matrix: &mut [f64]) {
        self.matrix([1.0, -x[1].abs()], matrix);
    }

    fn along_path(&mut self, x: &[f64], step: f64, rates: &mut [f64]) {
        let way = x[1] * step;
        rates[2] = (way.signum() - x[2]) * -(-way.abs()).exp_m1() / step;
    }
}

/// `q'' + damping q' + stiffness q = 0`.
struct Oscillator {
    stiffness: f64,
    damping: f64,
    implicit: bool,
}

impl Ode<f64> for Oscillator {
    fn dim(&self) -> usize {
        2
    }

    fn coordinates(&self) -> usize {
        1
    }

    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt.copy_from_slice(&[x[1], -self.stiffness * x[0] - self.damping * x[1]]);
    }

    fn jacobian(&mut self, _: &[f64], jacobian: &mut [f64]) {
        jacobian.copy_from_slice(&[0.0, 1.0, -self.stiffness, -self.damping]);
    }

    fn elasticity(&mut self, _: &[f64], block: &mut [f64]) -> bool {
        block.copy_from_slice(&[-self.stiffness, -self.damping]);
        self.implicit
    }
}
