//! A machine for the integrators: its rates, and the matrices that implicit steps ask for.

use super::additive::{Split, Stage};
use super::memory::Memories;
use super::recorded::Kind;
use super::routine::{Routines, kind_of};
use super::turning::{Trouble, Turning};
use super::{Dynamics, Machine, Matrix, drives, stiff};
use crate::actuator::Actuator;
use crate::ball::Ball;
use crate::effect::MemoryChords;
use crate::error::Result;
use crate::integrator::Method;
use crate::ode::Ode;
use crate::scalar::Scalar;

/// The largest code of a whole step, in operations, and of one with approximate derivatives. Each takes some 3 us to compile; larger steps
/// gain little beside their functions one by one. Of derivatives that is more, and fits run them often.
const MOST_OF_STEP: [usize; 2] = [3_000, 12_000];
/// A gap (m, or the cosine of an angle that has to be a right one) at which a loop counts as torn.
const OPEN: f64 = 1e-9;
/// How often loops are closed again after a correction, which may lead farther away than steps do, to where their ways bend.
const RETURNS: usize = 8;
/// By how much a whole step is larger than the matrix that it asks for, at least: in plain numbers, and with derivatives.
const LARGER: [usize; 2] = [2, 6];

/// The machine as an [`Ode`] in numbers `S`.
///
/// Plain numbers go through the laws themselves, or through machine code where it pays. Numbers with derivatives, and exact derivatives of
/// the rates, go through the recorded functions.
#[derive(Clone, Debug)]
pub struct System<S> {
    /// The machine in plain numbers.
    dynamics: Dynamics<f64>,
    routines: Routines<S>,
    actuators: Vec<Actuator<S>>,
    memories: Memories<S>,
    split: Split<f64>,
    resistances: Vec<f64>,
    chords: Vec<Option<MemoryChords<f64>>>,
    /// A column of an iteration matrix on its way.
    column: Vec<f64>,
    /// Rates at a state whose matrix is asked for alone.
    rates: Vec<S>,
    /// Whether these are the rates where the next step begins.
    ready: bool,
    /// Whether linearly implicit steps run as a whole.
    whole: bool,
    /// Whether derivatives of the matrices of such steps may be left out.
    approximate: bool,
    /// What samples ask for: all outputs with the rates, or those outputs that the state alone decides.
    seen: Kind,
    /// Ball joints.
    turning: Turning<S>,
    /// Coordinates and rates with closed loops, the gap that is left, and how many equations count.
    closed: Vec<S>,
    /// What closes them after steps, and after an observer has drawn some coordinates, which are held.
    closings: [Kind; 2],
    /// How many equations counted at first.
    independent: usize,
    /// What became of the loops.
    torn: Option<Trouble>,
}

impl<S: Scalar> System<S> {
    /// Ordinary differential equation (ODE) of a `machine` for the integrators.
    ///
    /// # Errors
    /// [`crate::error::Error::Unrecorded`] where a law decides by the value of a state, in numbers with derivatives.
    pub(crate) fn new(machine: Machine<'_, S>) -> Result<Self> {
        let Machine { dynamics, functions, theta, inputs, actuators, memories } = machine;
        let mut system = Self {
            routines: Routines::new(functions, theta, inputs),
            actuators,
            memories,
            split: Split::new(&dynamics),
            resistances: vec![0.0; dynamics.effects.len()],
            chords: vec![None; dynamics.memories.len()],
            column: vec![0.0; dynamics.coordinates()],
            rates: vec![S::zero(); dynamics.dim()],
            ready: false,
            whole: false,
            approximate: false,
            seen: Kind::Sample,
            turning: Turning::new(std::iter::empty()),
            closed: vec![S::zero(); if dynamics.loops.is_some() { 2 * dynamics.coordinates() + 2 } else { 0 }],
            closings: [Kind::Closed(Vec::new()), Kind::Closed(Vec::new())],
            independent: 0,
            torn: None,
            dynamics,
        };
        if !Self::is_plain() {
            system.routines.make(&Kind::Rates)?;
        }
        Ok(system)
    }

