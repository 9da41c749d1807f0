//! A machine for the integrators: its rates, and the matrices that implicit steps ask for.

use super::additive::{Split, Stage};
use super::tangent::Tangent;
use super::{Build, Dynamics, Fast, Kind, stiff};
use crate::contact::ContactFriction;
use crate::effect::JointEffect;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// The machine as an [`Ode`]: the right-hand side in `S`, and a copy of it in dual numbers over `S` for the exact state Jacobian.
#[derive(Clone, Debug)]
pub struct System<S> {
    dynamics: Dynamics<S>,
    tangent: Tangent<S>,
    split: Split<S>,
    resistances: Vec<S>,
    seals: Vec<Option<S>>,
    fadings: Vec<Option<S>>,
    /// A column of an iteration matrix on its way.
    column: Vec<S>,
    /// Rates at a state whose matrix is asked for alone.
    rates: Vec<S>,
    /// Whether these are the rates where the next step begins.
    ready: bool,
    /// Machine code of its functions, of plain numbers where it pays.
    fast: Option<Fast>,
}

impl<S: Scalar> System<S> {
    /// From the same machine in several number types; `build` makes it from numbers.
    pub fn new<E>(theta: &[S], build: impl Build<Error = E>) -> Result<Self, E> {
        let dynamics = build.dynamics(theta)?;
        let tangent = Tangent::new(theta, build, &dynamics)?;
        let resistances = vec![S::zero(); dynamics.joints()];
        let column = vec![S::zero(); dynamics.coordinates()];
        let seals = vec![None; dynamics.actuators.len()];
        let rates = vec![S::zero(); dynamics.dim()];
        let fadings = vec![None; dynamics.memories.len()];
        let split = Split::new(&dynamics);
        let (ready, fast) = (false, None);
        Ok(Self { dynamics, tangent, split, resistances, seals, fadings, column, rates, ready, fast })
    }

    /// Runs its functions as machine code from now on. Inputs have to be held anew.
    pub(crate) fn run_by(&mut self, fast: Fast) {
        (self.fast, self.ready) = (Some(fast), false);
    }

    /// Whether its functions run as machine code.
    pub(crate) fn has_code(&self) -> bool {
        self.fast.is_some()
    }

    /// Whether all frames, lines and the mass matrix are those of the state of the last [`Ode::rhs`].
    pub(crate) fn stands(&self) -> bool {
        self.fast.is_none() && self.dynamics.stands()
    }

    /// dx/dt and all true outputs at `x` by machine code; false if there is none.
    pub(crate) fn sample(&mut self, x: &[S], dxdt: &mut [S], outputs: &mut [S]) -> bool {
        self.ready = false;
        let plain = (S::plain(x), S::plain_mut(dxdt), S::plain_mut(outputs));
        let (Some(fast), (Some(x), Some(dxdt), Some(outputs))) = (&mut self.fast, plain) else { return false };
        fast.sample(x, dxdt, outputs);
        true
    }

    /// The rates and a matrix at `x` by machine code; false if there is none.
    fn by_code(&mut self, kind: Kind, x: &[S], matrix: &mut [S], dxdt: &mut [S]) -> bool {
        let plain = (S::plain(x), S::plain_mut(matrix), S::plain_mut(dxdt));
        let (Some(fast), (Some(x), Some(matrix), Some(dxdt))) = (&mut self.fast, plain) else { return false };
        fast.matrix(kind, x, matrix, dxdt)
    }

    /// The right-hand side.
    #[inline]
    pub fn dynamics(&mut self) -> &mut Dynamics<S> {
        self.ready = false;
        &mut self.dynamics
    }

    /// Holds what input `number` amounts to, see [`Dynamics::input`], from now on: one for each actuator, then the pressures of logged
    /// supplies.
    #[inline]
    pub fn hold(&mut self, number: usize, input: S) {
        self.ready = false;
        self.dynamics.hold(number, input);
        self.tangent.hold(number, input);
        if let (Some(fast), Some([input])) = (&mut self.fast, S::plain(&[input])) {
            fast.hold(number, *input);
        }
    }
}

impl<S: Scalar> System<S> {
    /// Takes note that the machine, last evaluated with these `rates`, makes its next step from that very state. What is asked of the
    /// system before makes it forget.
    pub(crate) fn depart(&mut self, rates: &[S]) {
        self.rates.copy_from_slice(rates);
        self.ready = true;
    }

    /// Whether the rates where the next step begins are at hand.
    pub(crate) fn is_ready(&self) -> bool {
        self.ready
    }

    /// Rates at `x`: those at hand if a step begins there.
    fn begin(&mut self, x: &[S], rates: &mut [S]) {
        if std::mem::take(&mut self.ready) {
            rates.copy_from_slice(&self.rates);
        } else {
            self.rhs(x, rates);
        }
    }

    /// Rates at `x`, with the direct evaluation left there, on which matrices lean.
    fn begin_directly(&mut self, x: &[S], rates: &mut [S]) {
        if self.fast.is_some() {
            self.ready = false;
            self.dynamics.rhs(x, rates);
        } else {
            self.begin(x, rates);
        }
    }

    /// As df/dx, without the friction of joints and seals, row by row.
    pub(crate) fn without_friction(&mut self, x: &[S], matrix: &mut [S]) {
        self.with_resistance(|_| S::zero(), x, matrix);
    }

    /// As df/dx, without friction of joints and seals that is not linear.
    pub(crate) fn without_dry_friction(&mut self, x: &[S], matrix: &mut [S]) {
        self.with_resistance(JointEffect::damping, x, matrix);
    }

