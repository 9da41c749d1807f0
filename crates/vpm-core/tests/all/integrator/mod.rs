//! How time steps are taken.

mod adaptive;
mod additive;
mod convergence;
mod convergence_flexible;
mod crank_nicolson;
mod resolution;
mod rosenbrock;
mod semi_implicit;
mod stability;
