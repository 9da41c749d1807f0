//! The equations of free coordinates beside others that follow a motion.

use super::observer::Held;
use super::quintic::{State, between};
use crate::algebra::Cholesky;
use crate::dynamics::flexible;
use crate::scalar::Scalar;
use crate::statics::free_coordinates;
use crate::system::Dynamics;

/// The coordinates of a machine on their way: those that follow a motion and those that are free.
pub(super) struct Buffers<S> {
    pub(super) dynamics: Dynamics<S>,
    /// The joints that follow.
    pub(super) driven: Vec<usize>,
    /// Passive joints, then elastic coordinates.
    pub(super) free: Vec<usize>,
    /// Gauges that hold their beams.
    pub(super) held: Vec<Held<S>>,
    pub(super) q: Vec<S>,
    pub(super) v: Vec<S>,
    pub(super) a: Vec<S>,
    pub(super) load: Vec<S>,
    pub(super) rates: Vec<S>,
    pub(super) state: Vec<S>,
    pub(super) ends: Vec<[State<S>; 2]>,
    /// A load on the free coordinates on its way.
    pub(super) column: Vec<S>,
    /// The block of the mass matrix of the free coordinates, and its factors.
    pub(super) mass: Vec<S>,
    pub(super) factors: Cholesky<S>,
}

impl<S: Scalar> Buffers<S> {
    pub(super) fn new(dynamics: Dynamics<S>, passive: &[usize], held: Vec<Held<S>>) -> Self {
        let (n, joints, zero) = (dynamics.coordinates(), dynamics.joints(), S::zero());
        let free = free_coordinates(&dynamics, passive);
        let driven = (0..joints).filter(|joint| !passive.contains(joint)).collect();
        let count = free.len();
        let [q, v, a, load] = [0; 4].map(|_| vec![zero; n]);
        let [rates, state] = [0; 2].map(|_| vec![zero; 2 * count + 1]);
        let (column, mass, factors) = (vec![zero; count], vec![zero; count * count], Cholesky::new(count));
        let ends = vec![[[zero; 3]; 2]; joints];
        Self { dynamics, driven, free, held, q, v, a, load, rates, state, ends, column, mass, factors }
    }

    /// Motion of all coordinates and rates of the state, at state `x` on the way between `ends`.
    pub(super) fn evaluate(&mut self, x: &[S], ends: &[[State<S>; 2]], interval: f64) {
        let Self { dynamics, driven, free, held, q, v, a, load, column, mass, factors, rates, .. } = self;
        let (n, count) = (q.len(), free.len());
        for &joint in &*driven {
            [q[joint], v[joint], a[joint]] = between(&ends[joint], x[2 * count], interval);
        }
        for (k, &place) in free.iter().enumerate() {
            (q[place], v[place], a[place]) = (x[k], x[count + k], S::zero());
        }
        dynamics.terms(q, v);
        flexible::required(&dynamics.model, &dynamics.data, (q, v), a, load);
        for (joint, effect) in &dynamics.effects {
            load[*joint] -= effect.effort(q[*joint], v[*joint]);
        }
        dynamics.subtract_connections(load);
        for held in &*held {
            held.hold(v, load, x[2 * count] / interval);
        }
        let matrix = dynamics.data.mass_matrix();
        for (own, &row) in mass.chunks_exact_mut(count.max(1)).zip(&*free) {
            for (entry, &place) in own.iter_mut().zip(&*free) {
                *entry = matrix[row * n + place];
            }
        }
        factors.factorise(mass);
        for (entry, &place) in column.iter_mut().zip(&*free) {
            *entry = -load[place];
        }
        factors.solve(column);
        for (k, &place) in free.iter().enumerate() {
            a[place] = column[k];
            (rates[k], rates[count + k]) = (v[place], column[k]);
        }
        rates[2 * count] = S::one();
    }

