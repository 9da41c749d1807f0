//! The fourth-order Rosenbrock method: its coefficients, its stability, its order on smooth and on stiff problems.

use nalgebra::{Complex, DMatrix, SMatrix, SVector};
use vpm_core::integrator::{Integrator, Method, RODAS4P2};
use vpm_core::ode::Ode;
use vpm_core::{Dual, Scalar};

type Square = SMatrix<f64, 6, 6>;
type Column = SVector<f64, 6>;

/// The coefficients in the notation of Hairer & Wanner 1996, section IV.7: alpha, beta = alpha + gamma, b.
fn classical() -> Option<(Square, Square, Column)> {
    let matrix = |rows: &[[f64; 6]; 6]| Square::from_fn(|i, j| rows[i][j]);
    let coupling = Square::identity() / RODAS4P2.gamma - matrix(&RODAS4P2.coupling);
    let gamma = coupling.try_inverse()?;
    let alpha = matrix(&RODAS4P2.distance) * gamma;
    let mut result = matrix(&RODAS4P2.distance).row(5).into_owned();
    result[5] = 1.0;
    Some((alpha, alpha + gamma, (result * gamma).transpose()))
}

#[test]
fn the_coefficients_satisfy_the_conditions_of_order_four() {
    let (alpha, beta, b) = classical().unwrap();
    let ones = Column::repeat(1.0);
    let (nodes, sums) = (alpha * ones, beta * ones);
    let power = |exponent: i32| nodes.map(|node| node.powi(exponent));
    // Hairer & Wanner 1996, table IV.7.1, with the diagonal in beta.
    let conditions = [
        (b.sum(), 1.0),
        (b.dot(&sums), 1.0 / 2.0),
        (b.dot(&power(2)), 1.0 / 3.0),
        (b.dot(&(beta * sums)), 1.0 / 6.0),
        (b.dot(&power(3)), 1.0 / 4.0),
        (b.dot(&nodes.component_mul(&(alpha * sums))), 1.0 / 8.0),
        (b.dot(&(beta * power(2))), 1.0 / 12.0),
        (b.dot(&(beta * beta * sums)), 1.0 / 24.0),
        // Order 2 whatever matrix stands in the place of the Jacobian: Hairer & Wanner 1996, section IV.7, W-methods.
        (b.dot(&nodes), 1.0 / 2.0),
    ];
    for (place, (found, exact)) in conditions.into_iter().enumerate() {
        assert!((found - exact).abs() < 1e-13, "condition {place}: {found} is not {exact}");
    }
    // Fifth order it is not: the test sees a wrong condition.
    assert!((b.dot(&power(4)) - 1.0 / 5.0).abs() > 1e-4);
}

#[test]
fn the_stability_function_is_that_of_an_l_stable_method() {
    let (_, beta, b) = classical().unwrap();
    let growth = |z: Complex<f64>| {
        let matrix = DMatrix::from_fn(6, 6, |i, j| Complex::from(f64::from(u8::from(i == j))) - z * beta[(i, j)]);
        let stages = matrix.lu().solve(&nalgebra::DVector::repeat(6, Complex::from(1.0))).unwrap();
        Complex::from(1.0) + z * (0..6).map(|k| stages[k] * b[k]).sum::<Complex<f64>>()
    };
    for k in -60..60 {
        let size = 10.0_f64.powf(f64::from(k) / 12.0);
        assert!(growth(Complex::new(0.0, size)).norm() <= 1.0 + 1e-12, "on the imaginary axis at {size}");
        assert!(growth(Complex::new(-size, size)).norm() < 1.0, "in the left half plane at {size}");
    }
    assert!(growth(Complex::new(-1e9, 0.0)).norm() < 1e-8);
    let small = Complex::new(-0.01, 0.02);
    assert!((growth(small) - small.exp()).norm() < 0.1 * small.norm().powi(5));
}

/// `dx/dt = law(x)` with an exact Jacobian.
struct Flow<F, const N: usize>(F);

trait Law<const N: usize> {
    fn rate<S: Scalar>(&self, x: &[S; N]) -> [S; N];
}

impl<F: Law<N>, const N: usize> Ode<f64> for Flow<F, N> {
    fn dim(&self) -> usize {
        N
    }
    fn coordinates(&self) -> usize {
        0
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt.copy_from_slice(&self.0.rate::<f64>(&std::array::from_fn(|k| x[k])));
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        let lifted: [Dual<f64, N>; N] = std::array::from_fn(|k| Dual::variable(x[k], k));
        for (row, rate) in jacobian.chunks_mut(N).zip(self.0.rate(&lifted)) {
            row.copy_from_slice(&rate.gradient);
        }
    }
}

fn run<const N: usize>(law: impl Law<N>, method: Method, start: [f64; N], end: f64, steps: usize) -> [f64; N] {
    let (mut ode, mut x, mut integrator) = (Flow(law), start, Integrator::new(method, N));
    for _ in 0..steps {
        integrator.step(&mut ode, &mut x, end / steps as f64);
    }
    x
}

fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

