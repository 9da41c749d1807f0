//! Time integration without allocation: fixed steps in bounded work, and steps of controlled error. It knows a system only as an [`Ode`].

/// Does something with a count as a constant where it is small, so that loops are written out; where it is not, the constant is 0.
macro_rules! for_size {
    ($count:expr, $n:ident => $work:expr) => {
        for_size!($count, $n => $work, 1 2 3 4 5 6 7 8 9 10 11 12)
    };
    ($count:expr, $n:ident => $work:expr, $($size:literal)*) => {
        match $count {
            $($size => { const $n: usize = $size; $work })*
            _ => { const $n: usize = 0; $work }
        }
    };
}

mod adaptive;
mod additive;
mod crank_nicolson;
pub mod growth;
mod linearly_implicit;
mod lu;
#[cfg(feature = "reference")]
pub mod reference;
pub mod resolution;
mod rk4;
mod rosenbrock;
mod semi_implicit;
mod split;
pub mod stability;
mod stage;

pub use adaptive::{Adaptive, Halt, MOST_STEPS, Steps, Stuck};
pub use additive::Additive;
pub use crank_nicolson::CrankNicolson;
pub use linearly_implicit::LinearlyImplicit;
pub use lu::Lu;
pub use rk4::Rk4;
pub use rosenbrock::{RODAS4P2, Rosenbrock, Tableau};
pub use semi_implicit::SemiImplicit;

use std::fmt;
use std::ops::{Mul, Neg};

use crate::error::{Error, Result};
use crate::ode::Ode;
use crate::scalar::Scalar;

/// Steps between two questions whether to stop.
const PATIENCE: usize = 256;
/// What `adaptive` alone stands for.
const TOLERANCE: f64 = 1e-6;

/// The length of a step, s: a number, or one that records what is done with it.
pub trait Length: Copy + Default + Neg<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self> {}

impl<L: Copy + Default + Neg<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>> Length for L {}

/// Asked now and then whether to stop.
pub type Ask<'a> = &'a (dyn Fn() -> bool + Sync);

/// Which integrator to use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Symplectic Euler, order 1.
    SemiImplicit,
    /// Classical Runge-Kutta, order 4, explicit.
    Rk4,
    /// Rosenbrock, order 2, L-stable.
    LinearlyImplicit,
    /// Rosenbrock, order 4, L-stable.
    Rosenbrock,
    /// Additive Runge-Kutta, order 4: L-stable for linear stiffness, damping and friction, explicit in all else.
    Additive,
    /// The same split in two steps of order 2 with one evaluation each, A-stable.
    CrankNicolson,
    /// The Rosenbrock method of order 4 with steps of controlled error, as many as it takes.
    Adaptive {
        /// Error of a step relative to each state and its scale.
        tolerance: f64,
    },
    /// That in bounded work: one step, or up to 16 where its error tells of an impact or a jump.
    Guarded,
}

impl Method {
    /// Those of fixed steps.
    pub const FIXED: [Self; 6] =
        [Self::SemiImplicit, Self::Rk4, Self::LinearlyImplicit, Self::Rosenbrock, Self::Additive, Self::CrankNicolson];
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::SemiImplicit,
        Self::Rk4,
        Self::LinearlyImplicit,
        Self::Rosenbrock,
        Self::Additive,
        Self::CrankNicolson,
        Self::Adaptive { tolerance: TOLERANCE },
        Self::Guarded,
    ];

    /// Least number of rate evaluations in a step of an integrator's method. Exact derivatives count as ten: without
    /// machine code they are worked out operation by operation.
    pub fn evaluations(self) -> usize {
        match self {
            Self::SemiImplicit | Self::CrankNicolson => 1,
            Self::LinearlyImplicit => 2,
            Self::Rk4 => 4,
            Self::Additive => 6,
            Self::Rosenbrock | Self::Adaptive { .. } | Self::Guarded => 6 + 10,
        }
    }

    /// Whether an integrator's method chooses its steps by their errors.
    pub fn controls_errors(self) -> bool {
        matches!(self, Self::Adaptive { .. } | Self::Guarded)
    }

    /// Whether an integrator's method takes what is stiff implicitly by [`Ode::additive_rates`].
    pub fn is_additive(self) -> bool {
        matches!(self, Self::Additive | Self::CrankNicolson)
    }

    /// Name of an integrator's method in options, without a tolerance.
    pub fn name(self) -> &'static str {
        match self {
            Self::SemiImplicit => "semi_implicit",
            Self::Rk4 => "rk4",
            Self::LinearlyImplicit => "linearly_implicit",
            Self::Rosenbrock => "rosenbrock",
            Self::Additive => "additive",
            Self::CrankNicolson => "crank_nicolson",
            Self::Adaptive { .. } => "adaptive",
            Self::Guarded => "guarded",
        }
    }

    /// Integrator's method of that name; `adaptive(1e-8)` is `adaptive` with another tolerance.
    pub fn from_name(name: &str) -> Result<Self> {
        let tolerance = name.strip_prefix("adaptive(").and_then(|rest| rest.strip_suffix(')'));
        if let Some(tolerance) = tolerance.and_then(|number| number.trim().parse().ok()) {
            adaptive::check(tolerance)?;
            return Ok(Self::Adaptive { tolerance });
        }
        Self::ALL
            .into_iter()
            .find(|method| method.name() == name)
            .ok_or_else(|| Error::Integrator { name: name.to_owned() })
    }

    /// Refuses a meaningless tolerance of an integrator.
    pub fn check(self) -> Result<()> {
        if let Self::Adaptive { tolerance } = self { adaptive::check(tolerance) } else { Ok(()) }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Adaptive { tolerance } => write!(formatter, "adaptive({tolerance:e})"),
            fixed => formatter.write_str(fixed.name()),
        }
    }
}

