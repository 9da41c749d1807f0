//! Free motion keeps its energy, and effort changes it by exactly the power put in.

use proptest::prelude::*;
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, energy};
use vpm_core::model::Model;
use vpm_core::samples::{Random, Sample, arm7, double_pendulum, random_tree};
use vpm_core::{Dual, Result};

/// Classical Runge-Kutta over state [q, v] of a model without effort (Hairer, Norsett & Wanner 1993, table II.1.2).
struct Motion {
    model: Model<f64>,
    data: Data<f64>,
    state: Vec<f64>,
}

impl Motion {
    fn new(sample: &Sample, q: &[f64], v: &[f64]) -> Result<Self> {
        let model = sample.model::<f64>()?;
        let data = Data::new(&model);
        Ok(Self { model, data, state: [q, v].concat() })
    }

    fn rate(&mut self, state: &[f64]) -> Vec<f64> {
        let (q, v) = state.split_at(self.model.n_joints());
        let rest = vec![0.0; q.len()];
        [v, aba(&self.model, &mut self.data, q, v, &rest)].concat()
    }

    fn step(&mut self, h: f64) {
        let start = self.state.clone();
        let along = |rate: &[f64], h: f64| -> Vec<f64> { start.iter().zip(rate).map(|(x, r)| x + h * r).collect() };
        let k1 = self.rate(&start);
        let k2 = self.rate(&along(&k1, 0.5 * h));
        let k3 = self.rate(&along(&k2, 0.5 * h));
        let k4 = self.rate(&along(&k3, h));
        for (i, x) in self.state.iter_mut().enumerate() {
            *x += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }

    fn energy(&mut self) -> f64 {
        let (q, v) = self.state.split_at(self.model.n_joints());
        let energy = energy(&self.model, &mut self.data, q, v);
        energy.kinetic + energy.potential
    }

    /// Energy gained in `duration` s with steps of `h` s, in J.
    fn drift(mut self, duration: f64, h: f64) -> f64 {
        let start = self.energy();
        for _ in 0..(duration / h).round() as usize {
            self.step(h);
        }
        self.energy() - start
    }
}

#[test]
fn double_pendulum_keeps_its_energy() -> Result<()> {
    let drift = Motion::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]), &[2.0, 1.0], &[0.0, 0.0])?.drift(2.0, 2e-4);
    assert!(drift.abs() < 1e-8, "{drift} J");
    Ok(())
}

#[test]
fn arm_keeps_its_energy_to_the_order_of_the_integrator() -> Result<()> {
    let (q, v) = ([0.3, -0.8, 0.5, 1.0, -0.4, 0.9, 0.2], [0.5, -0.3, 0.8, 0.2, -0.6, 0.4, 1.0]);
    let coarse = Motion::new(&arm7(), &q, &v)?.drift(0.4, 2e-3).abs();
    let fine = Motion::new(&arm7(), &q, &v)?.drift(0.4, 1e-3).abs();
    // A wrong velocity term would leave a drift that does not shrink with the step. Order 4 means a factor of about 16
    // for the state; the energy error may do better.
    assert!(fine < 1e-6 && coarse > 10.0 * fine, "{coarse} J, {fine} J");
    Ok(())
}

proptest! {
    #[test]
    fn power_in_is_the_rate_of_energy(seed: u64, n in 1..10_usize) {
        let random = &mut Random::new(!seed);
        let sample = random_tree(seed, n);
        let (q, v, tau) = (random.numbers(n, 3.0), random.numbers(n, 2.0), random.numbers(n, 9.0));
        let model = sample.model::<f64>()?;
        let a = aba(&model, &mut Data::new(&model), &q, &v, &tau).to_vec();
        // The derivative along the motion: q moves with v, v with a.
        let in_time = |numbers: &[f64], rates: &[f64]| -> Vec<Dual<f64, 1>> {
            numbers.iter().zip(rates).map(|(&value, &rate)| Dual { value, gradient: [rate] }).collect()
        };
        let model = sample.model::<Dual<f64, 1>>()?;
        let energy = energy(&model, &mut Data::new(&model), &in_time(&q, &v), &in_time(&v, &a));
        let rate = (energy.kinetic + energy.potential).gradient[0];
        let power: f64 = tau.iter().zip(&v).map(|(tau, v)| tau * v).sum();
        let scale = 1.0 + energy.kinetic.gradient[0].abs() + energy.potential.gradient[0].abs();
        prop_assert!((rate - power).abs() < 1e-9 * scale, "{rate} W, {power} W");
    }
}
