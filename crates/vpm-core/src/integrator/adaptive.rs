//! Steps of controlled error.

use super::rosenbrock::Rosenbrock;
use super::{Ask, PATIENCE};
use crate::error::{Error, Result};
use crate::ode::Ode;
use crate::scalar::Scalar;

/// Steps, taken and refused, that one [`Adaptive::advance`] may need.
pub const MOST_STEPS: usize = 10_000;
/// Steps below this part of the time to go are no steps any more.
const SHORTEST: f64 = 1e-12;
/// Smallest and largest tolerance that mean something.
const TOLERANCES: [f64; 2] = [1e-12, 0.1];
/// How much shorter the next step may be.
const SHORTER: f64 = 0.2;
/// Part of a step down to which one is cut where a contact closes: what is left of the way in takes no further step.
const NEAREST: f64 = 1e-3;
/// Part of the length that the error allows which is used.
const CAUTION: f64 = 0.9;

/// What is asked of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rule {
    /// Error of a step relative to each state and its scale.
    tolerance: f64,
    /// First step as a part of the time to go.
    first: f64,
    /// Steps no longer than this part of the time to go are taken whatever their error; 0 if there are none.
    floor: f64,
    /// How much longer the next step may be.
    longer: f64,
    /// How long the next step may be after a refused one, in its length.
    refused: f64,
}

impl Rule {
    /// Rule of the adaptive method: as many steps as the tolerance needs.
    const fn exact(tolerance: f64) -> Self {
        Self { tolerance, first: 1e-3, floor: 0.0, longer: 5.0, refused: 1.0 }
    }

    /// One step where that will do, sixteen at most, refused ones apart. With these factors there is no more than one refused step to
    /// every step taken, and four on the way from the longest to the shortest.
    const GUARDED: Self = Self { tolerance: 1e-2, first: 1.0, floor: 1.0 / 16.0, longer: 2.0, refused: 0.5 };
}

/// The Rosenbrock method of order 4 with steps as long as their error allows.
///
/// Law: the error of a step is the difference e to the embedded solution of order 3; with the weights
/// `w = tolerance (scale + max(|x|, |x+|))`, the scales those of [`Ode::scales`], a step is taken where `E = max |e/w| <= 1`, and the
/// next is `min(max(0.9 E^(-1/4), 1/5), 5)` times as long, not longer after a refused one. Where two steps are left, they are equal.
/// Source: Hairer & Wanner 1996, "Solving Ordinary Differential Equations II", sections IV.7 and IV.8, equations 8.19 to 8.21, with
/// the largest error in the place of the mean, so that states at rest do not hide one that moves.
/// A step from where a contact is open ends where it closes at the speed of now ([`Ode::horizon`]), unless that is next to no step: a
/// contact that closes and opens within a step has no stage to tell of it. What decelerates arrives in steps that become quadratically
/// shorter.
/// What decides are values alone: derivatives that the number type carries are those of the steps taken.
/// The step goes on where the last call left it; [`Adaptive::reset`] forgets it. The work is bounded by the number of steps, not by
/// the time. Checked: the tolerance; that the end is reached within the steps; the error follows the tolerance.
#[derive(Clone, Debug)]
pub struct Adaptive<S> {
    method: Rosenbrock<S>,
    rule: Rule,
    scales: Vec<f64>,
    next: Vec<S>,
    proposed: Option<f64>,
    /// Steps tried so far.
    attempts: usize,
}

/// What one [`Adaptive::advance`] has taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// Steps that were taken.
    pub accepted: usize,
    /// Steps that were too long.
    pub refused: usize,
}

/// Why steps end before their time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Halt {
    /// The caller asked for it.
    Interrupted,
    /// The step control does not get on.
    Stuck(Stuck),
}

/// Where a step control does not get on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stuck {
    /// The state whose error is the largest part of what it may be, or that is not finite.
    pub state: usize,
    /// How far the steps led, s.
    pub reached: f64,
    /// Length of the last step, s.
    pub step: f64,
    /// Whether there were too many steps; otherwise they became too short.
    pub many: bool,
}

impl Stuck {
    /// Event that the adaptive method cannot follow: the verb of a sentence about the state.
    pub fn event(&self) -> String {
        if self.many {
            return format!("takes more than {MOST_STEPS} steps to follow");
        }
        "changes faster than any step can follow".to_owned()
    }

    /// Repair for a state that the adaptive method cannot follow, for the end of the message.
    pub fn repair(&self) -> &'static str {
        if self.many {
            "use a larger tolerance or more substeps, and look for a vibration or a growth that should not be there"
        } else {
            "look for a jump or an infinite slope in what moves it, and check the signs and sizes of the parameters"
        }
    }
}

impl Halt {
    /// Halt of the adaptive method, with its time counted from `time` (s) earlier.
    pub(super) fn later(self, time: f64) -> Self {
        match self {
            Self::Interrupted => Self::Interrupted,
            Self::Stuck(stuck) => Self::Stuck(Stuck { reached: time + stuck.reached, ..stuck }),
        }
    }
}

impl From<Halt> for Error {
    fn from(halt: Halt) -> Self {
        match halt {
            Halt::Interrupted => Self::Interrupted,
            Halt::Stuck(stuck) => {
                let Stuck { state, reached, step, .. } = stuck;
                Self::Steps { state, event: stuck.event(), reached, step, repair: stuck.repair() }
            }
        }
    }
}

