//! Whole steps as one function: against the integrator itself over the laws, derivatives against dual numbers.

use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::graph::Evaluator;
use vpm_core::integrator::{LinearlyImplicit, Method};
use vpm_core::ode::Ode;
use vpm_core::samples::{Random, random_tree};
use vpm_core::scalar::{Dual, Scalar};
use vpm_core::simulate::{Run, Setting, Stepping, free_run};
use vpm_core::system::{Kind, System};
use vpm_core::table::Table;

use super::machines::{drawn, rubbing};
use crate::common::Machine;

/// Derivatives that the witness takes at once.
const LANES: usize = 4;

type Number = Dual<f64, LANES>;

/// A place where a step begins: state, inputs, parameters and length.
struct Start {
    x: Vec<f64>,
    u: Vec<f64>,
    theta: Vec<f64>,
    step: f64,
}

impl Start {
    fn new(d: &Description, seed: u64) -> Self {
        let random = &mut Random::new(seed);
        let step = 10_f64.powf(-4.0 + 2.0 * random.unit());
        let (x, u) = (random.numbers(d.n_states(), 1.0), random.numbers(d.n_inputs(), 1.0));
        Self { x, u, theta: d.parameters.clone(), step }
    }

    /// What the recorded function of that kind gives.
    fn recorded(&self, d: &Description, kind: &Kind) -> Result<Vec<f64>> {
        let placed = d.program(kind, &self.theta)?;
        let places = placed.places;
        let mut inputs = vec![0.0; places.count()];
        inputs[..places.states].copy_from_slice(&self.x);
        inputs[places.states..places.states + places.inputs].copy_from_slice(&self.u);
        inputs[places.reach()] = self.step;
        inputs[places.first_parameter()..].copy_from_slice(&self.theta);
        let mut outputs = vec![0.0; placed.program.outputs().len()];
        Evaluator::new(&placed.program).evaluate(&inputs, &mut outputs);
        let Kind::Derived(_, by) = kind else { return Ok(outputs) };
        let values = outputs.len() - placed.entries.len();
        let mut matrix = vec![0.0; values * by.len()];
        for (&(row, column), &entry) in placed.entries.iter().zip(&outputs[values..]) {
            matrix[row * by.len() + column] = entry;
        }
        Ok(matrix)
    }

    /// The state after the step by the integrator, in numbers that `lift` makes of each input of the recorded function.
    fn direct<S: Scalar>(&self, d: &Description, lift: impl Fn(usize, f64) -> S) -> Result<Vec<S>> {
        self.reached(d, lift, |system, x| LinearlyImplicit::new(x.len()).step(system, x, self.step))
    }

    /// The state that `step` leads to, as [`Start::direct`].
    fn reached<S: Scalar>(
        &self,
        d: &Description,
        lift: impl Fn(usize, f64) -> S,
        step: impl Fn(&mut System<S>, &mut [S]),
    ) -> Result<Vec<S>> {
        let places = d.program(&Kind::Rates, &self.theta)?.places;
        let all = |first: usize, values: &[f64]| -> Vec<S> {
            values.iter().enumerate().map(|(k, &value)| lift(first + k, value)).collect()
        };
        let mut system: System<S> = d.system(&all(places.first_parameter(), &self.theta))?;
        system.make_for(Method::LinearlyImplicit)?;
        for (number, input) in all(places.states, &self.u).into_iter().enumerate() {
            system.hold(number, input);
        }
        let mut x = all(0, &self.x);
        step(&mut system, &mut x);
        Ok(x)
    }

    /// The derivatives of the state after the step by the inputs at these places, row by row, in dual numbers.
    fn derived(&self, d: &Description, by: &[u32]) -> Result<Vec<f64>> {
        self.derived_by(d, by, |system, x| LinearlyImplicit::new(x.len()).step(system, x, self.step))
    }

    /// The same of another `step`.
    fn derived_by(
        &self,
        d: &Description,
        by: &[u32],
        step: impl Fn(&mut System<Number>, &mut [Number]),
    ) -> Result<Vec<f64>> {
        let mut matrix = vec![0.0; self.x.len() * by.len()];
        for (part, some) in by.chunks(LANES).enumerate() {
            let lane = |place: usize| some.iter().position(|&by| by as usize == place).unwrap_or(LANES);
            let next = self.reached(d, |place, value| Dual::variable(value, lane(place)), &step)?;
            for (row, number) in matrix.chunks_exact_mut(by.len()).zip(next) {
                row[part * LANES..][..some.len()].copy_from_slice(&number.gradient[..some.len()]);
            }
        }
        Ok(matrix)
    }
}

