//! A machine for the integrators: its rates, and the matrices that implicit steps ask for.

use super::tangent::Tangent;
use super::{Build, Dynamics, stiff};
use crate::ode::Ode;
use crate::scalar::Scalar;

/// The machine as an [`Ode`]: the right-hand side in `S`, and a copy of it in dual numbers over `S` for the exact state Jacobian.
#[derive(Clone, Debug)]
pub struct System<S> {
    dynamics: Dynamics<S>,
    tangent: Tangent<S>,
    resistances: Vec<S>,
    seals: Vec<Option<S>>,
    /// A column of an iteration matrix on its way.
    column: Vec<S>,
}

impl<S: Scalar> System<S> {
    /// From the same machine in several number types; `build` makes it from numbers.
    pub fn new<E>(theta: &[S], build: impl Build<Error = E>) -> Result<Self, E> {
        let dynamics = build.dynamics(theta)?;
        let tangent = Tangent::new(theta, build, dynamics.dim())?;
        let resistances = vec![S::zero(); dynamics.joints()];
        let column = vec![S::zero(); dynamics.coordinates()];
        let seals = vec![None; dynamics.actuators.len()];
        Ok(Self { dynamics, tangent, resistances, seals, column })
    }

    /// The right-hand side.
    #[inline]
    pub fn dynamics(&mut self) -> &mut Dynamics<S> {
        &mut self.dynamics
    }

    /// Holds what input `number` amounts to, see [`Dynamics::input`], from now on: one for each actuator, then the pressures of logged
    /// supplies.
    #[inline]
    pub fn hold(&mut self, number: usize, input: S) {
        self.dynamics.inputs[number] = input;
        self.tangent.hold(number, input);
    }
}

impl<S: Scalar> System<S> {
    /// As df/dx, without the friction of joints and seals, row by row.
    pub(crate) fn without_friction(&mut self, x: &[S], matrix: &mut [S]) {
        self.resistances.fill(S::zero());
        self.seals.fill(Some(S::zero()));
        self.tangent.chords(x, matrix, &self.resistances, &self.seals);
        self.seals.fill(None);
    }
}

impl<S: Scalar> Ode<S> for System<S> {
    #[inline]
    fn dim(&self) -> usize {
        self.dynamics.dim()
    }

    #[inline]
    fn coordinates(&self) -> usize {
        self.dynamics.coordinates()
    }

    #[inline]
    fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        self.dynamics.rhs(x, dxdt);
    }

    /// Columns by forward accumulation; exact also where S itself carries derivatives.
    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        self.tangent.jacobian(x, jacobian);
    }

    /// As df/dx, but with chords from rest in the place of the tangents of friction laws; of a machine with elastic beams and ideal drives,
    /// all that is stiff in it, for the price of one mass matrix.
    ///
    /// The tangent of dry friction is flat beyond the transition velocity, so that a step which crosses it would not see the friction
    /// turn around, and could keep a joint creeping for ever; the chord sees it. At rest, and for viscous friction, they are the same.
    fn iteration_matrix(&mut self, x: &[S], matrix: &mut [S]) {
        let n = self.coordinates();
        self.resistances.fill(S::zero());
        for (joint, effect) in &self.dynamics.effects {
            self.resistances[*joint] += effect.resistance(x[n + joint]);
        }
        if self.dynamics.model.n_elastic() == 0 || !self.dynamics.ideal || !self.dynamics.connections.is_free() {
            let (q, v) = x[..2 * n].split_at(n);
            self.dynamics.seal_chords(q, v, &mut self.seals);
            self.tangent.chords(x, matrix, &self.resistances, &self.seals);
        } else {
            stiff::iteration_matrix(&mut self.dynamics, x, matrix, &self.resistances, &mut self.column);
        }
    }

    /// A hundredth for coordinates, 1 for rates, of the drives what is natural for each.
    fn scales(&self, scales: &mut [f64]) {
        let n = self.coordinates();
        let (motion, internal) = scales.split_at_mut(2 * n);
        motion[..n].fill(1e-2);
        motion[n..].fill(1.0);
        self.dynamics.drive_scales(internal);
    }

    /// Stiffness and damping of the beams.
    fn elasticity(&mut self, x: &[S], block: &mut [S]) -> bool {
        let n = self.coordinates();
        if self.dynamics.model.n_elastic() == 0 {
            return false;
        }
        let (q, v) = x[..2 * n].split_at(n);
        self.dynamics.terms(q, v);
        self.dynamics.data.factorise();
        block.fill(S::zero());
        stiff::elasticity(&self.dynamics, block, 2 * n, &mut self.column);
        true
    }
}
