//! The one interface between physics and time stepping.

/// An autonomous system of ordinary differential equations `dx/dt = f(x)`; inputs are held constant inside it.
pub trait Ode<S> {
    /// Length of the state x of an ODE.
    fn dim(&self) -> usize;

    /// Number of second-order coordinates that lead the state of an ODE. `x[0..n]` are coordinates and `x[n..2n]` their
    /// rates, `dx[0..n]/dt = x[n..2n]`.
    fn coordinates(&self) -> usize;

    /// Writes the right-hand side f(x) of an ODE.
    fn rhs(&mut self, x: &[S], dxdt: &mut [S]);

    /// Writes df/dx of an ODE, row by row: entry (i, j) at `i * dim + j`.
    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]);

    /// Writes the matrix of an ODE that an implicit step puts in the place of df/dx. A system that knows one of better
    /// stability says so here.
    fn iteration_matrix(&mut self, x: &[S], matrix: &mut [S]) {
        self.jacobian(x, matrix);
    }

    /// Writes df/dx and f(x) of an ODE, for systems to which the one is of use for the other. Derivatives that numbers
    /// carry may be missing in the matrix: see [`Ode::turned`].
    fn linearise(&mut self, x: &[S], jacobian: &mut [S], rates: &mut [S]) {
        self.jacobian(x, jacobian);
        self.rhs(x, rates);
    }

    /// Writes [`Ode::iteration_matrix`] and f(x), likewise.
    fn prepare(&mut self, x: &[S], matrix: &mut [S], rates: &mut [S]) {
        self.iteration_matrix(x, matrix);
        self.rhs(x, rates);
    }

    /// Whether derivatives are missing in the matrix of the last [`Ode::linearise`] or [`Ode::prepare`].
    fn turns(&self) -> bool {
        false
    }

    /// Writes what missing derivatives of an ODE make of the values of `k`: their product, of value zero.
    ///
    /// Law: of `(1 - r A) k = b` the derivatives are `k' = (1 - r A)^-1 (b' + r A' k)`: they take the factors of the matrix of values, and
    /// of A' its product alone.
    fn turned(&mut self, _k: &[S], _product: &mut [S]) {}

    /// Writes the ODE's constant linear elasticity `[-M^-1 K, -M^-1 D]`; tells whether there is any. It adds to the
    /// accelerations by coordinates and rates: with n coordinates, n rows of 2 n entries each. Without it nothing is
    /// written.
    ///
    /// A semi-implicit step takes these two implicitly. Everything else that acts stays explicit.
    fn elasticity(&mut self, _x: &[S], _block: &mut [S]) -> bool {
        false
    }

    /// Writes the rates of an ODE for an additive step, explicit and implicit; tells whether any is implicit. The stage
    /// has come to `explicit` by one table, and will be at `implicit` and `reach` (s) times these rates by the other.
    ///
    /// Law: `f(explicit, implicit + reach rates)` of a split right-hand side with `f(x, x) = f(x)`: whatever is stiff is taken from the
    /// second argument, everything else from the first. Of a machine with coordinates q, rates v and other states s, E and I the two,
    /// `(M(q_E) + reach (D + R) + reach^2 K) a = f(x_E) - bias(q_E, v_E) - K (q_I + reach v_I) - (D + R) v_I`, f all other forces,
    /// `dq/dt = v_I + reach a`, `dv/dt = a`; R is the resistance of friction, K and D are linear stiffness and damping.
    /// The stages of a step come in their order; at the first, where there is no reach, the two states are the same.
    fn additive_rates(&mut self, explicit: &[S], _implicit: &[S], _reach: f64, rates: &mut [S]) -> bool {
        self.rhs(explicit, rates);
        false
    }

    /// Moves `x` of an ODE on by one linearly implicit `step` (s) as a whole; tells whether it did. What does not,
    /// leaves `x` as it is.
    ///
    /// Law: [`crate::integrator::LinearlyImplicit`].
    fn linearly_implicit_step(&mut self, _x: &mut [S], _step: f64) -> bool {
        false
    }

    /// Puts mean `rates` of an ODE's path-following states over a `step` into place. Coordinates move at the rates in
    /// `x` along that step. A semi-implicit step asks for it when it knows the new rates of the coordinates.
    fn along_path(&mut self, _x: &[S], _step: f64, _rates: &mut [S]) {}

    /// Notes for an ODE that a step has led to `x`, before the next begins there. The `step` (s) is of fixed length or
    /// one of controlled error. A system whose coordinates are local may go on in others.
    ///
    /// Law: a one-step method in local coordinates keeps its order (Munthe-Kaas 1999; Hairer, Lubich & Wanner 2006, "Geometric Numerical
    /// Integration", section IV.8).
    fn arrive(&mut self, _x: &mut [S], _step: Option<f64>) {}

    /// Horizon of an ODE: time (s) from `x` on in which its rates foresee everything. It is the least time in which an
    /// open contact closes at the speeds of now; infinite where none does. Steps of controlled error end there, since
    /// an error cannot tell of what no stage has met.
    fn horizon(&mut self, _x: &[S]) -> f64 {
        f64::INFINITY
    }

    /// Writes a natural size of every state of an ODE, in its unit: a change of the state is small beside it. Step
    /// control takes it for absolute tolerances.
    fn scales(&self, scales: &mut [f64]) {
        scales.fill(1.0);
    }
}
