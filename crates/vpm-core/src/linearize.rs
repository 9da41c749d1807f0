//! The linear machine near a state: exact derivatives of its rates and outputs.

use crate::ball::check_angles;
use crate::description::Description;
use crate::error::{Error, Result};
use crate::scalar::Dual;
use crate::sensitivity::LANES;
use crate::simulate::check_state;
use crate::system::{Kind, Routine};
use crate::table::Table;

/// What a sampled drive takes away.
const NO_LINEAR_MODEL: &str = "the machine has no linear model in continuous time";

/// A number with its derivatives along some of the states and inputs.
type Number = Dual<f64, LANES>;

/// `dx/dt = A x + B u`, `y = C x + D u` for small deviations, each matrix row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearization {
    /// A: derivative of the rates by the states, nx x nx.
    pub state: Vec<f64>,
    /// B: derivative of the rates by the inputs, nx x nu.
    pub input: Vec<f64>,
    /// C: derivative of the outputs by the states, ny x nx.
    pub output: Vec<f64>,
    /// D: derivative of the outputs by the inputs, ny x nu.
    pub feedthrough: Vec<f64>,
    /// dx/dt at the point itself: zero where the point is an equilibrium.
    pub rate: Vec<f64>,
    /// The outputs at the point itself.
    pub reading: Vec<f64>,
}

/// Linearizes at `state` under the commands `inputs`: A, B, C and D, exact to rounding.
///
/// The inputs are commands that stand for long: delays of actuators and sensors, which a matrix cannot hold, pass them unchanged.
/// Dead zones and saturations have the slope they have at the command, zero inside a dead zone and beyond a limit; a lag is a
/// state. Outputs are all channels as their sensors show them, with gain and offset.
/// Source: forward accumulation, see [`crate::scalar`]. Checked: the state has to be finite; tested against difference quotients
/// and against the response of the simulation to small steps.
pub fn linearize(description: &Description, theta: &[f64], state: &[f64], inputs: &[f64]) -> Result<Linearization> {
    description.refuse_sampled(NO_LINEAR_MODEL, "linearise the machine with an ideal drive in its place")?;
    check_state("state", description, state)?;
    Table::vector("inputs", inputs, description.n_inputs(), "actuator and logged supply")?;
    check_angles(&description.balls, state)?;
    let mut tangent = Tangent::new(description, theta)?;
    let (nx, nu, ny) = (state.len(), inputs.len(), description.n_outputs());
    let zeros = |rows: usize, columns: usize| vec![0.0; rows * columns];
    let mut result = Linearization {
        state: zeros(nx, nx),
        input: zeros(nx, nu),
        output: zeros(ny, nx),
        feedthrough: zeros(ny, nu),
        rate: zeros(nx, 1),
        reading: zeros(ny, 1),
    };
    for first in (0..nx + nu).step_by(LANES) {
        result.take(first, (nx, nu), tangent.evaluate(state, inputs, first));
    }
    result.checked((nx, nu))
}

/// What the machine shows in numbers that carry derivatives.
struct Tangent {
    readings: Routine<Number>,
    state: Vec<Number>,
    commands: Vec<Number>,
}

impl Tangent {
    fn new(description: &Description, theta: &[f64]) -> Result<Self> {
        description.check_values(theta)?;
        let readings = description.functions().function(&Kind::Readings, theta)?;
        let theta: Vec<Number> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let zeros = |length: usize| vec![Number::default(); length];
        let (state, commands) = (zeros(description.n_states()), zeros(description.n_inputs()));
        Ok(Self { readings: Routine::new(readings, &theta), state, commands })
    }

    /// Rates and outputs with derivatives along [`LANES`] directions from `first`, to linearize. Directions are states,
    /// then inputs.
    fn evaluate(&mut self, state: &[f64], inputs: &[f64], first: usize) -> (&[Number], &[Number]) {
        // A direction that is not among these wraps around to a lane that does not exist, which gives a constant.
        let lift = |(place, &value): (usize, &f64)| Dual::variable(value, place.wrapping_sub(first));
        for (number, lifted) in self.state.iter_mut().zip(state.iter().enumerate().map(lift)) {
            *number = lifted;
        }
        for (number, (place, &value)) in self.commands.iter_mut().zip(inputs.iter().enumerate()) {
            *number = lift((state.len() + place, &value));
        }
        self.readings.put(state.len(), &self.commands);
        self.readings.at(&self.state).split_at(state.len())
    }
}

impl Linearization {
    /// Takes the columns from direction `first` into a linearized machine.
    fn take(&mut self, first: usize, (nx, nu): (usize, usize), (rate, reading): (&[Number], &[Number])) {
        fill(rate, first, [(&mut self.state, 0..nx), (&mut self.input, nx..nx + nu)]);
        fill(reading, first, [(&mut self.output, 0..nx), (&mut self.feedthrough, nx..nx + nu)]);
        let values = |target: &mut [f64], numbers: &[Number]| {
            target.iter_mut().zip(numbers).for_each(|(value, number)| *value = number.value);
        };
        values(&mut self.rate, rate);
        values(&mut self.reading, reading);
    }

    fn checked(self, (nx, nu): (usize, usize)) -> Result<Self> {
        let parts =
            [("A", &self.state, nx), ("B", &self.input, nu), ("C", &self.output, nx), ("D", &self.feedthrough, nu)];
        for (matrix, entries, width) in parts {
            if let Some((place, &value)) = entries.iter().enumerate().find(|(_, entry)| !entry.is_finite()) {
                return Err(Error::NoDerivative { matrix, row: place / width, column: place % width, value });
            }
        }
        Ok(self)
    }
}

/// Fills matrices of a linearized machine with the derivatives of `numbers` from direction `first`. The matrices hold
/// ranges of all directions.
fn fill(numbers: &[Number], first: usize, matrices: [(&mut Vec<f64>, std::ops::Range<usize>); 2]) {
    for (matrix, range) in matrices {
        for (row, number) in matrix.chunks_exact_mut(range.len().max(1)).zip(numbers) {
            for (lane, &slope) in number.gradient.iter().enumerate() {
                if range.contains(&(first + lane)) {
                    row[first + lane - range.start] = slope;
                }
            }
        }
    }
}