/// A machine whose matrices of linearly implicit steps carry no derivatives.
struct ConstantMatrix<'a>(&'a mut System<Number>);

impl Ode<Number> for ConstantMatrix<'_> {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn coordinates(&self) -> usize {
        self.0.coordinates()
    }

    fn rhs(&mut self, x: &[Number], dxdt: &mut [Number]) {
        self.0.rhs(x, dxdt);
    }

    fn jacobian(&mut self, x: &[Number], jacobian: &mut [Number]) {
        self.0.jacobian(x, jacobian);
    }

    fn prepare(&mut self, x: &[Number], matrix: &mut [Number], rates: &mut [Number]) {
        self.0.prepare(x, matrix, rates);
        matrix.iter_mut().for_each(|entry| *entry = entry.frozen());
    }
}

/// The largest difference relative to the largest number.
fn apart(found: &[f64], expected: &[f64]) -> f64 {
    let size = expected.iter().fold(1e-300_f64, |most, entry| most.max(entry.abs()));
    found.iter().zip(expected).fold(0.0, |most: f64, (found, expected)| most.max((found - expected).abs() / size))
}

/// A drive train whose joints touch and stick: everything that is stiff in machines of few joints, as stiff as it comes.
fn train(seed: u64) -> Machine {
    let mut machine = Machine::new(&random_tree(seed, 2));
    let contact = [("stiffness", 3e5), ("damping", 0.1), ("width", 1e-4)];
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 5.0), ("transition_velocity", 1e-3)])
        .effect("joint_compliance", 1, &[("stiffness", 1e4), ("damping", 1.0)])
        .effect_behind("backlash", [0, 1], &[&contact[..], &[("gap", 5e-4), ("contact_damping", 100.0)]].concat())
        .effect("end_stop", 0, &[&contact[..], &[("low", -0.2), ("high", 0.2)]].concat())
        .effect("hysteresis", 1, &[("force", 3.0), ("displacement", 1e-3), ("shape", 1.0)])
        .actuator(0, &[("gain", 3.0), ("lag", 0.01)]);
    machine
}

/// Without exchanges of rows, which a recorded elimination leaves out, steps lose no digits; where they would, the function says so.
#[test]
fn a_whole_step_is_that_of_the_integrator() -> Result<()> {
    let machines = (0..300).map(|seed| (seed, drawn(seed))).chain((300..450).map(|seed| (seed, train(seed))));
    let machines = machines.chain((450..500).map(|seed| (seed, rubbing(seed))));
    let mut exact = 0;
    for (seed, machine) in machines {
        let d = machine.build();
        let start = Start::new(&d, seed);
        let recorded = start.recorded(&d, &Kind::Step)?;
        let (next, whether) = recorded.split_at(d.n_states());
        if whether != [1.0] {
            continue;
        }
        exact += 1;
        let error = apart(next, &start.direct(&d, |_, value| value)?);
        assert!(error < 1e-11, "machine {seed}: {error}");
    }
    assert!(exact >= 490, "only {exact} of 500 steps are exact");
    Ok(())
}

#[test]
fn derivatives_of_a_whole_step_are_those_of_dual_numbers() -> Result<()> {
    let machines = (0..60).map(|seed| (seed, drawn(seed))).chain((60..80).map(|seed| (seed, train(seed))));
    let machines = machines.chain((80..100).map(|seed| (seed, rubbing(seed))));
    for (seed, machine) in machines {
        let d = machine.build();
        if d.n_coordinates() > 3 {
            continue;
        }
        let (start, places) = (Start::new(&d, seed), d.program(&Kind::Rates, &d.parameters)?.places);
        // By the state, the inputs and, as the last effects and drives have them, some parameters.
        let parameters = (places.count() - 6..places.count()).map(|place| place as u32);
        let by: Vec<u32> = (0..(places.states + places.inputs) as u32).chain(parameters).collect();
        let found = start.recorded(&d, &Kind::Derived(Box::new(Kind::Step), by.clone()))?;
        let (found, of_exact) = found.split_at(d.n_states() * by.len());
        let error = apart(found, &start.derived(&d, &by)?);
        assert!(error < 1e-9, "machine {seed}: {error}");
        assert!(of_exact.iter().all(|&slope| slope == 0.0));
    }
    Ok(())
}

