//! A machine some of whose joints follow a motion, and what answers to it: other joints, beams, drives and supplies.

use super::Dynamics;
use super::quintic::{State, between};
use super::recorded::{Matrix, Places};
use crate::algebra::Cholesky;
use crate::dynamics::flexible;
use crate::graph::Recorded;
use crate::model::{Elastic, Strip};
use crate::scalar::Scalar;

/// Which part of a machine follows a motion, and which answers to it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Guidance {
    /// Joints that follow, ascending. The others and the elastic coordinates are free.
    pub joints: Vec<usize>,
    /// Gauges that hold their beams.
    pub gauges: Vec<usize>,
    /// Whether drives and supplies answer, to their inputs too; otherwise they do nothing.
    pub drives: bool,
    /// Number of effects that remember. Their memories always answer.
    pub memories: usize,
}

/// What a program of such a machine gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// Rates of the state.
    Rates,
    /// What is seen: the state of the whole machine, all its outputs, the efforts of the drives on the joints.
    Sample,
    /// Rates, then the entries of their derivatives by the state.
    Linearised,
    /// Rates, then the entries of all that is stiff, `[0, 1, 0; -M^-1 K, -M^-1 D, t]`.
    Prepared,
    /// What constant stiffness and damping of beams do, see [`crate::ode::Ode::elasticity`], after as many numbers as there are states.
    Elasticity,
}

impl Guidance {
    /// Number of values given to a guided machine beside its inputs: interval, joint motion and strain rates. These are
    /// the time between samples (s), then position, velocity and acceleration of each following joint at both samples.
    /// Of each gauge that holds there are the rate of strain (1/s) at both samples, and its gain (J s).
    pub(crate) fn given(&self) -> usize {
        self.first_gauge() + 3 * self.gauges.len()
    }

    /// Index of the first gauge among the values given to a guided machine.
    fn first_gauge(&self) -> usize {
        1 + 6 * self.joints.len()
    }

    /// Number of a guided machine's states beside its motion, of `all` that the whole machine has.
    fn internal(&self, all: usize) -> usize {
        if self.drives { all } else { self.memories }
    }

    /// Places of the inputs of a guided machine's programs. Free coordinates and their rates come first, then states of
    /// drives and memories, time since the sample before, inputs of the machine, given values and parameters.
    pub(super) fn places(&self, machine: Places) -> Places {
        let coordinates = machine.coordinates - self.joints.len();
        let internal = self.internal(machine.states - 2 * machine.coordinates);
        Places { coordinates, states: 2 * coordinates + internal + 1, inputs: machine.inputs + self.given(), ..machine }
    }
}

/// A gauge that holds its beam.
#[derive(Clone, Debug)]
struct Hold<S> {
    /// First coordinate of the beam.
    first: usize,
    /// Strain per unit of each of its coordinates.
    row: Vec<f64>,
    /// Rate of strain at the sample before and after (1/s), and gain (J s).
    strain: [S; 3],
}

/// The equations of what answers, with its buffers.
///
/// Law: `M_ff a_f = (effects - bias - K q - D v)_f - M_fj a_j` and `ds/dt = f(s, q, v, u)`, j the joints that follow, f the free coordinates
/// and s the states of drives, supplies and memories.
#[derive(Clone, Debug)]
pub(crate) struct Guided<S> {
    pub(super) dynamics: Dynamics<S>,
    guidance: Guidance,
    /// Passive joints, then elastic coordinates.
    pub(super) free: Vec<usize>,
    holds: Vec<Hold<S>>,
    /// Motion at the sample before and after of the joints that follow.
    ends: Vec<[State<S>; 2]>,
    /// Time between samples, s.
    interval: S,
    /// State of the whole machine, and its rate.
    x: Vec<S>,
    rate: Vec<S>,
    /// Rates of the state of what answers.
    pub(super) rates: Vec<S>,
    /// Efforts on all coordinates that the motion needs, without those for the free accelerations.
    load: Vec<S>,
    /// A load on the free coordinates on its way.
    column: Vec<S>,
    /// The block of the mass matrix of the free coordinates, and its factors.
    mass: Vec<S>,
    factors: Cholesky<S>,
}