/// How the error of a step compares with what it may be.
struct Verdict {
    /// Largest error in tolerances; infinite where the step has no number.
    error: f64,
    /// The state with that error.
    state: usize,
}

impl<S: Scalar> Adaptive<S> {
    /// Buffers of the adaptive method for `dim` states; `tolerance` is relative to each state and its scale.
    pub fn new(tolerance: f64, dim: usize) -> Result<Self> {
        check(tolerance)?;
        Ok(Self::unchecked(tolerance, dim))
    }

    pub(super) fn unchecked(tolerance: f64, dim: usize) -> Self {
        Self::with(Rule::exact(tolerance), dim)
    }

    /// Buffers of the adaptive method for `dim` states with bounded work. A call takes one step where its error stays
    /// below 1e-2, and no more than 16 (and 20 refused ones) where not. Steps of a sixteenth are taken whatever their
    /// error.
    pub fn guarded(dim: usize) -> Self {
        Self::with(Rule::GUARDED, dim)
    }

    fn with(rule: Rule, dim: usize) -> Self {
        let (method, next) = (Rosenbrock::new(dim), vec![S::zero(); dim]);
        Self { method, rule, scales: vec![1.0; dim], next, proposed: None, attempts: 0 }
    }

    /// Forgets the length of the last adaptive step.
    pub fn reset(&mut self) {
        self.proposed = None;
    }

    /// Moves `x` on by `duration` (s) in adaptive steps. The first is what the last call proposed or, at first, a
    /// thousandth of the duration.
    ///
    /// Now and then it asks whether to stop.
    pub fn advance(
        &mut self,
        ode: &mut impl Ode<S>,
        x: &mut [S],
        duration: f64,
        ask: Ask<'_>,
    ) -> std::result::Result<Steps, Halt> {
        ode.scales(&mut self.scales);
        let rule = self.rule;
        let (mut gone, mut steps, mut longest) = (0.0, Steps::default(), rule.longer);
        let (mut fresh, mut ahead) = (true, f64::INFINITY);
        let (mut step, floor) = (self.proposed.unwrap_or(rule.first * duration), rule.floor * duration);
        while gone < duration {
            let left = duration - gone;
            let taken = match left / step {
                ..=1.0 => left,
                ..2.0 => 0.5 * left,
                _ => step,
            };
            if fresh {
                // Work that is bounded has no steps to spare.
                ahead = if floor > 0.0 { f64::INFINITY } else { ode.horizon(x) };
                self.method.linearise(ode, x);
            }
            let taken = taken.min(ahead.max(NEAREST * step));
            let verdict = self.attempt(ode, x, taken);
            let stuck = Stuck { state: verdict.state, reached: gone, step: taken, many: false };
            let length = taken * (CAUTION / verdict.error.sqrt().sqrt()).clamp(SHORTER, longest);
            if verdict.error <= 1.0 || (taken <= floor && verdict.error.is_finite()) {
                x.copy_from_slice(&self.next);
                ode.arrive(x, (floor > 0.0).then_some(taken));
                gone = if taken < left { gone + taken } else { duration };
                // A step that the end or a contact cut short says nothing against the longer one.
                step = floor.max(if taken < step { step.max(length) } else { length });
                (steps.accepted, longest, fresh) = (steps.accepted + 1, rule.longer, true);
            } else if taken <= floor.max(SHORTEST * duration) {
                return Err(Halt::Stuck(stuck));
            } else {
                step = floor.max(length.min(rule.refused * taken));
                // Rates and Jacobian are still those where the step begins.
                (steps.refused, longest, fresh) = (steps.refused + 1, 1.0, false);
            }
            if steps.accepted + steps.refused >= MOST_STEPS && gone < duration {
                return Err(Halt::Stuck(Stuck { many: true, ..stuck }));
            }
            self.attempts = self.attempts.wrapping_add(1);
            if self.attempts.is_multiple_of(PATIENCE) && ask() {
                return Err(Halt::Interrupted);
            }
        }
        self.proposed = Some(step);
        Ok(steps)
    }

    /// Attempts an adaptive step into `next`, and judges it.
    fn attempt(&mut self, ode: &mut impl Ode<S>, x: &[S], step: f64) -> Verdict {
        self.method.attempt(ode, x, step);
        self.method.accept(&mut self.next);
        let mut worst = Verdict { error: 1e-12, state: 0 };
        let pairs = x.iter().zip(&self.next).zip(self.method.last_increment()).zip(&self.scales);
        for (state, (((before, after), error), scale)) in pairs.enumerate() {
            let (before, after) = (before.re().abs(), after.re().abs());
            let weight = self.rule.tolerance * (scale + if after > before { after } else { before });
            let error = (error.re() / weight).abs();
            // Not a number is as bad as it gets.
            let error = if error.is_nan() { f64::INFINITY } else { error };
            if error > worst.error {
                worst = Verdict { error, state };
            }
        }
        worst
    }
}

/// Refuses a meaningless tolerance of the adaptive method.
pub(super) fn check(tolerance: f64) -> Result<()> {
    let [least, most] = TOLERANCES;
    if (least..=most).contains(&tolerance) {
        return Ok(());
    }
    let (setting, condition) = ("the tolerance of adaptive", format!("lie between {least:e} and {most}"));
    Err(Error::Setting { setting, condition, value: tolerance, repair: "write adaptive(1e-6), for example" })
}
