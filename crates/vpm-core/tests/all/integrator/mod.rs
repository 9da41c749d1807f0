//! How time steps are taken.

mod adaptive;
mod convergence;
mod convergence_flexible;
mod rosenbrock;
mod semi_implicit;
mod stability;