    /// As df/dx, with this resistance of each effect in the place of friction.
    fn with_resistance(&mut self, resistance: impl Fn(&JointEffect<S>) -> S, x: &[S], matrix: &mut [S]) {
        self.ready = false;
        self.resistances.fill(S::zero());
        for (joint, effect) in &self.dynamics.effects {
            self.resistances[*joint] += resistance(effect);
        }
        self.seals.fill(Some(S::zero()));
        if self.tangent.leans() {
            self.dynamics.seals.copy_from_slice(&self.seals);
            let linear = |effects: &[(usize, JointEffect<S>)], [q, v, _]: [&[S]; 3], total: &mut [S]| {
                effects.iter().for_each(|(joint, effect)| {
                    total[*joint] += effect.effort_at_rest(q[*joint]) - resistance(effect) * v[*joint];
                });
            };
            let chord = |law: &ContactFriction<S>, square, normal| law.chord(square) * normal;
            self.dynamics.rhs_with(x, &mut self.rates, (linear, chord));
            self.dynamics.seals.fill(None);
        }
        self.fadings.fill(Some(S::zero()));
        self.tangent.chords(&mut self.dynamics, x, matrix, (&self.resistances, &self.seals, &self.fadings));
        self.seals.fill(None);
    }

    /// Writes [`Ode::iteration_matrix`], after the rates at `x` if the tangent leans on them.
    fn matrix(&mut self, x: &[S], matrix: &mut [S]) {
        let n = self.coordinates();
        let (q, v) = x[..2 * n].split_at(n);
        self.dynamics.write_resistances(q, v, &mut self.resistances);
        let first = self.dynamics.first_memory();
        self.dynamics.memories.fadings(&x[first..], v, &mut self.fadings);
        if self.dynamics.is_stiff_by_beams_alone() {
            let laws = (&*self.resistances, &*self.fadings);
            stiff::iteration_matrix(&mut self.dynamics, x, matrix, laws, &mut self.column);
            return;
        }
        self.dynamics.seal_chords(q, v, &mut self.seals);
        self.tangent.chords(&mut self.dynamics, x, matrix, (&self.resistances, &self.seals, &self.fadings));
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
        self.ready = false;
        match (&mut self.fast, S::plain(x), S::plain_mut(dxdt)) {
            (Some(fast), Some(x), Some(dxdt)) => fast.rates(x, dxdt),
            _ => self.dynamics.rhs(x, dxdt),
        }
    }

    /// Columns by forward accumulation; exact also where S itself carries derivatives.
    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        self.ready = false;
        if self.tangent.leans() {
            self.dynamics.rhs(x, &mut self.rates);
        }
        self.tangent.jacobian(&mut self.dynamics, x, jacobian);
    }

    fn linearise(&mut self, x: &[S], jacobian: &mut [S], rates: &mut [S]) {
        if self.by_code(Kind::Linearised, x, jacobian, rates) {
            return;
        }
        self.begin_directly(x, rates);
        self.tangent.jacobian(&mut self.dynamics, x, jacobian);
    }

    fn prepare(&mut self, x: &[S], matrix: &mut [S], rates: &mut [S]) {
        if self.by_code(Kind::Prepared, x, matrix, rates) {
            return;
        }
        self.begin_directly(x, rates);
        self.matrix(x, matrix);
    }

    /// As df/dx, but with chords from rest in the place of the tangents of friction laws; of a machine with elastic beams and ideal drives,
    /// all that is stiff in it, for the price of one mass matrix.
    ///
    /// The tangent of dry friction is flat beyond the transition velocity, so that a step which crosses it would not see the friction
    /// turn around, and could keep a joint creeping for ever; the chord sees it. At rest, and for viscous friction, they are the same.
    fn iteration_matrix(&mut self, x: &[S], matrix: &mut [S]) {
        self.ready = false;
        if self.tangent.leans() {
            self.dynamics.rhs(x, &mut self.rates);
        }
        self.matrix(x, matrix);
    }

    /// Beams, springs and linear damping of joints, friction of joints, memories and lags of ideal drives are taken implicitly; springs that
    /// are not linear by their slope where the stage has come to.
    fn additive_rates(&mut self, explicit: &[S], implicit: &[S], reach: f64, rates: &mut [S]) -> bool {
        if reach == 0.0 {
            let n = self.coordinates();
            let v = &explicit[n..2 * n];
            self.split.depart(v);
            if let (Some(fast), Some(v)) = (&mut self.fast, S::plain(v)) {
                fast.depart(v);
            }
            self.begin(explicit, rates);
            return true;
        }
        self.ready = false;
        let plain = (S::plain(explicit), S::plain(implicit), S::plain_mut(rates));
        if let (Some(fast), (Some(explicit), Some(implicit), Some(rates))) = (&mut self.fast, plain)
            && fast.additive([explicit, implicit], reach, rates)
        {
            return true;
        }
        let stage = Stage { explicit, implicit, reach: S::from_f64(reach) };
        self.dynamics.additive_rates(stage, rates, &mut self.split);
        true
    }

    /// A hundredth for coordinates, 1 for rates, of the drives what is natural for each.
    fn scales(&self, scales: &mut [f64]) {
        let n = self.coordinates();
        let (motion, internal) = scales.split_at_mut(2 * n);
        motion[..n].fill(1e-2);
        motion[n..].fill(1.0);
        self.dynamics.drive_scales(internal);
    }

    /// Memories move on exactly along the way of their joints.
    fn along_path(&mut self, x: &[S], step: f64, rates: &mut [S]) {
        let (n, first) = (self.coordinates(), self.dynamics.first_memory());
        self.dynamics.memories.mean_rates(&x[first..], &x[n..2 * n], step, &mut rates[first..]);
    }

    /// Stiffness and damping of the beams.
    fn elasticity(&mut self, x: &[S], block: &mut [S]) -> bool {
        self.ready = false;
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
