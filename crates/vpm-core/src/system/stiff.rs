//! What is stiff in a machine with elastic beams, for implicit steps.

use super::Dynamics;
use crate::actuator::{Drive, Target};
use crate::effect::MemoryChords;
use crate::scalar::Scalar;

/// Matrix of what is stiff: `[0, 1; -M^-1 K, -M^-1 D]` with beams, effects, lags and memories. K has the slopes of the
/// effects, and D their chords, `resistances`. Lags of ideal drives and memories with their `chords` have columns and
/// rows. It costs one mass matrix.
///
/// What it leaves out, the change of gravity, of velocity terms and of levers with the state, is slow beside the vibrations. Checked:
/// against the exact Jacobian of a beam at rest without gravity, where nothing is left out.
pub(super) fn iteration_matrix<S: Scalar>(
    dynamics: &mut Dynamics<S>,
    x: &[S],
    matrix: &mut [S],
    (resistances, chords): (&[S], &[Option<MemoryChords<S>>]),
    column: &mut [S],
) {
    let (n, dim) = (dynamics.coordinates(), x.len());
    let (q, v) = x[..2 * n].split_at(n);
    dynamics.terms(q, v);
    dynamics.data.factorise();
    matrix.fill(S::zero());
    for k in 0..n {
        matrix[k * dim + n + k] = S::one();
    }
    let lower = &mut matrix[n * dim..];
    elasticity(dynamics, lower, dim, column);
    let Dynamics { data, effects, actuators, .. } = dynamics;
    for (number, (seat, _)) in effects.iter().enumerate() {
        if effects[..number].iter().any(|(earlier, _)| earlier.place() == seat.place()) {
            continue;
        }
        let own = || effects.iter().zip(resistances).filter(|((other, _), _)| other.place() == seat.place());
        let slope: S = own().map(|((_, effect), _)| effect.slope_at_rest(seat.of(q))).sum();
        let resistance: S = own().map(|(_, &resistance)| resistance).sum();
        for (entry, block) in [(slope, 0), (-resistance, n)] {
            column.fill(S::zero());
            seat.push(column, entry);
            data.solve(column);
            seat.for_each(|joint, share| add_column(lower, dim, block + joint, (column, share)));
        }
    }
    let lagging = actuators.iter().filter_map(|actuator| actuator.lag.as_ref().map(|lag| (actuator, lag)));
    for (place, (actuator, lag)) in (2 * n..).zip(lagging) {
        column.fill(S::zero());
        let Drive::Ideal(drive) = &actuator.drive else { continue };
        let force = drive.slope(x[place]);
        match actuator.on {
            Target::Joint(joint) => column[joint] = force,
            Target::Line(line) => data.line_load(line, force, column),
        }
        data.solve(column);
        add_column(lower, dim, place, (column, S::one()));
        lower[(place - n) * dim + place] = lag.rate(S::one(), S::zero());
    }
    remember(dynamics, lower, dim, chords, column);
}

/// Columns and rows of the memories in the matrix of what is stiff.
fn remember<S: Scalar>(
    dynamics: &Dynamics<S>,
    rows: &mut [S],
    dim: usize,
    chords: &[Option<MemoryChords<S>>],
    column: &mut [S],
) {
    let (n, first) = (dynamics.coordinates(), dynamics.first_memory());
    for ((place, seat), law) in (first..).zip(dynamics.memories.seats()).zip(chords.iter().flatten()) {
        let push = |column: &mut [S], effort: S| {
            column.fill(S::zero());
            seat.push(column, effort);
            dynamics.data.solve(column);
        };
        push(column, -law.push);
        add_column(rows, dim, place, (column, S::one()));
        push(column, -law.resistance);
        seat.for_each(|joint, share| add_column(rows, dim, n + joint, (column, share)));
        let row = &mut rows[(place - n) * dim..];
        seat.for_each(|joint, share| row[n + joint] = law.gain * share);
        row[place] = -law.fading;
    }
}

/// Stiff part `[-M^-1 K, -M^-1 D]` of the beams, added to rows of `width` entries. The factors of M are in the data.
pub(super) fn elasticity<S: Scalar>(dynamics: &Dynamics<S>, rows: &mut [S], width: usize, column: &mut [S]) {
    let n = dynamics.coordinates();
    for elastic in dynamics.model.beams() {
        let (first, len) = (elastic.coordinate, elastic.beam.len());
        let damped = elastic.beam.is_damped().then(|| (n, elastic.beam.damping()));
        for (block, stiff) in [(0, elastic.beam.stiffness())].into_iter().chain(damped) {
            for k in 0..len {
                column.fill(S::zero());
                for (entry, row) in column[first..first + len].iter_mut().zip(stiff.chunks_exact(len)) {
                    *entry = -row[k];
                }
                dynamics.data.solve(column);
                add_column(rows, width, block + first + k, (column, S::one()));
            }
        }
    }
}

/// Adds a multiple of one column to another in the matrix of what is stiff.
fn add_column<S: Scalar>(rows: &mut [S], width: usize, place: usize, (column, times): (&[S], S)) {
    for (row, &entry) in rows.chunks_exact_mut(width).zip(column) {
        row[place] += entry * times;
    }
}