/// Any of the integrators, with its buffers.
#[derive(Clone, Debug)]
pub struct Integrator<S> {
    scheme: Scheme<S>,
    /// Fixed steps so far.
    steps: usize,
}

#[derive(Clone, Debug)]
enum Scheme<S> {
    SemiImplicit(SemiImplicit<S>),
    Rk4(Rk4<S>),
    LinearlyImplicit(LinearlyImplicit<S>),
    Rosenbrock(Rosenbrock<S>),
    Additive(Additive<S>),
    CrankNicolson(CrankNicolson<S>),
    Adaptive(Adaptive<S>),
}

impl<S: Scalar> Integrator<S> {
    /// The integrator `method` for systems of `dim` states.
    pub fn new(method: Method, dim: usize) -> Self {
        let scheme = match method {
            Method::SemiImplicit => Scheme::SemiImplicit(SemiImplicit::new(dim)),
            Method::Rk4 => Scheme::Rk4(Rk4::new(dim)),
            Method::LinearlyImplicit => Scheme::LinearlyImplicit(LinearlyImplicit::new(dim)),
            Method::Rosenbrock => Scheme::Rosenbrock(Rosenbrock::new(dim)),
            Method::Additive => Scheme::Additive(Additive::new(dim)),
            Method::CrankNicolson => Scheme::CrankNicolson(CrankNicolson::new(dim)),
            Method::Adaptive { tolerance } => Scheme::Adaptive(Adaptive::unchecked(tolerance, dim)),
            Method::Guarded => Scheme::Adaptive(Adaptive::guarded(dim)),
        };
        Self { scheme, steps: 0 }
    }

    /// Moves `x` on by the integrator's `step` (s): one step, or as many as error control needs. Where those do not get
    /// there, the state that stops them is not a number.
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        match &mut self.scheme {
            Scheme::SemiImplicit(method) => method.step(ode, x, step),
            Scheme::Rk4(method) => method.step(ode, x, step),
            Scheme::LinearlyImplicit(method) => {
                if !ode.linearly_implicit_step(x, step) {
                    method.step(ode, x, step);
                }
            }
            Scheme::Rosenbrock(method) => method.step(ode, x, step),
            Scheme::Additive(method) => method.step(ode, x, step),
            Scheme::CrankNicolson(method) => method.step(ode, x, step),
            Scheme::Adaptive(method) => {
                if let Err(Halt::Stuck(stuck)) = method.advance(ode, x, step, &|| false) {
                    x[stuck.state] = S::from_f64(f64::NAN);
                }
                return;
            }
        }
        ode.arrive(x, Some(step));
    }

    /// Moves `x` on by the integrator over `duration` (s) in equal `pieces`, and asks whether to stop.
    pub fn advance(
        &mut self,
        ode: &mut impl Ode<S>,
        x: &mut [S],
        (duration, pieces): (f64, usize),
        ask: Ask<'_>,
    ) -> std::result::Result<(), Halt> {
        let piece = duration / pieces as f64;
        for number in 0..pieces {
            if let Scheme::Adaptive(method) = &mut self.scheme {
                method.advance(ode, x, piece, ask).map_err(|halt| halt.later(number as f64 * piece))?;
                continue;
            }
            self.step(ode, x, piece);
            self.steps = self.steps.wrapping_add(1);
            if self.steps.is_multiple_of(PATIENCE) && ask() {
                return Err(Halt::Interrupted);
            }
        }
        Ok(())
    }

    /// Notes for the integrator that a step of that length (s) led from `start` to `x`, if it remembers.
    pub(crate) fn follow(&mut self, start: &[S], x: &[S], step: f64) {
        if let Scheme::CrankNicolson(method) = &mut self.scheme {
            method.follow(start, x, step);
        }
    }

    /// Notes for the integrator that a state counts anew from `value`, without a jump.
    pub(crate) fn recount(&mut self, state: usize, value: S) {
        if let Scheme::CrankNicolson(method) = &mut self.scheme {
            method.recount(state, value);
        }
    }

    /// Notes for the integrator that a small correction has moved the leading states to `x`.
    pub(crate) fn correct(&mut self, x: &[S]) {
        if let Scheme::CrankNicolson(method) = &mut self.scheme {
            method.correct(x);
        }
    }

    /// Forgets what earlier steps of the integrator have told about the next.
    pub fn reset(&mut self) {
        match &mut self.scheme {
            Scheme::Adaptive(method) => method.reset(),
            Scheme::CrankNicolson(method) => method.reset(),
            _ => (),
        }
    }
}