/// What is left out falls with the third power of the step, as does the error of a step.
#[test]
fn derivatives_with_a_constant_matrix_are_those_of_dual_numbers_and_of_the_order_of_the_step() -> Result<()> {
    let mut orders = Vec::new();
    for seed in 0..150 {
        let d = drawn(seed).build();
        if d.n_coordinates() > 3 {
            continue;
        }
        let start = Start::new(&d, seed);
        let by: Vec<u32> = (0..d.n_states() as u32).collect();
        let constant = Kind::Derived(Box::new(Kind::StepOfConstantMatrix), by.clone());
        let found = start.recorded(&d, &constant)?;
        let witness = start.derived_by(&d, &by, |system, x| {
            LinearlyImplicit::new(x.len()).step(&mut ConstantMatrix(system), x, start.step);
        })?;
        let error = apart(&found[..witness.len()], &witness);
        assert!(error < 1e-9, "machine {seed}: {error}");
        let left_out = |step: f64| -> Result<f64> {
            let start = Start { step, ..Start::new(&d, seed) };
            Ok(apart(&start.recorded(&d, &constant)?[..witness.len()], &start.derived(&d, &by)?))
        };
        let (long, short) = (left_out(2e-5)?, left_out(1e-5)?);
        if short > 1e-12 {
            orders.push((long / short).log2());
        }
    }
    orders.sort_by(f64::total_cmp);
    assert!(orders.len() >= 10, "only {} steps leave out anything", orders.len());
    assert!((orders[orders.len() / 2] - 3.0).abs() < 0.1, "{orders:?}");
    Ok(())
}

/// Of a tree of many joints they would be too many operations, however they are found.
#[test]
fn derivatives_of_a_large_tree_are_worked_out_along_directions() -> Result<()> {
    for (joints, along) in [(4, false), (60, true)] {
        let d = Machine::new(&random_tree(5, joints)).build();
        let places = d.program(&Kind::Rates, &d.parameters)?.places;
        let parameters = places.first_parameter() as u32..places.count() as u32;
        let by: Vec<u32> = (0..places.states as u32).chain(parameters).collect();
        let placed = d.program(&Kind::Derived(Box::new(Kind::Rates), by), &d.parameters)?;
        assert_eq!((placed.directions.is_some(), placed.entries.is_empty()), (along, along), "{joints} joints");
    }
    Ok(())
}

/// Steps within steps: as long runs take them as a whole, and short ones do not.
fn run(d: &Description, rows: usize, sensitivities: &[usize]) -> Result<Run> {
    let start = vec![0.0; d.n_states()];
    let inputs = vec![0.2; rows * d.n_inputs()];
    let stepping = Stepping::new(1e-3, 64, Method::LinearlyImplicit)?;
    let setting = Setting { description: d, theta: &d.parameters, stepping, sensitivities, interrupt: &|| false };
    free_run(setting, &start, Table::new("inputs", &inputs, rows, d.n_inputs())?)
}

#[test]
fn runs_by_whole_steps_are_the_same_and_repeat_bit_by_bit() -> Result<()> {
    for seed in 0..10 {
        let d = train(seed).build();
        let (long, short) = (run(&d, 90, &[])?, run(&d, 4, &[])?);
        assert!(apart(&long.states[..short.states.len()], &short.states) < 1e-11, "machine {seed}");
        assert!(run(&d, 90, &[])?.states == long.states);
    }
    // Small enough for derivatives of whole steps.
    for seed in [3, 5, 7, 10, 16, 20] {
        let d = drawn(seed).build();
        let some = [0, d.parameters.len() - 4, d.parameters.len() - 1];
        let (long, again) = (run(&d, 10, &some)?, run(&drawn(seed).build(), 10, &some)?);
        assert!(long.jacobian == again.jacobian && long.states == again.states);
        let short = run(&d, 4, &[])?;
        assert!(apart(&long.states[..short.states.len()], &short.states) < 1e-11, "machine {seed}, with derivatives");
    }
    Ok(())
}
