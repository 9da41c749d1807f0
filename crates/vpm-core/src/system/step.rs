//! A whole step of an integrator as one function of a machine: of where it begins, what the inputs hold and how long it is.

use super::Dynamics;
use super::recorded::{Matrix, Places};
use crate::graph::{Recorded, derivatives, input, slopes};
use crate::integrator::LinearlyImplicit;
use crate::ode::Ode;
use crate::scalar::{Dual, Scalar};

/// Derivatives that are recorded in one go.
const LANES: usize = 8;
/// Largest factor of an elimination without row exchanges that counts as exact: of the digits of a number it costs two for each row at most.
const LARGEST_FACTOR: f64 = 100.0;

/// Whole linearly implicit step as one function: the state after it, and whether that is exact.
///
/// Law: [`LinearlyImplicit`].
pub(super) fn linearly_implicit(dynamics: &mut Dynamics<Recorded>, places: Places) -> Vec<Recorded> {
    step::<0>(dynamics, places, &[], false).into_iter().map(|number| number.value).collect()
}

/// Whole step of [`linearly_implicit`] with its derivatives by the inputs at the places `by`.
///
/// Law: derivatives of a stage follow from those of its state, and of the solution of a linear system from that system again, see
/// [`Ode::turned`]: far fewer operations than derivatives of each operation. The matrix may be taken for `constant`.
pub(super) fn linearly_implicit_derived(
    dynamics: &mut Dynamics<Recorded>,
    places: Places,
    by: &[u32],
    constant: bool,
) -> (Vec<Recorded>, Matrix) {
    let values = linearly_implicit(dynamics, places);
    let mut matrix = vec![Recorded::zero(); values.len() * by.len()];
    for (part, by_some) in by.chunks(LANES).enumerate() {
        let numbers = step::<LANES>(dynamics, places, by_some, constant);
        for (row, number) in matrix.chunks_exact_mut(by.len()).zip(numbers) {
            row[part * LANES..][..by_some.len()].copy_from_slice(&number.gradient[..by_some.len()]);
        }
    }
    (values, Matrix::Entries(matrix, by.len()))
}

/// Whole step with at most N derivatives, `by` the inputs at these places.
///
/// Those of the matrix may be left out, as if it were `constant`, see [`super::constant`].
fn step<const N: usize>(
    dynamics: &mut Dynamics<Recorded>,
    places: Places,
    by: &[u32],
    constant: bool,
) -> Vec<Dual<Recorded, N>> {
    let lane = |place: usize| by.iter().position(|&by| by as usize == place).unwrap_or(N);
    let mut x: Vec<_> = (0..places.states).map(|place| Dual::variable(input(place, 0.0), lane(place))).collect();
    let mut integrator = LinearlyImplicit::new(x.len());
    let mut machine = Machine { dynamics, by, constant, columns: Vec::new(), turns: Vec::new() };
    integrator.step(&mut machine, &mut x, Dual::constant(input(places.reach(), 0.0)));
    let exact = integrator.largest_factor().if_less(LARGEST_FACTOR.into(), Dual::one, Dual::zero);
    x.push(exact);
    x
}

/// A machine as the integrators know it, in recorded numbers with derivatives by some of its inputs.
struct Machine<'a> {
    dynamics: &'a mut Dynamics<Recorded>,
    /// Which inputs these are, lane by lane.
    by: &'a [u32],
    /// Whether derivatives of the matrix are left out.
    constant: bool,
    /// Row and column of each entry of the last matrix that may change.
    columns: Vec<(usize, usize)>,
    /// Which of these changes by which input, and how fast.
    turns: Vec<((usize, usize), Recorded)>,
}

impl Machine<'_> {
    /// Inputs of a whole step by which derivatives are taken.
    fn variables(&self) -> Vec<Recorded> {
        self.by.iter().map(|&place| input(place as usize, 0.0)).collect()
    }

    /// Slopes of the rates in a whole step, without a limit: only small machines have such steps.
    fn slopes_of_rates(
        &self,
        x: &[Recorded],
        rates: &[Recorded],
        variables: &[Recorded],
    ) -> Vec<((usize, usize), Recorded)> {
        let found = self.dynamics.slopes_of_rates(x, rates, variables, usize::MAX);
        found.unwrap_or_else(|| slopes(rates, variables))
    }
}