impl<S: Scalar> Guided<S> {
    pub(super) fn new(dynamics: Dynamics<S>, guidance: &Guidance) -> Self {
        let (n, dim) = (dynamics.coordinates(), dynamics.dim());
        let free: Vec<usize> = (0..n).filter(|place| !guidance.joints.contains(place)).collect();
        let strips = guidance.gauges.iter().map(|&gauge| &dynamics.model.gauges()[gauge]);
        let hold = |strip: &Strip| Hold { first: strip.first, row: strip.row(), strain: [S::zero(); 3] };
        let (zeros, count) = (|count: usize| vec![S::zero(); count], free.len());
        let internal = guidance.internal(dim - 2 * n);
        Self {
            guidance: guidance.clone(),
            holds: strips.map(hold).collect(),
            ends: vec![[[S::zero(); 3]; 2]; guidance.joints.len()],
            interval: S::one(),
            x: zeros(dim),
            rate: zeros(dim),
            rates: zeros(2 * count + internal + 1),
            load: zeros(n),
            column: zeros(count),
            mass: zeros(count * count),
            factors: Cholesky::new(count),
            free,
            dynamics,
        }
    }

    /// Holds an input of a guided machine or, after these, a given value, see [`Guidance::given`].
    pub(super) fn hold(&mut self, number: usize, value: S) {
        let Some(place) = number.checked_sub(self.dynamics.inputs.len()) else {
            return self.dynamics.hold(number, value);
        };
        match (place.checked_sub(1), place.checked_sub(self.guidance.first_gauge())) {
            (_, Some(place)) => self.holds[place / 3].strain[place % 3] = value,
            (Some(place), _) => self.ends[place / 6][place / 3 % 2][place % 3] = value,
            _ => self.interval = value,
        }
    }

    /// Whether [`Guided::stiff`] suffices for an implicit step of a guided machine.
    pub(super) fn is_stiff_by_beams_alone(&self) -> bool {
        !self.guidance.drives && self.guidance.memories == 0 && self.dynamics.connections.is_free()
    }

    /// Evaluates the rates of a guided machine at `y`.
    pub(super) fn evaluate(&mut self, y: &[S]) {
        self.place(y);
        if !self.free.is_empty() {
            self.balance(y);
        }
        self.collect();
    }

    /// Samples a guided machine: the rates at `y`, then state, outputs and drive efforts in `seen`. State and outputs
    /// are those of the whole machine, efforts those on the joints. The outputs `effort` of the joints are what the
    /// motion needs; commands are left to the caller.
    pub(super) fn sample(&mut self, y: &[S], seen: &mut [S]) {
        self.place(y);
        self.balance(y);
        self.collect();
        let (n, joints) = (self.dynamics.coordinates(), self.dynamics.joints());
        self.require();
        let Self { dynamics, guidance, x, rate, load, .. } = self;
        seen.fill(S::zero());
        let (state, outputs) = seen.split_at_mut(x.len());
        let (outputs, applied) = outputs.split_at_mut(outputs.len() - joints);
        state.copy_from_slice(x);
        dynamics.observe_motion(x, outputs);
        if guidance.drives {
            dynamics.observe_efforts(x, rate, outputs);
            dynamics.add_drives(applied);
        } else {
            dynamics.observe_accelerated([&x[..n], &x[n..2 * n], &rate[n..2 * n]], outputs);
        }
        for ((channels, &a), &effort) in outputs.chunks_exact_mut(4).zip(&rate[n..]).zip(&*load).take(joints) {
            (channels[2], channels[3]) = (a, effort);
        }
    }

    /// Places a guided machine: motion of all coordinates without free accelerations, and its drives.
    fn place(&mut self, y: &[S]) {
        let Self { dynamics, guidance, free, ends, interval, x, rate, .. } = self;
        let (n, count, time) = (dynamics.coordinates(), free.len(), y[y.len() - 1]);
        for (&joint, ends) in guidance.joints.iter().zip(ends) {
            [x[joint], x[n + joint], rate[n + joint]] = between(ends, time, *interval);
        }
        for (k, &place) in free.iter().enumerate() {
            (x[place], x[n + place], rate[n + place]) = (y[k], y[count + k], S::zero());
        }
        let internal = &y[2 * count..y.len() - 1];
        let first = x.len() - internal.len();
        x[first..].copy_from_slice(internal);
        if guidance.drives {
            dynamics.drive(x, rate);
        } else {
            dynamics.remember(x, rate);
        }
    }