#[derive(Clone, Copy)]
struct Pendulum;
impl Law<2> for Pendulum {
    fn rate<S: Scalar>(&self, x: &[S; 2]) -> [S; 2] {
        [x[1], -(x[0].sin() * 9.81) - x[1] * 0.1]
    }
}

#[test]
fn a_pendulum_is_integrated_with_order_four() {
    let exact = run(Pendulum, Method::Rk4, [2.5, 0.3], 1.5, 40_000);
    let errors = [60, 120, 240].map(|steps| {
        let x = run(Pendulum, Method::Rosenbrock, [2.5, 0.3], 1.5, steps);
        (x[0] - exact[0]).hypot(x[1] - exact[1])
    });
    for order in orders(&errors) {
        assert!((order - 4.0).abs() < 0.2, "order {order} from {errors:?}");
    }
}

/// A pendulum that gives half of its Jacobian.
struct Careless;
impl Ode<f64> for Careless {
    fn dim(&self) -> usize {
        2
    }
    fn coordinates(&self) -> usize {
        1
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        Flow(Pendulum).rhs(x, dxdt);
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        Flow(Pendulum).jacobian(x, jacobian);
        jacobian.iter_mut().for_each(|entry| *entry *= 0.5);
    }
}

#[test]
fn with_an_inexact_jacobian_order_two_is_left() {
    let exact = run(Pendulum, Method::Rk4, [2.5, 0.3], 1.5, 40_000);
    let errors = [1600, 3200, 6400].map(|steps| {
        let (mut x, mut integrator) = ([2.5, 0.3], Integrator::new(Method::Rosenbrock, 2));
        for _ in 0..steps {
            integrator.step(&mut Careless, &mut x, 1.5 / f64::from(steps));
        }
        (x[0] - exact[0]).hypot(x[1] - exact[1])
    });
    for order in orders(&errors) {
        assert!((order - 2.0).abs() < 0.1, "order {order} from {errors:?}");
    }
}

/// Van der Pol's oscillator with the slow time of its relaxation.
#[derive(Clone, Copy)]
struct VanDerPol(f64);
impl Law<2> for VanDerPol {
    fn rate<S: Scalar>(&self, x: &[S; 2]) -> [S; 2] {
        [x[1], ((-(x[0] * x[0]) + 1.0) * x[1] - x[0]) / self.0]
    }
}

#[test]
fn a_stiff_van_der_pol_oscillator_is_integrated_where_explicit_methods_fail() {
    // On the slow branch from x = 2 to t = 0.5; the fast time is 1e-6 / 3, a thousandth of the smallest step here.
    // The start lies on the slow manifold: Hairer & Wanner 1996, equation IV.10.3 continued, x' = -2/3 + 10/81 e - 292/2187 e^2.
    let stiffness = 1e-6;
    let start = [2.0, -2.0 / 3.0 + 10.0 / 81.0 * stiffness - 292.0 / 2187.0 * stiffness * stiffness];
    let law = VanDerPol(stiffness);
    let exact = run(law, Method::Rosenbrock, start, 0.5, 20_000);
    let error = |method, steps| {
        let x = run(law, method, start, 0.5, steps);
        ((x[0] - exact[0]).abs(), (x[1] - exact[1]).abs())
    };
    let found = [25, 50, 100].map(|steps| error(Method::Rosenbrock, steps));
    for order in orders(&found.map(|pair| pair.0)) {
        assert!(order > 3.6, "order {order} from {found:?}");
    }
    assert!(!error(Method::Rk4, 1000).0.is_finite());
    assert!(found[2].0 < 1e-3 * error(Method::LinearlyImplicit, 100).0);
}

/// Prothero & Robinson 1974: `y' = rate (y - g(t)) + g'(t)`, `t' = 1`, whose solution from `g(0)` is g.
#[derive(Clone, Copy)]
struct ProtheroRobinson(f64);
impl Law<2> for ProtheroRobinson {
    fn rate<S: Scalar>(&self, x: &[S; 2]) -> [S; 2] {
        let (sine, cosine) = (x[1] + 0.7).sin_cos();
        [(x[0] - sine) * self.0 + cosine, S::one()]
    }
}

#[test]
fn on_a_fast_decay_toward_a_slow_motion_the_order_falls_to_three() {
    let error = |method, rate, steps| {
        let x = run(ProtheroRobinson(rate), method, [0.7_f64.sin(), 0.0], 1.0, steps);
        (x[0] - 1.7_f64.sin()).abs()
    };
    // In the stiff limit one order is lost, but the error shrinks with the stiffness.
    for (rate, expected, largest) in [(-1.0, 4.0, 1e-7), (-1e4, 3.0, 1e-9), (-1e6, 3.0, 1e-11)] {
        let errors = [10, 20, 40].map(|steps| error(Method::Rosenbrock, rate, steps));
        for order in orders(&errors) {
            assert!((order - expected).abs() < 0.1, "rate {rate}: order {order} from {errors:?}");
        }
        assert!(errors[0] < largest, "rate {rate}: {errors:?}");
        assert!(errors[2] < 1e-3 * error(Method::LinearlyImplicit, rate, 40), "rate {rate}");
    }
}
