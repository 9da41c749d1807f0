//! Forward dynamics, inverse dynamics, mass matrix and Lagrange's equations say the same of random trees.

use proptest::prelude::*;
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, check_regular, crba, energy, rnea};
use vpm_core::samples::{Random, Sample, random_tree};
use vpm_core::{Dual, Result, Scalar};

const TOLERANCE: f64 = 1e-10;

/// A random state of a tree with random efforts.
struct Case {
    tree: Sample,
    q: Vec<f64>,
    v: Vec<f64>,
    tau: Vec<f64>,
}

impl Case {
    fn new(seed: u64, n: usize) -> Self {
        let mut random = Random::new(!seed);
        let (q, v, tau) = (random.numbers(n, 3.0), random.numbers(n, 2.0), random.numbers(n, 20.0));
        let mut tree = random_tree(seed, n);
        for body in tree.bodies.iter_mut().step_by(2) {
            body.rotor_inertia = Some(random.unit());
        }
        Self { tree, q, v, tau }
    }

    fn forward(&self) -> Result<Vec<f64>> {
        let model = self.tree.model::<f64>()?;
        Ok(aba(&model, &mut Data::new(&model), &self.q, &self.v, &self.tau).to_vec())
    }

    fn inverse(&self, v: &[f64], a: &[f64]) -> Result<Vec<f64>> {
        let model = self.tree.model::<f64>()?;
        Ok(rnea(&model, &mut Data::new(&model), &self.q, v, a).to_vec())
    }

    fn mass_matrix(&self) -> Result<Vec<f64>> {
        let model = self.tree.model::<f64>()?;
        Ok(crba(&model, &mut Data::new(&model), &self.q).to_vec())
    }

    /// d/dt dL/dv_i - dL/dq_i with L = kinetic - potential energy: the inner dual is time, the outer lanes v_i and q_i.
    fn lagrange(&self, a: &[f64]) -> Result<Vec<f64>> {
        let model = self.tree.model::<Dual<Dual<f64, 1>, 2>>()?;
        let mut data = Data::new(&model);
        let moving = |numbers: &[f64], rates: &[f64], i: usize, lane: usize| -> Vec<_> {
            let in_time = numbers.iter().zip(rates).map(|(&value, &rate)| Dual { value, gradient: [rate] });
            let constant = in_time.map(Dual::<_, 2>::constant);
            let vary =
                |(k, number): (usize, Dual<_, 2>)| if k == i { Dual::variable(number.value, lane) } else { number };
            constant.enumerate().map(vary).collect()
        };
        let effort = |i: usize| {
            let state = energy(&model, &mut data, &moving(&self.q, &self.v, i, 1), &moving(&self.v, a, i, 0));
            let lagrangian = state.kinetic - state.potential;
            lagrangian.gradient[0].gradient[0] - lagrangian.gradient[1].value
        };
        Ok((0..self.q.len()).map(effort).collect())
    }
}

fn product(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    let n = vector.len();
    (0..n).map(|i| (0..n).map(|j| matrix[j * n + i] * vector[j]).sum()).collect()
}

/// Largest difference relative to the largest entry.
fn difference(found: &[f64], expected: &[f64]) -> f64 {
    let scale = expected.iter().fold(1.0_f64, |largest, entry| largest.max(entry.abs()));
    found.iter().zip(expected).fold(0.0, |largest: f64, (a, b)| largest.max((a - b).abs())) / scale
}

/// Whether a symmetric matrix has a Cholesky factor.
fn positive_definite(mut matrix: Vec<f64>, n: usize) -> bool {
    for j in 0..n {
        let pivot = matrix[j * n + j];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        for i in j + 1..n {
            let factor = matrix[j * n + i] / pivot;
            for k in i..n {
                matrix[i * n + k] -= factor * matrix[j * n + k];
            }
        }
    }
    true
}