    /// ODE of a machine with ball joints, each with whether it turns freely.
    #[must_use]
    pub(crate) fn with_balls<'a>(self, balls: impl Iterator<Item = (&'a Ball, bool)>) -> Self {
        Self { turning: Turning::new(balls), ..self }
    }

    /// ODE of a machine whose samples give only the outputs that the state alone decides.
    #[must_use]
    pub(crate) fn seen_in_motion(self) -> Self {
        Self { seen: Kind::Motion, ..self }
    }

    /// ODE of a machine with derivatives of the order of its steps, where that takes less time. Memories of friction come
    /// to rest within a step, so that no order tells what is left out of their matrices.
    #[must_use]
    pub(crate) fn with_approximate_derivatives(self) -> Self {
        Self { approximate: S::has_derivatives() && self.memories.len() == 0, ..self }
    }

    /// Enters a user's state: brings it into the coordinates of the ODE.
    pub(crate) fn enter(&mut self, x: &mut [S]) {
        self.turn(|turning, n, hold| turning.enter(x, n, hold));
        if self.dynamics.loops.is_some() {
            self.torn = None;
            let found = self.close(x, 0, S::from_f64(f64::INFINITY));
            self.independent = (0..S::LANES).map(|lane| equations(found[1], lane)).max().unwrap_or(0);
            self.watch(found);
        }
    }

    /// ODE of a machine with coordinates that an observer draws; closing loops leaves them.
    #[must_use]
    pub(crate) fn drawn_at(mut self, coordinates: Vec<u32>) -> Self {
        self.closings[1] = Kind::Closed(coordinates);
        self
    }

    /// Enters a state that an observer corrected: loops are closed again, drawn coordinates stay.
    pub(crate) fn corrected(&mut self, x: &mut [S]) {
        self.ready = false;
        if self.dynamics.loops.is_some() && self.closings[0] != self.closings[1] {
            let mut found = self.close(x, 1, S::from_f64(f64::INFINITY));
            for _ in 0..RETURNS {
                if found[0].is_within(OPEN) {
                    break;
                }
                found = self.close(x, 1, found[0]);
            }
            self.watch(found);
        }
    }

    /// Closes all loops of the ODE's state by the way of that number, in lanes where they are `open`. Returns what is
    /// left, and how many of their equations count.
    fn close(&mut self, x: &mut [S], way: usize, open: S) -> [S; 2] {
        self.ready = false;
        let moving = self.closed.len() - 2;
        let Self { closings, closed, routines, dynamics, .. } = self;
        let kind = &closings[way];
        if let Some(routine) = routines.get(kind) {
            closed.copy_from_slice(routine.at(x));
        } else if let (Kind::Closed(held), Some(x), Some(closed)) = (kind, S::plain(x), S::plain_mut(closed)) {
            closed[..moving].copy_from_slice(&x[..moving]);
            let found = dynamics.close(closed, held);
            closed[moving..].copy_from_slice(&found);
        } else {
            routines.copy(kind, x, &[], closed);
        }
        let most = S::from_f64(OPEN);
        x.iter_mut().zip(&closed[..moving]).for_each(|(own, &closed)| *own = most.select_less(open, closed, *own));
        [most.select_less(open, closed[moving], open), closed[moving + 1]]
    }

    /// Notes the gap that closing loops left in the ODE's state, and the counted equations.
    fn watch(&mut self, [gap, count]: [S; 2]) {
        for lane in 0..S::LANES {
            let (gap, count) = (gap.lane(lane), equations(count, lane));
            if count < self.independent {
                self.torn.get_or_insert(Trouble::Dependent(self.independent, count));
            } else if gap > OPEN {
                self.torn.get_or_insert(Trouble::Open(gap));
            }
        }
    }

    /// Shows the ODE's state `x` in the coordinates of users.
    pub(crate) fn show(&self, x: &[S], shown: &mut [S]) {
        shown.copy_from_slice(x);
        self.turning.show(x, self.dynamics.coordinates(), shown);
    }

    /// Rests: the ODE keeps its coordinates, however far steps lead.
    pub(crate) fn rest(&mut self) {
        self.turning.rest();
    }

    /// Trouble with the coordinates of a ball joint since the last [`System::enter`], if any.
    #[inline]
    pub(crate) fn trouble(&self) -> Option<Trouble> {
        self.torn.or(self.turning.trouble())
    }

    /// Turns ball joints of the ODE's state, which may hold other orientations after it.
    fn turn(&mut self, work: impl FnOnce(&mut Turning<S>, usize, &mut dyn FnMut(usize, S))) {
        if self.turning.is_empty() {
            return;
        }
        let (n, Self { turning, dynamics, routines, ready, .. }) = (self.dynamics.coordinates(), self);
        *ready = false;
        let first = dynamics.n_inputs();
        work(turning, n, &mut |place, number: S| {
            dynamics.hold(first + place, number.re());
            routines.hold(first + place, number);
        });
    }

    /// Whether the ODE runs in plain numbers.
    fn is_plain() -> bool {
        S::plain(&[]).is_some()
    }

    /// Makes all functions that samples and steps of the ODE by `method` need.
    ///
    /// # Errors
    /// [`crate::error::Error::Unrecorded`] where a law decides by the value of a state.
    pub fn make_for(&mut self, method: Method) -> Result<()> {
        let kinds = [Some(self.seen.clone()), kind_of(method)].into_iter().flatten().chain(self.closing());
        for kind in kinds.filter(|kind| !self.is_direct(kind)).collect::<Vec<_>>() {
            self.routines.make(&kind)?;
        }
        Ok(())
    }

    /// Functions that close loops at the end of the ODE's steps and corrections.
    fn closing(&self) -> Vec<Kind> {
        let [plain, drawn] = &self.closings;
        let own = self.dynamics.loops.iter().map(|_| plain);
        own.clone().chain(own.filter(|_| plain != drawn).map(|_| drawn)).cloned().collect()
    }

    /// Whether a function of the ODE is evaluated by the laws themselves.
    fn is_direct(&self, kind: &Kind) -> bool {
        Self::is_plain()
            && match kind {
                Kind::Linearised | Kind::Frictionless | Kind::LinearFriction => false,
                Kind::Prepared => self.dynamics.is_stiff_by_beams_alone(),
                _ => true,
            }
    }

    /// Compiles the ODE's samples and steps by `method` to machine code, or says why not.
    pub fn compile(&mut self, method: Method) -> std::result::Result<(), String> {
        self.ready = false;
        if S::has_derivatives() {
            let constant = self.approximate
                && method == Method::LinearlyImplicit
                && self.routines.compile(&Kind::Rates).is_ok()
                && self.routines.leave_matrices_constant().is_ok();
            // What has no code goes on operation by operation.
            let kinds = [Some(Kind::Rates), Some(self.seen.clone()), kind_of(method)].into_iter().flatten();
            let kinds = kinds.chain(self.closing()).filter(|kind| !constant || *kind != Kind::Prepared);
            return kinds.map(|kind| self.routines.compile(&kind)).fold(Ok(()), std::result::Result::and);
        }
        // An additive step begins with the rates of the sample before it, if that has any.
        let begun = method.is_additive() && self.seen == Kind::Sample && Self::is_plain();
        let rates = Some(Kind::Rates).filter(|_| !begun);
        let needed: Vec<Kind> = rates.into_iter().chain([self.seen.clone()]).chain(self.closing()).collect();
        self.routines.compile_all(&needed)?;
        let Some(kind) = kind_of(method).filter(|kind| *kind != Kind::Elasticity || !Self::is_plain()) else {
            return Ok(());
        };
        let made = self.routines.compile(&kind);
        if !Self::is_plain() {
            return made;
        }
        // A matrix alone that has no code is worked out as before.
        if made.is_err() && self.is_direct(&kind) {
            self.routines.forget(&kind);
        }
        Ok(())
    }

    /// Compiles whole steps of the ODE with constant inputs to machine code, where that pays.
    pub(crate) fn compile_steps(&mut self, method: Method) -> std::result::Result<(), String> {
        if method == Method::LinearlyImplicit && self.dynamics.is_well_scaled() && self.has_small_steps() {
            let kind = self.step_kind();
            let made = self.routines.compile_within(&kind, self.most_of_step());
            let mut needed = [self.seen.clone()].into_iter().chain(self.closing());
            if made.and_then(|()| needed.try_for_each(|kind| self.routines.compile(&kind))).is_ok() {
                (self.ready, self.whole) = (false, true);
                return Ok(());
            }
            self.routines.forget(&kind);
        }
        self.compile(method)
    }

    /// Kind of a whole linearly implicit step of the ODE.
    fn step_kind(&self) -> Kind {
        if self.approximate { Kind::StepOfConstantMatrix } else { Kind::Step }
    }

    /// Largest code of a whole step of the ODE, in operations.
    fn most_of_step(&self) -> usize {
        MOST_OF_STEP[usize::from(self.approximate)]
    }

    /// Compiles answers of the ODE to machine code, where they have some. The others are worked out as before.
    pub(crate) fn compile_answers(&mut self, kinds: impl Iterator<Item = Kind>) {
        for kind in kinds.filter(|_| Self::is_plain()) {
            if self.routines.compile(&kind).is_err() {
                self.routines.forget(&kind);
            }
        }
    }

    /// Whether the ODE is small enough to record a whole step. The matrix, which is at hand, shows about how large it
    /// is.
    fn has_small_steps(&mut self) -> bool {
        let larger = LARGER[usize::from(S::has_derivatives())];
        let most = self.most_of_step();
        self.routines.get(&Kind::Prepared).is_some_and(|routine| larger * routine.size() <= most)
    }

    /// Whether the ODE's functions run as machine code.
    pub fn has_code(&mut self) -> bool {
        Self::is_plain() && self.routines.get(&Kind::Sample).is_some()
    }

    /// Dynamics of the ODE in plain numbers.
    #[inline]
    pub fn dynamics(&mut self) -> &mut Dynamics<f64> {
        self.ready = false;
        &mut self.dynamics
    }

    /// Actuators of the ODE's machine.
    pub(crate) fn actuators(&self) -> &[Actuator<S>] {
        &self.actuators
    }

    /// Input `number` of the ODE over the interval from sample `k`: after delay, dead zone and saturation. That of a
    /// supply is as it is.
    #[inline]
    pub fn input(&self, number: usize, k: usize, time_step: f64, command: impl Fn(usize) -> S) -> S {
        drives::input(&self.actuators, number, (k, time_step), command)
    }

    /// Holds input `number` of the ODE, see [`System::input`], from now on. There is one for each actuator, then the
    /// pressures of logged supplies.
    #[inline]
    pub fn hold(&mut self, number: usize, input: S) {
        self.ready = false;
        self.dynamics.hold(number, input.re());
        self.routines.hold(number, input);
    }

    /// Sample of the ODE: dx/dt and all true outputs at `x`, or those that were asked for.
    pub fn sample(&mut self, x: &[S], dxdt: &mut [S], outputs: &mut [S]) {
        if self.seen == Kind::Motion {
            return self.observe_motion(x, outputs);
        }
        self.ready = false;
        let plain = (S::plain(x), S::plain_mut(dxdt), S::plain_mut(outputs));
        if let Some(routine) = self.routines.get(&Kind::Sample) {
            let (rates, seen) = routine.at(x).split_at(x.len());
            dxdt.copy_from_slice(rates);
            outputs.copy_from_slice(seen);
        } else if let (Some(x), Some(dxdt), Some(outputs)) = plain {
            self.dynamics.rhs(x, dxdt);
            self.dynamics.observe(x, dxdt, outputs);
        } else {
            debug_assert!(false, "samples are asked for before they are made");
            outputs.fill(S::from_f64(f64::NAN));
        }
        self.turning.show_outputs(x, self.dynamics.coordinates(), Some(dxdt), outputs);
    }

    /// Sample of the ODE's outputs that the state alone decides; others stay or become zero.
    pub(crate) fn observe_motion(&mut self, x: &[S], outputs: &mut [S]) {
        if let Some(routine) = self.routines.get(&Kind::Motion) {
            outputs.copy_from_slice(routine.at(x));
        } else if let (Some(x), Some(outputs)) = (S::plain(x), S::plain_mut(outputs)) {
            self.ready = false;
            self.dynamics.observe_motion(x, outputs);
        } else {
            self.routines.copy(&Kind::Motion, x, &[], outputs);
        }
        self.turning.show_outputs(x, self.dynamics.coordinates(), None, outputs);
    }

    /// Sample of the ODE's outputs that controllers read, by machine code; tells whether there is some. Others stay or
    /// become zero.
    pub(crate) fn observe_feedback(&mut self, x: &[S], outputs: &mut [S]) -> bool {
        let Some(routine) = self.routines.get(&Kind::Feedback) else { return false };
        outputs.copy_from_slice(routine.at(x));
        self.turning.show_outputs(x, self.dynamics.coordinates(), None, outputs);
        true
    }

    /// Lever arms of the ODE's lines: length per unit of each coordinate at `q`, lines x n.
    pub(crate) fn levers(&mut self, q: &[S], levers: &mut [S]) {
        match (S::plain(q), S::plain_mut(levers)) {
            (Some(q), Some(levers)) if self.by_laws(&Kind::Levers) => self.dynamics().levers(q, levers),
            _ => self.routines.copy(&Kind::Levers, q, &[], levers),
        }
    }

    /// Efforts that accelerations `a` need at the ODE's `state`, without contacts and bushings.
    pub(crate) fn required_of_tree(&mut self, state: &[S], a: &[S], efforts: &mut [S]) {
        match (S::plain(state), S::plain(a), S::plain_mut(efforts)) {
            (Some(state), Some(a), Some(efforts)) if self.by_laws(&Kind::RequiredOfTree) => {
                let (q, v) = state.split_at(a.len());
                self.dynamics().inverse_dynamics_of_tree(q, v, a, efforts);
            }
            _ => self.routines.copy(&Kind::RequiredOfTree, state, a, efforts),
        }
    }

    /// Departs: the ODE's next step begins at the state last evaluated with these `rates`. What is asked of the system
    /// before makes it forget.
    pub(crate) fn depart(&mut self, rates: &[S]) {
        self.rates.copy_from_slice(rates);
        self.ready = self.seen == Kind::Sample;
    }

    /// Forgets the last evaluation: the ODE's next step begins elsewhere.
    pub(crate) fn forget(&mut self) {
        self.ready = false;
    }

    /// Whether the ODE has the rates where its next step begins.
    pub(crate) fn is_ready(&self) -> bool {
        self.ready
    }

    /// Begins a step of the ODE: rates at `x`, known ones if there are any.
    fn begin(&mut self, x: &[S], rates: &mut [S]) {
        if std::mem::take(&mut self.ready) {
            rates.copy_from_slice(&self.rates);
        } else {
            self.rhs(x, rates);
        }
    }

    /// Begins a step of the ODE with the drives' efforts evaluated by the laws, for friction.
    fn begin_by_laws(&mut self, x: &[S], rates: &mut [S]) {
        if self.routines.get(&Kind::Rates).is_none() {
            return self.begin(x, rates);
        }
        self.ready = false;
        if let (Some(x), Some(rates)) = (S::plain(x), S::plain_mut(rates)) {
            self.dynamics.rhs(x, rates);
        }
    }

    /// Matrix df/dx of the ODE without friction of joints and seals, row by row.
    pub(crate) fn without_friction(&mut self, x: &[S], matrix: &mut [S]) {
        self.matrix_alone(&Kind::Frictionless, x, matrix);
    }

    /// Matrix df/dx of the ODE with linear damping in the place of all friction, row by row.
    pub(crate) fn without_dry_friction(&mut self, x: &[S], matrix: &mut [S]) {
        self.matrix_alone(&Kind::LinearFriction, x, matrix);
    }

    fn matrix_alone(&mut self, kind: &Kind, x: &[S], matrix: &mut [S]) {
        self.ready = false;
        let mut values = std::mem::take(&mut self.rates);
        self.routines.matrix(kind, x, matrix, x.len(), &mut values);
        self.rates = values;
    }

    /// Iteration matrix of an ODE whose beams are all that is stiff, by its laws.
    fn prepare_directly(&mut self, x: &[f64], matrix: &mut [f64]) {
        let n = self.dynamics.coordinates();
        let (q, v) = x[..2 * n].split_at(n);
        self.dynamics.write_resistances(q, v, &mut self.resistances);
        let first = self.dynamics.first_memory();
        self.dynamics.memories.write_chords(&x[first..], v, &mut self.chords);
        let laws = (&*self.resistances, &*self.chords);
        stiff::iteration_matrix(&mut self.dynamics, x, matrix, laws, &mut self.column);
    }

    /// Whether a matrix of the ODE belongs to a recorded function with the rates.
    pub(crate) fn has_rates_in(&mut self, matrix: Matrix) -> bool {
        match matrix {
            Matrix::Jacobian => true,
            Matrix::Iteration => !self.by_laws(&Kind::Prepared),
            Matrix::Elasticity => false,
        }
    }

    /// Whether a function of the ODE is evaluated by the laws now.
    fn by_laws(&mut self, kind: &Kind) -> bool {
        self.is_direct(kind) && self.routines.get(kind).is_none()
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
        if let Some(routine) = self.routines.get(&Kind::Rates) {
            dxdt.copy_from_slice(routine.at(x));
        } else if let (Some(x), Some(dxdt)) = (S::plain(x), S::plain_mut(dxdt)) {
            self.dynamics.rhs(x, dxdt);
        }
    }

    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        self.matrix_alone(&Kind::Linearised, x, jacobian);
    }

    fn linearise(&mut self, x: &[S], jacobian: &mut [S], rates: &mut [S]) {
        self.ready = false;
        self.routines.matrix(&Kind::Linearised, x, jacobian, x.len(), rates);
    }

    fn prepare(&mut self, x: &[S], matrix: &mut [S], rates: &mut [S]) {
        if self.by_laws(&Kind::Prepared) {
            self.begin_by_laws(x, rates);
            if let (Some(x), Some(matrix)) = (S::plain(x), S::plain_mut(matrix)) {
                self.prepare_directly(x, matrix);
            }
            return;
        }
        self.ready = false;
        self.routines.matrix(&Kind::Prepared, x, matrix, x.len(), rates);
    }

    fn horizon(&mut self, x: &[S]) -> f64 {
        if self.dynamics.connections.contacts.is_empty() {
            return f64::INFINITY;
        }
        match S::plain(x) {
            Some(plain) => self.dynamics.time_to_contact(plain),
            None => self.dynamics.time_to_contact(&x.iter().map(Scalar::re).collect::<Vec<_>>()),
        }
    }

    fn arrive(&mut self, x: &mut [S], step: Option<f64>) {
        if self.dynamics.loops.is_some() && !self.turning.is_resting() {
            let found = self.close(x, 0, S::from_f64(f64::INFINITY));
            self.watch(found);
        }
        self.turn(|turning, n, hold| turning.arrive(x, n, step, hold));
    }

    fn turns(&self) -> bool {
        self.routines.turns()
    }

    fn turned(&mut self, k: &[S], product: &mut [S]) {
        self.routines.turned(k, product);
    }

    /// Iteration matrix of the ODE: as df/dx, with chords from rest in the place of friction tangents. Of a machine
    /// with elastic beams and ideal drives it is all that is stiff, for the price of one mass matrix.
    ///
    /// The tangent of dry friction is flat beyond the transition velocity, so that a step which crosses it would not see the friction
    /// turn around, and could keep a joint creeping for ever; the chord sees it. At rest, and for viscous friction, they are the same.
    fn iteration_matrix(&mut self, x: &[S], matrix: &mut [S]) {
        self.ready = false;
        let mut rates = std::mem::take(&mut self.rates);
        self.prepare(x, matrix, &mut rates);
        self.rates = rates;
    }

    /// Additive rates of the ODE: beams, springs, damping, friction, memories and lags are implicit. Springs, damping
    /// and friction are those of joints, lags those of ideal drives. Springs that are not linear count by their slope
    /// where the stage has come to.
    fn additive_rates(&mut self, explicit: &[S], implicit: &[S], reach: f64, rates: &mut [S]) -> bool {
        let n = self.coordinates();
        if reach == 0.0 {
            let v = &explicit[n..2 * n];
            if let Some(v) = S::plain(v) {
                self.split.depart(v);
            }
            if let Some(routine) = self.routines.get(&Kind::Additive) {
                routine.depart(v);
            }
            self.begin(explicit, rates);
            return true;
        }
        self.ready = false;
        if let Some(routine) = self.routines.get(&Kind::Additive) {
            routine.additive([explicit, implicit], S::from_f64(reach), rates);
            return true;
        }
        let plain = (S::plain(explicit), S::plain(implicit), S::plain_mut(rates));
        if let (Some(explicit), Some(implicit), Some(rates)) = plain {
            let stage = Stage { explicit, implicit, reach };
            self.dynamics.additive_rates(stage, rates, &mut self.split);
            return true;
        }
        match self.routines.make(&Kind::Additive) {
            Ok(()) => self.additive_rates(explicit, implicit, reach, rates),
            Err(_) => false,
        }
    }

    fn scales(&self, scales: &mut [f64]) {
        self.dynamics.scales(scales);
    }

    /// Linearly implicit step of the ODE by machine code of the whole step, if there is some.
    #[inline]
    fn linearly_implicit_step(&mut self, x: &mut [S], step: f64) -> bool {
        if !self.whole {
            return false;
        }
        let next = self.routines.get(&self.step_kind()).and_then(|routine| routine.step(x, step));
        next.map(|next| x.copy_from_slice(next)).is_some_and(|()| {
            self.ready = false;
            true
        })
    }

    /// Path step of the ODE: memories move exactly along the way of their joints.
    fn along_path(&mut self, x: &[S], step: f64, rates: &mut [S]) {
        let (n, first) = (self.coordinates(), self.dynamics.first_memory());
        self.memories.mean_rates(&x[first..], &x[n..2 * n], step, &mut rates[first..]);
    }

    /// Stiffness and damping of the ODE's beams.
    fn elasticity(&mut self, x: &[S], block: &mut [S]) -> bool {
        let n = self.coordinates();
        if self.dynamics.model.n_elastic() == 0 {
            return false;
        }
        self.ready = false;
        if let (Some(x), Some(block)) = (S::plain(x), S::plain_mut(block)) {
            let (q, v) = x[..2 * n].split_at(n);
            self.dynamics.terms(q, v);
            self.dynamics.data.factorise();
            block.fill(0.0);
            stiff::elasticity(&self.dynamics, block, 2 * n, &mut self.column);
            return true;
        }
        let mut values = std::mem::take(&mut self.rates);
        self.routines.matrix(&Kind::Elasticity, x, block, 2 * n, &mut values);
        self.rates = values;
        true
    }
}

/// How many equations of loops count in a lane.
fn equations<S: Scalar>(count: S, lane: usize) -> usize {
    count.lane(lane).round() as usize
}
