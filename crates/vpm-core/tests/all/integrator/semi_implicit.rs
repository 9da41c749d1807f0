//! The semi-implicit method with constant elasticity taken implicitly: stable at any step, of first order, without energy from nowhere.

use allocation_counter::measure;
use vpm_core::integrator::{Integrator, Lu, Method};
use vpm_core::ode::Ode;

/// A chain of masses on springs between two walls, in displacements and rates, with its elasticity told.
struct Chain {
    n: usize,
    stiffness: f64,
    damping: f64,
    told: bool,
}

impl Chain {
    fn second_difference(x: &[f64], i: usize) -> f64 {
        let at = |k: Option<usize>| k.and_then(|k| x.get(k)).copied().unwrap_or(0.0);
        at(i.checked_sub(1)) + at(Some(i + 1)) - 2.0 * x[i]
    }
    fn energy(&self, x: &[f64]) -> f64 {
        let (q, v) = x.split_at(self.n);
        let elastic: f64 = (0..self.n).map(|i| -0.5 * self.stiffness * q[i] * Self::second_difference(q, i)).sum();
        elastic + v.iter().map(|v| 0.5 * v * v).sum::<f64>()
    }
    /// Stands out to the side in its slowest and its fastest mode.
    fn start(&self) -> Vec<f64> {
        let mode =
            |k: usize, i: usize| (std::f64::consts::PI * (k * (i + 1)) as f64 / (self.n + 1) as f64).sin() / k as f64;
        (0..self.n).map(|i| mode(1, i) + mode(self.n, i)).chain(vec![0.0; self.n]).collect()
    }
}

impl Ode<f64> for Chain {
    fn dim(&self) -> usize {
        2 * self.n
    }
    fn coordinates(&self) -> usize {
        self.n
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        let (q, v) = x.split_at(self.n);
        for i in 0..self.n {
            dxdt[i] = v[i];
            dxdt[self.n + i] =
                self.stiffness * Self::second_difference(q, i) + self.damping * Self::second_difference(v, i);
        }
    }
    fn jacobian(&mut self, _: &[f64], jacobian: &mut [f64]) {
        let n = self.n;
        jacobian.fill(0.0);
        let mut block = vec![0.0; 2 * n * n];
        self.fill(&mut block);
        jacobian[2 * n * n..].copy_from_slice(&block);
        for i in 0..n {
            jacobian[i * 2 * n + n + i] = 1.0;
        }
    }
    fn elasticity(&mut self, _: &[f64], block: &mut [f64]) -> bool {
        if self.told {
            self.fill(block);
        }
        self.told
    }
}

impl Chain {
    fn fill(&self, block: &mut [f64]) {
        let n = self.n;
        block.fill(0.0);
        for i in 0..n {
            for j in i.saturating_sub(1)..(i + 2).min(n) {
                let entry = if i == j { -2.0 } else { 1.0 };
                block[i * 2 * n + j] = entry * self.stiffness;
                block[i * 2 * n + n + j] = entry * self.damping;
            }
        }
    }
}

fn chain(told: bool) -> Chain {
    Chain { n: 12, stiffness: 1e4, damping: 0.0, told }
}

#[test]
fn told_of_its_stiffness_the_semi_implicit_method_is_stable_at_any_step() {
    // The explicit limit is 2 / (2 sqrt(k)) = 10 ms: at 11 ms it blows up, implicitly it holds at ten and a thousand times that.
    for (told, step, holds) in
        [(false, 9.9e-3, true), (false, 1.1e-2, false), (true, 1.1e-2, true), (true, 0.1, true), (true, 10.0, true)]
    {
        let mut ode = chain(told);
        let (mut x, mut method) = (ode.start(), Integrator::new(Method::SemiImplicit, 24));
        let begin = ode.energy(&x);
        let mut largest = 0.0_f64;
        let mut before = begin;
        for _ in 0..2000 {
            method.step(&mut ode, &mut x, step);
            let now = ode.energy(&x);
            assert!(!told || now <= before * (1.0 + 1e-12), "energy grows from {before} to {now} at {step}");
            before = now;
            largest = largest.max(now / begin);
        }
        assert_eq!(largest < 1e3, holds, "told {told}, step {step}: energy by {largest}");
    }
}

#[test]
fn told_of_its_stiffness_the_semi_implicit_method_has_order_one() {
    let end = |method, told, steps: usize| {
        let mut ode = Chain { damping: 3.0, ..chain(told) };
        let (mut x, mut method) = (ode.start(), Integrator::new(method, 24));
        for _ in 0..steps {
            method.step(&mut ode, &mut x, 0.05 / steps as f64);
        }
        x
    };
    let exact = end(Method::Rosenbrock, false, 2000);
    let errors = [400, 800, 1600].map(|steps| {
        let x = end(Method::SemiImplicit, true, steps);
        x.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    });
    for order in errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()) {
        assert!((order - 1.0).abs() < 0.1, "order {order} from {errors:?}");
    }
    // Damping that is told counts too: with it left out of the step the chain would still be stable, but not with that much of it.
    let mut ode = Chain { damping: 1e3, ..chain(true) };
    let (mut x, mut method) = (ode.start(), Integrator::new(Method::SemiImplicit, 24));
    for _ in 0..50 {
        method.step(&mut ode, &mut x, 0.1);
    }
    assert!(ode.energy(&x) < ode.energy(&ode.start()));
}

#[test]
fn factors_fit_the_matrix_they_are_resized_to() {
    let mut lu = Lu::new(3);
    lu.resize(2);
    lu.matrix().copy_from_slice(&[0.0, 2.0, 4.0, 1.0]);
    lu.factorise();
    let mut b = [6.0, 11.0];
    lu.solve(&mut b);
    assert_eq!(b, [2.0, 3.0]);
}

/// A chain with one more state that is no coordinate.
struct WithLag(Chain);
impl Ode<f64> for WithLag {
    fn dim(&self) -> usize {
        self.0.dim() + 2
    }
    fn coordinates(&self) -> usize {
        self.0.coordinates()
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        let n = self.0.dim();
        self.0.rhs(&x[..n], &mut dxdt[..n]);
        (dxdt[n], dxdt[n + 1]) = (-x[n], 1.0);
    }
    fn jacobian(&mut self, _: &[f64], _: &mut [f64]) {}
    fn elasticity(&mut self, x: &[f64], block: &mut [f64]) -> bool {
        self.0.elasticity(x, block)
    }
}

#[test]
fn steps_with_elasticity_allocate_nothing_and_leave_other_states_alone() {
    let mut ode = WithLag(chain(true));
    let mut x = ode.0.start();
    x.extend([1.0, 0.0]);
    let (mut bare, mut alone) = (chain(true), chain(true).start());
    let [mut method, mut other] = [26, 24].map(|dim| Integrator::new(Method::SemiImplicit, dim));
    let counted = measure(|| {
        for _ in 0..10 {
            method.step(&mut ode, &mut x, 0.05);
        }
    });
    for _ in 0..10 {
        other.step(&mut bare, &mut alone, 0.05);
    }
    assert_eq!(counted.count_total, 0);
    assert_eq!(x[..24], alone);
    assert!((x[24] - 0.95_f64.powi(10)).abs() < 1e-15 && (x[25] - 0.5).abs() < 1e-15);
}