    /// Turns the load that is left without the free accelerations into the efforts that the motion needs with them, by the mass matrix of
    /// the last evaluation.
    pub(super) fn require(&mut self) {
        let Self { dynamics, free, q, v, a, load, .. } = self;
        let matrix = dynamics.data.mass_matrix();
        for (effort, row) in load.iter_mut().zip(matrix.chunks_exact(q.len().max(1))) {
            *effort += free.iter().map(|&place| row[place] * a[place]).sum();
        }
        dynamics.follow_load(q, v, load);
    }

    /// Writes `[-M_ff^-1 K, -M_ff^-1 D]` of the beams, and of what holds them, into rows of `width` entries, with the factors of the last evaluation.
    pub(super) fn elasticity(&mut self, rows: &mut [S], width: usize) {
        let Self { dynamics, factors, driven, free, held, column, .. } = self;
        let count = free.len();
        for number in 0..dynamics.model.n_beams() {
            let Some((beam, first)) = dynamics.model.beam(number) else { continue };
            // The elastic coordinates are the last of all and of the free ones.
            let (first, len) = (first - driven.len(), beam.len());
            for (block, stiff) in [(0, beam.stiffness()), (count, beam.damping())] {
                for k in 0..len {
                    column.fill(S::zero());
                    for (entry, row) in column[first..first + len].iter_mut().zip(stiff.chunks_exact(len)) {
                        *entry = -row[k];
                    }
                    for held in held.iter().filter(|held| block > 0 && held.first == first + driven.len()) {
                        for (entry, &other) in column[first..first + len].iter_mut().zip(&held.row) {
                            *entry -= S::from_f64(held.gain * held.row[k] * other);
                        }
                    }
                    factors.solve(column);
                    set_column(rows, width, block + first + k, column);
                }
            }
        }
    }

    /// Writes the column of the time: what the changing accelerations of the driven joints, and the rates of strain that hold beams, do to
    /// those of the free coordinates, as chords over the interval. Without it a stiff mode would lag behind by a share of the step.
    pub(super) fn drift(&mut self, rows: &mut [S], width: usize, ends: &[[State<S>; 2]], interval: f64) {
        let Self { dynamics, factors, driven, free, held, load, column, .. } = self;
        let n = load.len();
        let matrix = dynamics.data.mass_matrix();
        load.fill(S::zero());
        for held in &*held {
            held.drift(load, interval);
        }
        for (entry, &place) in column.iter_mut().zip(&*free) {
            *entry = -load[place];
            for &joint in &*driven {
                *entry -= matrix[place * n + joint] * ((ends[joint][1][2] - ends[joint][0][2]) / interval);
            }
        }
        factors.solve(column);
        set_column(rows, width, width - 1, column);
    }

    /// Writes the columns of the passive joints: slopes of their effects, and chords from rest in the place of the tangents of friction.
    pub(super) fn joint_effects(&mut self, rows: &mut [S], width: usize) {
        let Self { dynamics, factors, free, q, v, column, .. } = self;
        let (count, joints) = (free.len(), dynamics.joints());
        for (k, &joint) in free.iter().enumerate().take_while(|(_, place)| **place < joints) {
            let own = || dynamics.effects.iter().filter(|(place, _)| *place == joint).map(|(_, effect)| effect);
            let slope: S = own().map(|effect| effect.slope_at_rest(q[joint])).sum();
            let resistance: S = own().map(|effect| effect.resistance(q[joint], v[joint])).sum();
            for (place, entry) in [(k, slope), (count + k, -resistance)] {
                column.fill(S::zero());
                column[k] = entry;
                factors.solve(column);
                set_column(rows, width, place, column);
            }
        }
    }
}

fn set_column<S: Scalar>(rows: &mut [S], width: usize, place: usize, column: &[S]) {
    for (row, &entry) in rows.chunks_exact_mut(width).zip(column) {
        row[place] = entry;
    }
}
