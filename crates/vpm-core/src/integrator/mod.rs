//! Time integration without allocation: fixed steps in bounded work, and steps of controlled error. It knows a system only as an [`Ode`].

mod adaptive;
pub mod growth;
mod linearly_implicit;
mod lu;
#[cfg(feature = "reference")]
pub mod reference;
mod rk4;
mod rosenbrock;
mod semi_implicit;
pub mod stability;

pub use adaptive::{Adaptive, StepControl, Steps};
pub use linearly_implicit::LinearlyImplicit;
pub use lu::Lu;
pub use rk4::Rk4;
pub use rosenbrock::{RODAS4P2, Rosenbrock, Tableau};
pub use semi_implicit::SemiImplicit;

use crate::error::{Error, Result};
use crate::ode::Ode;
use crate::scalar::Scalar;

/// Which integrator to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Symplectic Euler, order 1.
    SemiImplicit,
    /// Classical Runge-Kutta, order 4, explicit.
    Rk4,
    /// Rosenbrock, order 2, L-stable.
    LinearlyImplicit,
    /// Rosenbrock, order 4, L-stable.
    Rosenbrock,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::SemiImplicit, Self::Rk4, Self::LinearlyImplicit, Self::Rosenbrock];

    /// Its name in options and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::SemiImplicit => "semi_implicit",
            Self::Rk4 => "rk4",
            Self::LinearlyImplicit => "linearly_implicit",
            Self::Rosenbrock => "rosenbrock",
        }
    }

    /// The method of that name.
    pub fn from_name(name: &str) -> Result<Self> {
        Self::ALL
            .into_iter()
            .find(|method| method.name() == name)
            .ok_or_else(|| Error::Integrator { name: name.to_owned() })
    }
}

/// Any of the integrators, with its buffers.
#[derive(Clone, Debug)]
pub enum Integrator<S> {
    /// Symplectic Euler.
    SemiImplicit(SemiImplicit<S>),
    /// Classical Runge-Kutta.
    Rk4(Rk4<S>),
    /// Rosenbrock, order 2.
    LinearlyImplicit(LinearlyImplicit<S>),
    /// Rosenbrock, order 4.
    Rosenbrock(Rosenbrock<S>),
}

impl<S: Scalar> Integrator<S> {
    /// The integrator `method` for systems of `dim` states.
    pub fn new(method: Method, dim: usize) -> Self {
        match method {
            Method::SemiImplicit => Self::SemiImplicit(SemiImplicit::new(dim)),
            Method::Rk4 => Self::Rk4(Rk4::new(dim)),
            Method::LinearlyImplicit => Self::LinearlyImplicit(LinearlyImplicit::new(dim)),
            Method::Rosenbrock => Self::Rosenbrock(Rosenbrock::new(dim)),
        }
    }

    /// Moves `x` on by `step` (s).
    pub fn step(&mut self, ode: &mut impl Ode<S>, x: &mut [S], step: f64) {
        match self {
            Self::SemiImplicit(method) => method.step(ode, x, step),
            Self::Rk4(method) => method.step(ode, x, step),
            Self::LinearlyImplicit(method) => method.step(ode, x, step),
            Self::Rosenbrock(method) => method.step(ode, x, step),
        }
    }
}