    /// Load on all coordinates of a guided machine without free accelerations, and these.
    fn balance(&mut self, y: &[S]) {
        let Self { dynamics, free, holds, interval, x, rate, load, column, mass, factors, .. } = self;
        let (n, share) = (load.len(), y[y.len() - 1] / *interval);
        let (q, v) = x[..2 * n].split_at(n);
        dynamics.terms(q, v);
        flexible::required(&dynamics.model, &dynamics.data, (q, v), &rate[n..2 * n], load);
        for (seat, effect) in &dynamics.effects {
            seat.push(load, -effect.law().effort(seat.of(q), seat.of(v)));
        }
        dynamics.memories.subtract_efforts(v, load);
        dynamics.subtract_connections(load);
        for Hold { first, row, strain: [begin, end, gain] } in &*holds {
            let own = *first..*first + row.len();
            let mut lacking = *begin + (*end - *begin) * share;
            v[own.clone()].iter().zip(row).for_each(|(&rate, &entry)| lacking -= rate * entry);
            load[own].iter_mut().zip(row).for_each(|(load, &entry)| *load -= lacking * (*gain * entry));
        }
        let matrix = dynamics.data.mass_matrix();
        for (own, &row) in mass.chunks_exact_mut(free.len().max(1)).zip(&*free) {
            own.iter_mut().zip(&*free).for_each(|(entry, &place)| *entry = matrix[row * n + place]);
        }
        factors.factorise(mass);
        column.iter_mut().zip(&*free).for_each(|(entry, &place)| *entry = -load[place]);
        factors.solve(column);
        free.iter().zip(&*column).for_each(|(&place, &a)| rate[n + place] = a);
    }

    /// Collects the rates of a guided machine's state from those of the whole machine.
    fn collect(&mut self) {
        let Self { free, x, rate, rates, load, .. } = self;
        let (n, count, last) = (load.len(), free.len(), rates.len() - 1);
        for (k, &place) in free.iter().enumerate() {
            (rates[k], rates[count + k]) = (x[n + place], rate[n + place]);
        }
        let first = rate.len() - (last - 2 * count);
        rates[2 * count..last].copy_from_slice(&rate[first..]);
        rates[last] = S::one();
    }

    /// Efforts that the motion of a guided machine needs, by the mass matrix of the last evaluation. They come from the
    /// load that is left without the free accelerations.
    fn require(&mut self) {
        let Self { dynamics, free, x, rate, load, .. } = self;
        let (n, matrix) = (load.len(), dynamics.data.mass_matrix());
        for (effort, row) in load.iter_mut().zip(matrix.chunks_exact(n.max(1))) {
            *effort += free.iter().map(|&place| row[place] * rate[n + place]).sum();
        }
        dynamics.follow_load(&x[..n], &x[n..2 * n], load);
    }

    /// Writes the stiff matrix `[0, 1, 0; -M^-1 K, -M^-1 D, t]` of a guided machine from the last evaluation. It costs
    /// one mass matrix, and has the change in time of what drives the machine.
    pub(super) fn stiff(&mut self, matrix: &mut [S]) {
        let (n, dim) = (self.free.len(), self.rates.len());
        matrix.fill(S::zero());
        for k in 0..n {
            matrix[k * dim + n + k] = S::one();
        }
        let lower = &mut matrix[n * dim..2 * n * dim];
        self.stiffen(lower, dim);
        self.resist(lower, dim);
        self.drift(lower, dim);
        self.solve(lower, dim);
    }

    /// Writes `[-M_ff^-1 K, -M_ff^-1 D]` of a guided machine's beams from the last evaluation.
    pub(super) fn elasticity(&mut self, block: &mut [S]) {
        let width = 2 * self.free.len();
        block.fill(S::zero());
        self.stiffen(block, width);
        self.solve(block, width);
    }