impl<const N: usize> Ode<Dual<Recorded, N>> for Machine<'_> {
    fn dim(&self) -> usize {
        self.dynamics.dim()
    }

    fn coordinates(&self) -> usize {
        self.dynamics.coordinates()
    }

    fn rhs(&mut self, x: &[Dual<Recorded, N>], dxdt: &mut [Dual<Recorded, N>]) {
        // Frozen, the state stands by itself: no operation of the rates reaches through to what it was made of.
        let state: Vec<Recorded> = x.iter().map(|number| number.value.frozen()).collect();
        let mut rates = vec![Recorded::zero(); x.len()];
        self.dynamics.rhs(&state, &mut rates);
        dxdt.iter_mut().zip(&rates).for_each(|(dxdt, &rate)| *dxdt = Dual::constant(rate));
        let (dim, states) = (x.len(), x.len() as u32);
        let held = (0..).zip(self.by).filter(|&(_, &place)| place >= states);
        let (lanes, held): (Vec<usize>, Vec<_>) = held.map(|(lane, &place)| (lane, input(place as usize, 0.0))).unzip();
        let variables = [&state[..], &held].concat();
        for ((row, column), slope) in self.slopes_of_rates(&state, &rates, &variables) {
            let along = match column.checked_sub(dim) {
                None => x[column],
                Some(place) => Dual::variable(Recorded::zero(), lanes[place]),
            };
            let total = &mut dxdt[row].gradient;
            total.iter_mut().zip(along.gradient).for_each(|(total, along)| *total += slope * along);
        }
    }

    fn jacobian(&mut self, x: &[Dual<Recorded, N>], jacobian: &mut [Dual<Recorded, N>]) {
        self.iteration_matrix(x, jacobian);
    }

    /// Prepares a whole step at the state where it begins.
    fn prepare(&mut self, x: &[Dual<Recorded, N>], matrix: &mut [Dual<Recorded, N>], rates: &mut [Dual<Recorded, N>]) {
        let state: Vec<Recorded> = x.iter().map(|number| number.value).collect();
        let mut values = vec![Recorded::zero(); x.len()];
        self.dynamics.rhs(&state, &mut values);
        rates.iter_mut().zip(&values).for_each(|(rate, &value)| *rate = Dual::constant(value));
        let variables = self.variables();
        for ((row, lane), slope) in self.slopes_of_rates(&state, &values, &variables) {
            rates[row].gradient[lane] = slope;
        }
        // Chords stand for the laws in the copy: rates elsewhere follow the laws themselves.
        let entries = self.dynamics.clone().prepared(&state).entries();
        matrix.fill(Dual::zero());
        entries.iter().for_each(|&((row, column), entry)| matrix[row * x.len() + column] = Dual::constant(entry));
        if !self.constant {
            let (places, numbers): (Vec<_>, Vec<_>) = entries.into_iter().unzip();
            self.columns = places;
            self.turns = slopes(&numbers, &variables);
        }
    }

    fn turns(&self) -> bool {
        N > 0 && !self.constant
    }

    fn turned(&mut self, k: &[Dual<Recorded, N>], product: &mut [Dual<Recorded, N>]) {
        product.fill(Dual::zero());
        for &((entry, lane), slope) in &self.turns {
            let (row, column) = self.columns[entry];
            product[row].gradient[lane] += slope * k[column].value;
        }
    }
}

impl Matrix {
    /// Nonzero entries of a whole step's matrix: row, column and number of each.
    fn entries(self) -> Vec<((usize, usize), Recorded)> {
        match self {
            Self::Of(numbers, by) => derivatives(&numbers, &by),
            Self::Entries(numbers, columns) => numbers
                .into_iter()
                .enumerate()
                .map(|(place, entry)| ((place / columns, place % columns), entry))
                .collect(),
        }
    }
}