proptest! {
    #[test]
    fn forward_dynamics_solves_the_equation_of_motion(seed: u64, n in 1..12_usize) {
        let case = Case::new(seed, n);
        let a = case.forward()?;
        let bias = case.inverse(&case.v, &vec![0.0; n])?;
        let inertial = product(&case.mass_matrix()?, &a);
        let sum: Vec<f64> = inertial.iter().zip(&bias).map(|(inertial, bias)| inertial + bias).collect();
        // Rounding grows with the terms that cancel, so they are the scale.
        let terms = inertial.iter().chain(&bias).chain(&case.tau);
        let scale = terms.fold(1.0_f64, |largest, term| largest.max(term.abs()));
        for (sum, tau) in sum.iter().zip(&case.tau) {
            prop_assert!((sum - tau).abs() < TOLERANCE * scale, "M a + h = {sum}, tau = {tau}, scale {scale}");
        }
    }

    #[test]
    fn inverse_dynamics_undoes_forward_dynamics(seed: u64, n in 1..12_usize) {
        let case = Case::new(seed, n);
        let back = case.inverse(&case.v, &case.forward()?)?;
        let scale = case.inverse(&case.v, &vec![0.0; n])?.iter().fold(1.0_f64, |largest, h| largest.max(h.abs()));
        prop_assert!(difference(&back, &case.tau) < TOLERANCE * scale);
    }

    #[test]
    fn inverse_dynamics_is_lagrange(seed: u64, n in 1..8_usize) {
        let case = Case::new(seed, n);
        let a = &case.tau;
        prop_assert!(difference(&case.inverse(&case.v, a)?, &case.lagrange(a)?) < TOLERANCE);
    }

    #[test]
    fn mass_matrix_is_positive_definite(seed: u64, n in 1..12_usize) {
        let case = Case::new(seed, n);
        prop_assert!(positive_definite(case.mass_matrix()?, n));
    }

    #[test]
    fn bodies_with_inertia_make_regular_trees(seed: u64, n in 1..12_usize) {
        let model = Case::new(seed, n).tree.model::<f64>()?;
        prop_assert_eq!(check_regular(&model, &mut Data::new(&model)), Ok(()));
    }

    #[test]
    fn mass_matrix_gives_the_kinetic_energy(seed: u64, n in 1..12_usize) {
        let case = Case::new(seed, n);
        let model = case.tree.model::<f64>()?;
        let kinetic = energy(&model, &mut Data::new(&model), &case.q, &case.v).kinetic;
        let momentum = product(&case.mass_matrix()?, &case.v);
        let expected = 0.5 * momentum.iter().zip(&case.v).map(|(p, v)| p * v).sum::<f64>();
        prop_assert!((kinetic - expected).abs() < TOLERANCE * (1.0 + kinetic));
    }

    #[test]
    fn columns_of_the_mass_matrix_are_unit_accelerations(seed: u64, n in 1..8_usize) {
        let case = Case::new(seed, n);
        let (matrix, rest) = (case.mass_matrix()?, vec![0.0; n]);
        let weight = case.inverse(&rest, &rest)?;
        for j in 0..n {
            let mut unit = rest.clone();
            unit[j] = 1.0;
            let column: Vec<f64> = case.inverse(&rest, &unit)?.iter().zip(&weight).map(|(tau, h)| tau - h).collect();
            let scale = weight.iter().fold(1.0_f64, |largest, h| largest.max(h.abs()));
            prop_assert!(difference(&column, &matrix[j * n..(j + 1) * n]) < TOLERANCE * scale);
        }
    }

    #[test]
    fn derivative_of_forward_dynamics_by_effort_is_the_inverse_mass_matrix(seed: u64) {
        const N: usize = 5;
        let case = Case::new(seed, N);
        let model = case.tree.model::<Dual<f64, N>>()?;
        let lift = |numbers: &[f64]| vpm_core::scalar::seed::<f64, N>(numbers, &[]);
        let tau = vpm_core::scalar::seed::<f64, N>(&case.tau, &[0, 1, 2, 3, 4]);
        let mut data = Data::new(&model);
        let a = aba(&model, &mut data, &lift(&case.q), &lift(&case.v), &tau);
        let matrix = case.mass_matrix()?;
        for lane in 0..N {
            let column: Vec<f64> = a.iter().map(|number| number.gradient[lane]).collect();
            let mut unit = vec![0.0; N];
            unit[lane] = 1.0;
            prop_assert!(difference(&product(&matrix, &column), &unit) < 100.0 * TOLERANCE);
        }
    }

    #[test]
    fn derivative_of_forward_dynamics_by_mass_is_the_slope(seed: u64) {
        // A central difference of the f64 solution: independent of the dual number, good to its own truncation error.
        let case = Case::new(seed, 4);
        let at = |change: f64| -> Result<Vec<f64>> {
            let mut moved = Case::new(seed, 4);
            moved.tree.bodies[0].inertia.get_or_insert_default().mass += change;
            moved.forward()
        };
        let (step, mut lifted) = (1e-5, Vec::new());
        for (k, body) in case.tree.bodies.iter().enumerate() {
            let mut body = body.map(&mut |&number| Dual::<f64, 1>::from_f64(number));
            body.inertia.get_or_insert_default().mass.gradient = [if k == 0 { 1.0 } else { 0.0 }];
            lifted.push(body);
        }
        let model = vpm_core::model::Model::new(case.tree.gravity, &lifted, &[])?;
        let lift = |numbers: &[f64]| vpm_core::scalar::seed::<f64, 1>(numbers, &[]);
        let mut data = Data::new(&model);
        let a = aba(&model, &mut data, &lift(&case.q), &lift(&case.v), &lift(&case.tau));
        let slope: Vec<f64> = a.iter().map(|number| number.gradient[0]).collect();
        let (up, down) = (at(step)?, at(-step)?);
        let expected: Vec<f64> = up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * step)).collect();
        let size = up.iter().fold(1.0_f64, |largest, entry| largest.max(entry.abs()));
        prop_assert!(difference(&slope, &expected) < 1e-6 * size);
    }
}