    /// Adds `-K` and `-D` of a guided machine's beams to rows of `width` entries.
    fn stiffen(&self, rows: &mut [S], width: usize) {
        // The elastic coordinates are the last of all and of the free ones.
        let (count, driven) = (self.free.len(), self.guidance.joints.len());
        for Elastic { beam, coordinate, .. } in self.dynamics.model.beams() {
            let (first, len) = (coordinate - driven, beam.len());
            for (k, (&stiffness, &damping)) in beam.stiffness().iter().zip(beam.damping()).enumerate() {
                let row = &mut rows[(first + k / len) * width..][..width];
                row[first + k % len] -= stiffness;
                row[count + first + k % len] -= damping;
            }
        }
        for Hold { first, row, strain: [.., gain] } in &self.holds {
            let first = first - driven;
            for (line, &own) in rows[first * width..].chunks_exact_mut(width).zip(row) {
                let entries = line[count + first..].iter_mut().zip(row);
                entries.for_each(|(entry, &other)| *entry -= *gain * (own * other));
            }
        }
    }

    /// Adds slopes of effects on a guided machine's passive joints; chords from rest for friction.
    fn resist(&self, rows: &mut [S], width: usize) {
        let (n, count) = (self.load.len(), self.free.len());
        for (seat, effect) in &self.dynamics.effects {
            let (q, v) = (seat.of(&self.x), seat.of(&self.x[n..]));
            let (slope, resistance) = (effect.slope_at_rest(q), effect.law().resistance(q, v));
            let place = |joint: usize| self.free.iter().position(|&place| place == joint);
            seat.for_each(|joint, share| {
                let Some(k) = place(joint) else { return };
                seat.for_each(|joint, other_share| {
                    let Some(other) = place(joint) else { return };
                    rows[k * width + other] += slope * share * other_share;
                    rows[k * width + count + other] -= resistance * share * other_share;
                });
            });
        }
    }

    /// Adds the column of the time to a guided machine's matrix: chords of what changes over the interval. These are
    /// the load by changing accelerations of the following joints, and by strain rates that hold beams. Without it a
    /// stiff mode would lag behind by a share of the step.
    fn drift(&self, rows: &mut [S], width: usize) {
        let (n, matrix) = (self.load.len(), self.dynamics.data.mass_matrix());
        for (line, &place) in rows.chunks_exact_mut(width).zip(&self.free) {
            for (&joint, [begin, end]) in self.guidance.joints.iter().zip(&self.ends) {
                line[width - 1] -= matrix[place * n + joint] * ((end[2] - begin[2]) / self.interval);
            }
            for Hold { first, row, strain: [begin, end, gain] } in &self.holds {
                let entry = place.checked_sub(*first).and_then(|own| row.get(own)).copied().unwrap_or_default();
                line[width - 1] += (*end - *begin) * *gain / self.interval * entry;
            }
        }
    }

    /// Solves for a guided machine: multiplies rows of `width` entries by `M_ff^-1`.
    fn solve(&mut self, rows: &mut [S], width: usize) {
        for place in 0..width {
            let entries = rows.iter_mut().skip(place).step_by(width);
            self.column.iter_mut().zip(entries).for_each(|(own, entry)| *own = *entry);
            self.factors.solve(&mut self.column);
            let entries = rows.iter_mut().skip(place).step_by(width);
            entries.zip(&self.column).for_each(|(entry, &own)| *entry = own);
        }
    }
}

impl Guided<Recorded> {
    /// Recorded program of a guided machine at state `y`: numbers, and the matrix that follows.
    pub(super) fn recorded(&mut self, part: Part, y: &[Recorded]) -> (Vec<Recorded>, Option<Matrix>) {
        let zeros = |count: usize| vec![Recorded::default(); count];
        if part == Part::Sample {
            let mut seen = zeros(self.x.len() + self.dynamics.layout().count() + self.dynamics.joints());
            self.sample(y, &mut seen);
            return (seen, None);
        }
        self.evaluate(y);
        let (rates, count) = (self.rates.clone(), self.free.len());
        let matrix = match part {
            Part::Rates | Part::Sample => None,
            Part::Linearised => Some(Matrix::by_states(rates.clone(), y.len())),
            Part::Prepared => {
                let mut matrix = zeros(y.len() * y.len());
                self.stiff(&mut matrix);
                Some(Matrix::Entries(matrix, y.len()))
            }
            Part::Elasticity => {
                let mut block = zeros(2 * count * count);
                self.elasticity(&mut block);
                Some(Matrix::Entries(block, 2 * count))
            }
        };
        (rates, matrix)
    }
}
